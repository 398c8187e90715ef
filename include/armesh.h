#ifndef ARMESH_H
#define ARMESH_H

// armesh: slenderness (D1/D2) of the features of a triangle mesh, for metal additive manufacturing.
// C interface. C99 and later, C++11 and later; armesh.hpp wraps it for C++17.
//
// What is measured, at every vertex v of a triangle mesh (Ge & Flynn, J. Intell. Manuf. 33 (2022) 519-535):
//   D1(v)    = max over w of d(v, w), d the geodesic distance on the surface by the heat method (Eqs. 1-9): the
//              characteristic *length* seen from v.
//   D2(v)    = mean over the faces f at v of min_j ( l_j / cos theta_j ), l_j the length of ray j of a cone about
//              the inward normal of f, theta_j its angle to that normal (Eqs. 10-13): the *width* at v, the
//              diameter of an inscribed sphere.
//   ratio(v) = D1(v) / D2(v), the slenderness. Of the part: max D1 / max D2 (ar_summary.ratio_max).
// That is AR_PROFILE_PAPER. AR_PROFILE_PRINT, the default, measures the same length and width so that they depend on
// the shape and not on its triangles: d is exact, and D2 is the wall width (AR_D2_WALL).
// Lengths have the unit of the coordinates that came in; ratios have none.
//
// CONVENTIONS (they hold for every function and are not repeated)
//
// Status. Every function that can fail returns ar_status: AR_OK (0) or one negative AR_E_* code. The last parameter
//   `error` is NULL or an ar_error of the caller's, prepared by ar_error_init; it is written only on failure.
//   There is no hidden error state. The functions *_init and *_free have no `error`.
// Outputs. Written only on success, with one exception: *count is also written with AR_E_CAPACITY. After a failure
//   or a cancel every handle is as it was before the call; results of an earlier ar_compute stay.
// Buffers. The caller allocates. `capacity` is in elements as the function defines them (mostly: vertices or faces).
//   buffer == NULL: only *count is written, to learn the size (capacity is ignored).
//   buffer != NULL: capacity below the count gives AR_E_CAPACITY, otherwise *count elements are written.
//   `count` may be NULL if the buffer is not. Buffers need no alignment.
// Pointers must be valid as documented and are NULL only where it says so; NULL elsewhere gives AR_E_NULL. Nothing
//   keeps a pointer of the caller's after the call returns.
// Structs that cross start with `uint32_t struct_size`, which ar_<struct>_init sets along with the defaults: all
//   other fields 0, and 0 always means the documented default. A struct of an older, shorter version is accepted,
//   the fields it lacks being 0. In a longer input struct the part that this library does not know must be zero
//   (else AR_E_STRUCT); in a longer output struct that part is set to zero. Options may be NULL: all defaults.
// Enumerations cross as uint32_t and are checked: an unknown value or flag gives AR_E_ARGUMENT.
// Vertices and faces. "Vertex" is a vertex of the caller's for ar_mesh_new (vertices welded together share one
//   value) and a welded vertex for ar_mesh_load. "Face" is a triangle in the order given, degenerate ones included.
//   Both count from 0. What cannot be computed at a vertex is NaN, and ar_get_vertex_reason says why.
// Threads. A const pointer to a handle may be used by several threads at once. A non-const pointer needs exclusive
//   use for the length of the call. Worker threads start inside a call and have ended when it returns; results are
//   bit-identical for every thread count.
// Handles. Free each exactly once; freeing NULL does nothing. Use after free is undefined, as with malloc; where the
//   freed memory is still recognisable the call returns AR_E_HANDLE instead. A defect of the library never unwinds
//   into the caller: the call returns AR_E_INTERNAL, and the handle it used then only answers AR_E_POISONED and to
//   being freed.
// Paths are NUL-terminated and in the system's encoding; on Windows UTF-8.
//
// Generated from src/capi by cbindgen; edit there.

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

// ==============================================================================================================
// Version.
// ==============================================================================================================

/// Version of the interface as a number: the one in the library's SONAME (libarmesh.so.0). It changes when a
/// program built against the older header could no longer run; functions, codes and struct fields may be added
/// without changing it.
#define AR_ABI_VERSION 0

/// Version of the library, "major.minor.patch". Never NULL; lives as long as the library is loaded.
const char *ar_version(void);

/// AR_ABI_VERSION of the library that is loaded, to compare with the header's.
uint32_t ar_abi_version(void);

// ==============================================================================================================
// Status codes. Values are fixed and never reused.
// ==============================================================================================================

/// AR_OK or one of AR_E_*.
typedef int32_t ar_status;

/// Success.
#define AR_OK 0

/// A pointer that must not be NULL is.
#define AR_E_NULL (-1)

/// A parameter or option is outside its documented range.
#define AR_E_ARGUMENT (-2)

/// struct_size is no size of any version of the struct, or a part unknown to this library is not zero.
#define AR_E_STRUCT (-3)

/// The buffer is too small; *count says what is needed.
#define AR_E_CAPACITY (-4)

/// The mesh has no vertices or no faces.
#define AR_E_EMPTY (-5)

/// A face names a vertex that does not exist. ar_error.first_index is the first such face.
#define AR_E_INDEX (-6)

/// A coordinate is NaN or infinite. ar_error.first_index is the first such vertex.
#define AR_E_NON_FINITE (-7)

/// No face has an area: there is nothing to measure.
#define AR_E_DEGENERATE (-8)

/// A file cannot be read or written.
#define AR_E_IO (-9)

/// A file is not what its name or header says, or is damaged.
#define AR_E_FORMAT (-10)

/// An allocation failed, or the worker threads could not be started.
#define AR_E_NO_MEMORY (-11)

/// The memory budget does not allow the next step; nothing was allocated for it.
#define AR_E_BUDGET (-12)

/// The progress function or the cancel token asked to stop.
#define AR_E_CANCELLED (-13)

/// ar_compute has not succeeded on this mesh yet.
#define AR_E_NOT_COMPUTED (-14)

/// A numerical method failed (a factorisation broke down).
#define AR_E_NUMERIC (-15)

/// A defect of this library. Please report it.
#define AR_E_INTERNAL (-16)

/// The handle was in use during an earlier AR_E_INTERNAL and can only be freed.
#define AR_E_POISONED (-17)

/// The pointer is not a live handle of this type (freed already?). Best effort.
#define AR_E_HANDLE (-18)

/// The handle is in use by a running call that needs it exclusively. Best effort.
#define AR_E_BUSY (-19)

/// Name of a code, such as "AR_E_NULL"; "AR_E_UNKNOWN" for a number that is none. Never NULL, static.
const char *ar_status_name(ar_status status);

// ==============================================================================================================
// Error details.
// ==============================================================================================================

