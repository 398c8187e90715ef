// D1, D2 and their ratio on shapes whose values are known exactly. Meshes go through OpenMesh's own buffers.
#include "reference.hpp"
#include "support.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdio>

using namespace support;

namespace {

constexpr double kPi = 3.141592653589793;

double off(double value, double truth) { return std::fabs(value / truth - 1); }

} // namespace

TEST_CASE("sphere: D1max/D2max is pi/2 and D2 is the diameter everywhere", "[closed-form]") {
    const shapes::Mesh mesh = shapes::icosphere(24, 1.0);
    REQUIRE(mesh.triangles.size() >= 10000);
    const auto precision = GENERATE(Precision::single, Precision::twice);
    const Field field = compute(through_openmesh(mesh, precision));
    std::printf("sphere, %zu faces: D1max/D2max %.4f (exact %.4f), D2 %.4f .. %.4f (exact 2), D1 %.4f .. %.4f (exact %.4f)\n",
                mesh.triangles.size(), field.summary.ratio_max, kPi / 2, smallest(field.d2), largest(field.d2),
                smallest(field.d1), largest(field.d1), kPi);
    CHECK(off(field.summary.ratio_max, kPi / 2) <= 0.02);
    CHECK(off(smallest(field.d2), 2.0) <= 0.01);
    CHECK(off(largest(field.d2), 2.0) <= 0.01);
    CHECK(off(smallest(field.d1), kPi) <= 0.03);
    CHECK(off(field.summary.d1_max, kPi) <= 0.02);
}

TEST_CASE("boxes: D2max is the thickness, D1max the exact geodesic diameter", "[closed-form]") {
    struct Box {
        const char *name;
        double x, y, z, step, fine;
    };
    // D2 = thickness holds at the middle of a side; next to it, x away, a ray at 45 degrees meets the neighbouring side
    // and D2 is up to 2 x less. So a rod needs a fine strip there, where a slab does not.
    // (In the middle of its square ends no ray of twenty meets a side at 45 degrees, and D2 reads up to 2 % too much.)
    const Box box = GENERATE(values<Box>({{"slab 100 x 100 x 5", 100, 100, 5, 2.5, 0},
                                          {"slab 100 x 100 x 20", 100, 100, 20, 2.5, 0},
                                          {"cube", 10, 10, 10, 0.25, 0},
                                          {"box 10 x 10 x 50", 10, 10, 50, 0.5, 0},
                                          {"rod 4 x 4 x 80", 4, 4, 80, 0.5, 0.08},
                                          {"strip 30 x 6 x 1", 30, 6, 1, 0.25, 0}}));
    const double thickness = std::min({box.x, box.y, box.z});
    // the farthest pairs of a box lie at corners or centres or near them: nine samples along every edge
    std::vector<shapes::Point> samples = shapes::box(8, 8, 8, 1).points;
    for (shapes::Point &p : samples) {
        p = {p[0] * box.x / 8, p[1] * box.y / 8, p[2] * box.z / 8};
    }
    const double d1 = reference::exact_diameter(shapes::box(box.x, box.y, box.z, 0), samples);
    const shapes::Mesh mesh =
        box.fine > 0 ? shapes::box({shapes::fine_in_the_middle(box.x, box.step, box.fine),
                                    shapes::even(box.y, box.step), shapes::even(box.z, box.step)})
                     : shapes::box(box.x, box.y, box.z, box.step);
    const Field field = compute(through_openmesh(mesh));
    std::printf("%-20s %6zu faces: D1max %.4g (exact %.4g, %+.1f %%), D2max %.4g (exact %.4g, %+.1f %%), largest of a face %.4g\n", box.name,
                mesh.triangles.size(), field.summary.d1_max, d1, 100 * (field.summary.d1_max / d1 - 1),
                field.summary.d2_max, thickness, 100 * (field.summary.d2_max / thickness - 1), largest(field.face_d2));
    CHECK(off(field.summary.d1_max, d1) <= 0.03);
    CHECK(off(field.summary.d2_max, thickness) <= 0.01);
}

TEST_CASE("cylinders: D2max is the diameter, D1max the exact geodesic diameter", "[closed-form]") {
    struct Cylinder {
        double diameter, height, step;
    };
    const Cylinder c = GENERATE(values<Cylinder>({{10, 100, 1}, {4, 80, 0.6}, {20, 20, 1}}));
    // a facet's normal is off by up to pi / (3 sides) at its faces' centroids, and the ray at 60 degrees reads
    // tan 60 of that too short
    constexpr int sides = 96;
    const double d1 = reference::exact_diameter(shapes::cylinder(c.diameter, c.height, sides, 0),
                                                shapes::cylinder(c.diameter, c.height, 12, c.diameter / 2).points);
    const shapes::Mesh mesh = shapes::cylinder(c.diameter, c.height, sides, c.step);
    const Field field = compute(through_openmesh(mesh));
    std::printf("cylinder %g x %g, %zu faces: D1max %.4g (exact %.4g, %+.1f %%), D2max %.4g (exact %.4g, %+.1f %%)\n",
                c.diameter, c.height, mesh.triangles.size(), field.summary.d1_max, d1,
                100 * (field.summary.d1_max / d1 - 1), field.summary.d2_max, c.diameter,
                100 * (field.summary.d2_max / c.diameter - 1));
    CHECK(off(field.summary.d1_max, d1) <= 0.03);
    CHECK(off(field.summary.d2_max, c.diameter) <= 0.01);
}

TEST_CASE("mesh facts against CGAL and closed forms", "[closed-form]") {
    struct Case {
        const char *name;
        shapes::Mesh mesh;
    };
    const Case cases[] = {{"sphere", shapes::icosphere(8, 2)},        {"box", shapes::box(3, 4, 5, 1)},
                          {"torus", shapes::torus(3, 1, 40, 16)},     {"cylinder", shapes::cylinder(2, 5, 24, 0.5)},
                          {"helix", shapes::helix(10, 8, 1.5, 4, 60, 12)}, {"organic", shapes::organic(8)}};
    for (const Case &c : cases) {
        INFO(c.name);
        REQUIRE(reference::closed(c.mesh));
        const ar_diagnostics d = diagnostics(through_openmesh(c.mesh));
        CHECK(d.volume == Approx(reference::volume(c.mesh)).epsilon(1e-9));
        CHECK(d.closed == 1);
        CHECK(d.components == 1);
        CHECK(d.vertex_count == c.mesh.points.size());
        CHECK(d.face_count == c.mesh.triangles.size());
        CHECK(d.boundary_edges.count + d.non_manifold_edges.count + d.non_manifold_vertices.count +
                  d.orientation_conflicts.count + d.inverted_shells.count + d.zero_area_faces.count + d.duplicate_faces.count ==
              0);
    }
    const ar_diagnostics box = diagnostics(through_openmesh(shapes::box(3, 4, 5, 1)));
    CHECK(box.volume == Approx(60).epsilon(1e-12));
    CHECK(box.area == Approx(94).epsilon(1e-12));
    CHECK(box.bbox_max[2] == 5);
}
