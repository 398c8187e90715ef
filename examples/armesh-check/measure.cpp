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
constexpr unsigned kDefaultRays = 20;
constexpr double kDefaultCone = 120;
constexpr std::size_t kWorstPlaces = 5;
constexpr double kApart = 0.1; // of the part's diagonal: closer places are one place to a reader

Point point(const double *p) { return {p[0], p[1], p[2]}; }

const char *unit_name(std::uint32_t unit) {
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

MeshFacts facts(const armesh::mesh &mesh) {
    const ar_diagnostics d = mesh.diagnostics();
    MeshFacts out;
    out.vertices = d.welded_vertex_count;
    out.faces = d.face_count;
    out.components = d.components;
    out.closed = d.closed != 0;
    out.area = d.area;
    out.volume = d.volume;
    out.low = point(d.bbox_min);
    out.high = point(d.bbox_max);
    out.unit = unit_name(d.unit);
    out.warnings = mesh.warnings();
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

const char *method_name(std::uint32_t method) {
    switch (method) {
    case AR_METHOD_HEAT: return "heat";
    case AR_METHOD_REFINED_HEAT: return "heat, refined";
    case AR_METHOD_EXACT: return "exact";
    case AR_METHOD_EXACT_ON_PROXY: return "exact, simplified";
    default: return "";
    }
}

void add_accuracy(const armesh::mesh &mesh, Summary &out) {
    const ar_accuracy a = mesh.accuracy();
    out.d1_method = method_name(a.method);
    out.d1_error = a.d1_error;
    out.d1_gap = a.d1_gap;
}

Summary summarise(const armesh::mesh &mesh) {
    const ar_summary s = mesh.summary();
    Summary out;
    out.d1_max = s.d1_max;
    out.d1_mean = s.d1_mean;
    out.d2_max = s.d2_max;
    out.d2_mean = s.d2_mean;
    out.d2_min = s.d2_min;
    out.ratio_max = s.ratio_max;
    out.ratio_mean = s.ratio_mean;
    out.vertex_ratio_max = s.vertex_ratio_max;
    out.d1_max_at = point(s.d1_max_at.position);
    out.d1_max_far = point(s.d1_max_other.position);
    out.d2_max_at = point(s.d2_max_at.position);
    out.d2_min_at = point(s.d2_min_at.position);
    out.vertex_ratio_max_at = point(s.vertex_ratio_max_at.position);
    out.unmeasured = s.undefined_vertices;
    out.solves = s.solves;
    add_accuracy(mesh, out);
    return out;
}

std::vector<Place> find_worst(const Report &report, const armesh::mesh &mesh) {
    const std::vector<std::uint32_t> farthest = mesh.vertex_farthest();
    const Point &low = report.mesh.low, &high = report.mesh.high;
    const double apart = kApart * std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    std::vector<Place> out;
    for (const auto v : worst_vertices(report.positions, mesh.triangles(), report.ratio, apart, kWorstPlaces)) {
        const bool known = farthest[v] < report.positions.size();
        const Point far = known ? report.positions[farthest[v]] : Point{nan, nan, nan};
        out.push_back({v, report.positions[v], far, report.d1[v], report.d2[v], report.ratio[v]});
    }
    return out;
}

std::vector<Feature> find_features(const armesh::mesh &mesh, const armesh::limits &limits) {
    static const char *const kinds[] = {"body", "bar", "wall", "ring"};
    static const char *const severities[] = {"ok", "warning", "ERROR"};
    std::vector<Feature> out;
    for (const ar_feature_info &f : mesh.features(limits)) {
        Feature found;
        found.id = f.id;
        found.kind = f.kind < 4 ? kinds[f.kind] : "?";
        found.severity = f.severity < 3 ? severities[f.severity] : "?";
        found.error = f.severity == AR_SEVERITY_ERROR;
        found.listed = f.severity != AR_SEVERITY_OK;
        found.slender = (f.reasons & AR_FINDING_SLENDER) != 0;
        found.thin = (f.reasons & AR_FINDING_THIN) != 0;
        found.ratio = f.ratio;
        found.length = f.d1_max;
        found.width = f.width;
        found.thickness = f.d2_max;
        found.least = f.d2_min;
        found.centroid = point(f.centroid);
        found.least_at = point(f.d2_min_at);
        found.ends[0] = point(f.d1_ends);
        found.ends[1] = point(f.d1_ends + 3);
        out.push_back(found);
    }
    std::stable_sort(out.begin(), out.end(), [](const Feature &a, const Feature &b) {
        const auto key = [](const Feature &f) { return f.error ? 2 : f.listed ? 1 : 0; };
        return key(a) != key(b) ? key(a) > key(b) : a.ratio > b.ratio;
    });
    return out;
}

} // namespace

Report measure(const Args &args, const armesh::cancel_token &token, std::optional<armesh::mesh> &loaded) {
    const auto start = std::chrono::steady_clock::now();
    ProgressBar bar(!args.quiet);
    const auto progress = [&](double fraction, armesh::stage now) {
        bar.show(fraction, armesh::name(now));
        return true;
    };

    armesh::mesh_options intake;
    intake.threads = args.threads;
    intake.progress = progress;
    intake.cancel = &token;
    armesh::mesh &mesh = loaded.emplace(armesh::mesh::load(args.part, intake));

    armesh::compute_options options;
    options.profile = args.paper ? armesh::profile::paper : armesh::profile::print;
    options.threads = args.threads;
    options.progress = progress;
    options.cancel = &token;
    options.rays = args.rays != 0 ? args.rays : kDefaultRays;
    const double cone = args.cone_degrees != 0 ? args.cone_degrees : kDefaultCone;
    options.cone_angle = cone * kPi / 180;
    // two long calls, one bar
    options.progress = [&](double fraction, armesh::stage now) { return progress(0.5 * fraction, now); };
    mesh.compute(options);
    armesh::feature_options find;
    find.threads = args.threads;
    find.cancel = &token;
    find.progress = [&](double fraction, armesh::stage now) { return progress(0.5 + 0.5 * fraction, now); };
    mesh.find_features(find);
    armesh::limits limits;
    limits.warn_ratio = args.warn;
    limits.error_ratio = args.limit;
    limits.min_width = args.min_width;

    Report report;
    report.features = find_features(mesh, limits);
    report.library_report = mesh.report(limits);
    report.args = args;
    report.library_version = armesh::version();
    report.rays = options.rays;
    report.cone_degrees = cone;
    report.mesh = facts(mesh);
    report.summary = summarise(mesh);
    report.positions = mesh.positions();
    report.d1 = mesh.vertex_d1();
    report.d2 = mesh.vertex_d2();
    report.ratio = mesh.vertex_ratio();
    report.worst = find_worst(report, mesh);
    report.summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return report;
}

} // namespace check