/// Size of ar_error.message in bytes, the terminating NUL included.
#define AR_MESSAGE_SIZE 512

/// "No index", "none" wherever an index is a uint64_t.
#define AR_NONE UINT64_MAX

/// What went wrong. The caller owns it; one may serve many calls, but not two at once.
typedef struct ar_error {
  /// sizeof(ar_error), set by ar_error_init.
  uint32_t struct_size;
  /// The code that the call returned.
  ar_status status;
  /// Index of the first offending face or vertex (the message says which), or AR_NONE.
  uint64_t first_index;
  /// Number of offending faces or vertices; 0 if the failure is not about any.
  uint64_t count;
  /// UTF-8, NUL-terminated, one line: what and where. Truncated between characters if too long.
  char message[AR_MESSAGE_SIZE];
} ar_error;

/// Use ar_error_init. Prepares the first `struct_size` bytes of `error`: status AR_OK, first_index AR_NONE, empty
/// message.
ar_status ar_error_init_sized(ar_error *error,
                              uint32_t struct_size);

/// Sets `error` to the defaults of this header's version.
static inline ar_status ar_error_init(ar_error *error) {
  return ar_error_init_sized(error, (uint32_t)sizeof *error);
}

// ==============================================================================================================
// Progress. Stages run in the order of their numbers; a call may skip some.
// ==============================================================================================================

/// Reading and checking the mesh.
#define AR_STAGE_MESH 0

/// Refining the analysis surface.
#define AR_STAGE_SURFACE 1

/// D2: shooting rays.
#define AR_STAGE_THICKNESS 2

/// D1: factoring the Laplacian of the heat method.
#define AR_STAGE_FACTOR 3

/// D1: solving for geodesic distances.
#define AR_STAGE_GEODESIC 4

/// Partition into features.
#define AR_STAGE_SEGMENT 5

/// Called some 30 times a second with the fraction done (0 to 1, never falling, 1 at the end) and the AR_STAGE_*.
/// Return 0 to go on, anything else to cancel. Called only on the thread that made the call; `user` is passed
/// through. It must return: no exception and no longjmp may leave it (armesh.hpp carries exceptions across).
typedef int32_t (*ar_progress_fn)(void *user, double fraction, uint32_t stage);

/// Name of a stage, such as "thickness", to show beside a progress bar; "unknown" for other numbers. Never NULL,
/// static.
const char *ar_stage_name(uint32_t stage);

// ==============================================================================================================
// Cancelling from another thread.
// ==============================================================================================================

/// A flag that any thread may raise to stop the calls that were given it. Its functions may be called by several
/// threads at once.
typedef struct ar_cancel_token ar_cancel_token;

/// Makes a token, not raised. `token`: where to put the handle; free it with ar_cancel_token_free.
ar_status ar_cancel_token_new(ar_cancel_token **token, ar_error *error);

/// Frees a token, also while a call that was given it still runs. NULL does nothing. AR_E_HANDLE if it is
/// recognisably freed already.
ar_status ar_cancel_token_free(ar_cancel_token *token);

/// Raises the token: calls that were given it, running or to come, return AR_E_CANCELLED soon. Safe in a signal
/// handler if `error` is NULL and the token is live.
ar_status ar_cancel_token_cancel(const ar_cancel_token *token,
                                 ar_error *error);

/// Lowers the token, to use it again.
ar_status ar_cancel_token_reset(const ar_cancel_token *token, ar_error *error);

// ==============================================================================================================
// Mesh: from the caller's buffers or from a file.
// ==============================================================================================================

/// ar_mesh_desc.position_type: float x, y, z.
#define AR_FLOAT32 1

/// ar_mesh_desc.position_type: double x, y, z.
#define AR_FLOAT64 2

/// ar_mesh_desc.index_type: int32_t triples; negative ones give AR_E_INDEX.
#define AR_INT32 1

/// ar_mesh_desc.index_type: uint32_t triples.
#define AR_UINT32 2

/// weld: vertices with equal coordinates become one (-0 equals +0). The default: STL and most soup need it.
#define AR_WELD_EXACT 0

/// weld: no vertices are joined; the indices are the connectivity.
#define AR_WELD_NONE 1

/// weld: a vertex joins the first earlier one within weld_tolerance.
#define AR_WELD_TOLERANCE 2

/// flags: leave out faces with a vertex that is not finite or does not exist, instead of refusing the mesh. They
/// are counted by ar_mesh_get_diagnostics, and their vertices that no sound face uses have no results.
#define AR_MESH_SKIP_INVALID 1

/// A checked, welded triangle mesh, and the results of the latest successful ar_compute, ar_segment and
/// ar_find_features on it.
typedef struct ar_mesh ar_mesh;

/// A mesh in the caller's memory, as ar_mesh_new takes it. Read during the call only; nobody may write to the
/// buffers meanwhile.
typedef struct ar_mesh_desc {
  /// sizeof(ar_mesh_desc), set by ar_mesh_desc_init.
  uint32_t struct_size;
  /// 0 or AR_MESH_SKIP_INVALID.
  uint32_t flags;
  /// vertex_count rows of x, y, z. Any alignment.
  const void *positions;
  /// Number of vertices, below 2^32 - 1.
  uint64_t vertex_count;
  /// Bytes from one vertex to the next; 0 = tight (12 or 24).
  uint64_t position_stride;
  /// face_count rows of three vertex indices, counter-clockwise seen from outside. Any alignment.
  const void *triangles;
  /// Number of faces, below (2^32 - 1) / 3.
  uint64_t face_count;
  /// Bytes from one triangle to the next; 0 = tight (12).
  uint64_t triangle_stride;
  /// AR_FLOAT32 or AR_FLOAT64. Must be set.
  uint32_t position_type;
  /// AR_INT32 or AR_UINT32. Must be set.
  uint32_t index_type;
  /// AR_WELD_*.
  uint32_t weld;
  /// Threads to work on; 0 = one per core.
  uint32_t threads;
  /// With AR_WELD_TOLERANCE the distance, coordinate units, above 0; else 0.
  double weld_tolerance;
  /// Bytes that the call may use at its peak, about; 0 = no limit.
  uint64_t memory_budget;
  /// Progress function or NULL.
  ar_progress_fn progress;
  /// Passed to `progress`.
  void *user;
  /// Token that can stop the call, or NULL.
  const ar_cancel_token *cancel;
} ar_mesh_desc;

/// How ar_mesh_load reads a file.
typedef struct ar_load_options {
  /// sizeof(ar_load_options), set by ar_load_options_init.
  uint32_t struct_size;
  /// 0 or AR_MESH_SKIP_INVALID.
  uint32_t flags;
  /// AR_WELD_*.
  uint32_t weld;
  /// Threads to work on; 0 = one per core.
  uint32_t threads;
  /// With AR_WELD_TOLERANCE the distance, file units, above 0; else 0.
  double weld_tolerance;
  /// Bytes that the call may use at its peak, about; 0 = no limit.
  uint64_t memory_budget;
  /// Progress function or NULL.
  ar_progress_fn progress;
  /// Passed to `progress`.
  void *user;
  /// Token that can stop the call, or NULL.
  const ar_cancel_token *cancel;
} ar_load_options;

