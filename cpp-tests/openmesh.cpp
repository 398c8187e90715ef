// The only place of the tests that knows OpenMesh.
#include "support.hpp"

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include <stdexcept>
#include <type_traits>

namespace support {
namespace {

struct SingleTraits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3f;
    using Normal = OpenMesh::Vec3f;
};
struct DoubleTraits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
    using Normal = OpenMesh::Vec3d;
};
using SingleMesh = OpenMesh::TriMesh_ArrayKernelT<SingleTraits>;
using DoubleMesh = OpenMesh::TriMesh_ArrayKernelT<DoubleTraits>;

template <class Kernel> Kernel build(const shapes::Mesh &mesh) {
    using Scalar = typename Kernel::Point::value_type;
    Kernel out;
    std::vector<OpenMesh::VertexHandle> vertex;
    for (const shapes::Point &p : mesh.points) {
        vertex.push_back(out.add_vertex({static_cast<Scalar>(p[0]), static_cast<Scalar>(p[1]), static_cast<Scalar>(p[2])}));
    }
    for (const shapes::Triangle &t : mesh.triangles) {
        if (!out.add_face(vertex[t[0]], vertex[t[1]], vertex[t[2]]).is_valid()) {
            throw std::runtime_error("OpenMesh does not take this mesh");
        }
    }
    return out;
}

// What a host with an OpenMesh mesh writes: its point buffer as it is, and OpenMesh's connectivity as an index list.
template <class Kernel> Handle hand_over(const Kernel &mesh) {
    std::vector<std::int32_t> indices;
    indices.reserve(3 * mesh.n_faces());
    for (const auto face : mesh.faces()) {
        for (auto v = mesh.cfv_ccwbegin(face); v != mesh.cfv_ccwend(face); ++v) {
            indices.push_back(v->idx());
        }
    }
    ar_mesh_desc desc;
    ar_mesh_desc_init(&desc);
    desc.positions = mesh.points();
    desc.vertex_count = mesh.n_vertices();
    desc.position_stride = sizeof(typename Kernel::Point);
    desc.position_type = std::is_same_v<typename Kernel::Point::value_type, float> ? AR_FLOAT32 : AR_FLOAT64;
    desc.triangles = indices.data();
    desc.face_count = mesh.n_faces();
    desc.index_type = AR_INT32;
    Error error;
    ar_mesh *out = nullptr;
    check(ar_mesh_new(&desc, &out, &error), error);
    return Handle(out);
}

} // namespace

Handle through_openmesh(const shapes::Mesh &mesh, Precision precision) {
    return precision == Precision::single ? hand_over(build<SingleMesh>(mesh)) : hand_over(build<DoubleMesh>(mesh));
}

void openmesh_write(const shapes::Mesh &mesh, const std::filesystem::path &path, bool binary) {
    const OpenMesh::IO::Options how = binary ? OpenMesh::IO::Options::Binary : OpenMesh::IO::Options::Default;
    if (!OpenMesh::IO::write_mesh(build<DoubleMesh>(mesh), path.string(), how)) {
        throw std::runtime_error("OpenMesh could not write " + path.string());
    }
}

Handle openmesh_read(const std::filesystem::path &path) {
    DoubleMesh mesh;
    OpenMesh::IO::Options how;
    if (!OpenMesh::IO::read_mesh(mesh, path.string(), how)) {
        throw std::runtime_error("OpenMesh could not read " + path.string());
    }
    return hand_over(mesh);
}

} // namespace support
