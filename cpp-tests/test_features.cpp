// Features through the header: parts of blocks and tubes whose features and measures are known, what must not change,
// limits, and bad input.
#include "support.hpp"

#include <armesh.hpp>
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>

using namespace support;

namespace {

// A solid of unit cubes: `part` names the part that the cube with that lower corner belongs to, -1 outside.
struct Blocks {
    shapes::Mesh mesh;
    std::vector<std::int32_t> label;
};

Blocks blocks(const std::array<int, 3> &size, const std::function<int(int, int, int)> &part) {
    Blocks out;
    std::map<std::array<int, 3>, std::uint32_t> corner;
    const auto at = [&](const std::array<int, 3> &c) {
        const bool inside = std::equal(c.begin(), c.end(), size.begin(), [](int x, int n) { return x >= 0 && x < n; });
        return inside ? part(c[0], c[1], c[2]) : -1;
    };
    for (int i = 0; i < size[0] * size[1] * size[2]; ++i) {
        const std::array<int, 3> cube{i % size[0], i / size[0] % size[1], i / size[0] / size[1]};
        for (int side = 0; at(cube) >= 0 && side < 6; ++side) {
            const int k = side / 2, up = side % 2, u = (k + 1) % 3, v = (k + 2) % 3;
            std::array<int, 3> next = cube;
            next[k] += up ? 1 : -1;
            if (at(next) >= 0) {
                continue;
            }
            std::array<std::uint32_t, 4> q{};
            for (int c = 0; c < 4; ++c) {
                std::array<int, 3> p = cube;
                p[k] += up;
                p[u] += c == 1 || c == 2;
                p[v] += c >= 2;
                const auto fresh = corner.try_emplace(p, std::uint32_t(out.mesh.points.size()));
                if (fresh.second) {
                    out.mesh.points.push_back({double(p[0]), double(p[1]), double(p[2])});
                }
                q[c] = fresh.first->second;
            }
            if (!up) {
                std::swap(q[1], q[3]);
            }
            out.mesh.triangles.insert(out.mesh.triangles.end(), {{q[0], q[1], q[2]}, {q[0], q[2], q[3]}});
            out.label.insert(out.label.end(), 2, at(cube));
        }
    }
    return out;
}

// A plate 44 x 30 x 8 that carries a pin of 2 x 2, 20 high, and a fin of 2 x 20, 16 high.
Blocks plate_with_pin_and_fin() {
    return blocks({44, 30, 28}, [](int x, int y, int z) {
        const bool pin = x >= 8 && x < 10 && y >= 14 && y < 16, fin = x >= 30 && x < 32 && y >= 5 && y < 25 && z < 24;
        return z < 8 ? 0 : pin ? 1 : fin ? 2 : -1;
    });
}

Handle plain(const shapes::Mesh &mesh) {
    Error error;
    Handle handle = direct(mesh, error);
    REQUIRE(handle != nullptr);
    return handle;
}

struct Found {
    std::vector<std::int32_t> face;
    std::vector<ar_feature_info> info;
};

Found getters(const Handle &mesh, const ar_limits *limits = nullptr) {
    Error error;
    Found out;
    std::size_t count = 0;
    check(ar_get_face_feature(mesh.get(), nullptr, 0, &count, &error), error);
    out.face.resize(count);
    check(ar_get_face_feature(mesh.get(), out.face.data(), count, &count, &error), error);
    check(ar_get_features(mesh.get(), limits, nullptr, 0, &count, &error), error);
    out.info.resize(count);
    ar_feature_info_init(out.info.data());
    check(ar_get_features(mesh.get(), limits, out.info.data(), count, &count, &error), error);
    return out;
}

Found find(const shapes::Mesh &mesh, std::uint32_t threads = 0) {
    const Handle handle = plain(mesh);
    Error error;
    ar_feature_options how;
    ar_feature_options_init(&how);
    how.threads = threads;
    check(ar_find_features(handle.get(), &how, &error), error);
    return getters(handle);
}

double off(double value, double truth) { return std::fabs(value / truth - 1); }

// The feature that most faces with this label belong to; fails unless at least 95 % of both do.
const ar_feature_info &feature_of(const Found &found, const Blocks &solid, int label) {
    std::map<std::int32_t, int> votes;
    int own = 0;
    for (std::size_t f = 0; f < solid.label.size(); ++f) {
        if (solid.label[f] == label) {
            ++votes[found.face[f]];
            ++own;
        }
    }
    const auto best = std::max_element(votes.begin(), votes.end(), [](auto a, auto b) { return a.second < b.second; });
    const ar_feature_info &info = found.info.at(std::size_t(best->first));
    CHECK(best->second >= 0.95 * own);
    CHECK(best->second >= 0.95 * double(info.faces));
    return info;
}

// Radii and heights from the axis and back to it, turned around the axis in `n` steps, moved along x.
void turn(shapes::Mesh &mesh, const std::vector<std::array<double, 2>> &profile, std::uint32_t n, double x) {
    const auto first = std::uint32_t(mesh.points.size());
    const std::size_t rings = profile.size() - 2;
    const auto at = [&](std::size_t i, std::uint32_t j) { return first + 1 + std::uint32_t(i) * n + j % n; };
    const auto end = at(rings, 0);
    mesh.points.push_back({x, 0, profile.front()[1]});
    for (std::size_t i = 1; i <= rings; ++i) {
        for (std::uint32_t j = 0; j < n; ++j) {
            const double a = 2 * 3.14159265358979323846 * j / n, r = profile[i][0];
            mesh.points.push_back({x + r * std::cos(a), r * std::sin(a), profile[i][1]});
        }
    }
    mesh.points.push_back({x, 0, profile.back()[1]});
    for (std::uint32_t j = 0; j < n; ++j) {
        mesh.triangles.push_back({first, at(0, j + 1), at(0, j)});
        mesh.triangles.push_back({at(rings - 1, j), at(rings - 1, j + 1), end});
        for (std::size_t i = 0; i + 1 < rings; ++i) {
            mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
            mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
        }
    }
}

// A disc of 24 x 8 with a pin of 2 x 14 on a fillet of 1.5, and a disc of 24 x 8 with a blind tube of 10 x 12, 1.2 thick:
// fillets in `steps`, circles in `n`.
shapes::Mesh pin_and_tube(std::uint32_t steps, std::uint32_t n) {
    shapes::Mesh mesh;
    std::vector<std::array<double, 2>> pin{{0, -8}, {12, -8}, {12, 0}};
    for (std::uint32_t k = 0; k <= steps; ++k) {
        const double a = 0.5 * 3.14159265358979323846 * k / steps;
        pin.push_back({1 + 1.5 * (1 - std::sin(a)), 1.5 * (1 - std::cos(a))});
    }
    pin.insert(pin.end(), {{1, 14}, {0, 14}});
    turn(mesh, pin, n, 0);
    turn(mesh, {{0, -8}, {12, -8}, {12, 0}, {5, 0}, {5, 12}, {3.8, 12}, {3.8, 0}, {0, 0}}, n, 40);
    return mesh;
}

} // namespace

