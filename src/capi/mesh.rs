//! Mesh: from the caller's buffers or from a file.

use super::cancel::ar_cancel_token;
use super::error::{Fail, ar_error};
use super::guard::{self, Handle, guard, guard_handle};
use super::options::{self, CStruct, check_enum, check_flags};
use super::progress::{Running, ar_progress_fn};
use super::slices::{Buffers, Out};
use super::status::*;
use crate::feature::Features;
use crate::field::Field;
use crate::io::{LOAD_UNITS, Limits, Unit};
use crate::job::Stage;
use crate::mesh::{MeshOptions, NONE, TriMesh, Weld};
use crate::segment::Segmentation;
use std::ffi::{CStr, c_char, c_void};
use std::mem::offset_of;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, RwLock};

/// A checked, welded triangle mesh, and the results of the latest successful ar_compute, ar_segment and
/// ar_find_features on it.
pub struct ar_mesh {
    magic: u64,
    poisoned: AtomicBool,
    /// A call that needs the handle exclusively runs.
    pub(super) busy: AtomicBool,
    pub(super) mesh: Arc<TriMesh>,
    /// The caller counts welded vertices (a file) rather than its own (buffers).
    welded: bool,
    pub(super) unit: Unit,
    warnings: Vec<String>,
    pub(super) field: RwLock<Option<Arc<Field>>>,
    pub(super) segmentation: RwLock<Option<Arc<Segmentation>>>,
    pub(super) features: RwLock<Option<Arc<Features>>>,
}

impl Handle for ar_mesh {
    const NAME: &'static str = "ar_mesh";
    const MAGIC: u64 = u64::from_le_bytes(*b"armeshTM");
    fn magic(this: *const Self) -> *const u64 {
        // SAFETY: a field's address, nothing is read.
        unsafe { &raw const (*this).magic }
    }
    fn poisoned(&self) -> &AtomicBool {
        &self.poisoned
    }
    fn busy(&self) -> bool {
        self.busy.load(Ordering::Acquire)
    }
}

/// ar_mesh_desc.position_type: float x, y, z.
pub const AR_FLOAT32: u32 = 1;
/// ar_mesh_desc.position_type: double x, y, z.
pub const AR_FLOAT64: u32 = 2;
/// ar_mesh_desc.index_type: int32_t triples; negative ones give AR_E_INDEX.
pub const AR_INT32: u32 = 1;
/// ar_mesh_desc.index_type: uint32_t triples.
pub const AR_UINT32: u32 = 2;

/// weld: vertices with equal coordinates become one (-0 equals +0). The default: STL and most soup need it.
pub const AR_WELD_EXACT: u32 = 0;
/// weld: no vertices are joined; the indices are the connectivity.
pub const AR_WELD_NONE: u32 = 1;
/// weld: a vertex joins the first earlier one within weld_tolerance.
pub const AR_WELD_TOLERANCE: u32 = 2;

/// flags: leave out faces with a vertex that is not finite or does not exist, instead of refusing the mesh. They
/// are counted by ar_mesh_get_diagnostics, and their vertices that no sound face uses have no results.
pub const AR_MESH_SKIP_INVALID: u32 = 1;

