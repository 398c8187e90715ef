//! Segment: partitions a part into features and measures each. Needs no ar_compute and changes none of its results.
//!
//! AR_SEGMENT_CREASES (the default) cuts the surface along concave creases, sharp or rounded, wherever what a cut gains
//! by following creases outweighs the flat surface that it crosses. AR_SEGMENT_PAPER is Eqs. 14-23 of the paper on every
//! face as given: 8 bytes times the square of the number of faces. AR_SEGMENT_LANDMARKS has the paper's quantities between
//! patches of the surface and some hundred landmarks: memory in proportion to the faces. Where the paper's print is
//! incomplete: convex edges weigh epsilon (Eq. 15), the three distances are divided by their means before they are added
//! (Eq. 22), and so are the distances of Eq. 23, so that results do not depend on the size of the part.

use super::cancel::ar_cancel_token;
use super::compute::Busy;
use super::error::{Fail, ar_error};
use super::guard::guard_handle;
use super::mesh::ar_mesh;
use super::options::{self, CStruct, check_enum, or_default};
use super::progress::{Running, ar_progress_fn};
use super::slices::Out;
use super::status::*;
use crate::mesh::NONE;
use crate::segment::{self, Criterion, Method, Segment, SegmentOptions, Segmentation, Shares};
use std::ffi::c_void;
use std::mem::offset_of;
use std::sync::{Arc, PoisonError};

/// method: cuts along concave creases, sharp or rounded. The default.
pub const AR_SEGMENT_CREASES: u32 = 0;
/// method: the paper's spectral clustering of all faces. Refused with AR_E_BUDGET beyond memory_budget, and beyond some
/// 20 000 faces without one.
pub const AR_SEGMENT_PAPER: u32 = 1;
/// method: the paper's spectral clustering by patches and landmarks.
pub const AR_SEGMENT_LANDMARKS: u32 = 2;

/// criterion: the number of parts whose borders turn most into concave creases for their length. The default.
pub const AR_CRITERION_CREASES: u32 = 0;
/// criterion: the number before the largest fall of the eigenvalues after the first; at least 2.
pub const AR_CRITERION_EIGENGAP: u32 = 1;
/// criterion: the number with the largest mean silhouette.
pub const AR_CRITERION_SILHOUETTE: u32 = 2;

/// ar_segment_info.flags: a closed ring, on which two ways lead from any point to the opposite one.
pub const AR_SEGMENT_RING: u32 = 1;

/// How ar_segment works. All zero but for the size is the default.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ar_segment_options {
    /// sizeof(ar_segment_options), set by ar_segment_options_init.
    pub struct_size: u32,
    /// Threads to work on; 0 = one per core. The results do not depend on it.
    pub threads: u32,
    /// Bytes that the call may use at its peak, about; 0 = no limit. Refused with AR_E_BUDGET before a step allocates.
    pub memory_budget: u64,
    /// Progress function or NULL.
    pub progress: ar_progress_fn,
    /// Passed to `progress`.
    pub user: *mut c_void,
    /// Token that can stop the call, or NULL.
    pub cancel: *const ar_cancel_token,
    /// AR_SEGMENT_*.
    pub method: u32,
    /// Number of segments, N_f, up to 4096; 0 = automatic. Fewer come out where parts below min_area are joined with
    /// neighbours, more where the part has more shells than that.
    pub count: u32,
    /// With AR_SEGMENT_PAPER and AR_SEGMENT_LANDMARKS and count = 0: what decides on the number, AR_CRITERION_*.
    pub criterion: u32,
    /// 0.
    pub reserved: u32,
    /// Parts smaller than this share of the area are joined with a neighbour, up to 0.5; 0 = 0.001, negative = none.
    pub min_area: f64,
    /// Eq. 22: share of the geodesic distance; 0 = 0.1, negative = none.
    pub alpha: f64,
    /// Eq. 22: share of the angular distance; 0 = 0.8, negative = none.
    pub beta: f64,
    /// Eq. 22: share of the distance between volumetric shape images; 0 = 0.1, negative = none.
    pub gamma: f64,
    /// Eq. 15: weight of convex edges; 0 = 0.1, negative = none.
    pub epsilon: f64,
}

// SAFETY: integers, floats and pointers without padding, starts with struct_size; all zero is valid.
unsafe impl CStruct for ar_segment_options {
    const NAME: &'static str = "ar_segment_options";
    const MIN: usize = 96;
}

