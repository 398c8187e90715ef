// The C++ side of the comparison: armesh through its public header, CGAL's sdf_values, and the mesh for the Python side.
//
//   peers mesh N FILE         writes the ellipsoid (vertex count, face count, doubles, uint32), 20 N^2 faces
//   peers d1 N THREADS        D1 (and D2) of all vertices, one source each: prints seconds, seconds of processor time
//                             (which tell more on a busy machine) and the largest D1
//   peers certified N THREADS the same with as many sources as it takes to know D1 to 2 %; prints their number too
//   peers organic N FILE      writes the ellipsoid with dents and bumps
//   peers organic-d1 N THREADS  D1 of all its vertices to 5 %, print profile: seconds and processor seconds of D1 alone,
//                             the largest D1, the number of sources
//   peers d2 N THREADS RAYS   D2: prints the seconds of ar_compute's stages before D1
//   peers wall N THREADS      wall widths of all vertices and faces: the same
//   peers cgal-sdf N RAYS     CGAL's sdf_values, raw: prints seconds and processor seconds
//   peers cgal-heat N SOURCES CGAL's heat method (intrinsic Delaunay), one source after the other: likewise
//   peers stl N FILE          writes the ellipsoid as binary STL
//   peers start TIMES         a box of 12 triangles from buffers, ar_compute, freed: median and largest milliseconds
#include "shapes.hpp"

#include <armesh.hpp>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Heat_method_3/Surface_mesh_geodesic_distances_3.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/mesh_segmentation.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <initializer_list>
#include <stdexcept>

namespace {

using Clock = std::chrono::steady_clock;

// Wall and processor time since its making.
class Timer {
  public:
    double wall() const { return std::chrono::duration<double>(Clock::now() - wall_).count(); }
    double processor() const { return static_cast<double>(std::clock() - processor_) / CLOCKS_PER_SEC; }

  private:
    Clock::time_point wall_ = Clock::now();
    std::clock_t processor_ = std::clock();
};

shapes::Mesh ellipsoid(int n) { return shapes::ellipsoid(n, 1.0, 1.5, 2.5); }

armesh::mesh hand_over(const shapes::Mesh &mesh) {
    return armesh::mesh::from_buffers(mesh.points[0].data(), mesh.points.size(), 0, mesh.triangles[0].data(),
                                      mesh.triangles.size(), 0);
}

void write_mesh(const shapes::Mesh &mesh, const char *path) {
    std::FILE *file = std::fopen(path, "wb");
    const std::uint64_t counts[2] = {mesh.points.size(), mesh.triangles.size()};
    bool good = file != nullptr && std::fwrite(counts, sizeof counts, 1, file) == 1;
    good = good && std::fwrite(mesh.points.data(), sizeof(shapes::Point), mesh.points.size(), file) == mesh.points.size();
    good = good && std::fwrite(mesh.triangles.data(), sizeof(shapes::Triangle), mesh.triangles.size(), file) ==
                       mesh.triangles.size();
    if (!good || std::fclose(file) != 0) {
        throw std::runtime_error("cannot write the mesh");
    }
}

void d1(int n, unsigned threads, armesh::d1_method method) {
    armesh::mesh mesh = hand_over(ellipsoid(n));
    armesh::compute_options how;
    how.profile = armesh::profile::paper;
    how.threads = threads;
    how.d1_method = method;
    const Timer timer;
    mesh.compute(how);
    const double wall = timer.wall(), processor = timer.processor();
    std::printf("%.6f %.6f %.9g %llu\n", wall, processor, mesh.summary().d1_max,
                static_cast<unsigned long long>(mesh.summary().solves));
}

shapes::Mesh organic(int n) {
    shapes::Mesh mesh = ellipsoid(n);
    for (shapes::Point &p : mesh.points) {
        const double bump = 1 + 0.12 * std::sin(5 * p[0]) * std::cos(4 * p[1]) * std::sin(3 * p[2] + 1) +
                            0.03 * std::sin(11 * p[0] + 7 * p[2]) * std::cos(9 * p[1]);
        for (double &x : p) {
            x *= bump;
        }
    }
    return mesh;
}

// The seconds of some stages.
double seconds_of(const armesh::mesh &mesh, std::initializer_list<int> stages) {
    const auto summary = mesh.summary();
    double sum = 0;
    for (const int stage : stages) {
        sum += summary.stage_seconds[stage];
    }
    return sum;
}

// D1 as a slicer asks for it, without the time that D2 takes before.
void organic_d1(int n, unsigned threads) {
    armesh::mesh mesh = hand_over(organic(n));
    armesh::compute_options how;
    how.threads = threads;
    const Timer timer;
    double before = 0;
    how.progress = [&](double, armesh::stage now) {
        before = now == armesh::stage::mesh || now == armesh::stage::thickness ? timer.processor() : before;
        return true;
    };
    mesh.compute(how);
    const double wall = seconds_of(mesh, {AR_STAGE_SURFACE, AR_STAGE_FACTOR, AR_STAGE_GEODESIC});
    const auto summary = mesh.summary();
    std::printf("%.6f %.6f %.9g %llu\n", wall, timer.processor() - before, summary.d1_max,
                static_cast<unsigned long long>(summary.solves));
}

// Widths without D1, which is asked for roughly, as it has to be asked for.
void widths(int n, armesh::compute_options how) {
    armesh::mesh mesh = hand_over(ellipsoid(n));
    how.d1_method = armesh::d1_method::certified;
    how.d1_tolerance = 0.5;
    mesh.compute(how);
    std::printf("%.6f\n", seconds_of(mesh, {AR_STAGE_MESH, AR_STAGE_THICKNESS}));
}

void d2(int n, unsigned threads, unsigned rays) {
    armesh::compute_options how;
    how.profile = armesh::profile::paper;
    how.threads = threads;
    how.rays = rays;
    widths(n, how);
}

void wall(int n, unsigned threads) {
    armesh::compute_options how;
    how.profile = armesh::profile::print;
    how.threads = threads;
    widths(n, how);
}

void start(int times) {
    const shapes::Mesh box = shapes::box(30, 20, 10, 0);
    std::vector<double> milliseconds;
    for (int k = 0; k < times; ++k) {
        const Timer timer;
        armesh::mesh mesh = hand_over(box);
        mesh.compute();
        milliseconds.push_back(1000 * timer.wall());
    }
    std::sort(milliseconds.begin(), milliseconds.end());
    std::printf("%.6f %.6f\n", milliseconds[milliseconds.size() / 2], milliseconds.back());
}

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;

Surface surface_of(const shapes::Mesh &mesh) {
    Surface surface;
    for (const shapes::Point &p : mesh.points) {
        surface.add_vertex(Kernel::Point_3(p[0], p[1], p[2]));
    }
    for (const shapes::Triangle &t : mesh.triangles) {
        surface.add_face(Surface::Vertex_index(t[0]), Surface::Vertex_index(t[1]), Surface::Vertex_index(t[2]));
    }
    return surface;
}

void cgal_sdf(int n, unsigned rays) {
    Surface surface = surface_of(ellipsoid(n));
    auto value = surface.add_property_map<Surface::Face_index, double>("f:sdf", 0).first;
    const Timer timer;
    CGAL::sdf_values(surface, value, 2.0 / 3.0 * CGAL_PI, rays, false);
    std::printf("%.6f %.6f\n", timer.wall(), timer.processor());
}

// Building and factoring, then each source; the second pair of numbers is for the sources only.
void cgal_heat(int n, unsigned sources) {
    Surface surface = surface_of(ellipsoid(n));
    auto distance = surface.add_property_map<Surface::Vertex_index, double>("v:d", 0).first;
    const Timer timer;
    CGAL::Heat_method_3::Surface_mesh_geodesic_distances_3<Surface, CGAL::Heat_method_3::Intrinsic_Delaunay> heat(surface);
    heat.add_source(Surface::Vertex_index(0));
    heat.estimate_geodesic_distances(distance);
    const double prepared = timer.wall();
    for (unsigned k = 1; k <= sources; ++k) {
        heat.clear_sources();
        heat.add_source(Surface::Vertex_index(k * (surface.number_of_vertices() / (sources + 1))));
        heat.estimate_geodesic_distances(distance);
    }
    std::printf("%.6f %.6f %.6f\n", timer.wall(), timer.processor(), timer.wall() - prepared);
}

void write_stl(const shapes::Mesh &mesh, const char *path) {
    const std::string bytes = shapes::binary_stl(mesh);
    std::FILE *file = std::fopen(path, "wb");
    if (file == nullptr || std::fwrite(bytes.data(), 1, bytes.size(), file) != bytes.size() || std::fclose(file) != 0) {
        throw std::runtime_error("cannot write the mesh");
    }
}

} // namespace