/// Use ar_mesh_desc_init. Sets the first `struct_size` bytes of `desc` to the defaults; counts, pointers and types
/// must follow.
ar_status ar_mesh_desc_init_sized(ar_mesh_desc *desc,
                                  uint32_t struct_size);

/// Sets `desc` to the defaults of this header's version.
static inline ar_status ar_mesh_desc_init(ar_mesh_desc *desc) {
  return ar_mesh_desc_init_sized(desc, (uint32_t)sizeof *desc);
}

/// Use ar_load_options_init. Sets the first `struct_size` bytes of `options` to the defaults.
ar_status ar_load_options_init_sized(ar_load_options *options, uint32_t struct_size);

/// Sets `options` to the defaults of this header's version.
static inline ar_status ar_load_options_init(ar_load_options *options) {
  return ar_load_options_init_sized(options, (uint32_t)sizeof *options);
}

/// Makes a mesh from the caller's buffers, which can be freed afterwards.
///   desc   the buffers and how to take them in.
///   mesh   where to put the handle; free it with ar_mesh_free.
/// Refused: no vertices or faces (AR_E_EMPTY), a coordinate that is not finite (AR_E_NON_FINITE) or an index out of
/// range (AR_E_INDEX) unless AR_MESH_SKIP_INVALID, no face with an area (AR_E_DEGENERATE). Everything else wrong
/// with a mesh is taken and reported by ar_mesh_get_diagnostics. Worst case: O(vertices + faces) time and memory.
ar_status ar_mesh_new(const ar_mesh_desc *desc,
                      ar_mesh **mesh,
                      ar_error *error);

/// Makes a mesh from an STL (binary or ASCII), OBJ, PLY or 3MF file (the content decides, then the name).
///   path      NUL-terminated.
///   options   NULL = defaults.
///   mesh      where to put the handle; free it with ar_mesh_free.
/// 3MF: the items of the build, transformed; ar_diagnostics.unit is the file's unit and lengths are in it. Refusals
/// as in ar_mesh_new, and AR_E_IO, AR_E_FORMAT. Worst case: memory proportional to the unpacked file.
ar_status ar_mesh_load(const char *path,
                       const ar_load_options *options,
                       ar_mesh **mesh,
                       ar_error *error);

/// Frees a mesh and its results. NULL does nothing. AR_E_HANDLE if it is recognisably freed already, AR_E_BUSY if a
/// call that needs it exclusively runs (from a progress function, say); then nothing is freed.
ar_status ar_mesh_free(ar_mesh *mesh);

/// Positions of the vertices: x, y, z each, coordinate units. A welded vertex has the position of the first one it
/// was welded with, one that is not finite reads NaN.
///   xyz   3 * capacity numbers, capacity in vertices.
ar_status ar_mesh_get_positions(const ar_mesh *mesh,
                                double *xyz,
                                size_t capacity,
                                size_t *count,
                                ar_error *error);

/// Vertices of the faces, three each. Of vertices welded together the first stands for all. A face that takes no
/// part in the computation reads UINT32_MAX three times: skipped as invalid, or two of its corners are the same
/// point.
///   ijk   3 * capacity numbers, capacity in faces.
ar_status ar_mesh_get_triangles(const ar_mesh *mesh,
                                uint32_t *ijk,
                                size_t capacity,
                                size_t *count,
                                ar_error *error);

/// What was odd in the file that ar_mesh_load read, in words: one UTF-8 line each, every one ended by a newline; empty
/// for ar_mesh_new.
///   text   capacity bytes; *count is the length with the terminating NUL.
ar_status ar_mesh_get_warnings(const ar_mesh *mesh,
                               char *text,
                               size_t capacity,
                               size_t *count,
                               ar_error *error);

// ==============================================================================================================
// Diagnostics: what is wrong with a mesh and where, and how big it is.
// ==============================================================================================================

/// ar_diagnostics.unit: the mesh came without a unit.
#define AR_UNIT_UNKNOWN 0

/// ar_diagnostics.unit: micrometre.
#define AR_UNIT_MICRON 1

/// ar_diagnostics.unit: millimetre.
#define AR_UNIT_MM 2

/// ar_diagnostics.unit: centimetre.
#define AR_UNIT_CM 3

/// ar_diagnostics.unit: inch.
#define AR_UNIT_INCH 4

/// ar_diagnostics.unit: foot.
#define AR_UNIT_FOOT 5

/// ar_diagnostics.unit: metre.
#define AR_UNIT_M 6

/// How often a defect occurs, and where first.
typedef struct ar_finding {
  /// Number of occurrences.
  uint64_t count;
  /// Face or vertex of the first one (the field says which), or AR_NONE.
  uint64_t first;
  /// Place of the first one: x, y, z, coordinate units; NaN where it has no sound place.
  double at[3];
} ar_finding;

/// What ar_mesh_get_diagnostics reports.
typedef struct ar_diagnostics {
  /// sizeof(ar_diagnostics), set by ar_diagnostics_init.
  uint32_t struct_size;
  /// AR_UNIT_* of the coordinates.
  uint32_t unit;
  /// Vertices, the length of the per-vertex results.
  uint64_t vertex_count;
  /// Faces, the length of the per-face results.
  uint64_t face_count;
  /// Vertices after welding.
  uint64_t welded_vertex_count;
  /// Faces that take part in the computation: three distinct, sound corners.
  uint64_t used_face_count;
  /// Vertices with a coordinate that is NaN or infinite. first: a vertex (AR_NONE for a file).
  ar_finding non_finite_vertices;
  /// Vertices that no used face has. first: a vertex.
  ar_finding unreferenced_vertices;
  /// Faces that name a vertex that does not exist. first: a face.
  ar_finding out_of_range_faces;
  /// Faces without three distinct, finite corners, other than out_of_range_faces. first: a face.
  ar_finding collapsed_faces;
  /// Used faces with their corners on a line. first: a face.
  ar_finding zero_area_faces;
  /// Faces with the same three vertices as an earlier one. first: a face.
  ar_finding duplicate_faces;
  /// Edges with one face: the mesh is open there. first: that face; at: the middle of the edge.
  ar_finding boundary_edges;
  /// Edges with more than two faces. first: one of them; at: the middle of the edge.
  ar_finding non_manifold_edges;
  /// Vertices where separate fans of faces touch. first: a vertex.
  ar_finding non_manifold_vertices;
  /// Edges whose two faces are oriented against each other. first: one of them; at: the middle of the edge.
  ar_finding orientation_conflicts;
  /// Closed shells that face inward although nothing contains them. first: a face.
  ar_finding inverted_shells;
  /// Edge-connected components of the surface.
  uint64_t components;
  /// 1 if every edge has two faces or more, else 0.
  uint32_t closed;
  /// 1 if every component can be oriented, else 0 (a Moebius strip).
  uint32_t orientable;
  /// Enclosed volume, coordinate units cubed: outward shells less cavities; what overlaps counts twice, open
  /// shells nothing.
  double volume;
  /// Area of the used faces, coordinate units squared.
  double area;
  /// Lower corner of the bounding box, coordinate units.
  double bbox_min[3];
  /// Upper corner of the bounding box, coordinate units.
  double bbox_max[3];
} ar_diagnostics;