TEST_CASE("a plate with a pin and a fin", "[feature]") {
    const Blocks solid = plate_with_pin_and_fin();
    const Found found = find(solid.mesh);
    REQUIRE(found.info.size() == 3);
    const ar_feature_info &plate = feature_of(found, solid, 0);
    const ar_feature_info &pin = feature_of(found, solid, 1);
    const ar_feature_info &fin = feature_of(found, solid, 2);
    CHECK(plate.id == 0);
    CHECK(off(plate.d2_max, 8) <= 0.03);
    CHECK(off(pin.d2_max, 2) <= 0.02);
    CHECK(off(fin.d2_max, 2) <= 0.02);
    // From corner to corner of the foot over the top. Of the pin, unrolled onto one side and the top: at least up one
    // edge and down another, two apart; on the fin from one lower corner to the opposite one on the same side, or over
    // the top to the other side.
    CHECK(pin.d1_max >= 20 + 1);
    CHECK(pin.d1_max <= 20 + 20 + 4);
    CHECK(fin.d1_max >= 0.99 * std::hypot(20, 16));
    CHECK(fin.d1_max <= 1.03 * std::hypot(20, 2 * 16 + 2));
    CHECK(pin.kind == AR_FEATURE_BAR);
    CHECK(fin.kind == AR_FEATURE_WALL);
    CHECK(pin.severity == AR_SEVERITY_ERROR);
    CHECK(fin.severity == AR_SEVERITY_ERROR);
    CHECK(pin.reasons == AR_FINDING_SLENDER);
    for (const ar_feature_info &f : found.info) {
        CHECK(off(f.ratio, f.d1_max / f.d2_max) <= 1e-12);
        CHECK(f.d1_upper >= f.d1_max);
        CHECK(off(f.ratio_upper, f.d1_upper / f.d2_max) <= 1e-12);
        CHECK(f.d2_min <= f.d2_max * (1 + 1e-9));
        CHECK(f.struct_size == sizeof(ar_feature_info));
        const double *a = f.d1_ends, *b = f.d1_ends + 3;
        CHECK(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) <= f.d1_max * (1 + 1e-9));
    }
    // the box of the fin
    CHECK(off(fin.box_size[0], 20) <= 0.02);
    CHECK(off(fin.box_size[1], 16) <= 0.08);
    CHECK(off(fin.box_size[2], 2) <= 0.02);
    CHECK(std::fabs(fin.box_center[0] - 31) <= 0.1);
    CHECK(off(fin.area, 2 * 20 * 16 + 2 * 2 * 16 + 2 * 20) <= 0.06);
    CHECK(std::fabs(pin.centroid[2] - 18.3) <= 1);
}

