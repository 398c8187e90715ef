// The per-vertex values as CSV.
#include "format.hpp"
#include "report.hpp"

namespace check {

std::string to_csv(const Report &report) {
    std::string out = "x,y,z,d1,d2,ratio\n";
    out.reserve(report.positions.size() * 100 + 20);
    for (std::size_t v = 0; v < report.positions.size(); ++v) {
        for (const double value : report.positions[v]) {
            out += exact(value, "") + ",";
        }
        out += exact(report.d1[v], "") + "," + exact(report.d2[v], "") + "," + exact(report.ratio[v], "") + "\n";
    }
    return out;
}

} // namespace check
