// Against CGAL on the same meshes: heat and exact geodesic distances, the shape diameter function.
#include "reference.hpp"
#include "support.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdio>

using namespace support;

namespace {

constexpr double kCone = 2.0943951023931953; // 120 degrees

struct Shape {
    const char *name;
    shapes::Mesh mesh;
};

std::vector<Shape> well_shaped() {
    return {{"sphere", shapes::icosphere(16, 1)},
            {"ellipsoid", shapes::ellipsoid(16, 1, 1.6, 2.5)},
            {"box", shapes::box(3, 4, 5, 0.2)},
            {"torus", shapes::torus(3, 1, 120, 40)},
            {"helix", shapes::helix(10, 8, 1.5, 4, 360, 48)},
            {"organic", shapes::organic(20)}};
}

// The faces on which both sides have a value.
void keep_measured(std::vector<double> &ours, std::vector<double> &theirs) {
    for (std::size_t f = 0; f < theirs.size(); ++f) {
        if (!(theirs[f] > 0)) {
            theirs[f] = NAN; // CGAL writes -1 for "no value"
        }
    }
    REQUIRE(ours.size() == theirs.size());
}

} // namespace

TEST_CASE("single-source distance: CGAL's heat method and exact geodesics", "[reference]") {
    std::printf("\n%-10s %7s %18s %18s %18s\n", "distance", "source", "L2 to CGAL heat", "mean to exact", "worst to exact");
    for (const Shape &shape : well_shaped()) {
        const Handle mesh = through_openmesh(shape.mesh);
        for (const std::size_t part : {0, 3, 7}) {
            const auto source = static_cast<std::uint32_t>(shape.mesh.points.size() * part / 8);
            const std::vector<double> ours = distance(mesh, source);
            REQUIRE(ours.size() == shape.mesh.points.size());
            CHECK(ours[source] == 0);
            const std::vector<double> heat = reference::heat(shape.mesh, source);
            const std::vector<double> exact = reference::exact(shape.mesh, source);
            const double l2 = rms_relative(ours, heat), mean = mean_relative(ours, exact);
            std::printf("%-10s %7u %17.3f%% %17.2f%% %17.2f%%\n", shape.name, source, 100 * l2, 100 * mean,
                        100 * worst_relative(ours, exact));
            INFO(shape.name << " from " << source);
            CHECK(l2 <= 0.01);
            CHECK(mean <= 0.03);
        }
    }
}

TEST_CASE("shape diameter function: CGAL's raw values", "[reference]") {
    std::printf("\n%-10s %7s %10s %10s %10s %10s\n", "SDF", "faces", "spread", "Pearson", "median", "worst");
    for (const Shape &shape : well_shaped()) {
        ar_compute_options how = options();
        how.d2_method = AR_D2_SDF;
        std::vector<double> ours = compute(through_openmesh(shape.mesh), how).face_d2;
        std::vector<double> theirs = reference::sdf(shape.mesh, 25, kCone);
        keep_measured(ours, theirs);
        const double spread = variation(theirs), median = median_relative(ours, theirs);
        const double r = pearson(ours, theirs);
        std::printf("%-10s %7zu %9.2f%% %10.4f %9.2f%% %9.1f%%\n", shape.name, ours.size(), 100 * spread, r, 100 * median,
                    100 * worst_relative(ours, theirs));
        INFO(shape.name);
        CHECK(median <= 0.03);
        if (spread > 0.01) {
            CHECK(r >= 0.99);
        } else {
            // the field is constant (a sphere): what varies is rounding, which does not correlate
            CHECK(worst_relative(ours, theirs) <= 0.01);
        }
    }
}

TEST_CASE("the paper's D2 beside CGAL's shape diameter function", "[reference]") {
    // Two measures of width, not one: D2 is the least of l / cos(theta) (an inscribed sphere), SDF a mean of l over the cone.
    std::printf("\n%-10s %10s %14s\n", "D2 to SDF", "Spearman", "median D2/SDF");
    for (const Shape &shape : well_shaped()) {
        std::vector<double> ours = compute(through_openmesh(shape.mesh)).face_d2;
        std::vector<double> theirs = reference::sdf(shape.mesh, 25, kCone);
        keep_measured(ours, theirs);
        const double rank = spearman(ours, theirs), quotient = median_quotient(ours, theirs);
        std::printf("%-10s %10.3f %14.3f\n", shape.name, rank, quotient);
        CHECK(std::isfinite(quotient));
        CHECK(quotient > 0.3);
        CHECK(quotient < 3);
    }
}
