//! Results of the latest ar_compute; AR_E_NOT_COMPUTED before one succeeded.

use super::error::{AR_NONE, Fail, ar_error};
use super::guard::guard_handle;
use super::mesh::ar_mesh;
use super::options::{self, CStruct, check_enum};
use super::slices::Out;
use super::status::*;
use crate::field::{Field, Method, Quantity, reason};
use crate::mesh::NONE;
use std::mem::offset_of;
use std::sync::{Arc, PoisonError};

/// quantity: D1, a length.
pub const AR_D1: u32 = 0;
/// quantity: D2, a length.
pub const AR_D2: u32 = 1;
/// quantity: D1 / D2.
pub const AR_RATIO: u32 = 2;

/// reason: no used face has the vertex.
pub const AR_REASON_UNREFERENCED: u32 = 1;
/// reason: a coordinate of the vertex is NaN or infinite.
pub const AR_REASON_NON_FINITE: u32 = 2;
/// reason: no D2, since no ray from the faces at the vertex hits anything (the surface is open).
pub const AR_REASON_NO_HIT: u32 = 4;
/// reason: all faces at the vertex have no area.
pub const AR_REASON_DEGENERATE: u32 = 8;

/// D1 of every vertex: the greatest geodesic distance to a vertex of the same component, coordinate units; with
/// AR_PROFILE_PRINT to a corner of its shape, a vertex in which three planes or more meet, so that D1 does not depend on
/// how flat faces and straight edges are cut up. NaN: see ar_get_vertex_reason.
///   out   capacity numbers, capacity in vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_vertex_d1(
    mesh: *const ar_mesh,
    out: *mut f64,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe { copy_vertices(mesh, Out { buffer: out, capacity, count }, error, |f| &f.d1) }
}

/// Bounds of D1 of every vertex, by the triangle inequality from the sources that were solved for: no vertex is nearer
/// to its farthest point (with AR_PROFILE_PRINT: its farthest corner) than `lower`, none farther than `upper`, coordinate
/// units. With AR_PROFILE_PRINT they hold for exact distances to within rounding, as long as those were used; on a mesh
/// that stands in (ar_get_accuracy tells) they are padded by how far its distances were found to be off, and on large
/// meshes they are means of those of points near by. Bounds from heat distances are as good as these, and padded by the
/// contradictions that they show among themselves. NaN where D1 is.
///   lower, upper   capacity numbers each, capacity in vertices; both or neither NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_vertex_d1_bounds(
    mesh: *const ar_mesh,
    lower: *mut f64,
    upper: *mut f64,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            if lower.is_null() != upper.is_null() {
                return Err(Fail::argument("one of lower and upper is NULL, the other not"));
            }
            let field = field(m)?;
            let bound = |values: &Vec<f64>, i| [m.welded(i).map_or(f64::NAN, |w| values[w])];
            let n = m.vertex_count();
            Out { buffer: lower, capacity, count }.fill(n, |i| bound(&field.d1_bounds.0, i))?;
            Out { buffer: upper, capacity, count }.fill(n, |i| bound(&field.d1_bounds.1, i))
        })
    }
}

/// D2 of every vertex: the width, coordinate units: the wall width there, or the mean over the faces at the vertex
/// (AR_PROFILE_PAPER). NaN: see ar_get_vertex_reason.
///   out   capacity numbers, capacity in vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_vertex_d2(
    mesh: *const ar_mesh,
    out: *mut f64,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe { copy_vertices(mesh, Out { buffer: out, capacity, count }, error, |f| &f.d2) }
}

/// Slenderness D1 / D2 of every vertex. NaN where either is. With AR_PROFILE_PAPER it grows
/// towards sharp convex edges, where D2 falls to 0.
///   out   capacity numbers, capacity in vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_vertex_ratio(
    mesh: *const ar_mesh,
    out: *mut f64,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe { copy_vertices(mesh, Out { buffer: out, capacity, count }, error, |f| &f.ratio) }
}

/// Why a vertex has NaN: AR_REASON_* bits; 0 where D1, D2 and ratio are numbers.
///   out   capacity numbers, capacity in vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_vertex_reason(
    mesh: *const ar_mesh,
    out: *mut u32,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let field = field(m)?;
            let reason = |i| [m.welded(i).map_or(AR_REASON_NON_FINITE, |w| field.reason[w])];
            Out { buffer: out, capacity, count }.fill(m.vertex_count(), reason)
        })
    }
}