TEST_CASE("a wall flush with the side of its body", "[feature]") {
    // no crease on the outer side: only the width tells the wall from the block
    const Blocks solid = blocks({30, 24, 28}, [](int x, int y, int z) {
        return z < 14 ? 0 : x >= 28 && y >= 2 && y < 22 ? 1 : -1;
    });
    const Found found = find(solid.mesh);
    const ar_feature_info &wall = feature_of(found, solid, 1);
    CHECK(off(wall.d2_max, 2) <= 0.05);
    CHECK(wall.severity == AR_SEVERITY_ERROR);
}

TEST_CASE("a closed ring and a plain bar", "[feature]") {
    const Found ring = find(shapes::torus(10, 1, 120, 16));
    REQUIRE(ring.info.size() == 1);
    CHECK(ring.info[0].kind == AR_FEATURE_RING);
    CHECK(off(ring.info[0].d2_max, 2) <= 0.03);
    CHECK(off(ring.info[0].length, 2 * ring.info[0].d1_max) <= 1e-12);
    const Found bar = find(shapes::cylinder(2, 30, 32, 1));
    REQUIRE(bar.info.size() == 1);
    CHECK(bar.info[0].kind == AR_FEATURE_BAR);
    CHECK(off(bar.info[0].d2_max, 2) <= 0.02);
    // from the middle of one end to the middle of the other at least, rim to opposite rim at most
    CHECK(bar.info[0].d1_max >= 30);
    CHECK(bar.info[0].d1_max <= 32.1);
}

TEST_CASE("features do not depend on size, direction, numbering and threads", "[feature]") {
    const Blocks solid = plate_with_pin_and_fin();
    const Found before = find(solid.mesh);
    const auto same = [&](const Found &after, double factor) {
        REQUIRE(after.info.size() == before.info.size());
        for (std::size_t k = 0; k < after.info.size(); ++k) {
            CHECK(off(after.info[k].ratio, before.info[k].ratio) <= 0.03);
            CHECK(off(after.info[k].d1_max, factor * before.info[k].d1_max) <= 0.03);
            CHECK(after.info[k].kind == before.info[k].kind);
        }
    };
    shapes::Mesh moved = solid.mesh;
    shapes::rotate(moved, 0.7);
    same(find(moved), 1);
    for (const double factor : {1e-3, 1e3}) {
        moved = solid.mesh;
        shapes::scale(moved, factor);
        same(find(moved), factor);
    }
    same(find(shapes::renumber(solid.mesh, 5, nullptr)), 1);
    for (const std::uint32_t threads : {1u, 3u}) {
        const Found again = find(solid.mesh, threads);
        CHECK(again.face == before.face);
        REQUIRE(again.info.size() == before.info.size());
        CHECK(std::memcmp(again.info.data(), before.info.data(), before.info.size() * sizeof(ar_feature_info)) == 0);
    }
}

