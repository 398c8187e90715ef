// The report as a table for people.
#include "format.hpp"
#include "report.hpp"

#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace check {
namespace {

void line(std::string &out, const char *format, ...) {
    char text[1024];
    va_list values;
    va_start(values, format);
    std::vsnprintf(text, sizeof text, format, values);
    va_end(values);
    out += text;
    out += '\n';
}

void mesh_facts(std::string &out, const MeshFacts &mesh) {
    const std::string unit = mesh.unit[0] != '\0' ? mesh.unit : "units (the file does not say which)";
    const Point size = {mesh.high[0] - mesh.low[0], mesh.high[1] - mesh.low[1], mesh.high[2] - mesh.low[2]};
    line(out, "Mesh");
    line(out, "  %s faces, %s vertices, %s %s, %s", shown(mesh.faces).c_str(), shown(mesh.vertices).c_str(),
         shown(mesh.components).c_str(), mesh.components == 1 ? "shell" : "shells", mesh.closed ? "closed" : "NOT closed");
    line(out, "  %s x %s x %s %s, from %s to %s", shown(size[0]).c_str(), shown(size[1]).c_str(),
         shown(size[2]).c_str(), unit.c_str(), shown(mesh.low).c_str(), shown(mesh.high).c_str());
    line(out, "  area %s, volume %s", shown(mesh.area, 5).c_str(), shown(mesh.volume, 5).c_str());
    for (const std::string &warning : mesh.warnings) {
        line(out, "  warning: %s", warning.c_str());
    }
    for (const Finding &f : mesh.findings) {
        if (f.count == 0) {
            continue;
        }
        std::string where;
        if (f.located) {
            where = std::string(", the first at ") + (f.first_is_vertex ? "vertex " : "face ") +
                    std::to_string(f.first) + " " + shown(f.at);
        }
        line(out, "  warning: %s %s%s", shown(f.count).c_str(), f.words, where.c_str());
    }
}

void accuracy(std::string &out, const Summary &s) {
    const std::string error = std::isfinite(s.d1_error) ? "about " + shown(100 * s.d1_error) + " %" : "unknown";
    line(out, "  %-24s %s, bounds at most %s %% apart (distances: %s)", "D1, error", error.c_str(),
         shown(100 * s.d1_gap).c_str(), s.d1_method);
}

void slenderness(std::string &out, const Summary &s, std::uint64_t vertices) {
    line(out, "Slenderness");
    line(out, "  %-24s %10s %10s   %s", "", "largest", "mean", "where the largest is");
    line(out, "  %-24s %10s %10s   %s to %s", "D1, length", shown(s.d1_max).c_str(), shown(s.d1_mean).c_str(),
         shown(s.d1_max_at).c_str(), shown(s.d1_max_far).c_str());
    line(out, "  %-24s %10s %10s   %s", "D2, width", shown(s.d2_max).c_str(), shown(s.d2_mean).c_str(),
         shown(s.d2_max_at).c_str());
    line(out, "  %-24s %10s %10s", "part, D1/D2 of these", shown(s.ratio_max).c_str(), shown(s.ratio_mean).c_str());
    line(out, "  %-24s %10s %10s   %s", "D1/D2 at a vertex", shown(s.vertex_ratio_max).c_str(), "",
         shown(s.vertex_ratio_max_at).c_str());
    accuracy(out, s);
    if (s.unmeasured > 0) {
        line(out, "  warning: %s of %s vertices have no value", shown(s.unmeasured).c_str(), shown(vertices).c_str());
    }
}

void worst_places(std::string &out, const std::vector<Place> &places) {
    if (places.empty()) {
        return;
    }
    line(out, "Worst places");
    line(out, "  %10s %10s %10s   %s", "D1/D2", "D1", "D2", "where");
    for (const Place &p : places) {
        line(out, "  %10s %10s %10s   %s", shown(p.ratio).c_str(), shown(p.d1).c_str(), shown(p.d2).c_str(),
             shown(p.at).c_str());
    }
}

void features(std::string &out, const Report &report) {
    constexpr std::size_t most = 40;
    std::size_t errors = 0, warnings = 0, shown_lines = 0;
    for (const Feature &f : report.features) {
        errors += f.error ? 1 : 0;
        warnings += f.listed && !f.error ? 1 : 0;
    }
    line(out, "Features: %zu, of which %zu too slender or too thin, %zu near the limit", report.features.size(), errors,
         warnings);
    if (errors + warnings == 0) {
        return;
    }
    line(out, "  %-8s %4s %-5s %10s %10s %10s   %s", "", "id", "kind", "D1/D2", "length", "thickness", "where");
    for (const Feature &f : report.features) {
        if (!f.listed || shown_lines == most) {
            break;
        }
        ++shown_lines;
        line(out, "  %-8s %4u %-5s %10s %10s %10s   %s, from %s to %s", f.severity, f.id, f.kind, shown(f.ratio).c_str(),
             shown(f.length).c_str(), shown(f.thickness).c_str(), shown(f.centroid).c_str(), shown(f.ends[0]).c_str(),
             shown(f.ends[1]).c_str());
        if (f.thin) {
            line(out, "  %-8s %4s       only %s wide at %s", "", "", shown(f.least).c_str(), shown(f.least_at).c_str());
        }
    }
    if (errors + warnings > shown_lines) {
        line(out, "  ... and %zu more (--json lists all)", errors + warnings - shown_lines);
    }
}

} // namespace

std::string to_table(const Report &report) {
    std::string out = report.args.part + "\n\n";
    mesh_facts(out, report.mesh);
    out += '\n';
    slenderness(out, report.summary, report.mesh.vertices);
    out += '\n';
    worst_places(out, report.worst);
    out += '\n';
    features(out, report);
    const bool part = report.summary.ratio_max >= report.args.limit;
    bool slender = part;
    for (const Feature &f : report.features) {
        slender = slender || f.ratio >= report.args.limit;
    }
    line(out, "\n%s: slenderness of the part %s is %s the limit of %s  (%.2f s)",
         slender ? "TOO SLENDER" : report.over() ? "TOO THIN" : "ok", shown(report.summary.ratio_max).c_str(),
         part ? "at or over" : "under", shown(report.args.limit).c_str(), report.summary.seconds);
    return out;
}

} // namespace check