/// A mesh in the caller's memory, as ar_mesh_new takes it. Read during the call only; nobody may write to the
/// buffers meanwhile.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ar_mesh_desc {
    /// sizeof(ar_mesh_desc), set by ar_mesh_desc_init.
    pub struct_size: u32,
    /// 0 or AR_MESH_SKIP_INVALID.
    pub flags: u32,
    /// vertex_count rows of x, y, z. Any alignment.
    pub positions: *const c_void,
    /// Number of vertices, below 2^32 - 1.
    pub vertex_count: u64,
    /// Bytes from one vertex to the next; 0 = tight (12 or 24).
    pub position_stride: u64,
    /// face_count rows of three vertex indices, counter-clockwise seen from outside. Any alignment.
    pub triangles: *const c_void,
    /// Number of faces, below (2^32 - 1) / 3.
    pub face_count: u64,
    /// Bytes from one triangle to the next; 0 = tight (12).
    pub triangle_stride: u64,
    /// AR_FLOAT32 or AR_FLOAT64. Must be set.
    pub position_type: u32,
    /// AR_INT32 or AR_UINT32. Must be set.
    pub index_type: u32,
    /// AR_WELD_*.
    pub weld: u32,
    /// Threads to work on; 0 = one per core.
    pub threads: u32,
    /// With AR_WELD_TOLERANCE the distance, coordinate units, above 0; else 0.
    pub weld_tolerance: f64,
    /// Bytes that the call may use at its peak, about; 0 = no limit.
    pub memory_budget: u64,
    /// Progress function or NULL.
    pub progress: ar_progress_fn,
    /// Passed to `progress`.
    pub user: *mut c_void,
    /// Token that can stop the call, or NULL.
    pub cancel: *const ar_cancel_token,
}

// SAFETY: integers, floats and pointers without padding, starts with struct_size; all zero is valid.
unsafe impl CStruct for ar_mesh_desc {
    const NAME: &'static str = "ar_mesh_desc";
    const MIN: usize = 112;
}

/// How ar_mesh_load reads a file.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ar_load_options {
    /// sizeof(ar_load_options), set by ar_load_options_init.
    pub struct_size: u32,
    /// 0 or AR_MESH_SKIP_INVALID.
    pub flags: u32,
    /// AR_WELD_*.
    pub weld: u32,
    /// Threads to work on; 0 = one per core.
    pub threads: u32,
    /// With AR_WELD_TOLERANCE the distance, file units, above 0; else 0.
    pub weld_tolerance: f64,
    /// Bytes that the call may use at its peak, about; 0 = no limit.
    pub memory_budget: u64,
    /// Progress function or NULL.
    pub progress: ar_progress_fn,
    /// Passed to `progress`.
    pub user: *mut c_void,
    /// Token that can stop the call, or NULL.
    pub cancel: *const ar_cancel_token,
}

// SAFETY: as for ar_mesh_desc.
unsafe impl CStruct for ar_load_options {
    const NAME: &'static str = "ar_load_options";
    const MIN: usize = 56;
}

#[cfg(target_pointer_width = "64")]
const _: () = {
    assert!(size_of::<ar_mesh_desc>() == 112 && offset_of!(ar_mesh_desc, position_type) == 56);
    assert!(offset_of!(ar_mesh_desc, weld_tolerance) == 72 && offset_of!(ar_mesh_desc, cancel) == 104);
    assert!(size_of::<ar_load_options>() == 56 && offset_of!(ar_load_options, weld_tolerance) == 16);
};

/// Use ar_mesh_desc_init. Sets the first `struct_size` bytes of `desc` to the defaults; counts, pointers and types
/// must follow.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_mesh_desc_init_sized(desc: *mut ar_mesh_desc, struct_size: u32) -> ar_status {
    // SAFETY: the caller vouches for `struct_size` writable bytes.
    unsafe { options::init(desc, struct_size) }
}

/// Use ar_load_options_init. Sets the first `struct_size` bytes of `options` to the defaults.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_load_options_init_sized(options: *mut ar_load_options, struct_size: u32) -> ar_status {
    // SAFETY: the caller vouches for `struct_size` writable bytes.
    unsafe { options::init(options, struct_size) }
}

