#include "measure.hpp"

#include "progress.hpp"
#include "worst.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

namespace check {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr std::size_t kWorstPlaces = 5;
constexpr double kApart = 0.1; // of the part's diagonal: closer places are one place to a reader

// Calls `function(arguments..., &error)` and throws what it reports.
template <class Function, class... Arguments> void call(Function function, Arguments... arguments) {
    ar_error error;
    ar_error_init(&error);
    const ar_status status = function(arguments..., &error);
    if (status != AR_OK) {
        throw LibraryError(status, error.message);
    }
}

// Asks a getter how much there is and copies it out; `row` numbers an element.
template <class T, class Getter> std::vector<T> copy_out(Getter getter, const Mesh &mesh, std::size_t row = 1) {
    std::size_t count = 0;
    call(getter, mesh.get(), static_cast<T *>(nullptr), std::size_t{0}, &count);
    std::vector<T> out(count * row);
    call(getter, mesh.get(), out.data(), count, &count);
    return out;
}

// No exception may leave it: it is called from inside the library.
int32_t show_progress(void *bar, double fraction, uint32_t stage) {
    try {
        static_cast<ProgressBar *>(bar)->show(fraction, ar_stage_name(stage));
    } catch (...) {
        return 1;
    }
    return 0;
}

Point point(const double *p) { return {p[0], p[1], p[2]}; }

const char *unit_name(uint32_t unit) {
    switch (unit) {
    case AR_UNIT_MICRON: return "micron";
    case AR_UNIT_MM: return "mm";
    case AR_UNIT_CM: return "cm";
    case AR_UNIT_INCH: return "inch";
    case AR_UNIT_FOOT: return "foot";
    case AR_UNIT_M: return "m";
    default: return "";
    }
}

MeshFacts facts(const Mesh &mesh) {
    ar_diagnostics d;
    ar_diagnostics_init(&d);
    call(ar_mesh_get_diagnostics, mesh.get(), &d);
    MeshFacts out{d.vertex_count,      d.face_count,      d.components,       d.closed != 0, d.area, d.volume,
                  point(d.bbox_min), point(d.bbox_max), unit_name(d.unit), {}};
    const auto add = [&](const char *key, const char *words, const ar_finding &f, bool vertex) {
        const bool located = f.count > 0 && f.first != AR_NONE;
        out.findings.push_back({key, words, f.count, located, f.first, vertex, point(f.at)});
    };
    add("non_finite_vertices", "vertices that are not finite", d.non_finite_vertices, true);
    add("unreferenced_vertices", "vertices without a face", d.unreferenced_vertices, true);
    add("out_of_range_faces", "faces that name a vertex that does not exist", d.out_of_range_faces, false);
    add("collapsed_faces", "faces with two corners in one point", d.collapsed_faces, false);
    add("zero_area_faces", "faces without area", d.zero_area_faces, false);
    add("duplicate_faces", "duplicate faces", d.duplicate_faces, false);
    add("boundary_edges", "open edges (the surface has holes)", d.boundary_edges, false);
    add("non_manifold_edges", "edges with more than two faces", d.non_manifold_edges, false);
    add("non_manifold_vertices", "vertices where separate surfaces touch", d.non_manifold_vertices, true);
    add("orientation_conflicts", "edges whose two faces are oriented against each other", d.orientation_conflicts, false);
    add("inverted_shells", "shells that are inside out", d.inverted_shells, false);
    return out;
}

Summary summarise(const Mesh &mesh) {
    ar_summary s;
    ar_summary_init(&s);
    call(ar_get_summary, mesh.get(), &s);
    const auto at = [](const ar_place &place) { return point(place.position); };
    return {s.d1_max,
            s.d1_mean,
            s.d2_max,
            s.d2_mean,
            s.d2_min,
            s.ratio_max,
            s.ratio_mean,
            s.vertex_ratio_max,
            at(s.d1_max_at),
            at(s.d1_max_other),
            at(s.d2_max_at),
            at(s.d2_min_at),
            at(s.vertex_ratio_max_at),
            s.undefined_vertices,
            s.solves,
            0.0};
}

void find_worst(Report &report, const Mesh &mesh) {
    const std::vector<uint32_t> triangles = copy_out<uint32_t>(ar_mesh_get_triangles, mesh, 3);
    const std::vector<uint32_t> farthest = copy_out<uint32_t>(ar_get_vertex_farthest, mesh);
    const Point &low = report.mesh.low, &high = report.mesh.high;
    const double apart = kApart * std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    for (const auto v : worst_vertices(report.positions, triangles, report.ratio, apart, kWorstPlaces)) {
        const bool known = farthest[v] < report.positions.size();
        const Point far = known ? report.positions[farthest[v]] : Point{nan, nan, nan};
        report.worst.push_back({v, report.positions[v], far, report.d1[v], report.d2[v], report.ratio[v]});
    }
}

} // namespace

CancelToken make_token() {
    ar_cancel_token *token = nullptr;
    call(ar_cancel_token_new, &token);
    return CancelToken(token);
}

Report measure(const Args &args, ar_cancel_token *token, Mesh &mesh) {
    const auto start = std::chrono::steady_clock::now();
    ProgressBar bar(!args.quiet);

    ar_load_options load;
    ar_load_options_init(&load);
    load.threads = args.threads;
    load.progress = show_progress;
    load.user = &bar;
    load.cancel = token;
    ar_mesh *loaded = nullptr;
    call(ar_mesh_load, args.part.c_str(), &load, &loaded);
    mesh.reset(loaded);

    ar_compute_options options;
    ar_compute_options_init(&options);
    options.threads = args.threads;
    options.rays = args.rays;
    options.cone_angle = args.cone_degrees * kPi / 180;
    options.progress = show_progress;
    options.user = &bar;
    options.cancel = token;
    call(ar_compute, mesh.get(), &options);

    Report report;
    report.args = args;
    report.library_version = ar_version();
    report.rays = args.rays != 0 ? args.rays : 20;
    report.cone_degrees = args.cone_degrees != 0 ? args.cone_degrees : 120;
    report.mesh = facts(mesh);
    report.summary = summarise(mesh);
    const std::vector<double> xyz = copy_out<double>(ar_mesh_get_positions, mesh, 3);
    for (std::size_t v = 0; v + 2 < xyz.size(); v += 3) {
        report.positions.push_back(point(&xyz[v]));
    }
    report.d1 = copy_out<double>(ar_get_vertex_d1, mesh);
    report.d2 = copy_out<double>(ar_get_vertex_d2, mesh);
    report.ratio = copy_out<double>(ar_get_vertex_ratio, mesh);
    find_worst(report, mesh);
    report.summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return report;
}

void save_ply(const Mesh &mesh, const std::string &path) {
    call(ar_mesh_write_ply, mesh.get(), path.c_str(), uint32_t{AR_RATIO});
}

} // namespace check