TEST_CASE("features do not depend on the tessellation", "[feature]") {
    const Found coarse = find(pin_and_tube(5, 32)), fine = find(pin_and_tube(10, 64));
    for (const Found *found : {&coarse, &fine}) {
        REQUIRE(found->info.size() >= 4);
        // the ring in the middle of the fillet may be a feature of its own, but no finding
        CHECK(std::all_of(found->info.begin() + 4, found->info.end(),
                          [](const ar_feature_info &f) { return f.severity == AR_SEVERITY_OK; }));
        // the discs, the tube, the pin
        const ar_feature_info &tube = found->info[2], &pin = found->info[3];
        CHECK(tube.kind == AR_FEATURE_WALL);
        CHECK(off(tube.d2_max, 1.2) <= 0.03);
        CHECK(pin.kind == AR_FEATURE_BAR);
        CHECK(off(pin.d2_max, 2) <= 0.03);
        // from the end of the fillet to the middle of the top
        CHECK(off(pin.d1_max, 12.5 + 1) <= 0.02);
    }
    for (std::size_t k = 0; k < 4; ++k) {
        CHECK(off(coarse.info[k].ratio, fine.info[k].ratio) <= 0.03);
        CHECK(coarse.info[k].kind == fine.info[k].kind);
    }
}

TEST_CASE("limits are inclusive, and replaced by the caller", "[feature]") {
    const Handle mesh = plain(plate_with_pin_and_fin().mesh);
    Error error;
    check(ar_find_features(mesh.get(), nullptr, &error), error);
    const ar_feature_info pin = getters(mesh).info.back();
    const auto judged = [&](double warn, double over, double width) {
        ar_limits limits;
        ar_limits_init(&limits);
        limits.warn_ratio = warn;
        limits.error_ratio = over;
        limits.min_width = width;
        return getters(mesh, &limits).info.back();
    };
    const double more = std::nextafter(pin.ratio, 1e9);
    CHECK(judged(more, pin.ratio, 0).severity == AR_SEVERITY_ERROR);
    CHECK(judged(pin.ratio, more, 0).severity == AR_SEVERITY_WARNING);
    CHECK(judged(more, more, 0).severity == AR_SEVERITY_OK);
    CHECK(judged(more, INFINITY, pin.d2_min).severity == AR_SEVERITY_ERROR);
    CHECK(judged(more, INFINITY, pin.d2_min).reasons == AR_FINDING_THIN);
    CHECK(judged(more, INFINITY, std::nextafter(pin.d2_min, 0)).severity == AR_SEVERITY_OK);
    for (const std::uint32_t process : {AR_PROCESS_METAL_PBF, AR_PROCESS_POLYMER_PBF, AR_PROCESS_FILAMENT}) {
        ar_limits limits;
        ar_limits_init(&limits);
        CHECK(ar_limits_of_process(process, &limits, &error) == AR_OK);
        CHECK(limits.error_ratio == 8);
        CHECK(limits.warn_ratio == 5);
        CHECK(limits.min_width > 0);
    }
}

TEST_CASE("triangles without area have a feature or none, in the order of the file", "[feature]") {
    shapes::Mesh mesh = shapes::box(30, 4, 3, 0);
    const Found plain_box = find(mesh);
    const auto first = mesh.triangles[0];
    mesh.triangles.insert(mesh.triangles.begin() + 3, {first[0], first[0], first[1]});
    const Found found = find(mesh);
    REQUIRE(found.face.size() == 13);
    CHECK(found.face[3] == -1);
    for (std::size_t f = 0; f < 13; ++f) {
        if (f != 3) {
            CHECK(found.face[f] == plain_box.face[f - (f > 3)]);
        }
    }
}

