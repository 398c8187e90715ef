// Segmentation through the header: solids of blocks whose parts and measures are known, rings and bars, what must not
// change, and bad input.
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

using Labels = std::vector<std::uint32_t>;

// A solid of unit cubes whose faces are labelled.
struct Blocks {
    shapes::Mesh mesh;
    Labels label;
};

// `part` names the part that the cube with that lower corner belongs to, -1 outside. Cubes must not meet by an edge only.
Blocks blocks(const std::array<int, 3> &size, const std::function<int(int, int, int)> &part) {
    Blocks out;
    std::map<std::array<int, 3>, std::uint32_t> corner;
    const auto vertex = [&](const std::array<int, 3> &at) {
        const auto [found, fresh] = corner.try_emplace(at, static_cast<std::uint32_t>(out.mesh.points.size()));
        if (fresh) {
            out.mesh.points.push_back({double(at[0]), double(at[1]), double(at[2])});
        }
        return found->second;
    };
    const auto at = [&](const std::array<int, 3> &c) {
        for (int k = 0; k < 3; ++k) {
            if (c[k] < 0 || c[k] >= size[k]) {
                return -1;
            }
        }
        return part(c[0], c[1], c[2]);
    };
    for (int x = 0; x < size[0]; ++x) {
        for (int y = 0; y < size[1]; ++y) {
            for (int z = 0; z < size[2]; ++z) {
                const std::array<int, 3> cube{x, y, z};
                const int own = at(cube);
                for (int side = 0; own >= 0 && side < 6; ++side) {
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
                        q[c] = vertex(p);
                    }
                    if (!up) {
                        std::swap(q[1], q[3]);
                    }
                    out.mesh.triangles.insert(out.mesh.triangles.end(), {{q[0], q[1], q[2]}, {q[0], q[2], q[3]}});
                    out.label.insert(out.label.end(), 2, static_cast<std::uint32_t>(own));
                }
            }
        }
    }
    return out;
}

bool within(int x, int low, int high) { return x >= low && x < high; }

// A web 3 thick and 16 high below a flange 3 thick and 21 wide.
Blocks t_beam() {
    return blocks({40, 21, 19}, [](int, int y, int z) { return z >= 16 ? 0 : within(y, 9, 12) ? 1 : -1; });
}

// A plate 40 x 24 x 4 with four pins of 3 x 3, 14 high.
Blocks plate_with_pins() {
    return blocks({40, 24, 18}, [](int x, int y, int z) {
        const bool pin = (within(x, 8, 11) || within(x, 29, 32)) && (within(y, 5, 8) || within(y, 16, 19));
        return z < 4 ? 0 : pin ? 1 + (x > 20) + 2 * (y > 12) : -1;
    });
}

// Two cubes of side 14 and a bar of 4 x 4 x 24 between them.
Blocks dumb_bell() {
    return blocks({52, 14, 14}, [](int x, int y, int z) {
        const bool bar = within(y, 5, 9) && within(z, 5, 9);
        return x < 14 ? 0 : x >= 38 ? 1 : bar ? 2 : -1;
    });
}

// Hubert & Arabie 1985.
double adjusted_rand(const Labels &a, const Labels &b) {
    REQUIRE(a.size() == b.size());
    std::map<std::pair<std::uint32_t, std::uint32_t>, double> table;
    std::map<std::uint32_t, double> rows, columns;
    for (std::size_t i = 0; i < a.size(); ++i) {
        table[{a[i], b[i]}] += 1;
        rows[a[i]] += 1;
        columns[b[i]] += 1;
    }
    const auto pairs = [](double n) { return n * (n - 1) / 2; };
    double same = 0, r = 0, c = 0;
    for (const auto &t : table) same += pairs(t.second);
    for (const auto &t : rows) r += pairs(t.second);
    for (const auto &t : columns) c += pairs(t.second);
    const double expected = r * c / pairs(double(a.size())), most = 0.5 * (r + c);
    return most == expected ? 1 : (same - expected) / (most - expected);
}