/// Use ar_diagnostics_init. Sets the first `struct_size` bytes of `diagnostics` to zero and the size.
ar_status ar_diagnostics_init_sized(ar_diagnostics *diagnostics, uint32_t struct_size);

/// Sets `diagnostics` to the defaults of this header's version.
static inline ar_status ar_diagnostics_init(ar_diagnostics *diagnostics) {
  return ar_diagnostics_init_sized(diagnostics, (uint32_t)sizeof *diagnostics);
}

/// Reports what is wrong with the mesh and how big it is. Needs no ar_compute. The first call on a mesh is
/// O(faces), later ones O(1).
///   diagnostics   written; prepared by ar_diagnostics_init.
ar_status ar_mesh_get_diagnostics(const ar_mesh *mesh, ar_diagnostics *diagnostics, ar_error *error);

// ==============================================================================================================
// Compute: fills D1, D2 and their ratio.
// ==============================================================================================================

/// profile: for parts that are to be printed, on any triangulation. D1 by exact geodesic distances (on a simplified mesh
/// where those on the part are dear) towards the corners of the shape, D2 the wall width. The default.
#define AR_PROFILE_PRINT 0

/// profile: the method as the paper has it, Eqs. 1-13 on the mesh as given. For meshes of good triangles, and for
/// comparing with the paper.
#define AR_PROFILE_PAPER 1

/// d1_method: distances from as many vertices as it takes to know D1 of every vertex to within d1_tolerance, by the
/// triangle inequality; the number does not grow with the mesh. The default.
#define AR_D1_CERTIFIED 0

/// d1_method: distances from every vertex (the paper's definition, the reference).
#define AR_D1_ALL_VERTICES 1

/// d2_method: that of the profile: AR_D2_WALL with AR_PROFILE_PRINT, AR_D2_INSCRIBED with AR_PROFILE_PAPER. The default.
#define AR_D2_PROFILE 0

/// d2_method: diameter of an inscribed sphere, the least of l / cos(theta) over the rays (Eqs. 10-13).
#define AR_D2_INSCRIBED 3

/// d2_method: wall width, the diameter of the inscribed sphere that is held from opposite sides, 115 degrees apart or
/// more seen from its centre: a contact around a convex edge does not count, so the width does not fall to 0 there.
/// Overlapping shells count as one solid. Takes no rays.
#define AR_D2_WALL 2

/// d2_method: shape diameter function as Shapira 2008 and CGAL define it: mean of the ray lengths within one median
/// absolute deviation of their median, obtuse hits rejected, raw values (not smoothed or normalised).
#define AR_D2_SDF 1

/// How ar_compute and ar_geodesic_distance work. All zero but for the size is the default.
typedef struct ar_compute_options {
  /// sizeof(ar_compute_options), set by ar_compute_options_init.
  uint32_t struct_size;
  /// Threads to work on; 0 = one per core. The results do not depend on it.
  uint32_t threads;
  /// Bytes that the call may use at its peak, about; 0 = no limit. Refused with AR_E_BUDGET before a step
  /// allocates.
  uint64_t memory_budget;
  /// Progress function or NULL.
  ar_progress_fn progress;
  /// Passed to `progress`.
  void *user;
  /// Token that can stop the call, or NULL.
  const ar_cancel_token *cancel;
  /// AR_PROFILE_*.
  uint32_t profile;
  /// D2: rays a face, 1 to 4096; 0 = 20, with AR_D2_SDF 25.
  uint32_t rays;
  /// D2: full opening angle of the cone of rays, radians, above 0.001 and below pi - 0.001; 0 = 2 pi / 3 (120 degrees).
  double cone_angle;
  /// D2: AR_D2_*.
  uint32_t d2_method;
  /// D1: AR_D1_*.
  uint32_t d1_method;
  /// D1: m in the time step t = m * h^2 of the heat method, h the mean edge length; 1e-3 to 1e6; 0 = 1.
  double time_factor;
  /// D1: with AR_D1_CERTIFIED the relative gap between the bounds at which a vertex counts as known, 1e-6 to 1;
  /// 0 = 0.05, with AR_PROFILE_PAPER 0.02. Most values are far closer than the gap.
  double d1_tolerance;
} ar_compute_options;

/// Use ar_compute_options_init. Sets the first `struct_size` bytes of `options` to the defaults.
ar_status ar_compute_options_init_sized(ar_compute_options *options, uint32_t struct_size);

/// Sets `options` to the defaults of this header's version.
static inline ar_status ar_compute_options_init(ar_compute_options *options) {
  return ar_compute_options_init_sized(options, (uint32_t)sizeof *options);
}

/// Computes D1, D2 and ratio of every vertex, for the getters of the section "Results".
///   mesh      exclusive for the length of the call.
///   options   NULL = defaults.
/// On success the results replace those of an earlier call; on failure or cancel those stay.
///   Time      D2 takes about O(faces log faces), times rays where it shoots any. D1 takes one distance field a source:
///             some dozen to some hundred sources with AR_D1_CERTIFIED, in the worst case (and with
///             AR_D1_ALL_VERTICES) one per vertex. A heat distance takes about O(vertices log vertices); an exact one,
///             in the print profile, 2 to 10 ms.
///   Memory    about 1.6 kB a vertex.
ar_status ar_compute(ar_mesh *mesh,
                     const ar_compute_options *options,
                     ar_error *error);

// ==============================================================================================================
// Results of the latest ar_compute; AR_E_NOT_COMPUTED before one succeeded.
// ==============================================================================================================

/// quantity: D1, a length.
#define AR_D1 0

/// quantity: D2, a length.
#define AR_D2 1

/// quantity: D1 / D2.
#define AR_RATIO 2

/// reason: no used face has the vertex.
#define AR_REASON_UNREFERENCED 1

/// reason: a coordinate of the vertex is NaN or infinite.
#define AR_REASON_NON_FINITE 2