/// A segment. Lengths in coordinate units; NaN where there is no value.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ar_segment_info {
    /// sizeof(ar_segment_info), set by ar_segment_info_init.
    pub struct_size: u32,
    /// AR_SEGMENT_RING or 0.
    pub flags: u32,
    /// Number of faces.
    pub faces: u64,
    /// Handles of its surface, holes thought closed: 1 for a ring, or a pipe with its bore.
    pub handles: u32,
    /// Number of segments that share an edge with it: ar_get_segment_neighbours.
    pub neighbours: u32,
    /// D1max: the longest geodesic distance within its own surface.
    pub d1_max: f64,
    /// D1ave: mean of D1 over its surface.
    pub d1_mean: f64,
    /// D2max: the largest wall width of the solid at its surface, where both walls are its own.
    pub d2_max: f64,
    /// D2ave: mean of the widths over its surface.
    pub d2_mean: f64,
    /// The width that half of its surface is below.
    pub d2_median: f64,
    /// Least width.
    pub d2_min: f64,
    /// d1_max / d2_max: its slenderness.
    pub ratio_max: f64,
    /// d1_mean / d2_mean.
    pub ratio_mean: f64,
    /// Area.
    pub area: f64,
    /// Length of its borders with other segments and of open edges.
    pub boundary_length: f64,
    /// With AR_SEGMENT_RING the length of the closed way around, 2 d1_max: D1max of the same bar cut open. Else NaN.
    pub loop_length: f64,
    /// x, y, z of the two points at distance d1_max.
    pub d1_ends: [f64; 6],
    /// x, y, z of the point where the width is d2_max.
    pub d2_max_at: [f64; 3],
    /// x, y, z of the point where the width is d2_min.
    pub d2_min_at: [f64; 3],
    /// x, y, z of the centroid of its surface.
    pub centroid: [f64; 3],
    /// Least x, y, z.
    pub lower: [f64; 3],
    /// Greatest x, y, z.
    pub upper: [f64; 3],
}

// SAFETY: numbers without padding, starts with struct_size.
unsafe impl CStruct for ar_segment_info {
    const NAME: &'static str = "ar_segment_info";
    const MIN: usize = 280;
}

#[cfg(target_pointer_width = "64")]
const _: () = {
    assert!(size_of::<ar_segment_options>() == 96 && offset_of!(ar_segment_options, method) == 40);
    assert!(offset_of!(ar_segment_options, min_area) == 56 && offset_of!(ar_segment_options, epsilon) == 88);
    assert!(size_of::<ar_segment_info>() == 280 && offset_of!(ar_segment_info, d1_max) == 24);
    assert!(offset_of!(ar_segment_info, d1_ends) == 112 && offset_of!(ar_segment_info, upper) == 256);
};

/// Use ar_segment_options_init. Sets the first `struct_size` bytes of `options` to the defaults.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_segment_options_init_sized(
    options: *mut ar_segment_options,
    struct_size: u32,
) -> ar_status {
    // SAFETY: the caller vouches for `struct_size` writable bytes.
    unsafe { options::init(options, struct_size) }
}

/// Use ar_segment_info_init. Sets the first `struct_size` bytes of `info` to zero and the size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_segment_info_init_sized(info: *mut ar_segment_info, struct_size: u32) -> ar_status {
    // SAFETY: the caller vouches for `struct_size` writable bytes.
    unsafe { options::init(info, struct_size) }
}

/// Partitions the mesh into segments and measures them, for the getters below.
///   mesh      exclusive for the length of the call.
///   options   NULL = defaults.
/// Segments are connected, cover all faces that take part, and are numbered from 0 by falling area. On success they
/// replace those of an earlier call; on failure or cancel those stay. Time and memory: with AR_SEGMENT_PAPER
/// O(faces^2 log faces) and 8 bytes times faces^2; otherwise O(faces log faces), about 1 kB a face.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_segment(
    mesh: *mut ar_mesh,
    options: *const ar_segment_options,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let o = options::read_or_default(options)?;
            let how = segment_options(&o)?;
            let (threads, memory_budget) = (o.threads, o.memory_budget);
            let running = Running { threads, memory_budget, progress: o.progress, user: o.user, cancel: o.cancel };
            let _busy = Busy::enter(&m.busy)?;
            let found = running.run(|job| segment::segment(&m.mesh, &how, job))?;
            *m.segmentation.write().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(found));
            Ok(())
        })
    }
}

/// Segment of every face. UINT32_MAX for a face that takes no part.
///   out   capacity numbers, capacity in faces.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_face_segment(
    mesh: *const ar_mesh,
    out: *mut u32,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let (found, kept) = (segmentation(m)?, m.mesh.face_of_input());
            Out { buffer: out, capacity, count }.fill(kept.len(), |f| match kept[f] {
                NONE => [NONE],
                k => [found.face_segment[k as usize]],
            })
        })
    }
}