Handle plain(const shapes::Mesh &mesh) {
    Error error;
    Handle handle = direct(mesh, error);
    REQUIRE(handle != nullptr);
    return handle;
}

ar_segment_options segment_options() {
    ar_segment_options how;
    REQUIRE(ar_segment_options_init(&how) == AR_OK);
    return how;
}

struct Parts {
    Labels face;
    std::vector<ar_segment_info> info;
};

Parts parts(const Handle &mesh) {
    Error error;
    Parts out;
    std::size_t count = 0;
    check(ar_get_face_segment(mesh.get(), nullptr, 0, &count, &error), error);
    out.face.resize(count);
    check(ar_get_face_segment(mesh.get(), out.face.data(), count, &count, &error), error);
    check(ar_get_segments(mesh.get(), nullptr, 0, &count, &error), error);
    out.info.resize(count);
    ar_segment_info_init(out.info.data());
    check(ar_get_segments(mesh.get(), out.info.data(), count, &count, &error), error);
    return out;
}

Parts parts(const shapes::Mesh &mesh, const ar_segment_options &how = segment_options()) {
    const Handle handle = plain(mesh);
    Error error;
    check(ar_segment(handle.get(), &how, &error), error);
    return parts(handle);
}

double off(double value, double truth) { return std::fabs(value / truth - 1); }

} // namespace

TEST_CASE("solids of blocks fall into their parts by themselves", "[segment]") {
    for (const Blocks &solid : {t_beam(), plate_with_pins(), dumb_bell()}) {
        const Parts found = parts(solid.mesh);
        const std::uint32_t truth = *std::max_element(solid.label.begin(), solid.label.end()) + 1;
        CHECK(found.info.size() == truth);
        CHECK(adjusted_rand(found.face, solid.label) >= 0.9);
        std::uint64_t faces = 0;
        for (std::size_t k = 0; k < found.info.size(); ++k) {
            const auto own = std::count(found.face.begin(), found.face.end(), static_cast<std::uint32_t>(k));
            CHECK(found.info[k].faces == static_cast<std::uint64_t>(own));
            CHECK(found.info[k].struct_size == sizeof(ar_segment_info));
            CHECK((k == 0 || found.info[k].area <= found.info[k - 1].area * (1 + 1e-6)));
            faces += found.info[k].faces;
        }
        CHECK(faces == solid.label.size());
    }
}

TEST_CASE("the measures of square pins on a plate", "[segment]") {
    const Blocks solid = plate_with_pins();
    const Handle handle = plain(solid.mesh);
    Error error;
    check(ar_segment(handle.get(), nullptr, &error), error);
    const Parts found = parts(handle);
    REQUIRE(found.info.size() == 5);
    const ar_segment_info &plate = found.info[0];
    CHECK(plate.neighbours == 4);
    CHECK(plate.handles == 0);
    CHECK(off(plate.d2_median, 4) <= 0.05);
    CHECK(off(plate.area, 2 * 40 * 24 + 2 * 4 * (40 + 24) - 4 * 9) <= 0.02);
    // corner to opposite corner over the surface
    CHECK(off(plate.d1_max, std::hypot(40, 24)) <= 0.15);
    for (std::size_t k = 1; k < 5; ++k) {
        const ar_segment_info &pin = found.info[k];
        CAPTURE(k, pin.area, pin.boundary_length, pin.d1_max, pin.d2_max);
        CHECK(pin.flags == 0);
        CHECK(off(pin.area, 4 * 3 * 14 + 9) <= 0.05);
        CHECK(off(pin.boundary_length, 12) <= 0.3);
        CHECK(off(pin.d2_max, 3) <= 0.05);
        CHECK(off(pin.d2_median, 3) <= 0.05);
        // at least straight up and to the middle of the top; at most up one side, over the top and down the other
        CHECK(pin.d1_max >= 14);
        CHECK(pin.d1_max <= 1.05 * (2 * 14 + 3));
        CHECK(off(pin.ratio_max, pin.d1_max / pin.d2_max) <= 1e-12);
        CHECK(off(pin.upper[2], 18) <= 1e-12);
        CHECK(std::fabs(pin.centroid[2] - 11) <= 0.6);
        std::uint32_t neighbour = 99;
        std::size_t count = 0;
        check(ar_get_segment_neighbours(handle.get(), std::uint32_t(k), &neighbour, 1, &count, &error), error);
        CHECK(count == 1);
        CHECK(neighbour == 0);
    }
}

