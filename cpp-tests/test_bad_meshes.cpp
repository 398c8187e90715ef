// Meshes that are wrong in ways that C arrays can be: what can be measured is, the rest is reported, nothing crashes.
#include "support.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

using namespace support;

namespace {

Handle take(const shapes::Mesh &mesh, std::uint32_t flags = 0) {
    Error error;
    Handle out = direct(mesh, error, flags);
    INFO(error.message);
    REQUIRE(out);
    return out;
}

ar_status refusal(const shapes::Mesh &mesh, Error &error) {
    CHECK_FALSE(direct(mesh, error));
    CHECK(std::string(error.message).size() > 4);
    return error.status;
}

std::vector<std::uint32_t> reasons(const Handle &mesh, std::size_t count) {
    std::vector<std::uint32_t> out(count);
    Error error;
    check(ar_get_vertex_reason(mesh.get(), out.data(), out.size(), nullptr, &error), error);
    return out;
}

// NaN exactly where there is a reason, and lengths that are lengths elsewhere.
void sane(const Handle &mesh, const Field &field) {
    const std::vector<std::uint32_t> reason = reasons(mesh, field.ratio.size());
    for (std::size_t v = 0; v < field.ratio.size(); ++v) {
        INFO("vertex " << v << " D1 " << field.d1[v] << " D2 " << field.d2[v] << " reason " << reason[v]);
        CHECK(std::isnan(field.ratio[v]) == (reason[v] != 0));
        CHECK((std::isnan(field.d1[v]) || (std::isfinite(field.d1[v]) && field.d1[v] > 0)));
        CHECK((std::isnan(field.d2[v]) || (std::isfinite(field.d2[v]) && field.d2[v] >= 0)));
    }
}

} // namespace

TEST_CASE("a bad index or coordinate is located, or left out on request", "[bad]") {
    shapes::Mesh mesh = shapes::box(4, 4, 4, 1);
    const std::size_t vertices = mesh.points.size(), faces = mesh.triangles.size();
    Error error;
    mesh.triangles[17][1] = static_cast<std::uint32_t>(vertices);
    CHECK(refusal(mesh, error) == AR_E_INDEX);
    CHECK(error.first_index == 17);
    mesh.triangles[17][1] = 0xFFFFFFFF;
    CHECK(refusal(mesh, error) == AR_E_INDEX);

    mesh = shapes::box(4, 4, 4, 1);
    mesh.points[30][2] = std::numeric_limits<double>::quiet_NaN();
    CHECK(refusal(mesh, error) == AR_E_NON_FINITE);
    CHECK(error.first_index == 30);
    mesh.points[30][2] = std::numeric_limits<double>::infinity();
    CHECK(refusal(mesh, error) == AR_E_NON_FINITE);

    const Handle taken = take(mesh, AR_MESH_SKIP_INVALID);
    const ar_diagnostics d = diagnostics(taken);
    CHECK(d.non_finite_vertices.count == 1);
    CHECK(d.non_finite_vertices.first == 30);
    CHECK(d.face_count == faces);
    CHECK(d.closed == 0);
    const Field field = compute(taken);
    REQUIRE(field.ratio.size() == vertices);
    CHECK(std::isnan(field.ratio[30]));
    CHECK((reasons(taken, vertices)[30] & AR_REASON_NON_FINITE) != 0);
    sane(taken, field);
}

TEST_CASE("vertices without faces have no values and say so", "[bad]") {
    shapes::Mesh mesh = shapes::box(2, 2, 2, 1);
    mesh.points.push_back({7, 7, 7});
    const Handle taken = take(mesh);
    CHECK(diagnostics(taken).unreferenced_vertices.count == 1);
    CHECK(diagnostics(taken).unreferenced_vertices.first == mesh.points.size() - 1);
    const Field field = compute(taken);
    CHECK(std::isnan(field.ratio.back()));
    CHECK(reasons(taken, field.ratio.size()).back() == AR_REASON_UNREFERENCED);
    sane(taken, field);
}