/// The segments.
///   out   capacity structs, capacity in segments. The first must be prepared by ar_segment_info_init: its struct_size
///         is taken as the size of all, and set in all.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_segments(
    mesh: *const ar_mesh,
    out: *mut ar_segment_info,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let found = segmentation(m)?;
            let n = found.segments.len();
            Out { buffer: out, capacity, count }.check(n)?;
            if out.is_null() || n == 0 {
                return Ok(());
            }
            options::check_out(out)?;
            if !count.is_null() {
                count.write_unaligned(n);
            }
            let size = out.cast::<u32>().read_unaligned();
            for (k, s) in found.segments.iter().enumerate() {
                let place = out.cast::<u8>().add(k * size as usize).cast::<ar_segment_info>();
                place.cast::<u32>().write_unaligned(size);
                options::write(place, info(s));
            }
            Ok(())
        })
    }
}

/// The segments that share an edge with one, ascending.
///   segment   which one.
///   out       capacity numbers, capacity in segments.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_segment_neighbours(
    mesh: *const ar_mesh,
    segment: u32,
    out: *mut u32,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let found = segmentation(m)?;
            let missing = || Fail::argument(format!("segment {segment} of {} does not exist", found.segments.len()));
            let neighbours = &found.segments.get(segment as usize).ok_or_else(missing)?.neighbours;
            Out { buffer: out, capacity, count }.fill(neighbours.len(), |i| [neighbours[i]])
        })
    }
}

fn segmentation(m: &ar_mesh) -> Result<Arc<Segmentation>, Fail> {
    let held = m.segmentation.read().unwrap_or_else(PoisonError::into_inner).clone();
    held.ok_or_else(|| Fail::new(AR_E_NOT_COMPUTED, "no segments yet: call ar_segment first"))
}

fn segment_options(o: &ar_segment_options) -> Result<SegmentOptions, Fail> {
    let defaults = SegmentOptions::default();
    let method = match check_enum(o.method, &[AR_SEGMENT_CREASES, AR_SEGMENT_PAPER, AR_SEGMENT_LANDMARKS], "method")? {
        AR_SEGMENT_PAPER => Method::Paper,
        AR_SEGMENT_LANDMARKS => Method::Landmarks,
        _ => Method::Creases,
    };
    let known = [AR_CRITERION_CREASES, AR_CRITERION_EIGENGAP, AR_CRITERION_SILHOUETTE];
    let criterion = match check_enum(o.criterion, &known, "criterion")? {
        AR_CRITERION_EIGENGAP => Criterion::Eigengap,
        AR_CRITERION_SILHOUETTE => Criterion::Silhouette,
        _ => Criterion::Creases,
    };
    if o.reserved != 0 {
        return Err(Fail::argument("reserved is not 0"));
    }
    // a share that may be switched off
    let share = |value: f64, default: f64, most: f64, field: &str| {
        if value < 0.0 { Ok(0.0) } else { or_default(value, default, [0.0, most], field) }
    };
    let count = (o.count > 0).then_some(o.count);
    let min_area = share(o.min_area, defaults.min_area, 0.5, "min_area")?;
    let shares = Shares {
        geodesic: share(o.alpha, defaults.shares.geodesic, 1e6, "alpha")?,
        angular: share(o.beta, defaults.shares.angular, 1e6, "beta")?,
        volumetric: share(o.gamma, defaults.shares.volumetric, 1e6, "gamma")?,
        epsilon: share(o.epsilon, defaults.shares.epsilon, 1e6, "epsilon")?,
    };
    Ok(SegmentOptions { method, criterion, count, min_area, shares, ..defaults })
}

fn info(s: &Segment) -> ar_segment_info {
    let [[a, b, c], [d, e, f]] = s.d1_ends;
    ar_segment_info {
        struct_size: 0,
        flags: if s.ring { AR_SEGMENT_RING } else { 0 },
        faces: s.faces.into(),
        handles: s.handles,
        neighbours: s.neighbours.len() as u32,
        d1_max: s.d1_max,
        d1_mean: s.d1_mean,
        d2_max: s.d2_max,
        d2_mean: s.d2_mean,
        d2_median: s.d2_median,
        d2_min: s.d2_min,
        ratio_max: s.ratio_max,
        ratio_mean: s.ratio_mean,
        area: s.area,
        boundary_length: s.boundary_length,
        loop_length: s.loop_length,
        d1_ends: [a, b, c, d, e, f],
        d2_max_at: s.d2_max_at,
        d2_min_at: s.d2_min_at,
        centroid: s.centroid,
        lower: s.bounds[0],
        upper: s.bounds[1],
    }
}