TEST_CASE("a closed ring is told from an open bar of the same length", "[segment]") {
    const double turn = 2 * std::acos(-1.0);
    const Parts closed = parts(shapes::torus(10, 1, 120, 16));
    REQUIRE(closed.info.size() == 1);
    CHECK(closed.info[0].flags == AR_SEGMENT_RING);
    CHECK(closed.info[0].handles == 1);
    // between the inner and the outer equator
    CHECK(closed.info[0].loop_length >= turn * 9);
    CHECK(closed.info[0].loop_length <= turn * 11.5);
    const Parts open = parts(shapes::helix(10, 3, 0.95, 2, 120, 16));
    REQUIRE(open.info.size() == 1);
    CHECK(open.info[0].flags == 0);
    CHECK(open.info[0].handles == 0);
    CHECK(std::isnan(open.info[0].loop_length));
    // the ratio of the ring is half of the bar's, by the loop length it is not
    CHECK(off(2 * closed.info[0].ratio_max, open.info[0].ratio_max) <= 0.15);
    CHECK(off(closed.info[0].loop_length / closed.info[0].d2_max, open.info[0].ratio_max) <= 0.15);
}

TEST_CASE("the partition does not depend on size, place, direction, numbering and threads", "[segment]") {
    for (const Blocks &solid : {t_beam(), plate_with_pins(), dumb_bell()}) {
        const Parts before = parts(solid.mesh);
        for (const double factor : {1e-3, 1e4}) {
            shapes::Mesh moved = solid.mesh;
            shapes::scale(moved, factor);
            CHECK(adjusted_rand(parts(moved).face, before.face) >= 0.98);
        }
        shapes::Mesh moved = solid.mesh;
        shapes::rotate(moved, 1.1);
        shapes::translate(moved, {300, -20, 7});
        const Parts after = parts(moved);
        CHECK(adjusted_rand(after.face, before.face) >= 0.98);
        REQUIRE(after.info.size() == before.info.size());
        for (std::size_t k = 0; k < after.info.size(); ++k) {
            CHECK(off(after.info[k].ratio_max, before.info[k].ratio_max) <= 0.1);
        }
        // faces come in another order: told apart by what they hold
        std::vector<std::uint32_t> place;
        const shapes::Mesh mixed = shapes::renumber(solid.mesh, 7, &place);
        const auto key = [](shapes::Triangle t) {
            std::sort(t.begin(), t.end());
            return t;
        };
        std::map<shapes::Triangle, std::uint32_t> old;
        for (std::size_t f = 0; f < solid.mesh.triangles.size(); ++f) {
            const shapes::Triangle &t = solid.mesh.triangles[f];
            old[key({place[t[0]], place[t[1]], place[t[2]]})] = before.face[f];
        }
        Labels expected;
        for (const shapes::Triangle &t : mixed.triangles) {
            expected.push_back(old.at(key(t)));
        }
        CHECK(adjusted_rand(parts(mixed).face, expected) >= 0.98);

        ar_segment_options how = segment_options();
        for (const std::uint32_t threads : {1u, 3u}) {
            how.threads = threads;
            const Parts same = parts(solid.mesh, how);
            CHECK(same.face == before.face);
            REQUIRE(same.info.size() == before.info.size());
            CHECK(std::memcmp(same.info.data(), before.info.data(), same.info.size() * sizeof(ar_segment_info)) == 0);
        }
    }
}