int main(int argc, char **argv) {
    const auto number = [&](int k) { return k < argc ? std::atoi(argv[k]) : 0; };
    const auto count = [&](int k) { return static_cast<unsigned>(number(k)); };
    try {
        if (argc == 4 && std::strcmp(argv[1], "mesh") == 0) {
            write_mesh(ellipsoid(number(2)), argv[3]);
        } else if (argc == 4 && std::strcmp(argv[1], "d1") == 0) {
            d1(number(2), count(3), armesh::d1_method::all_vertices);
        } else if (argc == 4 && std::strcmp(argv[1], "certified") == 0) {
            d1(number(2), count(3), armesh::d1_method::certified);
        } else if (argc == 4 && std::strcmp(argv[1], "organic") == 0) {
            write_mesh(organic(number(2)), argv[3]);
        } else if (argc == 4 && std::strcmp(argv[1], "organic-d1") == 0) {
            organic_d1(number(2), count(3));
        } else if (argc == 5 && std::strcmp(argv[1], "d2") == 0) {
            d2(number(2), count(3), count(4));
        } else if (argc == 4 && std::strcmp(argv[1], "wall") == 0) {
            wall(number(2), count(3));
        } else if (argc == 4 && std::strcmp(argv[1], "cgal-sdf") == 0) {
            cgal_sdf(number(2), count(3));
        } else if (argc == 4 && std::strcmp(argv[1], "cgal-heat") == 0) {
            cgal_heat(number(2), count(3));
        } else if (argc == 4 && std::strcmp(argv[1], "stl") == 0) {
            write_stl(ellipsoid(number(2)), argv[3]);
        } else if (argc == 3 && std::strcmp(argv[1], "start") == 0) {
            start(number(2));
        } else {
            std::fprintf(stderr, "usage: see the top of peers.cpp\n");
            return 2;
        }
    } catch (const std::exception &error) {
        std::fprintf(stderr, "peers: %s\n", error.what());
        return 1;
    }
    return 0;
}
