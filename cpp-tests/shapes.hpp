// Closed, outward oriented test meshes with known shapes, made here and nowhere else.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace shapes {

using Point = std::array<double, 3>;
using Triangle = std::array<std::uint32_t, 3>;

struct Mesh {
    std::vector<Point> points;
    std::vector<Triangle> triangles;
};

// Sphere: 20 n^2 faces from an icosahedron whose edges are cut into n.
Mesh icosphere(int n, double radius);
// Icosphere with its three axes scaled.
Mesh ellipsoid(int n, double a, double b, double c);
// A smooth lump: a sphere with four rounded bumps and a dent.
Mesh organic(int n);
// Axis-parallel box from the origin with cells no longer than `step`; step 0: 12 triangles.
Mesh box(double x, double y, double z, double step);
// The same on grid lines of one's own, from 0 up.
Mesh box(const std::array<std::vector<double>, 3> &lines);
// Grid lines over 0..length no farther apart than `step`; in the second form with five lines `fine` apart in the middle.
std::vector<double> even(double length, double step);
std::vector<double> fine_in_the_middle(double length, double step, double fine);
// Cylinder along z with `sides` sides and flat ends, rings no farther apart than `step`; step 0: no inner rings.
Mesh cylinder(double diameter, double height, int sides, double step);
// Torus in the xy plane.
Mesh torus(double major, double minor, int around, int across);
// Tube of the given wire diameter along a helix with flat ends.
Mesh helix(double radius, double pitch, double turns, double wire, int along, int across);
// Moebius strip, one triangle thick (an open surface that cannot be oriented).
Mesh moebius(int n);

// In place: rows of a rotation, by `angle` radians about the axis (1, 2, 3)/|.|.
void rotate(Mesh &mesh, double angle);
void scale(Mesh &mesh, double factor);
void translate(Mesh &mesh, const Point &by);
void flip(Mesh &mesh);
// Same surface with the vertices renumbered and the faces reordered by a fixed pseudo-random permutation.
// `old_to_new` receives the vertex permutation if not null.
Mesh renumber(const Mesh &mesh, unsigned seed, std::vector<std::uint32_t> *old_to_new);
// Appends `other` as further shells.
void append(Mesh &mesh, const Mesh &other);
// Longest side of the bounding box.
double size(const Mesh &mesh);

// File bytes.
std::string binary_stl(const Mesh &mesh);
std::string ascii_stl(const Mesh &mesh);

} // namespace shapes
