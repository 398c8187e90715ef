/* Bad input through the C header, in C99: every case is refused with its code and a message, or taken and reported. */
#include <armesh.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

static void expect_at(int line, const char *what, long long got, long long wanted) {
    if (got != wanted) {
        printf("line %d: %s is %lld, not %lld\n", line, what, got, wanted);
        ++failures;
    }
}
#define EXPECT(got, wanted) expect_at(__LINE__, #got, (long long)(got), (long long)(wanted))

static const double tetrahedron[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
static const int32_t faces[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};

static ar_mesh_desc description(void) {
    ar_mesh_desc desc;
    ar_mesh_desc_init(&desc);
    desc.positions = tetrahedron;
    desc.vertex_count = 4;
    desc.position_type = AR_FLOAT64;
    desc.triangles = faces;
    desc.face_count = 4;
    desc.index_type = AR_INT32;
    return desc;
}

/* Status of ar_mesh_new; checks the rules that hold for every refusal. */
static ar_status make(const ar_mesh_desc *desc, ar_error *error) {
    ar_mesh *const untouched = (ar_mesh *)(void *)&failures;
    ar_mesh *mesh = untouched;
    ar_status status;
    ar_error_init(error);
    status = ar_mesh_new(desc, &mesh, error);
    if (status == AR_OK) {
        EXPECT(mesh != untouched, 1);
        EXPECT(ar_mesh_free(mesh), AR_OK);
    } else {
        EXPECT(mesh == untouched, 1); /* outputs only on success */
        EXPECT(error->status, status);
        EXPECT(strlen(error->message) > 4 && strchr(error->message, '\n') == NULL, 1);
    }
    return status;
}

static void good_mesh_is_taken(void) {
    ar_error error;
    const ar_mesh_desc desc = description();
    ar_mesh *mesh = NULL;
    double ratio[4];
    size_t count = 0, i;
    EXPECT(make(&desc, &error), AR_OK);
    EXPECT(ar_mesh_new(&desc, &mesh, NULL), AR_OK); /* no error struct wanted */
    EXPECT(ar_compute(mesh, NULL, NULL), AR_OK);    /* default options */
    EXPECT(ar_get_vertex_ratio(mesh, ratio, 4, &count, NULL), AR_OK);
    EXPECT(count, 4);
    for (i = 0; i < 4; ++i) {
        EXPECT(ratio[i] > 0, 1);
    }
    EXPECT(ar_mesh_free(mesh), AR_OK);
}

static void null_pointers(void) {
    ar_error error;
    ar_mesh_desc desc = description();
    ar_mesh *mesh = NULL;
    double number;
    size_t count = 0;
    ar_summary summary;
    ar_diagnostics diagnostics;
    ar_error_init(&error);
    ar_summary_init(&summary);
    ar_diagnostics_init(&diagnostics);
    EXPECT(ar_mesh_new(NULL, &mesh, &error), AR_E_NULL);
    EXPECT(ar_mesh_new(&desc, NULL, &error), AR_E_NULL);
    EXPECT(ar_mesh_load(NULL, NULL, &mesh, &error), AR_E_NULL);
    EXPECT(ar_mesh_load("x.stl", NULL, NULL, &error), AR_E_NULL);
    EXPECT(ar_compute(NULL, NULL, &error), AR_E_NULL);
    EXPECT(ar_get_vertex_d1(NULL, &number, 1, &count, &error), AR_E_NULL);
    EXPECT(ar_get_vertex_d2(NULL, &number, 1, &count, &error), AR_E_NULL);
    EXPECT(ar_get_vertex_ratio(NULL, &number, 1, &count, &error), AR_E_NULL);
    EXPECT(ar_get_face_d2(NULL, &number, 1, &count, &error), AR_E_NULL);
    EXPECT(ar_get_summary(NULL, &summary, &error), AR_E_NULL);
    EXPECT(ar_get_histogram(NULL, AR_D1, &number, &number, 1, &error), AR_E_NULL);
    EXPECT(ar_mesh_get_diagnostics(NULL, &diagnostics, &error), AR_E_NULL);
    EXPECT(ar_mesh_get_positions(NULL, &number, 1, &count, &error), AR_E_NULL);
    EXPECT(ar_geodesic_distance(NULL, 0, NULL, &number, 1, &count, &error), AR_E_NULL);
    EXPECT(ar_mesh_write_ply(NULL, "x.ply", AR_RATIO, &error), AR_E_NULL);
    EXPECT(ar_cancel_token_new(NULL, &error), AR_E_NULL);
    EXPECT(ar_cancel_token_cancel(NULL, &error), AR_E_NULL);
    EXPECT(ar_mesh_free(NULL), AR_OK);
    EXPECT(ar_cancel_token_free(NULL), AR_OK);
    desc.positions = NULL;
    EXPECT(make(&desc, &error), AR_E_NULL);
    desc = description();
    desc.triangles = NULL;
    EXPECT(make(&desc, &error), AR_E_NULL);
    EXPECT(ar_mesh_desc_init(NULL), AR_E_NULL);
    EXPECT(ar_error_init(NULL), AR_E_NULL);
}

static void empty_meshes(void) {
    ar_error error;
    ar_mesh_desc desc = description();
    desc.vertex_count = 0;
    EXPECT(make(&desc, &error), AR_E_EMPTY);
    desc.positions = NULL; /* NULL is fine for nothing, but nothing is not a mesh */
    EXPECT(make(&desc, &error), AR_E_EMPTY);
    desc = description();
    desc.face_count = 0;
    EXPECT(make(&desc, &error), AR_E_EMPTY);
}

static void indices_out_of_range(void) {
    ar_error error;
    ar_mesh_desc desc = description();
    int32_t bad[12];
    const int32_t values[4] = {4, -1, INT32_MIN, INT32_MAX};
    size_t i;
    for (i = 0; i < 4; ++i) {
        memcpy(bad, faces, sizeof bad);
        bad[7] = values[i]; /* in face 2 */
        bad[10] = values[i]; /* in face 3 */
        desc.triangles = bad;
        desc.index_type = AR_INT32;
        EXPECT(make(&desc, &error), AR_E_INDEX);
        EXPECT(error.first_index, 2);
        EXPECT(error.count, 2);
        desc.index_type = AR_UINT32;
        EXPECT(make(&desc, &error), AR_E_INDEX);
        EXPECT(error.first_index, 2);
    }
    desc.flags = AR_MESH_SKIP_INVALID; /* taken on request, and reported */
    EXPECT(make(&desc, &error), AR_OK);
}

static void coordinates_not_finite(void) {
    ar_error error;
    ar_mesh_desc desc = description();
    double bad[12];
    float single[12];
    const double values[3] = {NAN, INFINITY, -INFINITY};
    size_t i, k;
    for (i = 0; i < 3; ++i) {
        memcpy(bad, tetrahedron, sizeof bad);
        bad[4] = values[i]; /* vertex 1 */
        desc.positions = bad;
        desc.position_type = AR_FLOAT64;
        EXPECT(make(&desc, &error), AR_E_NON_FINITE);
        EXPECT(error.first_index, 1);
        EXPECT(error.count, 1);
        for (k = 0; k < 12; ++k) {
            single[k] = (float)bad[k];
        }
        desc.positions = single;
        desc.position_type = AR_FLOAT32;
        EXPECT(make(&desc, &error), AR_E_NON_FINITE);
    }
}

static void faces_without_area(void) {
    ar_error error;
    ar_mesh_desc desc = description();
    static const double line[12] = {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3};
    static const int32_t repeated[6] = {0, 0, 1, 2, 3, 3};
    desc.positions = line;
    EXPECT(make(&desc, &error), AR_E_DEGENERATE);
    desc = description();
    desc.triangles = repeated;
    desc.face_count = 2;
    EXPECT(make(&desc, &error), AR_E_DEGENERATE);
}

static void struct_sizes(void) {
    ar_error error;
    ar_mesh_desc desc = description();
    struct {
        ar_mesh_desc known;
        uint64_t tail[2];
    } newer;
    ar_mesh *mesh = NULL;
    ar_summary summary;
    ar_compute_options options;
    const uint32_t sizes[5] = {0, 1, 4, 8, 0xFFFFFFFFu};
    size_t i;
    for (i = 0; i < 5; ++i) {
        desc = description();
        desc.struct_size = sizes[i];
        EXPECT(make(&desc, &error), AR_E_STRUCT);
    }
    memset(&newer, 0, sizeof newer);
    newer.known = description();
    newer.known.struct_size = sizeof newer;
    EXPECT(make(&newer.known, &error), AR_OK); /* a newer, longer struct that asks for nothing unknown */
    newer.tail[1] = 1;
    EXPECT(make(&newer.known, &error), AR_E_STRUCT);

    desc = description();
    ar_error_init(&error);
    EXPECT(ar_mesh_new(&desc, &mesh, &error), AR_OK);
    ar_compute_options_init(&options);
    options.struct_size = 0;
    EXPECT(ar_compute(mesh, &options, &error), AR_E_STRUCT);
    EXPECT(ar_compute(mesh, NULL, &error), AR_OK);
    ar_summary_init(&summary);
    summary.struct_size = 3;
    EXPECT(ar_get_summary(mesh, &summary, &error), AR_E_STRUCT);
    error.struct_size = 0;
    EXPECT(ar_compute(mesh, NULL, &error), AR_E_STRUCT);
    EXPECT(ar_mesh_free(mesh), AR_OK);
}

static void options_out_of_range(void) {
    ar_error error;
    const ar_mesh_desc good = description();
    ar_mesh_desc desc;
    ar_mesh *mesh = NULL;
    ar_compute_options options;
    ar_error_init(&error);
    desc = good, desc.position_type = 0;
    EXPECT(make(&desc, &error), AR_E_ARGUMENT);
    desc = good, desc.index_type = 77;
    EXPECT(make(&desc, &error), AR_E_ARGUMENT);
    desc = good, desc.weld = 9;
    EXPECT(make(&desc, &error), AR_E_ARGUMENT);
    desc = good, desc.flags = 0x80000000u;
    EXPECT(make(&desc, &error), AR_E_ARGUMENT);
    desc = good, desc.weld = AR_WELD_TOLERANCE, desc.weld_tolerance = -1;
    EXPECT(make(&desc, &error), AR_E_ARGUMENT);
    desc = good, desc.weld = AR_WELD_TOLERANCE, desc.weld_tolerance = NAN;
    EXPECT(make(&desc, &error), AR_E_ARGUMENT);
    desc = good, desc.position_stride = 23; /* below a row */
    EXPECT(make(&desc, &error), AR_E_ARGUMENT);
    desc = good, desc.triangle_stride = 8;
    EXPECT(make(&desc, &error), AR_E_ARGUMENT);
    desc = good, desc.vertex_count = UINT64_MAX / 24 + 2; /* overflows any address */
    EXPECT(make(&desc, &error), AR_E_ARGUMENT);

    EXPECT(ar_mesh_new(&good, &mesh, &error), AR_OK);
    ar_compute_options_init(&options);
    options.rays = 10001;
    EXPECT(ar_compute(mesh, &options, &error), AR_E_ARGUMENT);
    ar_compute_options_init(&options);
    options.cone_angle = 3.2;
    EXPECT(ar_compute(mesh, &options, &error), AR_E_ARGUMENT);
    options.cone_angle = NAN;
    EXPECT(ar_compute(mesh, &options, &error), AR_E_ARGUMENT);
    options.cone_angle = -1;
    EXPECT(ar_compute(mesh, &options, &error), AR_E_ARGUMENT);
    ar_compute_options_init(&options);
    options.d2_method = 42;
    EXPECT(ar_compute(mesh, &options, &error), AR_E_ARGUMENT);
    ar_compute_options_init(&options);
    options.time_factor = INFINITY;
    EXPECT(ar_compute(mesh, &options, &error), AR_E_ARGUMENT);
    EXPECT(ar_mesh_free(mesh), AR_OK);
}

static void getters(void) {
    ar_error error;
    const ar_mesh_desc desc = description();
    ar_mesh *mesh = NULL;
    double number[4] = {-7, -7, -7, -7};
    uint32_t id[12];
    size_t count = 99;
    ar_summary summary;
    ar_error_init(&error);
    ar_summary_init(&summary);
    EXPECT(ar_mesh_new(&desc, &mesh, &error), AR_OK);
    EXPECT(ar_get_vertex_d1(mesh, number, 4, &count, &error), AR_E_NOT_COMPUTED);
    EXPECT(ar_get_summary(mesh, &summary, &error), AR_E_NOT_COMPUTED);
    EXPECT(ar_mesh_write_ply(mesh, "never.ply", AR_RATIO, &error), AR_E_NOT_COMPUTED);
    EXPECT(ar_compute(mesh, NULL, &error), AR_OK);
    count = 99;
    EXPECT(ar_get_vertex_d1(mesh, number, 3, &count, &error), AR_E_CAPACITY);
    EXPECT(count, 4);
    EXPECT(number[0] == -7, 1);
    EXPECT(ar_get_vertex_d1(mesh, NULL, 0, &count, &error), AR_OK); /* only the size */
    EXPECT(count, 4);
    EXPECT(ar_get_vertex_d1(mesh, NULL, 0, NULL, &error), AR_E_NULL);
    EXPECT(ar_get_vertex_d1(mesh, number, 4, NULL, &error), AR_OK);
    EXPECT(number[0] > 0, 1);
    EXPECT(ar_mesh_get_triangles(mesh, id, 3, &count, &error), AR_E_CAPACITY);
    EXPECT(ar_mesh_get_triangles(mesh, id, 4, &count, &error), AR_OK);
    EXPECT(id[1], 2);
    EXPECT(ar_get_histogram(mesh, 17, number, number, 1, &error), AR_E_ARGUMENT);
    EXPECT(ar_get_histogram(mesh, AR_D1, number, number, 0, &error), AR_E_ARGUMENT);
    EXPECT(ar_geodesic_distance(mesh, 4, NULL, number, 4, &count, &error), AR_E_ARGUMENT);
    EXPECT(ar_geodesic_distance(mesh, 0, NULL, number, 3, &count, &error), AR_E_CAPACITY);
    EXPECT(ar_mesh_write_ply(mesh, "/no/such/folder/x.ply", AR_RATIO, &error), AR_E_IO);
    EXPECT(ar_mesh_free(mesh), AR_OK);
}

static void budget_of_one_byte(void) {
    ar_error error;
    ar_mesh_desc desc = description();
    ar_mesh *mesh = NULL;
    ar_compute_options options;
    double number[4];
    ar_error_init(&error);
    desc.memory_budget = 1;
    EXPECT(make(&desc, &error), AR_E_BUDGET);
    desc.memory_budget = 0;
    EXPECT(ar_mesh_new(&desc, &mesh, &error), AR_OK);
    ar_compute_options_init(&options);
    options.memory_budget = 1;
    EXPECT(ar_compute(mesh, &options, &error), AR_E_BUDGET);
    EXPECT(ar_get_vertex_d1(mesh, number, 4, NULL, &error), AR_E_NOT_COMPUTED); /* the handle is as it was */
    EXPECT(ar_compute(mesh, NULL, &error), AR_OK);
    EXPECT(ar_compute(mesh, &options, &error), AR_E_BUDGET);
    EXPECT(ar_get_vertex_d1(mesh, number, 4, NULL, &error), AR_OK);
    EXPECT(ar_mesh_free(mesh), AR_OK);
}

static void names(void) {
    int32_t code;
    for (code = 0; code >= -19; --code) {
        EXPECT(strncmp(ar_status_name(code), "AR_", 3), 0);
        EXPECT(strcmp(ar_status_name(code), "AR_E_UNKNOWN") != 0, 1);
    }
    EXPECT(strcmp(ar_status_name(1), "AR_E_UNKNOWN"), 0);
    EXPECT(strcmp(ar_status_name(INT32_MIN), "AR_E_UNKNOWN"), 0);
    EXPECT(strcmp(ar_stage_name(999), "unknown"), 0);
    EXPECT(ar_abi_version(), AR_ABI_VERSION);
    EXPECT(strlen(ar_version()) >= 5, 1);
}

int main(void) {
    good_mesh_is_taken();
    null_pointers();
    empty_meshes();
    indices_out_of_range();
    coordinates_not_finite();
    faces_without_area();
    struct_sizes();
    options_out_of_range();
    getters();
    budget_of_one_byte();
    names();
    printf("%d failed\n", failures);
    return failures == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