TEST_CASE("features: the report and the wrapper", "[feature]") {
    const Blocks solid = plate_with_pin_and_fin();
    std::vector<double> xyz;
    std::vector<std::uint32_t> ijk;
    for (const auto &p : solid.mesh.points) xyz.insert(xyz.end(), p.begin(), p.end());
    for (const auto &t : solid.mesh.triangles) ijk.insert(ijk.end(), t.begin(), t.end());
    armesh::mesh mesh = armesh::mesh::from_arrays(xyz, ijk);
    CHECK_THROWS_AS(mesh.features(), armesh::error);
    double last = 0;
    armesh::feature_options how;
    how.progress = [&](double fraction, armesh::stage) {
        CHECK(fraction >= last);
        last = fraction;
        return true;
    };
    mesh.find_features(how);
    CHECK(last == 1);
    CHECK(mesh.features().size() == 3);
    CHECK(mesh.face_feature().size() == solid.label.size());
    const std::string report = mesh.report();
    for (const char *word : {"\"report_schema\": \"armesh-report/1\"", "\"features\"", "\"face_feature\"", "\"error\""}) {
        CHECK(report.find(word) != std::string::npos);
    }
    const TemporaryFolder folder;
    for (const auto by : {armesh::colour_by::feature, armesh::colour_by::ratio, armesh::colour_by::width}) {
        const auto path = folder / "part.ply";
        mesh.write_features_ply(path.string(), by);
        CHECK(std::filesystem::file_size(path) > solid.label.size() * 13);
    }
    how.progress = [](double, armesh::stage) { return false; };
    CHECK_THROWS_AS(mesh.find_features(how), armesh::error);
    CHECK(mesh.features().size() == 3);
    CHECK(armesh::limits_of_process(AR_PROCESS_METAL_PBF).error_ratio == 8);
    CHECK_THROWS_AS(armesh::limits_of_process(99), armesh::error);
}

TEST_CASE("features: bad input is refused and changes nothing", "[feature]") {
    const Handle mesh = plain(shapes::box(10, 4, 3, 0));
    Error error;
    std::size_t count = 77;
    CHECK(ar_find_features(nullptr, nullptr, &error) == AR_E_NULL);
    CHECK(ar_get_face_feature(mesh.get(), nullptr, 0, &count, &error) == AR_E_NOT_COMPUTED);
    CHECK(ar_get_features(mesh.get(), nullptr, nullptr, 0, &count, &error) == AR_E_NOT_COMPUTED);
    CHECK(ar_get_report(mesh.get(), nullptr, nullptr, 0, &count, &error) == AR_E_NOT_COMPUTED);
    CHECK(ar_features_write_ply(mesh.get(), "/nowhere/x.ply", 0, &error) == AR_E_NOT_COMPUTED);
    CHECK(count == 77);
    ar_feature_options how;
    ar_feature_options_init(&how);
    how.min_area = 0.7;
    CHECK(ar_find_features(mesh.get(), &how, &error) == AR_E_ARGUMENT);
    how.min_area = std::nan("");
    CHECK(ar_find_features(mesh.get(), &how, &error) == AR_E_ARGUMENT);
    how.struct_size = 12;
    CHECK(ar_find_features(mesh.get(), &how, &error) == AR_E_STRUCT);
    check(ar_find_features(mesh.get(), nullptr, &error), error);
    ar_feature_info info[1];
    ar_feature_info_init(info);
    CHECK(ar_get_features(mesh.get(), nullptr, info, 0, &count, &error) == AR_E_CAPACITY);
    CHECK(count == 1);
    ar_limits limits;
    ar_limits_init(&limits);
    limits.warn_ratio = -1;
    CHECK(ar_get_features(mesh.get(), &limits, info, 1, &count, &error) == AR_E_ARGUMENT);
    limits.warn_ratio = std::nan("");
    CHECK(ar_get_features(mesh.get(), &limits, info, 1, &count, &error) == AR_E_ARGUMENT);
    ar_limits_init(&limits);
    limits.reserved = 1;
    CHECK(ar_get_features(mesh.get(), &limits, info, 1, &count, &error) == AR_E_ARGUMENT);
    CHECK(ar_limits_of_process(3, &limits, &error) == AR_E_ARGUMENT);
    CHECK(ar_limits_of_process(0, nullptr, &error) == AR_E_NULL);
    CHECK(ar_features_write_ply(mesh.get(), nullptr, 0, &error) == AR_E_NULL);
    CHECK(ar_features_write_ply(mesh.get(), "/nowhere/x.ply", 9, &error) == AR_E_ARGUMENT);
    CHECK(ar_features_write_ply(mesh.get(), "/nowhere/x.ply", 0, &error) == AR_E_IO);
    // an open surface and a lone triangle have features without a width or not at all, but no failure
    shapes::Mesh one;
    one.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    one.triangles = {{0, 1, 2}};
    const Found lone = find(one);
    CHECK(lone.face.size() == 1);
}
