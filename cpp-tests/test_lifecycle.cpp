// Progress, cancel at every stage, budgets, threads sharing a handle, handles after their end, and the C++ wrapper.
#include "support.hpp"

#include <armesh.hpp>
#include <catch2/catch.hpp>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <thread>

using namespace support;

namespace {

struct Watch {
    std::vector<std::pair<double, std::uint32_t>> seen;
    std::thread::id caller = std::this_thread::get_id();
    bool elsewhere = false;
    // cancel at the n-th call, or in a stage; -1: never
    int at_call = -1;
    std::int64_t at_stage = -1;
};

extern "C" std::int32_t watch(void *user, double fraction, std::uint32_t stage) {
    auto &w = *static_cast<Watch *>(user);
    w.seen.emplace_back(fraction, stage);
    w.elsewhere |= std::this_thread::get_id() != w.caller;
    return static_cast<int>(w.seen.size()) == w.at_call || std::int64_t{stage} == w.at_stage;
}

// Every vertex a source: work that lasts some tenths of a second, so that there is something to cancel.
ar_compute_options watched(Watch &w) {
    ar_compute_options how = options();
    how.d1_method = AR_D1_ALL_VERTICES;
    how.progress = watch;
    how.user = &w;
    return how;
}

const shapes::Mesh &slow_mesh() {
    static const shapes::Mesh mesh = shapes::organic(20);
    return mesh;
}

} // namespace

TEST_CASE("progress rises from 0 to 1 on the caller's thread", "[lifecycle]") {
    Watch w;
    const Handle mesh = through_openmesh(slow_mesh());
    compute(mesh, watched(w));
    REQUIRE(w.seen.size() >= 3);
    CHECK(w.seen.front().first == 0);
    CHECK(w.seen.back().first == 1);
    for (std::size_t i = 1; i < w.seen.size(); ++i) {
        CHECK(w.seen[i].first >= w.seen[i - 1].first);
    }
    CHECK_FALSE(w.elsewhere);
}

TEST_CASE("cancelling at every call of the progress function leaves the handle as it was", "[lifecycle]") {
    const Handle mesh = through_openmesh(slow_mesh());
    Error error;
    Watch all;
    const auto begin = std::chrono::steady_clock::now();
    const Field before = compute(mesh, watched(all));
    const double whole = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    std::set<std::uint32_t> stages;
    const int calls = static_cast<int>(all.seen.size());
    for (int n = 1; n <= calls; n += std::max(1, calls / 12)) {
        const Handle fresh = through_openmesh(slow_mesh());
        for (const Handle *h : {&fresh, &mesh}) {
            Watch w;
            w.at_call = n;
            const ar_compute_options how = watched(w);
            const auto start = std::chrono::steady_clock::now();
            const ar_status status = ar_compute(h->get(), &how, &error);
            const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            if (static_cast<int>(w.seen.size()) < n) {
                CHECK(status == AR_OK); // this run was faster than the first: it never came to call n
                continue;
            }
            CHECK(status == AR_E_CANCELLED);
            CHECK(static_cast<int>(w.seen.size()) == n); // not called again after it said stop
            CHECK(seconds < 2 * whole + 1);
            stages.insert(w.seen.back().second);
        }
        double number;
        CHECK((ar_get_vertex_d1(fresh.get(), &number, 1, nullptr, &error) == AR_E_NOT_COMPUTED ||
               ar_get_vertex_d1(fresh.get(), &number, 1, nullptr, &error) == AR_E_CAPACITY));
        std::vector<double> d1(before.d1.size());
        REQUIRE(ar_get_vertex_d1(mesh.get(), d1.data(), d1.size(), nullptr, &error) == AR_OK);
        CHECK(std::memcmp(d1.data(), before.d1.data(), d1.size() * sizeof(double)) == 0);
    }
    CHECK(stages.size() >= 2);
}

TEST_CASE("cancelling in each stage by its number", "[lifecycle]") {
    Watch all;
    compute(through_openmesh(slow_mesh()), watched(all));
    std::set<std::uint32_t> stages;
    for (const auto &[_, stage] : all.seen) {
        stages.insert(stage);
    }
    for (const std::uint32_t stage : stages) {
        INFO(ar_stage_name(stage));
        CHECK(std::string(ar_stage_name(stage)) != "unknown");
        Watch w;
        w.at_stage = stage;
        const ar_compute_options how = watched(w);
        Error error;
        const Handle mesh = through_openmesh(slow_mesh());
        const ar_status status = ar_compute(mesh.get(), &how, &error);
        const bool came_by = w.seen.back().second == stage; // a short stage may fall between two calls
        CHECK(status == (came_by ? AR_E_CANCELLED : AR_OK));
    }
}

