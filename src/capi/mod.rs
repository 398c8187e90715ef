//! armesh: slenderness (D1/D2) of the features of a triangle mesh, for metal additive manufacturing.
//! C interface. C99 and later, C++11 and later; armesh.hpp wraps it for C++17.
//!
//! What is measured, at every vertex v of a triangle mesh (Ge & Flynn, J. Intell. Manuf. 33 (2022) 519-535):
//!   D1(v)    = max over w of d(v, w), d the geodesic distance on the surface by the heat method (Eqs. 1-9): the
//!              characteristic *length* seen from v.
//!   D2(v)    = mean over the faces f at v of min_j ( l_j / cos theta_j ), l_j the length of ray j of a cone about
//!              the inward normal of f, theta_j its angle to that normal (Eqs. 10-13): the *width* at v, the
//!              diameter of an inscribed sphere.
//!   ratio(v) = D1(v) / D2(v), the slenderness. Of the part: max D1 / max D2 (ar_summary.ratio_max).
//! That is AR_PROFILE_PAPER. AR_PROFILE_PRINT, the default, measures the same length and width so that they depend on
//! the shape and not on its triangles: d is exact, and D2 is the wall width (AR_D2_WALL).
//! Lengths have the unit of the coordinates that came in; ratios have none.
//!
//! CONVENTIONS (they hold for every function and are not repeated)
//!
//! Status. Every function that can fail returns ar_status: AR_OK (0) or one negative AR_E_* code. The last parameter
//!   `error` is NULL or an ar_error of the caller's, prepared by ar_error_init; it is written only on failure.
//!   There is no hidden error state. The functions *_init and *_free have no `error`.
//! Outputs. Written only on success, with one exception: *count is also written with AR_E_CAPACITY. After a failure
//!   or a cancel every handle is as it was before the call; results of an earlier ar_compute stay.
//! Buffers. The caller allocates. `capacity` is in elements as the function defines them (mostly: vertices or faces).
//!   buffer == NULL: only *count is written, to learn the size (capacity is ignored).
//!   buffer != NULL: capacity below the count gives AR_E_CAPACITY, otherwise *count elements are written.
//!   `count` may be NULL if the buffer is not. Buffers need no alignment.
//! Pointers must be valid as documented and are NULL only where it says so; NULL elsewhere gives AR_E_NULL. Nothing
//!   keeps a pointer of the caller's after the call returns.
//! Structs that cross start with `uint32_t struct_size`, which ar_<struct>_init sets along with the defaults: all
//!   other fields 0, and 0 always means the documented default. A struct of an older, shorter version is accepted,
//!   the fields it lacks being 0. In a longer input struct the part that this library does not know must be zero
//!   (else AR_E_STRUCT); in a longer output struct that part is set to zero. Options may be NULL: all defaults.
//! Enumerations cross as uint32_t and are checked: an unknown value or flag gives AR_E_ARGUMENT.
//! Vertices and faces. "Vertex" is a vertex of the caller's for ar_mesh_new (vertices welded together share one
//!   value) and a welded vertex for ar_mesh_load. "Face" is a triangle in the order given, degenerate ones included.
//!   Both count from 0. What cannot be computed at a vertex is NaN, and ar_get_vertex_reason says why.
//! Threads. A const pointer to a handle may be used by several threads at once. A non-const pointer needs exclusive
//!   use for the length of the call. Worker threads start inside a call and have ended when it returns; results are
//!   bit-identical for every thread count.
//! Handles. Free each exactly once; freeing NULL does nothing. Use after free is undefined, as with malloc; where the
//!   freed memory is still recognisable the call returns AR_E_HANDLE instead. A defect of the library never unwinds
//!   into the caller: the call returns AR_E_INTERNAL, and the handle it used then only answers AR_E_POISONED and to
//!   being freed.
//! Paths are NUL-terminated and in the system's encoding; on Windows UTF-8.

// The names are C's.
#![allow(non_camel_case_types)]
// What a caller must hold to is said once, in the conventions above.
#![allow(clippy::missing_safety_doc)]

pub mod cancel;
pub mod compute;
pub mod diagnostics;
pub mod error;
pub mod feature;
pub mod geodesic;
mod guard;
pub mod mesh;
mod options;
pub mod ply;
pub mod progress;
pub mod results;
pub mod segment;
mod slices;
pub mod status;
#[cfg(test)]
mod tests;
pub mod version;
