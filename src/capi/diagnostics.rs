//! Diagnostics: what is wrong with a mesh and where, and how big it is.

use super::error::{AR_NONE, ar_error};
use super::guard::guard_handle;
use super::mesh::ar_mesh;
use super::options::{self, CStruct};
use super::status::ar_status;
use crate::io::Unit;
use crate::mesh::Finding;
use std::mem::offset_of;

/// ar_diagnostics.unit: the mesh came without a unit.
pub const AR_UNIT_UNKNOWN: u32 = 0;
/// ar_diagnostics.unit: micrometre.
pub const AR_UNIT_MICRON: u32 = 1;
/// ar_diagnostics.unit: millimetre.
pub const AR_UNIT_MM: u32 = 2;
/// ar_diagnostics.unit: centimetre.
pub const AR_UNIT_CM: u32 = 3;
/// ar_diagnostics.unit: inch.
pub const AR_UNIT_INCH: u32 = 4;
/// ar_diagnostics.unit: foot.
pub const AR_UNIT_FOOT: u32 = 5;
/// ar_diagnostics.unit: metre.
pub const AR_UNIT_M: u32 = 6;

/// How often a defect occurs, and where first.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ar_finding {
    /// Number of occurrences.
    pub count: u64,
    /// Face or vertex of the first one (the field says which), or AR_NONE.
    pub first: u64,
    /// Place of the first one: x, y, z, coordinate units; NaN where it has no sound place.
    pub at: [f64; 3],
}

/// What ar_mesh_get_diagnostics reports.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ar_diagnostics {
    /// sizeof(ar_diagnostics), set by ar_diagnostics_init.
    pub struct_size: u32,
    /// AR_UNIT_* of the coordinates.
    pub unit: u32,
    /// Vertices, the length of the per-vertex results.
    pub vertex_count: u64,
    /// Faces, the length of the per-face results.
    pub face_count: u64,
    /// Vertices after welding.
    pub welded_vertex_count: u64,
    /// Faces that take part in the computation: three distinct, sound corners.
    pub used_face_count: u64,
    /// Vertices with a coordinate that is NaN or infinite. first: a vertex (AR_NONE for a file).
    pub non_finite_vertices: ar_finding,
    /// Vertices that no used face has. first: a vertex.
    pub unreferenced_vertices: ar_finding,
    /// Faces that name a vertex that does not exist. first: a face.
    pub out_of_range_faces: ar_finding,
    /// Faces without three distinct, finite corners, other than out_of_range_faces. first: a face.
    pub collapsed_faces: ar_finding,
    /// Used faces with their corners on a line. first: a face.
    pub zero_area_faces: ar_finding,
    /// Faces with the same three vertices as an earlier one. first: a face.
    pub duplicate_faces: ar_finding,
    /// Edges with one face: the mesh is open there. first: that face; at: the middle of the edge.
    pub boundary_edges: ar_finding,
    /// Edges with more than two faces. first: one of them; at: the middle of the edge.
    pub non_manifold_edges: ar_finding,
    /// Vertices where separate fans of faces touch. first: a vertex.
    pub non_manifold_vertices: ar_finding,
    /// Edges whose two faces are oriented against each other. first: one of them; at: the middle of the edge.
    pub orientation_conflicts: ar_finding,
    /// Closed shells that face inward although nothing contains them. first: a face.
    pub inverted_shells: ar_finding,
    /// Edge-connected components of the surface.
    pub components: u64,
    /// 1 if every edge has two faces or more, else 0.
    pub closed: u32,
    /// 1 if every component can be oriented, else 0 (a Moebius strip).
    pub orientable: u32,
    /// Enclosed volume, coordinate units cubed: outward shells less cavities; what overlaps counts twice, open
    /// shells nothing.
    pub volume: f64,
    /// Area of the used faces, coordinate units squared.
    pub area: f64,
    /// Lower corner of the bounding box, coordinate units.
    pub bbox_min: [f64; 3],
    /// Upper corner of the bounding box, coordinate units.
    pub bbox_max: [f64; 3],
}

