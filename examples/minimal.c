/* How slender is a part? The smallest complete program in C99.
 *
 *   minimal              a rod of 20 x 1 x 1, from arrays of our own
 *   minimal part.stl     a file: STL, OBJ, PLY or 3MF
 */
#include <armesh.h>
#include <stdio.h>
#include <stdlib.h>

static int failed(const char *what, const ar_error *error) {
  fprintf(stderr, "%s: %s: %s\n", what, ar_status_name(error->status), error->message);
  return 2;
}

/* The buffers stay ours; strides would let them be part of larger structs. */
static ar_status make_rod(ar_mesh **mesh, ar_error *error) {
  static const float xyz[8][3] = {{0, 0, 0},  {20, 0, 0}, {20, 1, 0}, {0, 1, 0},
                                  {0, 0, 1},  {20, 0, 1}, {20, 1, 1}, {0, 1, 1}};
  static const int32_t ijk[12][3] = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                                     {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
  ar_mesh_desc desc;
  ar_mesh_desc_init(&desc);
  desc.positions = xyz;
  desc.vertex_count = 8;
  desc.position_type = AR_FLOAT32;
  desc.triangles = ijk;
  desc.face_count = 12;
  desc.index_type = AR_INT32;
  return ar_mesh_new(&desc, mesh, error);
}

int main(int argc, char **argv) {
  ar_error error;
  ar_summary summary;
  ar_mesh *mesh = NULL;
  double *ratio = NULL;
  size_t count = 0, above = 0, i;
  int result = 0;

  ar_error_init(&error);
  ar_summary_init(&summary);
  if ((argc > 1 ? ar_mesh_load(argv[1], NULL, &mesh, &error) : make_rod(&mesh, &error)) != AR_OK) {
    return failed("mesh", &error);
  }
  if (ar_compute(mesh, NULL, &error) != AR_OK || ar_get_summary(mesh, &summary, &error) != AR_OK ||
      ar_get_vertex_ratio(mesh, NULL, 0, &count, &error) != AR_OK) {
    result = failed("compute", &error);
  } else {
    printf("D1max %g / D2max %g = %g\n", summary.d1_max, summary.d2_max, summary.ratio_max);
    ratio = malloc(count * sizeof *ratio);
    if (ratio != NULL && ar_get_vertex_ratio(mesh, ratio, count, NULL, &error) == AR_OK) {
      for (i = 0; i < count; i++) {
        above += ratio[i] > 8.0; /* false for NaN: no value there */
      }
      printf("%zu of %zu vertices are over 8\n", above, count);
    }
  }
  free(ratio);
  ar_mesh_free(mesh);
  return result;
}