/// The witness of every D1: the vertex that is that far away. UINT32_MAX where D1 is NaN.
///   out   capacity numbers, capacity in vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_vertex_farthest(
    mesh: *const ar_mesh,
    out: *mut u32,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let field = field(m)?;
            let farthest = |i| [m.welded(i).map_or(NONE, |w| m.callers_vertex(field.farthest[w]))];
            Out { buffer: out, capacity, count }.fill(m.vertex_count(), farthest)
        })
    }
}

/// D2 of every face, at its centroid, coordinate units. NaN for a face without area or that takes no part, or whose
/// rays hit nothing.
///   out   capacity numbers, capacity in faces.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_face_d2(
    mesh: *const ar_mesh,
    out: *mut f64,
    capacity: usize,
    count: *mut usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let (field, kept) = (field(m)?, m.mesh.face_of_input());
            Out { buffer: out, capacity, count }.fill(kept.len(), |f| match kept[f] {
                NONE => [f64::NAN],
                k => [field.face_d2[k as usize]],
            })
        })
    }
}

/// A place on the part.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ar_place {
    /// The vertex there (the first of those welded together), or AR_NONE if there is none.
    pub vertex: u64,
    /// x, y, z, coordinate units; NaN if there is no such place.
    pub position: [f64; 3],
}

/// The part in a few numbers. Maxima, minima and means are over the welded vertices that have the value; all NaN if
/// none has.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ar_summary {
    /// sizeof(ar_summary), set by ar_summary_init.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Greatest D1, coordinate units; with AR_PROFILE_PRINT the longest way between any two points of the surface, which
    /// need not be vertices (then d1_max_at.vertex is AR_NONE).
    pub d1_max: f64,
    /// Mean D1, coordinate units.
    pub d1_mean: f64,
    /// Greatest D2, coordinate units.
    pub d2_max: f64,
    /// Mean D2, coordinate units.
    pub d2_mean: f64,
    /// Least D2, coordinate units.
    pub d2_min: f64,
    /// d1_max / d2_max: the slenderness of the part, what the paper recommends.
    pub ratio_max: f64,
    /// d1_mean / d2_mean.
    pub ratio_mean: f64,
    /// Greatest ratio of a vertex; sharp edges raise it without bound as a mesh is refined.
    pub vertex_ratio_max: f64,
    /// Where D1 is greatest: one end of the longest way.
    pub d1_max_at: ar_place,
    /// The other end of it.
    pub d1_max_other: ar_place,
    /// Where D2 is greatest.
    pub d2_max_at: ar_place,
    /// Where D2 is least.
    pub d2_min_at: ar_place,
    /// Where the ratio is greatest.
    pub vertex_ratio_max_at: ar_place,
    /// Welded vertices without a ratio (NaN).
    pub undefined_vertices: u64,
    /// Sources whose distance fields D1 was made of.
    pub solves: u64,
    /// Time that each AR_STAGE_* took, seconds, by its number; 0 for a stage that did not run.
    pub stage_seconds: [f64; 8],
}

// SAFETY: numbers without padding, starts with struct_size.
unsafe impl CStruct for ar_summary {
    const NAME: &'static str = "ar_summary";
    const MIN: usize = 312;
}

const _: () = {
    assert!(AR_REASON_UNREFERENCED == reason::UNREFERENCED && AR_REASON_NON_FINITE == reason::NOT_FINITE);
    assert!(AR_REASON_NO_HIT == reason::NO_HIT && AR_REASON_DEGENERATE == reason::NO_AREA);
    assert!(size_of::<ar_place>() == 32);
    assert!(size_of::<ar_summary>() == 312 && offset_of!(ar_summary, d1_max_at) == 72);
    assert!(offset_of!(ar_summary, undefined_vertices) == 232 && offset_of!(ar_summary, stage_seconds) == 248);
};