// SAFETY: numbers without padding, starts with struct_size.
unsafe impl CStruct for ar_diagnostics {
    const NAME: &'static str = "ar_diagnostics";
    const MIN: usize = 560;
}

const _: () = {
    assert!(size_of::<ar_finding>() == 40);
    assert!(size_of::<ar_diagnostics>() == 560 && offset_of!(ar_diagnostics, non_finite_vertices) == 40);
    assert!(offset_of!(ar_diagnostics, components) == 480 && offset_of!(ar_diagnostics, bbox_max) == 536);
};

/// Use ar_diagnostics_init. Sets the first `struct_size` bytes of `diagnostics` to zero and the size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_diagnostics_init_sized(diagnostics: *mut ar_diagnostics, struct_size: u32) -> ar_status {
    // SAFETY: the caller vouches for `struct_size` writable bytes.
    unsafe { options::init(diagnostics, struct_size) }
}

/// Reports what is wrong with the mesh and how big it is. Needs no ar_compute. The first call on a mesh is
/// O(faces), later ones O(1).
///   diagnostics   written; prepared by ar_diagnostics_init.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ar_mesh_get_diagnostics(
    mesh: *const ar_mesh,
    diagnostics: *mut ar_diagnostics,
    error: *mut ar_error,
) -> ar_status {
    // SAFETY: the pointers are as the header demands.
    unsafe {
        guard_handle(mesh, error, |m| {
            options::check_out(diagnostics)?;
            options::write(diagnostics, report(m)?);
            Ok(())
        })
    }
}

fn report(m: &ar_mesh) -> crate::error::Result<ar_diagnostics> {
    let d = m.mesh.diagnostics()?;
    let finding = |f: &Finding, first: Option<u64>| {
        let first = if f.count == 0 { None } else { first };
        let at = if f.count == 0 { [f64::NAN; 3] } else { f.at };
        ar_finding { count: f.count, first: first.unwrap_or(AR_NONE), at }
    };
    let face = |f: &Finding| finding(f, Some(f.first));
    let vertex = |f: &Finding| finding(f, m.vertex_of_source(f.first));
    Ok(ar_diagnostics {
        struct_size: 0,
        unit: unit(m.unit),
        vertex_count: m.vertex_count() as u64,
        face_count: m.mesh.input_face_count() as u64,
        welded_vertex_count: m.mesh.positions().len() as u64,
        used_face_count: m.mesh.triangles().len() as u64,
        non_finite_vertices: vertex(&d.non_finite_vertices),
        unreferenced_vertices: vertex(&d.unreferenced_vertices),
        out_of_range_faces: face(&d.out_of_range_faces),
        collapsed_faces: face(&d.collapsed_faces),
        zero_area_faces: face(&d.zero_area_faces),
        duplicate_faces: face(&d.duplicate_faces),
        boundary_edges: face(&d.boundary_edges),
        non_manifold_edges: face(&d.non_manifold_edges),
        non_manifold_vertices: vertex(&d.non_manifold_vertices),
        orientation_conflicts: face(&d.orientation_conflicts),
        inverted_shells: face(&d.inverted_shells),
        components: d.shells,
        closed: d.closed.into(),
        orientable: d.orientable.into(),
        volume: d.volume,
        area: d.area,
        bbox_min: d.bounds.0,
        bbox_max: d.bounds.1,
    })
}

fn unit(unit: Unit) -> u32 {
    match unit {
        Unit::Unknown => AR_UNIT_UNKNOWN,
        Unit::Micron => AR_UNIT_MICRON,
        Unit::Millimetre => AR_UNIT_MM,
        Unit::Centimetre => AR_UNIT_CM,
        Unit::Inch => AR_UNIT_INCH,
        Unit::Foot => AR_UNIT_FOOT,
        Unit::Metre => AR_UNIT_M,
    }
}
