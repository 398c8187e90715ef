// The print profile: what it measures must not depend on how a shape is triangulated, and damage must stay where it is.
#include "support.hpp"

#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <map>

using namespace support;

namespace {

ar_compute_options print_options() {
    ar_compute_options how = options();
    how.profile = AR_PROFILE_PRINT;
    return how;
}

Handle plain(const shapes::Mesh &mesh) {
    Error error;
    Handle handle = direct(mesh, error);
    REQUIRE(handle != nullptr);
    return handle;
}

Field print_field(const shapes::Mesh &mesh) { return compute(plain(mesh), print_options()); }

// Every triangle cut in four at the middles of its sides.
shapes::Mesh subdivided(const shapes::Mesh &mesh) {
    shapes::Mesh out{mesh.points, {}};
    std::map<std::array<std::uint32_t, 2>, std::uint32_t> middle;
    const auto mid = [&](std::uint32_t a, std::uint32_t b) {
        const auto [at, fresh] = middle.try_emplace({std::min(a, b), std::max(a, b)}, out.points.size());
        if (fresh) {
            const shapes::Point p = out.points[a], q = out.points[b];
            out.points.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
        }
        return at->second;
    };
    for (const auto &[a, b, c] : mesh.triangles) {
        const std::uint32_t ab = mid(a, b), bc = mid(b, c), ca = mid(c, a);
        out.triangles.insert(out.triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    return out;
}

double off(double value, double truth) { return std::fabs(value / truth - 1); }

} // namespace

TEST_CASE("a box of 12 triangles is measured like a finely meshed one", "[print]") {
    // the geodesic diameter of a bar with square ends runs from the middle of one end to the middle of the other
    const std::array<std::array<double, 4>, 3> boxes = {
        {{100, 100, 2000, 2100}, {100, 100, 500, 590.3}, {100, 100, 2, 142.86}}};
    for (const auto &[x, y, z, diameter] : boxes) {
        const Field raw = print_field(shapes::box(x, y, z, 0));
        const Field fine = print_field(shapes::box(x, y, z, std::max(x, z) / 12));
        const double thickness = std::min(x, z);
        CAPTURE(x, y, z, raw.summary.d1_max, fine.summary.d1_max, raw.summary.d2_max, fine.summary.d2_max);
        CHECK(off(raw.summary.d1_max, diameter) <= 0.02);
        CHECK(off(fine.summary.d1_max, diameter) <= 0.02);
        CHECK(off(raw.summary.d2_max, thickness) <= 0.01);
        CHECK(off(fine.summary.d2_max, thickness) <= 0.01);
        CHECK(smallest(fine.d2) >= 0.98 * thickness); // also on the edges
        CHECK(off(raw.summary.ratio_max, fine.summary.ratio_max) <= 0.03);
    }
}

TEST_CASE("subdivision changes nothing at the vertices that were there", "[print]") {
    for (const shapes::Mesh &mesh : {shapes::cylinder(10, 40, 24, 0), shapes::box(30, 6, 1, 0), shapes::icosphere(5, 3)}) {
        const Field raw = print_field(mesh);
        Field fine = print_field(subdivided(subdivided(mesh)));
        fine.d1.resize(raw.d1.size());
        fine.d2.resize(raw.d2.size());
        CHECK(worst_relative(fine.d1, raw.d1) <= 0.02);
        CHECK(median_relative(fine.d2, raw.d2) <= 0.01);
        CHECK(worst_relative(fine.d2, raw.d2) <= 0.05);
    }
}

TEST_CASE("the bounds hold D1 measured from every vertex", "[print]") {
    const shapes::Mesh mesh = shapes::organic(11);
    const Handle handle = plain(mesh);
    ar_compute_options how = print_options();
    how.d1_method = AR_D1_ALL_VERTICES;
    const Field every = compute(handle, how);
    const Field few = compute(handle, print_options());
    std::vector<double> lower(few.d1.size()), upper(few.d1.size());
    std::size_t count = 0;
    Error error;
    check(ar_get_vertex_d1_bounds(handle.get(), lower.data(), upper.data(), lower.size(), &count, &error), error);
    REQUIRE(count == few.d1.size());
    CHECK(few.summary.solves < every.summary.solves);
    for (std::size_t v = 0; v < count; ++v) {
        CHECK(lower[v] <= every.d1[v]);
        CHECK(every.d1[v] <= upper[v]);
        CHECK(upper[v] <= 1.06 * lower[v]);
    }
}

TEST_CASE("two overlapping boxes are as wide as their union", "[print]") {
    shapes::Mesh both = shapes::box(10, 10, 40, 0);
    shapes::Mesh second = shapes::box(10, 10, 40, 0);
    shapes::translate(second, {5, 0, 0});
    shapes::append(both, second);
    const Field field = print_field(both);
    const Field whole = print_field(shapes::box(15, 10, 40, 0));
    CHECK(off(field.summary.d2_max, whole.summary.d2_max) <= 0.02);
}

TEST_CASE("a hole and turned faces are told and change nothing far from them", "[print]") {
    const shapes::Mesh sound = shapes::cylinder(10, 60, 32, 2);
    const Field truth = print_field(sound);
    const auto far_from_damage = [&](const Field &field, double z) {
        for (std::size_t v = 0; v < sound.points.size(); ++v) {
            if (std::fabs(sound.points[v][2] - z) > 15) {
                CAPTURE(v, field.d1[v], truth.d1[v], field.d2[v], truth.d2[v]);
                REQUIRE(off(field.d1[v], truth.d1[v]) <= 0.05);
                REQUIRE(off(field.d2[v], truth.d2[v]) <= 0.05);
            }
        }
    };
    shapes::Mesh torn = sound;
    std::size_t hole = 0;
    while (std::fabs(torn.points[torn.triangles[hole][0]][2] - 30) > 1.5) {
        ++hole;
    }
    torn.triangles.erase(torn.triangles.begin() + static_cast<std::ptrdiff_t>(hole));
    CHECK(diagnostics(plain(torn)).boundary_edges.count == 3);
    far_from_damage(print_field(torn), 30);

    shapes::Mesh turned = sound;
    for (std::size_t f = 0; f < turned.triangles.size(); f += 100) {
        std::swap(turned.triangles[f][0], turned.triangles[f][1]);
    }
    CHECK(diagnostics(plain(turned)).orientation_conflicts.count > 0);
    far_from_damage(print_field(turned), -100); // orientation is mended: nowhere
}
