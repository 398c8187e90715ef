// Segmentation side by side: armesh's ar_segment and CGAL's sdf_values with segmentation_from_sdf_values, on the same
// meshes in one run.
//
//   segment FILE.off...     with FILE.labels beside it, the true part of every face, if there is one
//
// Prints a line a mesh: faces, true parts, and for each program the parts found, the adjusted Rand index against the
// truth and seconds. armesh: automatic number, measures included, all cores; then one core. CGAL's defaults, which use one.
#include <armesh.hpp>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/mesh_segmentation.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;
using Labels = std::vector<std::size_t>;

struct Mesh {
    std::vector<double> xyz;
    std::vector<std::uint32_t> ijk;
};

Mesh read_off(const std::string &path) {
    std::ifstream in(path);
    std::string magic;
    std::size_t vertices = 0, faces = 0, edges = 0;
    in >> magic >> vertices >> faces >> edges;
    Mesh mesh;
    mesh.xyz.resize(3 * vertices);
    mesh.ijk.resize(3 * faces);
    for (double &x : mesh.xyz) {
        in >> x;
    }
    for (std::size_t f = 0; f < faces; ++f) {
        int corners = 0;
        in >> corners >> mesh.ijk[3 * f] >> mesh.ijk[3 * f + 1] >> mesh.ijk[3 * f + 2];
    }
    if (!in || magic != "OFF") {
        throw std::runtime_error(path + " is not an OFF file of triangles");
    }
    return mesh;
}

// Hubert & Arabie 1985.
double adjusted_rand(const Labels &a, const Labels &b) {
    std::map<std::pair<std::size_t, std::size_t>, double> table;
    std::map<std::size_t, double> rows, columns;
    for (std::size_t i = 0; i < a.size(); ++i) {
        table[{a[i], b[i]}] += 1;
        rows[a[i]] += 1;
        columns[b[i]] += 1;
    }
    const auto pairs = [](double n) { return n * (n - 1) / 2; };
    double same = 0, r = 0, c = 0;
    for (const auto &t : table) same += pairs(t.second);
    for (const auto &t : rows) r += pairs(t.second);
    for (const auto &t : columns) c += pairs(t.second);
    const double expected = r * c / pairs(static_cast<double>(a.size())), most = 0.5 * (r + c);
    return most == expected ? 1 : (same - expected) / (most - expected);
}

template <class Work>
double seconds(Work work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Labels cgal(const Mesh &mesh, double &time) {
    Surface surface;
    for (std::size_t v = 0; v < mesh.xyz.size(); v += 3) {
        surface.add_vertex(Kernel::Point_3(mesh.xyz[v], mesh.xyz[v + 1], mesh.xyz[v + 2]));
    }
    for (std::size_t f = 0; f < mesh.ijk.size(); f += 3) {
        const auto corner = [&](std::size_t k) { return Surface::Vertex_index(mesh.ijk[f + k]); };
        if (surface.add_face(corner(0), corner(1), corner(2)) == Surface::null_face()) {
            throw std::runtime_error("CGAL does not take this mesh");
        }
    }
    auto value = surface.add_property_map<Surface::Face_index, double>("f:sdf", 0).first;
    auto part = surface.add_property_map<Surface::Face_index, std::size_t>("f:part", 0).first;
    time = seconds([&] {
        CGAL::sdf_values(surface, value);
        CGAL::segmentation_from_sdf_values(surface, value, part);
    });
    Labels out;
    for (const auto f : surface.faces()) {
        out.push_back(part[f]);
    }
    return out;
}

Labels ours(const Mesh &mesh, unsigned threads, double &time) {
    auto taken = armesh::mesh::from_arrays(mesh.xyz, mesh.ijk);
    armesh::segment_options how;
    how.threads = threads;
    time = seconds([&] { taken.segment(how); });
    const auto found = taken.face_segment();
    return Labels(found.begin(), found.end());
}

std::size_t count(const Labels &labels) {
    std::map<std::size_t, int> seen;
    for (auto l : labels) seen[l] = 1;
    return seen.size();
}

} // namespace

int main(int argc, char **argv) {
    std::printf("%-18s %8s %6s | %-30s | %s\n", "mesh", "faces", "parts", "armesh: parts  index  s   s on 1",
                "CGAL: parts  index  s");
    for (int i = 1; i < argc; ++i) {
        const std::string path = argv[i];
        try {
            const Mesh mesh = read_off(path);
            Labels truth;
            std::ifstream labels(path.substr(0, path.rfind('.')) + ".labels");
            for (std::size_t l; labels >> l;) truth.push_back(l);
            double t = 0, one = 0, theirs = 0;
            const Labels a = ours(mesh, 0, t), b = ours(mesh, 1, one), c = cgal(mesh, theirs);
            const bool known = truth.size() == a.size();
            const auto name = path.substr(path.rfind('/') + 1);
            std::printf("%-18s %8zu %6zu | %13zu  %5.3f  %5.2f  %5.2f | %11zu  %5.3f  %6.2f\n", name.c_str(),
                        mesh.ijk.size() / 3, count(truth), count(a), known ? adjusted_rand(a, truth) : NAN, t, one,
                        count(c), known ? adjusted_rand(c, truth) : NAN, theirs);
            if (a != b) {
                std::printf("  one thread found other parts\n");
                return 1;
            }
        } catch (const std::exception &e) {
            std::printf("%s: %s\n", path.c_str(), e.what());
        }
    }
}