TEST_CASE("faces without area, collapsed and duplicate faces are counted and do no harm", "[bad]") {
    shapes::Mesh mesh = shapes::box(4, 4, 4, 1);
    const auto first = static_cast<std::uint64_t>(mesh.triangles.size());
    const auto a = mesh.triangles[3];
    mesh.triangles.push_back({a[0], a[1], a[1]}); // collapsed
    const auto n = static_cast<std::uint32_t>(mesh.points.size());
    mesh.points.push_back({10, 0, 0});
    mesh.points.push_back({11, 0, 0});
    mesh.points.push_back({13, 0, 0});
    mesh.triangles.push_back({n, n + 1, n + 2}); // no area
    const Handle taken = take(mesh);
    const ar_diagnostics d = diagnostics(taken);
    CHECK(d.collapsed_faces.count == 1);
    CHECK(d.collapsed_faces.first == first);
    CHECK(d.zero_area_faces.count == 1);
    CHECK(d.zero_area_faces.first == first + 1);
    const Field field = compute(taken);
    sane(taken, field);
    CHECK(std::isnan(field.d2[n]));
    CHECK(field.summary.d2_max == Approx(compute(take(shapes::box(4, 4, 4, 1))).summary.d2_max).epsilon(0.01));
    CHECK(field.face_d2.size() == mesh.triangles.size());

    mesh = shapes::box(4, 4, 4, 1);
    mesh.triangles.push_back(mesh.triangles[5]);
    CHECK(diagnostics(take(mesh)).duplicate_faces.count == 1);
    CHECK(diagnostics(take(mesh)).duplicate_faces.first == mesh.triangles.size() - 1);
    const Handle doubled = take(mesh);
    sane(doubled, compute(doubled));
}

TEST_CASE("three faces on one edge", "[bad]") {
    const shapes::Mesh mesh = {{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}}, {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}};
    const Handle taken = take(mesh);
    const ar_diagnostics d = diagnostics(taken);
    CHECK(d.non_manifold_edges.count == 1);
    CHECK(d.non_manifold_edges.at[2] == Approx(0.5));
    CHECK(d.boundary_edges.count == 6);
    const ar_compute_options how = options();
    Error error;
    const ar_status status = ar_compute(taken.get(), &how, &error);
    INFO(error.message);
    CHECK(status == AR_OK);
}

TEST_CASE("two solids that share an edge, and two that share a vertex", "[bad]") {
    for (const shapes::Point &by : {shapes::Point{2, 2, 0}, shapes::Point{2, 2, 2}}) {
        shapes::Mesh mesh = shapes::box(2, 2, 2, 1), other = mesh;
        shapes::translate(other, by);
        shapes::append(mesh, other);
        const Handle taken = take(mesh);
        const ar_diagnostics d = diagnostics(taken);
        CHECK((by[2] == 0 ? d.non_manifold_edges.count : d.non_manifold_vertices.count) >= 1);
        CHECK(d.closed == 1);
        CHECK(d.volume == Approx(16));
        const Field field = compute(taken);
        sane(taken, field);
        CHECK(field.summary.d2_max == Approx(2).epsilon(0.35));
    }
}