/// reason: no D2, since no ray from the faces at the vertex hits anything (the surface is open).
#define AR_REASON_NO_HIT 4

/// reason: all faces at the vertex have no area.
#define AR_REASON_DEGENERATE 8

/// method: heat distances on the mesh as given.
#define AR_METHOD_HEAT 0

/// method: heat distances on the mesh with vertices added.
#define AR_METHOD_REFINED_HEAT 1

/// method: exact distances on the mesh as given.
#define AR_METHOD_EXACT 2

/// method: exact distances on a mesh of fewer faces that stands in for it.
#define AR_METHOD_EXACT_ON_PROXY 3

/// A place on the part.
typedef struct ar_place {
  /// The vertex there (the first of those welded together), or AR_NONE if there is none.
  uint64_t vertex;
  /// x, y, z, coordinate units; NaN if there is no such place.
  double position[3];
} ar_place;

/// The part in a few numbers. Maxima, minima and means are over the welded vertices that have the value; all NaN if
/// none has.
typedef struct ar_summary {
  /// sizeof(ar_summary), set by ar_summary_init.
  uint32_t struct_size;
  /// 0.
  uint32_t reserved;
  /// Greatest D1, coordinate units; with AR_PROFILE_PRINT the longest way between any two points of the surface, which
  /// need not be vertices (then d1_max_at.vertex is AR_NONE).
  double d1_max;
  /// Mean D1, coordinate units.
  double d1_mean;
  /// Greatest D2, coordinate units.
  double d2_max;
  /// Mean D2, coordinate units.
  double d2_mean;
  /// Least D2, coordinate units.
  double d2_min;
  /// d1_max / d2_max: the slenderness of the part, what the paper recommends.
  double ratio_max;
  /// d1_mean / d2_mean.
  double ratio_mean;
  /// Greatest ratio of a vertex; sharp edges raise it without bound as a mesh is refined.
  double vertex_ratio_max;
  /// Where D1 is greatest: one end of the longest way.
  ar_place d1_max_at;
  /// The other end of it.
  ar_place d1_max_other;
  /// Where D2 is greatest.
  ar_place d2_max_at;
  /// Where D2 is least.
  ar_place d2_min_at;
  /// Where the ratio is greatest.
  ar_place vertex_ratio_max_at;
  /// Welded vertices without a ratio (NaN).
  uint64_t undefined_vertices;
  /// Sources whose distance fields D1 was made of.
  uint64_t solves;
  /// Time that each AR_STAGE_* took, seconds, by its number; 0 for a stage that did not run.
  double stage_seconds[8];
} ar_summary;

/// How right D1 is, and what was left out.
typedef struct ar_accuracy {
  /// sizeof(ar_accuracy), set by ar_accuracy_init.
  uint32_t struct_size;
  /// AR_METHOD_*: what solved for the distances.
  uint32_t method;
  /// Vertices of the surface that they were solved on.
  uint64_t vertices;
  /// Its faces.
  uint64_t faces;
  /// Its mean edge length, coordinate units.
  double spacing;
  /// Estimated relative error of D1, by independent solves: distance_error, and by how much D1 fell short of a field
  /// from the vertex itself where it was known least. NaN: nothing to compare with.
  double d1_error;
  /// How far the distances are off those on the mesh as given (of a very fine one: on one of some ten thousand faces),
  /// relative to the longest: seen in two fields. Part of d1_error.
  double distance_error;
  /// Greatest (upper - lower) / D1 of a vertex, by ar_get_vertex_d1_bounds.
  double d1_gap;
  /// Distance fields that were solved for.
  uint64_t solves;
  /// Shells of which no face has an area; their vertices have no values.
  uint64_t flat_shells;
  /// A face of the first of them, or AR_NONE.
  uint64_t first_flat_face;
  /// Other shells of which no vertex has a D2: they are open.
  uint64_t open_shells;
  /// A face of the first of them, or AR_NONE.
  uint64_t first_open_face;
} ar_accuracy;

/// D1 of every vertex: the greatest geodesic distance to a vertex of the same component, coordinate units; with
/// AR_PROFILE_PRINT to a corner of its shape, a vertex in which three planes or more meet, so that D1 does not depend on
/// how flat faces and straight edges are cut up. NaN: see ar_get_vertex_reason.
///   out   capacity numbers, capacity in vertices.
ar_status ar_get_vertex_d1(const ar_mesh *mesh,
                           double *out,
                           size_t capacity,
                           size_t *count,
                           ar_error *error);

/// Bounds of D1 of every vertex, by the triangle inequality from the sources that were solved for: no vertex is nearer
/// to its farthest point (with AR_PROFILE_PRINT: its farthest corner) than `lower`, none farther than `upper`, coordinate
/// units. With AR_PROFILE_PRINT they hold for exact distances to within rounding, as long as those were used; on a mesh
/// that stands in (ar_get_accuracy tells) they are padded by how far its distances were found to be off, and on large
/// meshes they are means of those of points near by. Bounds from heat distances are as good as these, and padded by the
/// contradictions that they show among themselves. NaN where D1 is.
///   lower, upper   capacity numbers each, capacity in vertices; both or neither NULL.
ar_status ar_get_vertex_d1_bounds(const ar_mesh *mesh,
                                  double *lower,
                                  double *upper,
                                  size_t capacity,
                                  size_t *count,
                                  ar_error *error);

/// D2 of every vertex: the width, coordinate units: the wall width there, or the mean over the faces at the vertex
/// (AR_PROFILE_PAPER). NaN: see ar_get_vertex_reason.
///   out   capacity numbers, capacity in vertices.
ar_status ar_get_vertex_d2(const ar_mesh *mesh,
                           double *out,
                           size_t capacity,
                           size_t *count,
                           ar_error *error);

/// Slenderness D1 / D2 of every vertex. NaN where either is. With AR_PROFILE_PAPER it grows
/// towards sharp convex edges, where D2 falls to 0.
///   out   capacity numbers, capacity in vertices.
ar_status ar_get_vertex_ratio(const ar_mesh *mesh,
                              double *out,
                              size_t capacity,
                              size_t *count,
                              ar_error *error);

/// Why a vertex has NaN: AR_REASON_* bits; 0 where D1, D2 and ratio are numbers.
///   out   capacity numbers, capacity in vertices.
ar_status ar_get_vertex_reason(const ar_mesh *mesh,
                               uint32_t *out,
                               size_t capacity,
                               size_t *count,
                               ar_error *error);

/// The witness of every D1: the vertex that is that far away. UINT32_MAX where D1 is NaN.
///   out   capacity numbers, capacity in vertices.
ar_status ar_get_vertex_farthest(const ar_mesh *mesh,
                                 uint32_t *out,
                                 size_t capacity,
                                 size_t *count,
                                 ar_error *error);

