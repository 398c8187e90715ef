#include "shapes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <map>
#include <numeric>
#include <random>

namespace shapes {
namespace {

constexpr double kTau = 6.283185307179586;

Point operator+(const Point &a, const Point &b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Point operator*(double s, const Point &a) { return {s * a[0], s * a[1], s * a[2]}; }
double dot(const Point &a, const Point &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point unit(const Point &a) { return (1.0 / std::sqrt(dot(a, a))) * a; }
Point cross(const Point &a, const Point &b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// A quad mesh cell a-b-c-d (anticlockwise) as two triangles, the diagonal by `odd`.
void quad(Mesh &mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d, bool odd) {
    if (odd) {
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({a, c, d});
    } else {
        mesh.triangles.push_back({a, b, d});
        mesh.triangles.push_back({b, c, d});
    }
}

// Tube of `across` points a ring; `point(i, k)` is point k of ring i. Closed along if `cyclic`, else the rings' ends stay open.
Mesh tube(int along, int across, bool cyclic, const std::function<Point(int, int)> &point) {
    Mesh mesh;
    const int rings = cyclic ? along : along + 1;
    for (int i = 0; i < rings; ++i) {
        for (int k = 0; k < across; ++k) {
            mesh.points.push_back(point(i, k));
        }
    }
    const auto id = [&](int i, int k) { return static_cast<std::uint32_t>(i % rings * across + k % across); };
    for (int i = 0; i < along; ++i) {
        for (int k = 0; k < across; ++k) {
            quad(mesh, id(i, k), id(i, k + 1), id(i + 1, k + 1), id(i + 1, k), (i + k) % 2 != 0);
        }
    }
    return mesh;
}

// Closes ring `first..first+across` of a tube with a flat disc of concentric rings about `centre`.
void cap(Mesh &mesh, std::uint32_t first, int across, const Point &centre, int rings, bool outward_is_forward) {
    std::uint32_t outer = first;
    const auto face = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (outward_is_forward) {
            mesh.triangles.push_back({a, b, c});
        } else {
            mesh.triangles.push_back({a, c, b});
        }
    };
    for (int r = 1; r < rings; ++r) {
        const auto inner = static_cast<std::uint32_t>(mesh.points.size());
        for (int k = 0; k < across; ++k) {
            const Point p = mesh.points[first + k];
            mesh.points.push_back(centre + (1.0 - static_cast<double>(r) / rings) * (p + -1.0 * centre));
        }
        for (int k = 0; k < across; ++k) {
            const auto next = static_cast<std::uint32_t>((k + 1) % across);
            face(outer + k, outer + next, inner + next);
            face(outer + k, inner + next, inner + k);
        }
        outer = inner;
    }
    const auto middle = static_cast<std::uint32_t>(mesh.points.size());
    mesh.points.push_back(centre);
    for (int k = 0; k < across; ++k) {
        face(outer + k, outer + static_cast<std::uint32_t>((k + 1) % across), middle);
    }
}

} // namespace

Mesh icosphere(int n, double radius) {
    const double g = (1 + std::sqrt(5.0)) / 2;
    const std::vector<Point> corner = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                                       {0, -1, -g}, {0, 1, -g}, {g, 0, -1}, {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    const std::vector<Triangle> side = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                                        {11, 10, 2}, {10, 7, 6}, {7, 1, 8},   {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                                        {3, 8, 9},  {4, 9, 5},  {2, 4, 11},  {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    Mesh mesh;
    std::map<std::array<long, 3>, std::uint32_t> seen;
    const auto vertex = [&](const Triangle &t, int i, int j) {
        // barycentric on the flat face; the three weights times the corners are exact enough to share by rounding
        const Point p = unit((n - i - j) * corner[t[0]] + double(i) * corner[t[1]] + double(j) * corner[t[2]]);
        const std::array<long, 3> key = {std::lround(p[0] * 1e8), std::lround(p[1] * 1e8), std::lround(p[2] * 1e8)};
        const auto [at, fresh] = seen.try_emplace(key, static_cast<std::uint32_t>(mesh.points.size()));
        if (fresh) {
            mesh.points.push_back(radius * p);
        }
        return at->second;
    };
    for (const Triangle &t : side) {
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n - i; ++j) {
                mesh.triangles.push_back({vertex(t, i, j), vertex(t, i + 1, j), vertex(t, i, j + 1)});
                if (j + 1 < n - i) {
                    mesh.triangles.push_back({vertex(t, i + 1, j), vertex(t, i + 1, j + 1), vertex(t, i, j + 1)});
                }
            }
        }
    }
    return mesh;
}

Mesh ellipsoid(int n, double a, double b, double c) {
    Mesh mesh = icosphere(n, 1.0);
    for (Point &p : mesh.points) {
        p = {a * p[0], b * p[1], c * p[2]};
    }
    return mesh;
}

Mesh organic(int n) {
    Mesh mesh = icosphere(n, 1.0);
    const std::vector<std::pair<Point, double>> bumps = {
        {unit({1, 0.2, 0.1}), 0.7}, {unit({-0.6, 0.9, 0.3}), 0.5}, {unit({-0.3, -0.8, 0.7}), 0.6}, {unit({0.1, 0.3, -1}), 0.4},
        {unit({0.2, 0.4, 1}), -0.25}};
    for (Point &p : mesh.points) {
        double r = 1;
        for (const auto &[axis, height] : bumps) {
            r += height * std::exp(-4.0 * (1 - dot(p, axis)));
        }
        p = r * p;
    }
    return mesh;
}

std::vector<double> even(double length, double step) {
    const int n = step > 0 ? std::max(1, static_cast<int>(std::ceil(length / step - 1e-9))) : 1;
    std::vector<double> out;
    for (int i = 0; i <= n; ++i) {
        out.push_back(length * i / n);
    }
    return out;
}

std::vector<double> fine_in_the_middle(double length, double step, double fine) {
    std::vector<double> out = even(length, step);
    for (const double k : {-2.0, -1.0, 0.0, 1.0, 2.0}) {
        const double at = 0.5 * length + k * fine;
        out.erase(std::remove_if(out.begin(), out.end(), [&](double c) { return std::fabs(c - at) < 0.7 * fine; }), out.end());
        out.push_back(at);
    }
    std::sort(out.begin(), out.end());
    return out;
}

Mesh box(double x, double y, double z, double step) { return box({even(x, step), even(y, step), even(z, step)}); }

Mesh box(const std::array<std::vector<double>, 3> &lines) {
    std::array<int, 3> n{};
    for (int k = 0; k < 3; ++k) {
        n[k] = static_cast<int>(lines[k].size()) - 1;
    }
    Mesh mesh;
    std::map<std::array<int, 3>, std::uint32_t> seen;
    const auto vertex = [&](const std::array<int, 3> &at) {
        const auto [it, fresh] = seen.try_emplace(at, static_cast<std::uint32_t>(mesh.points.size()));
        if (fresh) {
            mesh.points.push_back({lines[0][at[0]], lines[1][at[1]], lines[2][at[2]]});
        }
        return it->second;
    };
    for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (int side = 0; side < 2; ++side) {
            for (int i = 0; i < n[u]; ++i) {
                for (int j = 0; j < n[v]; ++j) {
                    const auto corner = [&](int di, int dj) {
                        std::array<int, 3> at{};
                        at[axis] = side * n[axis];
                        at[u] = i + di;
                        at[v] = j + dj;
                        return vertex(at);
                    };
                    const std::uint32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
                    if (side == 1) {
                        quad(mesh, a, b, c, d, (i + j) % 2 != 0);
                    } else {
                        quad(mesh, a, d, c, b, (i + j) % 2 != 0);
                    }
                }
            }
        }
    }
    return mesh;
}

Mesh cylinder(double diameter, double height, int sides, double step) {
    const int along = step > 0 ? std::max(1, static_cast<int>(std::ceil(height / step))) : 1;
    const int rings = step > 0 ? std::max(1, static_cast<int>(std::ceil(0.5 * diameter / step))) : 1;
    const double r = 0.5 * diameter;
    Mesh mesh = tube(along, sides, false, [&](int i, int k) -> Point {
        const double a = kTau * k / sides;
        return {r * std::cos(a), r * std::sin(a), height * i / along};
    });
    cap(mesh, 0, sides, {0, 0, 0}, rings, false);
    cap(mesh, static_cast<std::uint32_t>(along * sides), sides, {0, 0, height}, rings, true);
    return mesh;
}

Mesh torus(double major, double minor, int around, int across) {
    // the ring runs so that (around, across) is anticlockwise seen from outside after the flip in tube's order
    return tube(around, across, true, [&](int i, int k) -> Point {
        const double a = kTau * i / around, b = -kTau * k / across;
        const double r = major + minor * std::cos(b);
        return {r * std::cos(a), r * std::sin(a), minor * std::sin(b)};
    });
}

Mesh helix(double radius, double pitch, double turns, double wire, int along, int across) {
    const auto frame = [&](int i) {
        const double a = kTau * turns * i / along;
        const Point centre = {radius * std::cos(a), radius * std::sin(a), pitch * a / kTau};
        const Point forward = unit({-radius * std::sin(a), radius * std::cos(a), pitch / kTau});
        const Point out = {std::cos(a), std::sin(a), 0};
        return std::array<Point, 3>{centre, out, cross(forward, out)};
    };
    Mesh mesh = tube(along, across, false, [&](int i, int k) -> Point {
        const auto [centre, out, up] = frame(i);
        const double b = kTau * k / across;
        return centre + 0.5 * wire * (std::cos(b) * out + std::sin(b) * up);
    });
    const int rings = std::max(2, across / 6);
    cap(mesh, 0, across, frame(0)[0], rings, false);
    cap(mesh, static_cast<std::uint32_t>(along * across), across, frame(along)[0], rings, true);
    return mesh;
}

Mesh moebius(int n) {
    Mesh mesh;
    constexpr int width = 4;
    for (int i = 0; i < n; ++i) {
        for (int k = 0; k <= width; ++k) {
            const double a = kTau * i / n, w = 0.4 * (2.0 * k / width - 1);
            const double r = 1 + w * std::cos(a / 2);
            mesh.points.push_back({r * std::cos(a), r * std::sin(a), w * std::sin(a / 2)});
        }
    }
    const auto id = [&](int i, int k) {
        return static_cast<std::uint32_t>(i < n ? i * (width + 1) + k : width - k); // the seam turns over
    };
    for (int i = 0; i < n; ++i) {
        for (int k = 0; k < width; ++k) {
            quad(mesh, id(i, k), id(i, k + 1), id(i + 1, k + 1), id(i + 1, k), (i + k) % 2 != 0);
        }
    }
    return mesh;
}

void rotate(Mesh &mesh, double angle) {
    const Point axis = unit({1, 2, 3});
    const double c = std::cos(angle), s = std::sin(angle);
    for (Point &p : mesh.points) {
        p = c * p + s * cross(axis, p) + ((1 - c) * dot(axis, p)) * axis;
    }
}

void scale(Mesh &mesh, double factor) {
    for (Point &p : mesh.points) {
        p = factor * p;
    }
}

void translate(Mesh &mesh, const Point &by) {
    for (Point &p : mesh.points) {
        p = p + by;
    }
}

void flip(Mesh &mesh) {
    for (Triangle &t : mesh.triangles) {
        std::swap(t[1], t[2]);
    }
}

Mesh renumber(const Mesh &mesh, unsigned seed, std::vector<std::uint32_t> *old_to_new) {
    std::mt19937 random(seed);
    const auto shuffled = [&](std::size_t n) {
        std::vector<std::uint32_t> order(n);
        std::iota(order.begin(), order.end(), 0u);
        for (std::size_t k = n; k > 1; --k) {
            std::swap(order[k - 1], order[random() % k]);
        }
        return order;
    };
    const std::vector<std::uint32_t> to = shuffled(mesh.points.size()), face = shuffled(mesh.triangles.size());
    Mesh out;
    out.points.resize(mesh.points.size());
    for (std::size_t v = 0; v < to.size(); ++v) {
        out.points[to[v]] = mesh.points[v];
    }
    for (const std::uint32_t f : face) {
        const Triangle &t = mesh.triangles[f];
        const int turn = static_cast<int>(random() % 3);
        out.triangles.push_back({to[t[turn]], to[t[(turn + 1) % 3]], to[t[(turn + 2) % 3]]});
    }
    if (old_to_new != nullptr) {
        *old_to_new = to;
    }
    return out;
}

void append(Mesh &mesh, const Mesh &other) {
    const auto shift = static_cast<std::uint32_t>(mesh.points.size());
    mesh.points.insert(mesh.points.end(), other.points.begin(), other.points.end());
    for (const Triangle &t : other.triangles) {
        mesh.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
    }
}

double size(const Mesh &mesh) {
    double longest = 0;
    for (int k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax_element(mesh.points.begin(), mesh.points.end(),
                                                     [&](const Point &a, const Point &b) { return a[k] < b[k]; });
        longest = std::max(longest, (*high)[k] - (*low)[k]);
    }
    return longest;
}

std::string binary_stl(const Mesh &mesh) {
    std::string out(80, '\0');
    const auto put = [&](const void *data, std::size_t n) { out.append(static_cast<const char *>(data), n); };
    const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
    put(&count, 4); // the tests run on little-endian machines
    for (const Triangle &t : mesh.triangles) {
        const float normal[3] = {0, 0, 0};
        put(normal, sizeof normal);
        for (const std::uint32_t v : t) {
            for (const double c : mesh.points[v]) {
                const auto single = static_cast<float>(c);
                put(&single, 4);
            }
        }
        put("\0\0", 2);
    }
    return out;
}

std::string ascii_stl(const Mesh &mesh) {
    std::string out = "solid part\n";
    char line[128];
    for (const Triangle &t : mesh.triangles) {
        out += "facet normal 0 0 0\n outer loop\n";
        for (const std::uint32_t v : t) {
            const Point &p = mesh.points[v];
            std::snprintf(line, sizeof line, "  vertex %.9g %.9g %.9g\n", p[0], p[1], p[2]);
            out += line;
        }
        out += " endloop\nendfacet\n";
    }
    return out + "endsolid part\n";
}

} // namespace shapes