/// Makes a mesh from the caller's buffers, which can be freed afterwards.
///   desc   the buffers and how to take them in.
///   mesh   where to put the handle; free it with ar_mesh_free.
/// Refused: no vertices or faces (AR_E_EMPTY), a coordinate that is not finite (AR_E_NON_FINITE) or an index out of
/// range (AR_E_INDEX) unless AR_MESH_SKIP_INVALID, no face with an area (AR_E_DEGENERATE). Everything else wrong
/// with a mesh is taken and reported by ar_mesh_get_diagnostics. Worst case: O(vertices + faces) time and memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_mesh_new(
    desc: *const ar_mesh_desc,
    mesh: *mut *mut ar_mesh,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard(error, || {
            let desc = options::read(desc)?;
            check_handle_out(mesh)?;
            let buffers = Buffers::new(&desc)?;
            let options = mesh_options(desc.flags, desc.weld, desc.weld_tolerance)?;
            let (threads, memory_budget) = (desc.threads, desc.memory_budget);
            let (progress, user, cancel) = (desc.progress, desc.user, desc.cancel);
            let running = Running { threads, memory_budget, progress, user, cancel };
            let made = running.run(|job| TriMesh::new(&buffers, &options, job))?;
            mesh.write_unaligned(guard::leak(ar_mesh::new(made, false, Unit::Unknown, Vec::new())));
            Ok(())
        })
    }
}

/// Makes a mesh from an STL (binary or ASCII), OBJ, PLY or 3MF file (the content decides, then the name).
///   path      NUL-terminated.
///   options   NULL = defaults.
///   mesh      where to put the handle; free it with ar_mesh_free.
/// 3MF: the items of the build, transformed; ar_diagnostics.unit is the file's unit and lengths are in it. Refusals
/// as in ar_mesh_new, and AR_E_IO, AR_E_FORMAT. Worst case: memory proportional to the unpacked file.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_mesh_load(
    path: *const c_char,
    options: *const ar_load_options,
    mesh: *mut *mut ar_mesh,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard(error, || {
            let (path, o) = (path_of(path)?, options::read_or_default(options)?);
            check_handle_out(mesh)?;
            let options = mesh_options(o.flags, o.weld, o.weld_tolerance)?;
            let (threads, memory_budget) = (o.threads, o.memory_budget);
            let (progress, user, cancel) = (o.progress, o.user, o.cancel);
            let running = Running { threads, memory_budget, progress, user, cancel };
            let (made, unit, warnings) = running.run(|job| {
                job.begin(Stage::Mesh, 0.0, 0.7, LOAD_UNITS)?;
                let raw = crate::io::load(&path, &Limits::default(), job)?;
                job.begin(Stage::Mesh, 0.7, 1.0, 1)?;
                Ok((TriMesh::new(&raw, &options, job)?, raw.unit, raw.warnings))
            })?;
            mesh.write_unaligned(guard::leak(ar_mesh::new(made, true, unit, warnings)));
            Ok(())
        })
    }
}

/// Frees a mesh and its results. NULL does nothing. AR_E_HANDLE if it is recognisably freed already, AR_E_BUSY if a
/// call that needs it exclusively runs (from a progress function, say); then nothing is freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_mesh_free(mesh: *mut ar_mesh) -> ar_status {
    // SAFETY: as the header demands.
    unsafe { guard::free(mesh) }
}

/// Positions of the vertices: x, y, z each, coordinate units. A welded vertex has the position of the first one it
/// was welded with, one that is not finite reads NaN.
///   xyz   3 * capacity numbers, capacity in vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_mesh_get_positions(
    mesh: *const ar_mesh,
    xyz: *mut f64,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let positions = m.mesh.positions();
            Out { buffer: xyz, capacity, count }
                .fill(m.vertex_count(), |i| m.welded(i).map_or([f64::NAN; 3], |w| positions[w]))
        })
    }
}

/// Vertices of the faces, three each. Of vertices welded together the first stands for all. A face that takes no
/// part in the computation reads UINT32_MAX three times: skipped as invalid, or two of its corners are the same
/// point.
///   ijk   3 * capacity numbers, capacity in faces.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_mesh_get_triangles(
    mesh: *const ar_mesh,
    ijk: *mut u32,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let (kept, triangles) = (m.mesh.face_of_input(), m.mesh.triangles());
            Out { buffer: ijk, capacity, count }.fill(kept.len(), |f| match kept[f] {
                NONE => [NONE; 3],
                k => triangles[k as usize].map(|w| m.callers_vertex(w)),
            })
        })
    }
}