/// D2 of every face, at its centroid, coordinate units. NaN for a face without area or that takes no part, or whose
/// rays hit nothing.
///   out   capacity numbers, capacity in faces.
ar_status ar_get_face_d2(const ar_mesh *mesh,
                         double *out,
                         size_t capacity,
                         size_t *count,
                         ar_error *error);

/// Use ar_summary_init. Sets the first `struct_size` bytes of `summary` to zero and the size.
ar_status ar_summary_init_sized(ar_summary *summary, uint32_t struct_size);

/// Sets `summary` to the defaults of this header's version.
static inline ar_status ar_summary_init(ar_summary *summary) {
  return ar_summary_init_sized(summary, (uint32_t)sizeof *summary);
}

/// The part in a few numbers.
///   summary   written; prepared by ar_summary_init.
ar_status ar_get_summary(const ar_mesh *mesh, ar_summary *summary, ar_error *error);

/// Use ar_accuracy_init. Sets the first `struct_size` bytes of `accuracy` to zero and the size.
ar_status ar_accuracy_init_sized(ar_accuracy *accuracy, uint32_t struct_size);

/// Sets `accuracy` to the defaults of this header's version.
static inline ar_status ar_accuracy_init(ar_accuracy *accuracy) {
  return ar_accuracy_init_sized(accuracy, (uint32_t)sizeof *accuracy);
}

/// How right D1 is, and what was left out.
///   accuracy   written; prepared by ar_accuracy_init.
ar_status ar_get_accuracy(const ar_mesh *mesh, ar_accuracy *accuracy, ar_error *error);

/// Probability distribution of a quantity over the welded vertices that have it (the paper's Fig. 12).
///   quantity   AR_D1, AR_D2 or AR_RATIO.
///   edges      bins + 1 numbers, written: bin k holds edges[k] <= value < edges[k + 1], the last one its upper
///              edge too; from the least to the greatest value in equal steps.
///   share      bins numbers, written: the part of the vertices in each bin; they sum to 1.
///   bins       1 to 1 000 000.
/// AR_E_ARGUMENT if no vertex has the quantity.
ar_status ar_get_histogram(const ar_mesh *mesh,
                           uint32_t quantity,
                           double *edges,
                           double *share,
                           size_t bins,
                           ar_error *error);

// ==============================================================================================================
// Geodesic distance from one vertex.
// ==============================================================================================================

/// Geodesic distance from one vertex to every vertex, by the heat method (Eqs. 1-9). Needs no ar_compute and
/// changes no results.
///   source    a vertex that takes part in the computation.
///   options   NULL = defaults; the D2 fields do not matter.
///   out       capacity numbers, capacity in vertices: coordinate units; 0 at the source; NaN in other components
///             and where a vertex takes no part.
/// With out == NULL only *count is written and nothing is computed. Each call factors the operator anew: for D1 of
/// every vertex ar_compute is far faster.
ar_status ar_geodesic_distance(const ar_mesh *mesh,
                               uint32_t source,
                               const ar_compute_options *options,
                               double *out,
                               size_t capacity,
                               size_t *count,
                               ar_error *error);

// ==============================================================================================================
// Segment: partitions a part into features and measures each. Needs no ar_compute and changes none of its results.
//
// AR_SEGMENT_CREASES (the default) cuts the surface along concave creases, sharp or rounded, wherever what a cut gains
// by following creases outweighs the flat surface that it crosses. AR_SEGMENT_PAPER is Eqs. 14-23 of the paper on every
// face as given: 8 bytes times the square of the number of faces. AR_SEGMENT_LANDMARKS has the paper's quantities between
// patches of the surface and some hundred landmarks: memory in proportion to the faces. Where the paper's print is
// incomplete: convex edges weigh epsilon (Eq. 15), the three distances are divided by their means before they are added
// (Eq. 22), and so are the distances of Eq. 23, so that results do not depend on the size of the part.
// ==============================================================================================================

/// method: cuts along concave creases, sharp or rounded. The default.
#define AR_SEGMENT_CREASES 0

/// method: the paper's spectral clustering of all faces. Refused with AR_E_BUDGET beyond memory_budget, and beyond some
/// 20 000 faces without one.
#define AR_SEGMENT_PAPER 1

/// method: the paper's spectral clustering by patches and landmarks.
#define AR_SEGMENT_LANDMARKS 2

/// criterion: the number of parts whose borders turn most into concave creases for their length. The default.
#define AR_CRITERION_CREASES 0

/// criterion: the number before the largest fall of the eigenvalues after the first; at least 2.
#define AR_CRITERION_EIGENGAP 1

/// criterion: the number with the largest mean silhouette.
#define AR_CRITERION_SILHOUETTE 2

/// ar_segment_info.flags: a closed ring, on which two ways lead from any point to the opposite one.
#define AR_SEGMENT_RING 1

/// How ar_segment works. All zero but for the size is the default.
typedef struct ar_segment_options {
  /// sizeof(ar_segment_options), set by ar_segment_options_init.
  uint32_t struct_size;
  /// Threads to work on; 0 = one per core. The results do not depend on it.
  uint32_t threads;
  /// Bytes that the call may use at its peak, about; 0 = no limit. Refused with AR_E_BUDGET before a step allocates.
  uint64_t memory_budget;
  /// Progress function or NULL.
  ar_progress_fn progress;
  /// Passed to `progress`.
  void *user;
  /// Token that can stop the call, or NULL.
  const ar_cancel_token *cancel;
  /// AR_SEGMENT_*.
  uint32_t method;
  /// Number of segments, N_f, up to 4096; 0 = automatic. Fewer come out where parts below min_area are joined with
  /// neighbours, more where the part has more shells than that.
  uint32_t count;
  /// With AR_SEGMENT_PAPER and AR_SEGMENT_LANDMARKS and count = 0: what decides on the number, AR_CRITERION_*.
  uint32_t criterion;
  /// 0.
  uint32_t reserved;
  /// Parts smaller than this share of the area are joined with a neighbour, up to 0.5; 0 = 0.001, negative = none.
  double min_area;
  /// Eq. 22: share of the geodesic distance; 0 = 0.1, negative = none.
  double alpha;
  /// Eq. 22: share of the angular distance; 0 = 0.8, negative = none.
  double beta;
  /// Eq. 22: share of the distance between volumetric shape images; 0 = 0.1, negative = none.
  double gamma;
  /// Eq. 15: weight of convex edges; 0 = 0.1, negative = none.
  double epsilon;
} ar_segment_options;