/// Use ar_summary_init. Sets the first `struct_size` bytes of `summary` to zero and the size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_summary_init_sized(summary: *mut ar_summary, struct_size: u32) -> ar_status {
    // SAFETY: the caller vouches for `struct_size` writable bytes.
    unsafe { options::init(summary, struct_size) }
}

/// The part in a few numbers.
///   summary   written; prepared by ar_summary_init.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_summary(
    mesh: *const ar_mesh,
    summary: *mut ar_summary,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            options::check_out(summary)?;
            options::write(summary, summarise(m, field(m)?.as_ref()));
            Ok(())
        })
    }
}

/// method: heat distances on the mesh as given.
pub const AR_METHOD_HEAT: u32 = 0;
/// method: heat distances on the mesh with vertices added.
pub const AR_METHOD_REFINED_HEAT: u32 = 1;
/// method: exact distances on the mesh as given.
pub const AR_METHOD_EXACT: u32 = 2;
/// method: exact distances on a mesh of fewer faces that stands in for it.
pub const AR_METHOD_EXACT_ON_PROXY: u32 = 3;

/// How right D1 is, and what was left out.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ar_accuracy {
    /// sizeof(ar_accuracy), set by ar_accuracy_init.
    pub struct_size: u32,
    /// AR_METHOD_*: what solved for the distances.
    pub method: u32,
    /// Vertices of the surface that they were solved on.
    pub vertices: u64,
    /// Its faces.
    pub faces: u64,
    /// Its mean edge length, coordinate units.
    pub spacing: f64,
    /// Estimated relative error of D1, by independent solves: distance_error, and by how much D1 fell short of a field
    /// from the vertex itself where it was known least. NaN: nothing to compare with.
    pub d1_error: f64,
    /// How far the distances are off those on the mesh as given (of a very fine one: on one of some ten thousand faces),
    /// relative to the longest: seen in two fields. Part of d1_error.
    pub distance_error: f64,
    /// Greatest (upper - lower) / D1 of a vertex, by ar_get_vertex_d1_bounds.
    pub d1_gap: f64,
    /// Distance fields that were solved for.
    pub solves: u64,
    /// Shells of which no face has an area; their vertices have no values.
    pub flat_shells: u64,
    /// A face of the first of them, or AR_NONE.
    pub first_flat_face: u64,
    /// Other shells of which no vertex has a D2: they are open.
    pub open_shells: u64,
    /// A face of the first of them, or AR_NONE.
    pub first_open_face: u64,
}

// SAFETY: numbers without padding, starts with struct_size.
unsafe impl CStruct for ar_accuracy {
    const NAME: &'static str = "ar_accuracy";
    const MIN: usize = 96;
}

const _: () = {
    assert!(size_of::<ar_accuracy>() == 96 && offset_of!(ar_accuracy, first_open_face) == 88);
    assert!(AR_METHOD_HEAT == Method::Heat as u32 && AR_METHOD_REFINED_HEAT == Method::RefinedHeat as u32);
    assert!(AR_METHOD_EXACT == Method::Exact as u32 && AR_METHOD_EXACT_ON_PROXY == Method::ExactOnProxy as u32);
};

/// Use ar_accuracy_init. Sets the first `struct_size` bytes of `accuracy` to zero and the size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_accuracy_init_sized(accuracy: *mut ar_accuracy, struct_size: u32) -> ar_status {
    // SAFETY: the caller vouches for `struct_size` writable bytes.
    unsafe { options::init(accuracy, struct_size) }
}

/// How right D1 is, and what was left out.
///   accuracy   written; prepared by ar_accuracy_init.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_accuracy(
    mesh: *const ar_mesh,
    accuracy: *mut ar_accuracy,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            options::check_out(accuracy)?;
            let field = field(m)?;
            let a = field.accuracy;
            let face = |f: u32| if f == NONE { AR_NONE } else { m.mesh.input_of_face()[f as usize].into() };
            let size = size_of::<ar_accuracy>() as u32;
            options::write(
                accuracy,
                ar_accuracy {
                    struct_size: size,
                    method: a.method as u32,
                    vertices: a.vertices,
                    faces: a.faces,
                    spacing: a.spacing,
                    d1_error: a.error,
                    distance_error: a.distance_error,
                    d1_gap: a.gap,
                    solves: field.solves,
                    flat_shells: a.flat_shells.0,
                    first_flat_face: face(a.flat_shells.1),
                    open_shells: a.open_shells.0,
                    first_open_face: face(a.open_shells.1),
                },
            );
            Ok(())
        })
    }
}