TEST_CASE("cancel token: before, during, and lowered again", "[lifecycle]") {
    Error error;
    ar_cancel_token *token = nullptr;
    check(ar_cancel_token_new(&token, &error), error);
    const Handle mesh = through_openmesh(slow_mesh());
    ar_compute_options how = options();
    how.d1_method = AR_D1_ALL_VERTICES;
    how.cancel = token;

    check(ar_cancel_token_cancel(token, &error), error);
    CHECK(ar_compute(mesh.get(), &how, &error) == AR_E_CANCELLED);
    const TemporaryFolder folder;
    const auto path = folder.file("part.stl", shapes::binary_stl(slow_mesh())).string();
    ar_load_options load;
    ar_load_options_init(&load);
    load.cancel = token;
    ar_mesh *none = nullptr;
    CHECK(ar_mesh_load(path.c_str(), &load, &none, &error) == AR_E_CANCELLED);
    CHECK(none == nullptr);

    check(ar_cancel_token_reset(token, &error), error);
    std::thread other([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(40));
        ar_cancel_token_cancel(token, nullptr);
    });
    const ar_status status = ar_compute(mesh.get(), &how, &error);
    other.join();
    CHECK((status == AR_E_CANCELLED || status == AR_OK));

    check(ar_cancel_token_reset(token, &error), error);
    CHECK(ar_compute(mesh.get(), &how, &error) == AR_OK);
    CHECK(ar_cancel_token_free(token) == AR_OK);
}

TEST_CASE("budgets refuse before they allocate", "[lifecycle]") {
    const Handle mesh = through_openmesh(slow_mesh());
    ar_compute_options how = options();
    Error error;
    for (const std::uint64_t bytes : {1ull, 1000ull, 100000ull}) {
        how.memory_budget = bytes;
        CHECK(ar_compute(mesh.get(), &how, &error) == AR_E_BUDGET);
        CHECK(std::string(error.message).find("budget") != std::string::npos);
    }
    how.memory_budget = 1ull << 40;
    CHECK(ar_compute(mesh.get(), &how, &error) == AR_OK);
    const TemporaryFolder folder;
    const auto path = folder.file("part.stl", shapes::binary_stl(slow_mesh())).string();
    ar_load_options load;
    ar_load_options_init(&load);
    load.memory_budget = 1;
    ar_mesh *none = nullptr;
    CHECK(ar_mesh_load(path.c_str(), &load, &none, &error) == AR_E_BUDGET);
}

TEST_CASE("const functions of one handle from many threads at once", "[lifecycle]") {
    const Handle mesh = through_openmesh(shapes::organic(8));
    const Field wanted = compute(mesh);
    std::vector<double> from_zero = distance(mesh, 0);
    std::atomic<int> wrong = 0;
    std::vector<std::thread> threads;
    for (int t = 0; t < 8; ++t) {
        threads.emplace_back([&, t] {
            for (int k = 0; k < 20; ++k) {
                std::vector<double> ratio(wanted.ratio.size());
                Error error;
                wrong += ar_get_vertex_ratio(mesh.get(), ratio.data(), ratio.size(), nullptr, &error) != AR_OK;
                wrong += std::memcmp(ratio.data(), wanted.ratio.data(), ratio.size() * sizeof(double)) != 0;
                ar_diagnostics d;
                ar_diagnostics_init(&d);
                wrong += ar_mesh_get_diagnostics(mesh.get(), &d, &error) != AR_OK || d.closed != 1;
                if (t < 2 && k % 5 == 0) {
                    wrong += distance(mesh, 0) != from_zero;
                }
            }
        });
    }
    for (std::thread &t : threads) {
        t.join();
    }
    CHECK(wrong == 0);
}

TEST_CASE("many handles computed at the same time", "[lifecycle]") {
    const shapes::Mesh mesh = shapes::organic(6);
    const Field wanted = compute(through_openmesh(mesh));
    std::atomic<int> wrong = 0;
    std::vector<std::thread> threads;
    for (int t = 0; t < 6; ++t) {
        threads.emplace_back([&] { wrong += compute(through_openmesh(mesh)).ratio != wanted.ratio; });
    }
    for (std::thread &t : threads) {
        t.join();
    }
    CHECK(wrong == 0);
}

TEST_CASE("a handle of another kind is recognised", "[lifecycle]") {
    Error error;
    ar_cancel_token *token = nullptr;
    check(ar_cancel_token_new(&token, &error), error);
    CHECK(ar_compute(reinterpret_cast<ar_mesh *>(token), nullptr, &error) == AR_E_HANDLE);
    CHECK(ar_mesh_free(reinterpret_cast<ar_mesh *>(token)) == AR_E_HANDLE);
    CHECK(ar_cancel_token_free(token) == AR_OK);
    // memory of the caller's that once was nothing of ours, as after a double free
    alignas(64) std::uint64_t stale[64] = {};
    CHECK(ar_mesh_free(reinterpret_cast<ar_mesh *>(stale)) == AR_E_HANDLE);
}