/// A segment. Lengths in coordinate units; NaN where there is no value.
typedef struct ar_segment_info {
  /// sizeof(ar_segment_info), set by ar_segment_info_init.
  uint32_t struct_size;
  /// AR_SEGMENT_RING or 0.
  uint32_t flags;
  /// Number of faces.
  uint64_t faces;
  /// Handles of its surface, holes thought closed: 1 for a ring, or a pipe with its bore.
  uint32_t handles;
  /// Number of segments that share an edge with it: ar_get_segment_neighbours.
  uint32_t neighbours;
  /// D1max: the longest geodesic distance within its own surface.
  double d1_max;
  /// D1ave: mean of D1 over its surface.
  double d1_mean;
  /// D2max: the largest wall width of the solid at its surface, where both walls are its own.
  double d2_max;
  /// D2ave: mean of the widths over its surface.
  double d2_mean;
  /// The width that half of its surface is below.
  double d2_median;
  /// Least width.
  double d2_min;
  /// d1_max / d2_max: its slenderness.
  double ratio_max;
  /// d1_mean / d2_mean.
  double ratio_mean;
  /// Area.
  double area;
  /// Length of its borders with other segments and of open edges.
  double boundary_length;
  /// With AR_SEGMENT_RING the length of the closed way around, 2 d1_max: D1max of the same bar cut open. Else NaN.
  double loop_length;
  /// x, y, z of the two points at distance d1_max.
  double d1_ends[6];
  /// x, y, z of the point where the width is d2_max.
  double d2_max_at[3];
  /// x, y, z of the point where the width is d2_min.
  double d2_min_at[3];
  /// x, y, z of the centroid of its surface.
  double centroid[3];
  /// Least x, y, z.
  double lower[3];
  /// Greatest x, y, z.
  double upper[3];
} ar_segment_info;

/// Use ar_segment_options_init. Sets the first `struct_size` bytes of `options` to the defaults.
ar_status ar_segment_options_init_sized(ar_segment_options *options, uint32_t struct_size);

/// Sets `options` to the defaults of this header's version.
static inline ar_status ar_segment_options_init(ar_segment_options *options) {
  return ar_segment_options_init_sized(options, (uint32_t)sizeof *options);
}

/// Use ar_segment_info_init. Sets the first `struct_size` bytes of `info` to zero and the size.
ar_status ar_segment_info_init_sized(ar_segment_info *info, uint32_t struct_size);

/// Sets `info` to the defaults of this header's version.
static inline ar_status ar_segment_info_init(ar_segment_info *info) {
  return ar_segment_info_init_sized(info, (uint32_t)sizeof *info);
}

/// Partitions the mesh into segments and measures them, for the getters below.
///   mesh      exclusive for the length of the call.
///   options   NULL = defaults.
/// Segments are connected, cover all faces that take part, and are numbered from 0 by falling area. On success they
/// replace those of an earlier call; on failure or cancel those stay. Time and memory: with AR_SEGMENT_PAPER
/// O(faces^2 log faces) and 8 bytes times faces^2; otherwise O(faces log faces), about 1 kB a face.
ar_status ar_segment(ar_mesh *mesh,
                     const ar_segment_options *options,
                     ar_error *error);

/// Segment of every face. UINT32_MAX for a face that takes no part.
///   out   capacity numbers, capacity in faces.
ar_status ar_get_face_segment(const ar_mesh *mesh,
                              uint32_t *out,
                              size_t capacity,
                              size_t *count,
                              ar_error *error);

/// The segments.
///   out   capacity structs, capacity in segments. The first must be prepared by ar_segment_info_init: its struct_size
///         is taken as the size of all, and set in all.
ar_status ar_get_segments(const ar_mesh *mesh,
                          ar_segment_info *out,
                          size_t capacity,
                          size_t *count,
                          ar_error *error);

/// The segments that share an edge with one, ascending.
///   segment   which one.
///   out       capacity numbers, capacity in segments.
ar_status ar_get_segment_neighbours(const ar_mesh *mesh,
                                    uint32_t segment,
                                    uint32_t *out,
                                    size_t capacity,
                                    size_t *count,
                                    ar_error *error);

// ==============================================================================================================
// Feature: what of a part is too slender or too thin, where, how bad, and why. Needs no ar_compute and no ar_segment and
// changes none of their results.
//
// A feature is a wall, pin, strut, rib, tube, handle, or the body they stand on. Its ratio is D1max / D2max: the longest
// shortest way on its own surface over its thickness, the wall width where both sides are its own. Features are judged
// by ar_limits: a ratio at or over a limit counts, and so does a width at or under the least width.
// ==============================================================================================================

/// kind: about as thick as long and wide, or of no simple sort; mostly what the others stand on.
#define AR_FEATURE_BODY 0

/// kind: long, and about as wide as thick: a pin, strut, hook or wire.
#define AR_FEATURE_BAR 1

/// kind: long and wide, and thin: a plate, fin, rib, web, tube or shell.
#define AR_FEATURE_WALL 2

/// kind: a bar that closes on itself.
#define AR_FEATURE_RING 3

/// severity: under the limits.
#define AR_SEVERITY_OK 0

/// severity: at or over warn_ratio.
#define AR_SEVERITY_WARNING 1

/// severity: at or over error_ratio, or at or under min_width.
#define AR_SEVERITY_ERROR 2

/// ar_feature_info.reasons: for its ratio.
#define AR_FINDING_SLENDER 1

/// ar_feature_info.reasons: for its width.
#define AR_FINDING_THIN 2

/// process: powder bed fusion of metals.
#define AR_PROCESS_METAL_PBF 0

/// process: powder bed fusion of polymers.
#define AR_PROCESS_POLYMER_PBF 1

/// process: filament extrusion.
#define AR_PROCESS_FILAMENT 2

/// colour_by: each feature has a colour of its own.
#define AR_COLOUR_FEATURE 0

/// colour_by: the ratio of the feature, dark violet for the least, yellow for the greatest.
#define AR_COLOUR_RATIO 1

/// colour_by: the wall width at the face, dark violet for the least, yellow for the greatest.
#define AR_COLOUR_WIDTH 2

/// How ar_find_features works. All zero but for the size is the default.
typedef struct ar_feature_options {
  /// sizeof(ar_feature_options), set by ar_feature_options_init.
  uint32_t struct_size;
  /// Threads to work on; 0 = one per core. The results do not depend on it.
  uint32_t threads;
  /// Bytes that the call may use at its peak, about; 0 = no limit. Refused with AR_E_BUDGET before a step allocates.
  uint64_t memory_budget;
  /// Progress function or NULL.
  ar_progress_fn progress;
  /// Passed to `progress`.
  void *user;
  /// Token that can stop the call, or NULL.
  const ar_cancel_token *cancel;
  /// Pieces smaller than this share of the area are joined with a neighbour, up to 0.5; 0 = 0.001, negative = none.
  double min_area;
} ar_feature_options;