/// What was odd in the file that ar_mesh_load read, in words: one UTF-8 line each, every one ended by a newline; empty
/// for ar_mesh_new.
///   text   capacity bytes; *count is the length with the terminating NUL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_mesh_get_warnings(
    mesh: *const ar_mesh,
    text: *mut c_char,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let lines: String = m.warnings.iter().map(|w| w.replace(['\0', '\n'], " ") + "\n").collect();
            let bytes = lines.as_bytes();
            Out { buffer: text, capacity, count }
                .fill(bytes.len() + 1, |i| [bytes.get(i).copied().unwrap_or(0) as c_char])
        })
    }
}

impl ar_mesh {
    fn new(mesh: TriMesh, welded: bool, unit: Unit, warnings: Vec<String>) -> ar_mesh {
        let [poisoned, busy] = [AtomicBool::new(false), AtomicBool::new(false)];
        let (magic, mesh, field) = (Self::MAGIC, Arc::new(mesh), RwLock::new(None));
        let (segmentation, features) = (RwLock::new(None), RwLock::new(None));
        ar_mesh { magic, poisoned, busy, mesh, welded, unit, warnings, field, segmentation, features }
    }

    /// Number of vertices as the caller counts them.
    pub(super) fn vertex_count(&self) -> usize {
        if self.welded { self.mesh.positions().len() } else { self.mesh.input_vertex_count() }
    }

    /// The welded vertex of the caller's vertex `i`, unless that is not finite.
    pub(super) fn welded(&self, i: usize) -> Option<usize> {
        let w = if self.welded { i as u32 } else { self.mesh.vertex_of_input()[i] };
        (w != NONE).then_some(w as usize)
    }

    /// The first of the caller's vertices that make up the welded vertex `w`; [`NONE`] for [`NONE`].
    pub(super) fn callers_vertex(&self, w: u32) -> u32 {
        if self.welded || w == NONE { w } else { self.mesh.input_of_vertex()[w as usize] }
    }

    /// The caller's vertex for the source's vertex `i`, if it has one.
    pub(super) fn vertex_of_source(&self, i: u64) -> Option<u64> {
        if !self.welded {
            return Some(i);
        }
        self.mesh.vertex_of_input().get(i as usize).filter(|&&w| w != NONE).map(|&w| w.into())
    }
}

fn mesh_options(flags: u32, weld: u32, tolerance: f64) -> Result<MeshOptions, Fail> {
    check_flags(flags, AR_MESH_SKIP_INVALID, "flags")?;
    let weld = match check_enum(weld, &[AR_WELD_EXACT, AR_WELD_NONE, AR_WELD_TOLERANCE], "weld")? {
        AR_WELD_TOLERANCE => Weld::Tolerance(tolerance),
        _ if tolerance != 0.0 => {
            return Err(Fail::argument("weld_tolerance is set but weld is not AR_WELD_TOLERANCE"));
        }
        AR_WELD_NONE => Weld::None,
        _ => Weld::Exact,
    };
    Ok(MeshOptions { weld, skip_invalid: flags & AR_MESH_SKIP_INVALID != 0 })
}

fn check_handle_out<T>(out: *mut *mut T) -> Result<(), Fail> {
    if out.is_null() { Err(Fail::null("the place for the handle")) } else { Ok(()) }
}

/// The path in the system's encoding.
pub(super) unsafe fn path_of(path: *const c_char) -> Result<PathBuf, Fail> {
    if path.is_null() {
        return Err(Fail::null("path"));
    }
    // SAFETY: the caller vouches for the terminating NUL.
    let bytes = unsafe { CStr::from_ptr(path) };
    #[cfg(unix)]
    let path = PathBuf::from(<std::ffi::OsStr as std::os::unix::ffi::OsStrExt>::from_bytes(bytes.to_bytes()));
    #[cfg(not(unix))]
    let path = PathBuf::from(bytes.to_str().map_err(|_| Fail::argument("path is not UTF-8"))?);
    Ok(path)
}
