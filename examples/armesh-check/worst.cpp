#include "worst.hpp"

#include <algorithm>
#include <cmath>

namespace check {

std::vector<std::uint64_t> worst_vertices(const std::vector<Point> &positions,
                                          const std::vector<std::array<std::uint32_t, 3>> &triangles,
                                          const std::vector<double> &ratio, double apart, std::size_t wanted) {
    std::vector<bool> peak(ratio.size());
    for (std::size_t v = 0; v < ratio.size(); ++v) {
        peak[v] = std::isfinite(ratio[v]);
    }
    for (const auto &t : triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = t[k], b = t[(k + 1) % 3];
            if (a >= ratio.size() || b >= ratio.size()) {
                continue;
            }
            if (ratio[a] < ratio[b]) {
                peak[a] = false;
            } else if (ratio[b] < ratio[a]) {
                peak[b] = false;
            }
        }
    }
    std::vector<std::uint64_t> order;
    for (std::size_t v = 0; v < ratio.size(); ++v) {
        if (peak[v]) {
            order.push_back(v);
        }
    }
    std::stable_sort(order.begin(), order.end(), [&](std::uint64_t a, std::uint64_t b) { return ratio[a] > ratio[b]; });
    std::vector<std::uint64_t> chosen;
    for (const std::uint64_t v : order) {
        const bool clear = std::none_of(chosen.begin(), chosen.end(), [&](std::uint64_t c) {
            const Point &p = positions[v], &q = positions[c];
            return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) < apart;
        });
        if (clear) {
            chosen.push_back(v);
            if (chosen.size() == wanted) {
                break;
            }
        }
    }
    return chosen;
}

} // namespace check
