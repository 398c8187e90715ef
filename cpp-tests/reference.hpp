// What CGAL says about a mesh. The only place of the tests that knows CGAL.
#pragma once

#include "shapes.hpp"

namespace reference {

// Heat-method distances (Crane et al.; CGAL, Direct mode: the given triangulation) from `source` to every vertex.
std::vector<double> heat(const shapes::Mesh &mesh, std::uint32_t source);

// Exact polyhedral distances from `source` to every vertex.
std::vector<double> exact(const shapes::Mesh &mesh, std::uint32_t source);

// Largest exact distance over `solid`'s surface between any two of `samples` (points on it). `solid` should be as coarse
// as its shape allows: the cost grows with the square of its faces.
double exact_diameter(const shapes::Mesh &solid, const std::vector<shapes::Point> &samples);

// Raw shape diameter function, one value a face; -1 where CGAL gives none.
std::vector<double> sdf(const shapes::Mesh &mesh, int rays, double cone_angle);

// Signed volume by the divergence theorem, and whether the mesh is closed and consistently oriented.
double volume(const shapes::Mesh &mesh);
bool closed(const shapes::Mesh &mesh);

} // namespace reference