TEST_CASE("open surface", "[bad]") {
    shapes::Mesh mesh = shapes::box(4, 4, 4, 1);
    mesh.triangles.pop_back();
    const Handle taken = take(mesh);
    const ar_diagnostics d = diagnostics(taken);
    CHECK(d.closed == 0);
    CHECK(d.boundary_edges.count == 3);
    CHECK(d.boundary_edges.first < mesh.triangles.size());
    sane(taken, compute(taken));

    // a lone sheet: D1 is known, D2 has nothing to hit
    shapes::Mesh sheet;
    for (int i = 0; i <= 10; ++i) {
        for (int k = 0; k <= 10; ++k) {
            sheet.points.push_back({double(i), double(k), 0});
        }
    }
    for (std::uint32_t i = 0; i < 10; ++i) {
        for (std::uint32_t k = 0; k < 10; ++k) {
            const std::uint32_t a = 11 * i + k;
            sheet.triangles.push_back({a, a + 11, a + 12});
            sheet.triangles.push_back({a, a + 12, a + 1});
        }
    }
    const Handle flat = take(sheet);
    const Field field = compute(flat);
    for (std::size_t v = 0; v < field.ratio.size(); ++v) {
        CHECK(std::isnan(field.ratio[v]));
        CHECK(field.d1[v] > 0);
    }
    CHECK((reasons(flat, field.ratio.size())[60] & AR_REASON_NO_HIT) != 0);
    CHECK(field.summary.d1_max == Approx(10 * std::sqrt(2.0)).epsilon(0.1));
    CHECK(std::isnan(field.summary.ratio_max));
    CHECK(field.summary.undefined_vertices == field.ratio.size());
}

TEST_CASE("Moebius strip", "[bad]") {
    const Handle taken = take(shapes::moebius(60));
    const ar_diagnostics d = diagnostics(taken);
    CHECK(d.orientable == 0);
    CHECK(d.closed == 0);
    CHECK(d.orientation_conflicts.count >= 1);
    sane(taken, compute(taken));
}

TEST_CASE("inverted cube", "[bad]") {
    shapes::Mesh mesh = shapes::box(4, 4, 4, 0.5);
    const Field upright = compute(take(mesh));
    shapes::flip(mesh);
    const Handle taken = take(mesh);
    CHECK(diagnostics(taken).inverted_shells.count == 1);
    CHECK(diagnostics(taken).orientation_conflicts.count == 0);
    const Field field = compute(taken);
    sane(taken, field);
    CHECK(field.summary.d1_max == Approx(upright.summary.d1_max).epsilon(1e-3));
}

TEST_CASE("nested shells: a hollow cube is as wide as its wall", "[bad]") {
    shapes::Mesh mesh = shapes::box(10, 10, 10, 1), cavity = shapes::box(8, 8, 8, 1);
    shapes::translate(cavity, {1, 1, 1});
    shapes::flip(cavity);
    shapes::append(mesh, cavity);
    const Handle taken = take(mesh);
    const ar_diagnostics d = diagnostics(taken);
    CHECK(d.components == 2);
    CHECK(d.inverted_shells.count == 0); // a cavity faces inward by right
    CHECK(d.volume == Approx(1000 - 512));
    const Field field = compute(taken);
    sane(taken, field);
    // far from the edges the wall is 1 thick on both sides
    for (std::size_t v = 0; v < mesh.points.size(); ++v) {
        const shapes::Point &p = mesh.points[v];
        if (p[2] == 10 && p[0] > 3 && p[0] < 7 && p[1] > 3 && p[1] < 7) {
            CHECK(field.d2[v] == Approx(1).epsilon(0.01));
        }
    }
}

TEST_CASE("hostile sizes: huge, tiny and flat coordinates", "[bad]") {
    for (const double factor : {1e-300, 1e-150, 1e-30, 1e30, 1e150, 1e300}) {
        INFO("scaled by " << factor);
        shapes::Mesh mesh = shapes::box(4, 3, 2, 1);
        shapes::scale(mesh, factor);
        Error error;
        const Handle taken = direct(mesh, error);
        if (!taken) {
            CHECK(std::string(error.message).size() > 4);
            continue;
        }
        const ar_status status = ar_compute(taken.get(), nullptr, &error);
        INFO(error.message);
        CHECK((status == AR_OK || std::string(error.message).size() > 4));
        CHECK(status != AR_E_INTERNAL);
    }
    // corners that coincide but for the last bit
    shapes::Mesh mesh = shapes::box(4, 3, 2, 1);
    for (std::size_t v = 0; v < mesh.points.size(); v += 3) {
        mesh.points[v][0] = std::nextafter(mesh.points[v][0], 10.0);
    }
    const Handle jittered = take(mesh);
    sane(jittered, compute(jittered));
}
