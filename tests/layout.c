/* The layout that src/capi asserts on the Rust side, asserted on the C side. Compiling it (C11) is the test. */
#include <armesh.h>

#define SIZE(type, bytes) _Static_assert(sizeof(type) == (bytes), "size of " #type)
#define AT(type, field, bytes) _Static_assert(offsetof(type, field) == (bytes), #type "." #field)

SIZE(ar_status, 4);

SIZE(ar_error, 536);
AT(ar_error, struct_size, 0);
AT(ar_error, status, 4);
AT(ar_error, first_index, 8);
AT(ar_error, count, 16);
AT(ar_error, message, 24);

#if UINTPTR_MAX == UINT64_MAX
SIZE(ar_mesh_desc, 112);
AT(ar_mesh_desc, struct_size, 0);
AT(ar_mesh_desc, flags, 4);
AT(ar_mesh_desc, positions, 8);
AT(ar_mesh_desc, vertex_count, 16);
AT(ar_mesh_desc, position_stride, 24);
AT(ar_mesh_desc, triangles, 32);
AT(ar_mesh_desc, face_count, 40);
AT(ar_mesh_desc, triangle_stride, 48);
AT(ar_mesh_desc, position_type, 56);
AT(ar_mesh_desc, index_type, 60);
AT(ar_mesh_desc, weld, 64);
AT(ar_mesh_desc, threads, 68);
AT(ar_mesh_desc, weld_tolerance, 72);
AT(ar_mesh_desc, memory_budget, 80);
AT(ar_mesh_desc, progress, 88);
AT(ar_mesh_desc, user, 96);
AT(ar_mesh_desc, cancel, 104);

SIZE(ar_load_options, 56);
AT(ar_load_options, struct_size, 0);
AT(ar_load_options, flags, 4);
AT(ar_load_options, weld, 8);
AT(ar_load_options, threads, 12);
AT(ar_load_options, weld_tolerance, 16);
AT(ar_load_options, memory_budget, 24);
AT(ar_load_options, progress, 32);
AT(ar_load_options, user, 40);
AT(ar_load_options, cancel, 48);

SIZE(ar_compute_options, 80);
AT(ar_compute_options, struct_size, 0);
AT(ar_compute_options, threads, 4);
AT(ar_compute_options, memory_budget, 8);
AT(ar_compute_options, progress, 16);
AT(ar_compute_options, user, 24);
AT(ar_compute_options, cancel, 32);
AT(ar_compute_options, profile, 40);
AT(ar_compute_options, rays, 44);
AT(ar_compute_options, cone_angle, 48);
AT(ar_compute_options, d2_method, 56);
AT(ar_compute_options, d1_method, 60);
AT(ar_compute_options, time_factor, 64);
AT(ar_compute_options, d1_tolerance, 72);
#endif

SIZE(ar_finding, 40);
AT(ar_finding, count, 0);
AT(ar_finding, first, 8);
AT(ar_finding, at, 16);

SIZE(ar_diagnostics, 560);
AT(ar_diagnostics, struct_size, 0);
AT(ar_diagnostics, unit, 4);
AT(ar_diagnostics, vertex_count, 8);
AT(ar_diagnostics, face_count, 16);
AT(ar_diagnostics, welded_vertex_count, 24);
AT(ar_diagnostics, used_face_count, 32);
AT(ar_diagnostics, non_finite_vertices, 40);
AT(ar_diagnostics, inverted_shells, 440);
AT(ar_diagnostics, components, 480);
AT(ar_diagnostics, closed, 488);
AT(ar_diagnostics, orientable, 492);
AT(ar_diagnostics, volume, 496);
AT(ar_diagnostics, area, 504);
AT(ar_diagnostics, bbox_min, 512);
AT(ar_diagnostics, bbox_max, 536);

SIZE(ar_place, 32);
AT(ar_place, vertex, 0);
AT(ar_place, position, 8);

SIZE(ar_accuracy, 96);
AT(ar_accuracy, method, 4);
AT(ar_accuracy, d1_error, 32);
AT(ar_accuracy, first_open_face, 88);

SIZE(ar_summary, 312);
AT(ar_summary, struct_size, 0);
AT(ar_summary, reserved, 4);
AT(ar_summary, d1_max, 8);
AT(ar_summary, vertex_ratio_max, 64);
AT(ar_summary, d1_max_at, 72);
AT(ar_summary, d1_max_other, 104);
AT(ar_summary, d2_max_at, 136);
AT(ar_summary, d2_min_at, 168);
AT(ar_summary, vertex_ratio_max_at, 200);
AT(ar_summary, undefined_vertices, 232);
AT(ar_summary, solves, 240);
AT(ar_summary, stage_seconds, 248);

#if UINTPTR_MAX == UINT64_MAX
SIZE(ar_segment_options, 96);
AT(ar_segment_options, threads, 4);
AT(ar_segment_options, memory_budget, 8);
AT(ar_segment_options, method, 40);
AT(ar_segment_options, count, 44);
AT(ar_segment_options, criterion, 48);
AT(ar_segment_options, min_area, 56);
AT(ar_segment_options, alpha, 64);
AT(ar_segment_options, epsilon, 88);
#endif

SIZE(ar_segment_info, 280);
AT(ar_segment_info, struct_size, 0);
AT(ar_segment_info, flags, 4);
AT(ar_segment_info, faces, 8);
AT(ar_segment_info, handles, 16);
AT(ar_segment_info, d1_max, 24);
AT(ar_segment_info, ratio_max, 72);
AT(ar_segment_info, loop_length, 104);
AT(ar_segment_info, d1_ends, 112);
AT(ar_segment_info, d2_max_at, 160);
AT(ar_segment_info, centroid, 208);
AT(ar_segment_info, upper, 256);

#if UINTPTR_MAX == UINT64_MAX
SIZE(ar_feature_options, 48);
AT(ar_feature_options, threads, 4);
AT(ar_feature_options, memory_budget, 8);
AT(ar_feature_options, progress, 16);
AT(ar_feature_options, min_area, 40);
#endif

SIZE(ar_limits, 32);
AT(ar_limits, warn_ratio, 8);
AT(ar_limits, error_ratio, 16);
AT(ar_limits, min_width, 24);

SIZE(ar_feature_info, 448);
AT(ar_feature_info, id, 4);
AT(ar_feature_info, kind, 8);
AT(ar_feature_info, severity, 12);
AT(ar_feature_info, reasons, 16);
AT(ar_feature_info, faces, 24);
AT(ar_feature_info, ratio, 32);
AT(ar_feature_info, d1_max, 48);
AT(ar_feature_info, area, 80);
AT(ar_feature_info, d1_ends, 112);
AT(ar_feature_info, d2_max_at, 160);
AT(ar_feature_info, d2_min_at, 232);
AT(ar_feature_info, centroid, 304);
AT(ar_feature_info, box_axes, 352);
AT(ar_feature_info, box_size, 424);