TEST_CASE("the paper's method and the others agree at an equal number of parts", "[segment]") {
    const Blocks solid = dumb_bell();
    ar_segment_options how = segment_options();
    how.count = 3;
    const Parts creases = parts(solid.mesh, how);
    how.method = AR_SEGMENT_LANDMARKS;
    const Parts landmarks = parts(solid.mesh, how);
    how.method = AR_SEGMENT_PAPER;
    const Parts paper = parts(solid.mesh, how);
    CHECK(adjusted_rand(paper.face, landmarks.face) >= 0.9);
    CHECK(adjusted_rand(paper.face, creases.face) >= 0.9);
}

TEST_CASE("more segments than faces, and parts below the least area", "[segment]") {
    ar_segment_options how = segment_options();
    how.count = 4096;
    for (const std::uint32_t method : {AR_SEGMENT_CREASES, AR_SEGMENT_PAPER, AR_SEGMENT_LANDMARKS}) {
        how.method = method;
        const Parts found = parts(shapes::box(3, 2, 1, 0), how);
        CHECK(found.face.size() == 12);
        CHECK(found.info.size() >= 1);
        CHECK(found.info.size() <= 12);
    }
    how = segment_options();
    how.min_area = 0.5;
    const Parts whole = parts(plate_with_pins().mesh, how);
    CHECK(whole.info.size() == 1);
}