TEST_CASE("using the mesh inside its own progress function is refused, not a deadlock", "[lifecycle]") {
    struct Inside {
        ar_mesh *mesh;
        ar_status again = 1, freed = 1;
    } inside{nullptr};
    const Handle mesh = through_openmesh(shapes::organic(8));
    inside.mesh = mesh.get();
    ar_compute_options how = options();
    how.user = &inside;
    how.progress = [](void *user, double, std::uint32_t) -> std::int32_t {
        auto &i = *static_cast<Inside *>(user);
        i.again = ar_compute(i.mesh, nullptr, nullptr);
        i.freed = ar_mesh_free(i.mesh);
        return 0;
    };
    Error error;
    check(ar_compute(mesh.get(), &how, &error), error);
    CHECK(inside.again == AR_E_BUSY);
    CHECK(inside.freed == AR_E_BUSY);
}

TEST_CASE("C++ wrapper: values, exceptions, moves", "[wrapper]") {
    const shapes::Mesh box = shapes::box(4, 3, 2, 1);
    std::vector<float> xyz;
    std::vector<int> ijk;
    for (const shapes::Point &p : box.points) {
        xyz.insert(xyz.end(), p.begin(), p.end());
    }
    for (const shapes::Triangle &t : box.triangles) {
        ijk.insert(ijk.end(), t.begin(), t.end());
    }
    armesh::mesh mesh = armesh::mesh::from_arrays(xyz, ijk);
    CHECK_THROWS_AS(mesh.vertex_ratio(), armesh::error);
    try {
        (void)mesh.summary();
        FAIL("not computed yet");
    } catch (const armesh::error &e) {
        CHECK(e.status() == AR_E_NOT_COMPUTED);
        CHECK(std::string(e.name()) == "AR_E_NOT_COMPUTED");
    }
    mesh.compute();
    CHECK(mesh.vertex_ratio().size() == box.points.size());
    CHECK(mesh.positions().size() == box.points.size());
    CHECK(mesh.triangles().size() == box.triangles.size());
    const armesh::histogram h = mesh.histogram_of(armesh::quantity::d1, 10);
    double sum = 0;
    for (const double share : h.share) {
        sum += share;
    }
    CHECK(sum == Approx(1));
    CHECK(h.edges.front() == Approx(smallest(mesh.vertex_d1())));
    CHECK(h.edges.back() == Approx(mesh.summary().d1_max));

    armesh::mesh moved = std::move(mesh);
    CHECK(moved.summary().ratio_max > 0);
    CHECK_THROWS_AS(mesh.summary(), armesh::error); // NOLINT: on purpose

    ijk[7] = -1;
    try {
        armesh::mesh::from_arrays(xyz, ijk);
        FAIL("a negative index was taken");
    } catch (const armesh::error &e) {
        CHECK(e.status() == AR_E_INDEX);
        CHECK(e.index() == 2u);
        CHECK(e.count() == 1);
    }
    CHECK_THROWS_AS(armesh::mesh::load("/no/such/file.stl"), armesh::error);

    struct Mine : std::exception {};
    armesh::compute_options how;
    how.progress = [](double, armesh::stage) -> bool { throw Mine(); };
    CHECK_THROWS_AS(moved.compute(how), Mine);
    CHECK(moved.summary().ratio_max > 0);
    how.progress = [](double, armesh::stage) { return false; };
    try {
        moved.compute(how);
        FAIL("not cancelled");
    } catch (const armesh::error &e) {
        CHECK(e.status() == AR_E_CANCELLED);
    }
}

TEST_CASE("summary and histogram agree with the fields", "[wrapper]") {
    const Handle mesh = through_openmesh(shapes::organic(8));
    const Field f = compute(mesh);
    const ar_summary &s = f.summary;
    CHECK(s.d1_max == largest(f.d1));
    CHECK(s.d2_max == largest(f.d2));
    CHECK(s.d2_min == smallest(f.d2));
    CHECK(s.vertex_ratio_max == largest(f.ratio));
    CHECK(s.ratio_max == s.d1_max / s.d2_max);
    CHECK(s.ratio_mean == Approx(s.d1_mean / s.d2_mean));
    CHECK(f.d1[s.d1_max_at.vertex] == s.d1_max);
    CHECK(f.d2[s.d2_max_at.vertex] == s.d2_max);
    CHECK(s.undefined_vertices == 0);
    double mean = 0;
    for (const double d : f.d1) {
        mean += d / static_cast<double>(f.d1.size());
    }
    CHECK(s.d1_mean == Approx(mean));
    for (std::size_t v = 0; v < f.ratio.size(); ++v) {
        CHECK(f.ratio[v] == f.d1[v] / f.d2[v]);
    }
    // the witness of D1: heat distances are not quite symmetric, so about
    const std::vector<double> from = distance(mesh, static_cast<std::uint32_t>(s.d1_max_at.vertex));
    CHECK(from[s.d1_max_other.vertex] == Approx(s.d1_max).epsilon(0.02));
}
