// What must not change: results under rotation, translation, scaling, renumbering, and with the number of threads.
#include "support.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace support;

namespace {

struct Shape {
    const char *name;
    shapes::Mesh mesh;
};

std::vector<Shape> parts() {
    return {{"organic", shapes::organic(10)},
            {"helix", shapes::helix(10, 8, 1, 4, 70, 14)},
            {"box", shapes::box(9, 5, 2, 0.5)},
            {"cylinder", shapes::cylinder(3, 20, 20, 0.8)}};
}

struct Mode {
    const char *name;
    std::uint32_t d1;
    double vertex; // how much the ratio of a vertex may change
};

// With AR_D1_CERTIFIED, D1 of a vertex is known to 2 % plus the asymmetry of heat distances, and which of several equally
// far vertices becomes the next source hangs on rounding. With every vertex as a source nothing does.
const Mode kModes[] = {{"all vertices", AR_D1_ALL_VERTICES, 1e-3}, {"certified", AR_D1_CERTIFIED, 0.05}};

ar_compute_options with(const Mode &mode) {
    ar_compute_options how = options();
    how.d1_method = mode.d1;
    return how;
}

void same(const Mode &mode, const Field &before, const Field &after) {
    INFO("D1 from " << mode.name);
    CHECK(std::fabs(after.summary.ratio_max / before.summary.ratio_max - 1) <= 1e-3);
    CHECK(std::fabs(after.summary.ratio_mean / before.summary.ratio_mean - 1) <= 0.1 * mode.vertex + 9e-4);
    CHECK(worst_relative(after.ratio, before.ratio) <= mode.vertex);
}

// Where a sphere between walls could as well go one way as the other, rounding decides: when a symmetrical shape is turned
// that is so at a few vertices, which change by no more than `worst`.
void same_widths(const std::vector<double> &before, const std::vector<double> &after, double worst) {
    std::vector<double> change;
    for (std::size_t v = 0; v < before.size(); ++v) {
        change.push_back(std::fabs(after[v] / before[v] - 1));
    }
    std::sort(change.begin(), change.end());
    CHECK(change[change.size() * 95 / 100] <= 1e-3);
    CHECK(change.back() <= worst);
}

bool identical(const std::vector<double> &a, const std::vector<double> &b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

} // namespace

TEST_CASE("ratio does not depend on where the part is, how it lies or how big it is", "[invariance]") {
    const Mode mode = GENERATE(from_range(std::begin(kModes), std::end(kModes)));
    const auto run = [&](const shapes::Mesh &mesh) { return compute(through_openmesh(mesh), with(mode)); };
    for (const Shape &shape : parts()) {
        const Field before = run(shape.mesh);
        const double size = shapes::size(shape.mesh);
        for (const double angle : {0.3, 1.1, 2.0, 2.9}) {
            INFO(shape.name << " turned by " << angle);
            shapes::Mesh mesh = shape.mesh;
            shapes::rotate(mesh, angle);
            same(mode, before, run(mesh));
        }
        for (const shapes::Point &by : {shapes::Point{1e6, 0, 0}, shapes::Point{-1e6, 1e6, 0.3e6}}) {
            INFO(shape.name << " moved by a million times its size");
            shapes::Mesh mesh = shape.mesh;
            shapes::translate(mesh, {by[0] * size, by[1] * size, by[2] * size});
            same(mode, before, run(mesh));
        }
        for (const double factor : {1e-6, 1e6, 0.0254}) {
            INFO(shape.name << " scaled by " << factor);
            shapes::Mesh mesh = shape.mesh;
            shapes::scale(mesh, factor);
            const Field after = run(mesh);
            same(mode, before, after);
            CHECK(std::fabs(after.summary.d1_max / (factor * before.summary.d1_max) - 1) <= 1e-3);
            CHECK(std::fabs(after.summary.d2_max / (factor * before.summary.d2_max) - 1) <= 1e-3);
        }
    }
}

TEST_CASE("ratio does not depend on the order of vertices, faces and corners", "[invariance]") {
    const Mode mode = GENERATE(from_range(std::begin(kModes), std::end(kModes)));
    for (const Shape &shape : parts()) {
        const Field before = compute(through_openmesh(shape.mesh), with(mode));
        for (const unsigned seed : {1u, 2u}) {
            INFO(shape.name << ", order " << seed);
            std::vector<std::uint32_t> to;
            Field after = compute(through_openmesh(shapes::renumber(shape.mesh, seed, &to)), with(mode));
            const std::vector<double> renumbered = after.ratio;
            for (std::size_t v = 0; v < to.size(); ++v) {
                after.ratio[v] = renumbered[to[v]];
            }
            same(mode, before, after);
        }
    }
}

TEST_CASE("widths of the print profile do not depend on how a part lies or is numbered", "[invariance]") {
    ar_compute_options how = options();
    how.profile = AR_PROFILE_PRINT;
    for (const Shape &shape : parts()) {
        const Field before = compute(through_openmesh(shape.mesh), how);
        for (const double angle : {0.3, 1.1, 2.0, 2.9}) {
            INFO(shape.name << " turned by " << angle);
            shapes::Mesh mesh = shape.mesh;
            shapes::rotate(mesh, angle);
            same_widths(before.d2, compute(through_openmesh(mesh), how).d2, 0.06);
        }
        for (const unsigned seed : {1u, 2u}) {
            INFO(shape.name << ", order " << seed);
            std::vector<std::uint32_t> to;
            const Field after = compute(through_openmesh(shapes::renumber(shape.mesh, seed, &to)), how);
            std::vector<double> d2 = after.d2;
            for (std::size_t v = 0; v < to.size(); ++v) {
                d2[v] = after.d2[to[v]];
            }
            same_widths(before.d2, d2, 2e-3);
        }
    }
}

TEST_CASE("results are bit-identical for every number of threads", "[invariance]") {
    for (const Shape &shape : parts()) {
        for (const std::uint32_t method : {AR_D2_INSCRIBED, AR_D2_SDF}) {
            ar_compute_options how = options();
            how.d2_method = method;
            how.threads = 1;
            const Field one = compute(through_openmesh(shape.mesh), how);
            for (const std::uint32_t threads : {2u, 3u, 7u, 0u}) {
                INFO(shape.name << " on " << threads << " threads");
                how.threads = threads;
                const Field many = compute(through_openmesh(shape.mesh), how);
                CHECK(identical(one.d1, many.d1));
                CHECK(identical(one.d2, many.d2));
                CHECK(identical(one.ratio, many.ratio));
                CHECK(identical(one.face_d2, many.face_d2));
                CHECK(std::memcmp(&one.summary.d1_max, &many.summary.d1_max, 8 * sizeof(double)) == 0);
            }
        }
    }
}

TEST_CASE("float, double, strided and soup input give one answer", "[invariance]") {
    // powers of two: exact in float too
    const shapes::Mesh mesh = shapes::box(8, 4, 2, 0.5);
    const Field twice = compute(through_openmesh(mesh, Precision::twice), with(kModes[0]));
    const Field single = compute(through_openmesh(mesh, Precision::single), with(kModes[0]));
    CHECK(identical(twice.ratio, single.ratio));

    struct Record { // a slicer's vertex: float position first, other things after it
        float x, y, z;
        float normal[3];
        std::uint32_t color;
    };
    struct Face {
        std::uint32_t material;
        std::int32_t corner[3];
    };
    std::vector<Record> records;
    for (const shapes::Point &p : mesh.points) {
        const float nan = std::nanf("");
        records.push_back({float(p[0]), float(p[1]), float(p[2]), {nan, nan, nan}, 0xFFFFFFFF});
    }
    std::vector<Face> faces;
    for (const shapes::Triangle &t : mesh.triangles) {
        faces.push_back({0xFFFFFFFF, {std::int32_t(t[0]), std::int32_t(t[1]), std::int32_t(t[2])}});
    }
    ar_mesh_desc desc;
    ar_mesh_desc_init(&desc);
    desc.positions = records.data();
    desc.vertex_count = records.size();
    desc.position_stride = sizeof(Record);
    desc.position_type = AR_FLOAT32;
    desc.triangles = faces[0].corner;
    desc.face_count = faces.size();
    desc.triangle_stride = sizeof(Face);
    desc.index_type = AR_INT32;
    Error error;
    ar_mesh *strided = nullptr;
    check(ar_mesh_new(&desc, &strided, &error), error);
    CHECK(identical(twice.ratio, compute(Handle(strided), with(kModes[0])).ratio));

    shapes::Mesh soup;
    for (const shapes::Triangle &t : mesh.triangles) {
        const auto at = static_cast<std::uint32_t>(soup.points.size());
        for (const std::uint32_t v : t) {
            shapes::Point p = mesh.points[v];
            for (double &c : p) {
                c = c == 0 && at % 2 == 0 ? -0.0 : c; // -0 and +0 are one place
            }
            soup.points.push_back(p);
        }
        soup.triangles.push_back({at, at + 1, at + 2});
    }
    const Handle welded = direct(soup, error);
    REQUIRE(welded);
    CHECK(diagnostics(welded).welded_vertex_count == mesh.points.size());
    CHECK(diagnostics(welded).closed == 1);
    const Field from_soup = compute(welded, with(kModes[0]));
    REQUIRE(from_soup.ratio.size() == soup.points.size());
    std::vector<double> expected;
    for (const shapes::Triangle &t : mesh.triangles) {
        for (const std::uint32_t v : t) {
            expected.push_back(twice.ratio[v]);
        }
    }
    CHECK(worst_relative(from_soup.ratio, expected) <= 1e-3); // every welded vertex has its value at all its copies
}