/// Probability distribution of a quantity over the welded vertices that have it (the paper's Fig. 12).
///   quantity   AR_D1, AR_D2 or AR_RATIO.
///   edges      bins + 1 numbers, written: bin k holds edges[k] <= value < edges[k + 1], the last one its upper
///              edge too; from the least to the greatest value in equal steps.
///   share      bins numbers, written: the part of the vertices in each bin; they sum to 1.
///   bins       1 to 1 000 000.
/// AR_E_ARGUMENT if no vertex has the quantity.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_get_histogram(
    mesh: *const ar_mesh,
    quantity: u32,
    edges: *mut f64,
    share: *mut f64,
    bins: usize,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            if edges.is_null() || share.is_null() {
                return Err(Fail::null("edges or share"));
            }
            if !(1..=1_000_000).contains(&bins) {
                return Err(Fail::argument(format!("bins is {bins}, outside 1..1000000")));
            }
            let histogram = field(m)?.histogram(self::quantity(quantity)?, bins)?;
            let [no_edges, no_share] = [std::ptr::null_mut(); 2];
            Out { buffer: edges, capacity: bins + 1, count: no_edges }.fill(bins + 1, |i| [histogram.edges[i]])?;
            Out { buffer: share, capacity: bins, count: no_share }.fill(bins, |i| [histogram.share[i]])
        })
    }
}

pub(super) fn quantity(value: u32) -> Result<Quantity, Fail> {
    Ok(match check_enum(value, &[AR_D1, AR_D2, AR_RATIO], "quantity")? {
        AR_D1 => Quantity::D1,
        AR_D2 => Quantity::D2,
        _ => Quantity::Ratio,
    })
}

/// The results, shared: a later ar_compute replaces but does not touch them.
pub(super) fn field(m: &ar_mesh) -> Result<Arc<Field>, Fail> {
    let held = m.field.read().unwrap_or_else(PoisonError::into_inner).clone();
    held.ok_or_else(|| Fail::new(AR_E_NOT_COMPUTED, "nothing computed yet: call ar_compute first"))
}

unsafe fn copy_vertices(
    mesh: *const ar_mesh,
    out: Out<f64>,
    error: *mut ar_error,
    pick: impl Fn(&Field) -> &Vec<f64>,
) -> ar_status {
    // SAFETY: the caller's pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            let field = field(m)?;
            let values = pick(&field);
            out.fill(m.vertex_count(), |i| [m.welded(i).map_or(f64::NAN, |w| values[w])])
        })
    }
}

fn summarise(m: &ar_mesh, field: &Field) -> ar_summary {
    let s = field.summary();
    let place = |w: u32| match w {
        NONE => ar_place { vertex: AR_NONE, position: [f64::NAN; 3] },
        w => ar_place { vertex: m.callers_vertex(w).into(), position: m.mesh.positions()[w as usize] },
    };
    let end = |position: [f64; 3]| match m.mesh.positions().iter().position(|p| *p == position) {
        Some(w) => place(w as u32),
        None => ar_place { vertex: AR_NONE, position },
    };
    let mut stage_seconds = [0.0; 8];
    stage_seconds[..field.seconds.len()].copy_from_slice(&field.seconds);
    ar_summary {
        struct_size: 0,
        reserved: 0,
        d1_max: s.d1_max,
        d1_mean: s.d1_mean,
        d2_max: s.d2_max,
        d2_mean: s.d2_mean,
        d2_min: s.d2_min,
        ratio_max: s.ratio_max,
        ratio_mean: s.ratio_mean,
        vertex_ratio_max: s.vertex_ratio_max,
        d1_max_at: end(s.d1_max_ends[0]),
        d1_max_other: end(s.d1_max_ends[1]),
        d2_max_at: place(s.d2_max_at),
        d2_min_at: place(s.d2_min_at),
        vertex_ratio_max_at: place(s.vertex_ratio_max_at),
        undefined_vertices: s.undefined_vertices,
        solves: field.solves,
        stage_seconds,
    }
}
