#include "reference.hpp"

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Heat_method_3/Surface_mesh_geodesic_distances_3.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_shortest_path.h>
#include <CGAL/mesh_segmentation.h>

#include <stdexcept>

namespace reference {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;
using Vertex = Surface::Vertex_index;

Surface surface(const shapes::Mesh &mesh) {
    Surface out;
    for (const shapes::Point &p : mesh.points) {
        out.add_vertex(Kernel::Point_3(p[0], p[1], p[2]));
    }
    for (const shapes::Triangle &t : mesh.triangles) {
        if (out.add_face(Vertex(t[0]), Vertex(t[1]), Vertex(t[2])) == Surface::null_face()) {
            throw std::runtime_error("CGAL does not take this mesh: not an oriented manifold");
        }
    }
    return out;
}

} // namespace

std::vector<double> heat(const shapes::Mesh &mesh, std::uint32_t source) {
    Surface s = surface(mesh);
    auto distance = s.add_property_map<Vertex, double>("v:distance", 0).first;
    CGAL::Heat_method_3::Surface_mesh_geodesic_distances_3<Surface, CGAL::Heat_method_3::Direct> solver(s);
    solver.add_source(Vertex(source));
    solver.estimate_geodesic_distances(distance);
    std::vector<double> out;
    for (const Vertex v : s.vertices()) {
        out.push_back(distance[v]);
    }
    return out;
}

std::vector<double> exact(const shapes::Mesh &mesh, std::uint32_t source) {
    Surface s = surface(mesh);
    CGAL::Surface_mesh_shortest_path<CGAL::Surface_mesh_shortest_path_traits<Kernel, Surface>> paths(s);
    paths.add_source_point(Vertex(source));
    std::vector<double> out;
    for (const Vertex v : s.vertices()) {
        out.push_back(paths.shortest_distance_to_source_points(v).first);
    }
    return out;
}

double exact_diameter(const shapes::Mesh &solid, const std::vector<shapes::Point> &samples) {
    Surface s = surface(solid);
    using Paths = CGAL::Surface_mesh_shortest_path<CGAL::Surface_mesh_shortest_path_traits<Kernel, Surface>>;
    Paths paths(s);
    CGAL::AABB_tree<CGAL::AABB_traits<Kernel, CGAL::AABB_face_graph_triangle_primitive<Surface>>> tree;
    paths.build_aabb_tree(tree);
    std::vector<Paths::Face_location> places;
    for (const shapes::Point &p : samples) {
        places.push_back(paths.locate(Kernel::Point_3(p[0], p[1], p[2]), tree));
    }
    double longest = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
        paths.remove_all_source_points();
        paths.add_source_point(places[i]);
        for (std::size_t k = i + 1; k < places.size(); ++k) {
            longest = std::max(longest, paths.shortest_distance_to_source_points(places[k].first, places[k].second).first);
        }
    }
    return longest;
}

std::vector<double> sdf(const shapes::Mesh &mesh, int rays, double cone_angle) {
    Surface s = surface(mesh);
    auto value = s.add_property_map<Surface::Face_index, double>("f:sdf", 0).first;
    CGAL::sdf_values(s, value, cone_angle, static_cast<std::size_t>(rays), false);
    std::vector<double> out;
    for (const auto f : s.faces()) {
        out.push_back(value[f]);
    }
    return out;
}

double volume(const shapes::Mesh &mesh) { return CGAL::Polygon_mesh_processing::volume(surface(mesh)); }

bool closed(const shapes::Mesh &mesh) { return CGAL::is_closed(surface(mesh)); }

} // namespace reference