TEST_CASE("segmentation: bad input is refused and changes nothing", "[segment]") {
    const Handle mesh = plain(t_beam().mesh);
    Error error;
    std::size_t count = 77;
    CHECK(ar_segment(nullptr, nullptr, &error) == AR_E_NULL);
    CHECK(ar_get_face_segment(nullptr, nullptr, 0, &count, &error) == AR_E_NULL);
    CHECK(ar_get_segments(nullptr, nullptr, 0, &count, &error) == AR_E_NULL);
    CHECK(ar_get_segment_neighbours(nullptr, 0, nullptr, 0, &count, &error) == AR_E_NULL);
    CHECK(ar_segment_options_init(nullptr) == AR_E_NULL);
    CHECK(ar_segment_info_init(nullptr) == AR_E_NULL);
    CHECK(ar_get_face_segment(mesh.get(), nullptr, 0, &count, &error) == AR_E_NOT_COMPUTED);
    CHECK(ar_get_segments(mesh.get(), nullptr, 0, &count, &error) == AR_E_NOT_COMPUTED);
    CHECK(ar_get_segment_neighbours(mesh.get(), 0, nullptr, 0, &count, &error) == AR_E_NOT_COMPUTED);
    CHECK(count == 77);

    check(ar_segment(mesh.get(), nullptr, nullptr), error);
    const Parts before = parts(mesh);
    REQUIRE(before.info.size() == 2);
    const auto refused = [&](const std::function<void(ar_segment_options &)> &spoil) {
        ar_segment_options how = segment_options();
        spoil(how);
        return ar_segment(mesh.get(), &how, &error);
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK(refused([](auto &o) { o.struct_size = 3; }) == AR_E_STRUCT);
    CHECK(refused([](auto &o) { o.method = 3; }) == AR_E_ARGUMENT);
    CHECK(refused([](auto &o) { o.criterion = 3; }) == AR_E_ARGUMENT);
    CHECK(refused([](auto &o) { o.reserved = 1; }) == AR_E_ARGUMENT);
    CHECK(refused([](auto &o) { o.count = 4097; }) == AR_E_ARGUMENT);
    CHECK(refused([](auto &o) { o.min_area = 0.6; }) == AR_E_ARGUMENT);
    CHECK(refused([&](auto &o) { o.min_area = nan; }) == AR_E_ARGUMENT);
    CHECK(refused([&](auto &o) { o.alpha = nan; }) == AR_E_ARGUMENT);
    CHECK(refused([](auto &o) { o.alpha = o.beta = o.gamma = -1; }) == AR_E_ARGUMENT);
    CHECK(refused([](auto &o) { o.memory_budget = 1; }) == AR_E_BUDGET);
    CHECK(refused([](auto &o) { o.method = AR_SEGMENT_PAPER, o.memory_budget = 1 << 20; }) == AR_E_BUDGET);
    CHECK(std::strlen(error.message) > 0);

    // cancelled in every stage
    int calls = 0;
    const auto from = [](void *user, double, std::uint32_t) -> std::int32_t { return --*static_cast<int *>(user) <= 0; };
    for (int call = 1; call < 40; call += 6) {
        calls = call;
        const ar_status status = refused([&](auto &o) { o.progress = from, o.user = &calls; });
        CHECK((status == AR_E_CANCELLED || calls > 0));
    }
    ar_cancel_token *token = nullptr;
    check(ar_cancel_token_new(&token, &error), error);
    check(ar_cancel_token_cancel(token, &error), error);
    CHECK(refused([&](auto &o) { o.cancel = token; }) == AR_E_CANCELLED);
    ar_cancel_token_free(token);
    CHECK(parts(mesh).face == before.face);

    // buffers that are too small; one that is longer
    Labels few(5, 42);
    CHECK(ar_get_face_segment(mesh.get(), few.data(), few.size(), &count, &error) == AR_E_CAPACITY);
    CHECK(count == before.face.size());
    CHECK(few == Labels(5, 42));
    std::vector<ar_segment_info> info(3);
    CHECK(ar_get_segments(mesh.get(), info.data(), 1, &count, &error) == AR_E_CAPACITY);
    CHECK(count == 2);
    info[0].struct_size = 0;
    CHECK(ar_get_segments(mesh.get(), info.data(), 3, &count, &error) == AR_E_STRUCT);
    ar_segment_info_init(info.data());
    CHECK(ar_get_segments(mesh.get(), info.data(), 3, nullptr, &error) == AR_OK);
    CHECK(std::memcmp(info.data(), before.info.data(), 2 * sizeof(ar_segment_info)) == 0);
    std::uint32_t neighbour = 0;
    CHECK(ar_get_segment_neighbours(mesh.get(), 2, &neighbour, 1, &count, &error) == AR_E_ARGUMENT);
    CHECK(ar_get_segment_neighbours(mesh.get(), 0, &neighbour, 0, &count, &error) == AR_E_CAPACITY);

    // no faces, no mesh
    shapes::Mesh none{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}};
    CHECK(direct(none, error) == nullptr);
}

TEST_CASE("segmentation through the C++ wrapper", "[segment]") {
    const Blocks solid = plate_with_pins();
    std::vector<double> xyz;
    std::vector<std::uint32_t> ijk;
    for (const auto &p : solid.mesh.points) xyz.insert(xyz.end(), p.begin(), p.end());
    for (const auto &t : solid.mesh.triangles) ijk.insert(ijk.end(), t.begin(), t.end());
    armesh::mesh mesh = armesh::mesh::from_arrays(xyz, ijk);
    CHECK_THROWS_AS(mesh.segments(), armesh::error);
    mesh.segment();
    CHECK(mesh.segments().size() == 5);
    CHECK(adjusted_rand(mesh.face_segment(), solid.label) >= 0.9);
    CHECK(mesh.segment_neighbours(0) == Labels{1, 2, 3, 4});
    CHECK_THROWS_AS(mesh.segment_neighbours(5), armesh::error);
    armesh::segment_options how;
    how.count = 1;
    mesh.segment(how);
    CHECK(mesh.segments().size() == 1);
    how.min_area = 2;
    CHECK_THROWS_AS(mesh.segment(how), armesh::error);
    CHECK(mesh.segments().size() == 1);
}
