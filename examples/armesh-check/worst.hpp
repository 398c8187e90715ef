// Picks a few places that tell a reader where the trouble is.
#pragma once

#include "report.hpp"

namespace check {

// Up to `wanted` vertices that no neighbour surpasses in ratio, the highest first, each at least `apart` from the others.
// Faces with a vertex that does not exist (UINT32_MAX: a face that takes no part) are passed over.
std::vector<std::uint64_t> worst_vertices(const std::vector<Point> &positions,
                                          const std::vector<std::array<std::uint32_t, 3>> &triangles,
                                          const std::vector<double> &ratio, double apart, std::size_t wanted);

} // namespace check