/// What features are judged by. All zero but for the size is the default.
typedef struct ar_limits {
  /// sizeof(ar_limits), set by ar_limits_init.
  uint32_t struct_size;
  /// 0.
  uint32_t reserved;
  /// A feature at or over this ratio deserves a look; 0 = 5.
  double warn_ratio;
  /// A feature at or over this ratio is too slender; 0 = 8. INFINITY: none is.
  double error_ratio;
  /// A feature whose least width, in coordinate units, is at or under this is too thin; 0 = widths are not judged.
  double min_width;
} ar_limits;

/// A feature. Lengths in coordinate units; NaN where there is no value.
typedef struct ar_feature_info {
  /// sizeof(ar_feature_info), set by ar_feature_info_init.
  uint32_t struct_size;
  /// Its number, as in ar_get_face_feature.
  uint32_t id;
  /// AR_FEATURE_*.
  uint32_t kind;
  /// AR_SEVERITY_*.
  uint32_t severity;
  /// AR_FINDING_SLENDER, AR_FINDING_THIN, both or 0: what the severity is for.
  uint32_t reasons;
  /// 0.
  uint32_t reserved;
  /// Number of faces.
  uint64_t faces;
  /// d1_max / d2_max: its slenderness.
  double ratio;
  /// The ratio is not greater, as far as lengths go: d1_upper / d2_max.
  double ratio_upper;
  /// D1max: the longest shortest way found on its own surface.
  double d1_max;
  /// No way on its surface is longer.
  double d1_upper;
  /// D2max: its thickness.
  double d2_max;
  /// D2min: the least width on its surface.
  double d2_min;
  /// Area of its surface; of a face that its border crosses, the part on its side.
  double area;
  /// D1max; of a ring the way around.
  double length;
  /// The width of a strip of its length that has its area on two sides; of a bar about its thickness.
  double width;
  /// D2max.
  double thickness;
  /// x, y, z of the two ends of the way of length d1_max.
  double d1_ends[6];
  /// x, y, z of a point where the width is d2_max.
  double d2_max_at[3];
  /// x, y, z of the two walls there.
  double d2_max_contacts[6];
  /// x, y, z of a point where the width is d2_min.
  double d2_min_at[3];
  /// x, y, z of the two walls there.
  double d2_min_contacts[6];
  /// x, y, z of the centroid of its surface.
  double centroid[3];
  /// x, y, z of the centre of the box that it fits in.
  double box_center[3];
  /// x, y, z of the unit directions of the edges of that box, right-handed.
  double box_axes[9];
  /// Lengths of those edges, falling.
  double box_size[3];
} ar_feature_info;

/// Use ar_feature_options_init. Sets the first `struct_size` bytes of `options` to the defaults.
ar_status ar_feature_options_init_sized(ar_feature_options *options, uint32_t struct_size);

/// Sets `options` to the defaults of this header's version.
static inline ar_status ar_feature_options_init(ar_feature_options *options) {
  return ar_feature_options_init_sized(options, (uint32_t)sizeof *options);
}

/// Use ar_limits_init. Sets the first `struct_size` bytes of `limits` to the defaults.
ar_status ar_limits_init_sized(ar_limits *limits, uint32_t struct_size);

/// Sets `limits` to the defaults of this header's version.
static inline ar_status ar_limits_init(ar_limits *limits) {
  return ar_limits_init_sized(limits, (uint32_t)sizeof *limits);
}

/// Use ar_feature_info_init. Sets the first `struct_size` bytes of `info` to zero and the size.
ar_status ar_feature_info_init_sized(ar_feature_info *info, uint32_t struct_size);

/// Sets `info` to the defaults of this header's version.
static inline ar_status ar_feature_info_init(ar_feature_info *info) {
  return ar_feature_info_init_sized(info, (uint32_t)sizeof *info);
}

/// Limits for a process, to start from: widths in millimetres. docs/findings.md says where they come from.
///   process   AR_PROCESS_*.
///   out       prepared by ar_limits_init.
ar_status ar_limits_of_process(uint32_t process, ar_limits *out, ar_error *error);

/// Finds and measures the features of the part, for the getters below.
///   mesh      exclusive for the length of the call.
///   options   NULL = defaults.
/// Features cover all faces that take part and are numbered from 0 by falling area. On success they replace those of an
/// earlier call; on failure or cancel those stay. O(faces log faces) in time and about 1 kB a face.
ar_status ar_find_features(ar_mesh *mesh,
                           const ar_feature_options *options,
                           ar_error *error);

/// Feature of every face in the order of the file or buffer, -1 for a face that takes no part. A face that a border
/// crosses has the feature that most of it belongs to; features are measured on what is theirs of such faces.
///   out   capacity numbers, capacity in faces.
ar_status ar_get_face_feature(const ar_mesh *mesh,
                              int32_t *out,
                              size_t capacity,
                              size_t *count,
                              ar_error *error);

/// The features by number, judged.
///   limits   NULL = defaults.
///   out      capacity structs, capacity in features. The first must be prepared by ar_feature_info_init: its
///            struct_size is taken as the size of all, and set in all.
ar_status ar_get_features(const ar_mesh *mesh,
                          const ar_limits *limits,
                          ar_feature_info *out,
                          size_t capacity,
                          size_t *count,
                          ar_error *error);

/// The features as JSON, a NUL-terminated text: docs/report-schema.json describes it. Worst first.
///   limits   NULL = defaults.
///   text     capacity characters, the NUL among them.
ar_status ar_get_report(const ar_mesh *mesh,
                        const ar_limits *limits,
                        char *text,
                        size_t capacity,
                        size_t *count,
                        ar_error *error);

/// Writes the welded vertices and used faces as binary PLY, with a colour and the scalars feature and ratio (float; by
/// width, width too) for every face. Needs ar_find_features.
///   path        NUL-terminated; an existing file is replaced.
///   colour_by   AR_COLOUR_*.
ar_status ar_features_write_ply(const ar_mesh *mesh,
                                const char *path,
                                uint32_t colour_by,
                                ar_error *error);

// ==============================================================================================================
// Coloured PLY, to look at in MeshLab, ParaView and the like.
// ==============================================================================================================

/// Writes the welded vertices and used faces with the results as binary PLY: vertex x, y, z (float, or double where
/// floats would show), red, green, blue (uchar, by `quantity` on the viridis scale: dark violet for the least value,
/// yellow for the greatest; grey where it is NaN), d1, d2, ratio, quality (float; quality is `quantity` once more, under
/// the only name that MeshLab reads). Needs ar_compute.
///   path       NUL-terminated; an existing file is replaced.
///   quantity   AR_D1, AR_D2 or AR_RATIO.
ar_status ar_mesh_write_ply(const ar_mesh *mesh,
                            const char *path,
                            uint32_t quantity,
                            ar_error *error);

#ifdef __cplusplus
}
#endif

#endif // ARMESH_H
