// Shared by the tests: meshes through OpenMesh into armesh by its own buffers, results out, statistics.
#pragma once

#include "shapes.hpp"

#include <armesh.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace support {

struct FreeMesh {
    void operator()(ar_mesh *mesh) const { ar_mesh_free(mesh); }
};
using Handle = std::unique_ptr<ar_mesh, FreeMesh>;

// An ar_error ready for use.
struct Error : ar_error {
    Error() { ar_error_init(this); }
};

// Throws for a failed call that a test did not expect.
void check(ar_status status, const ar_error &error);

// Which of OpenMesh's kernels holds the points.
enum class Precision { single, twice };

// Puts `mesh` into an OpenMesh kernel and hands armesh OpenMesh's own point buffer (float or double) and a face index list.
Handle through_openmesh(const shapes::Mesh &mesh, Precision precision = Precision::twice);

// Hands over shapes::Mesh's buffers (double, uint32), for meshes that OpenMesh does not take (non-manifold, bad indices).
// On failure null, and the details in `error`.
Handle direct(const shapes::Mesh &mesh, ar_error &error, std::uint32_t flags = 0);

// Writes with OpenMesh's own writer; the format by the file's extension. Throws if OpenMesh fails.
void openmesh_write(const shapes::Mesh &mesh, const std::filesystem::path &path, bool binary);
// Reads with OpenMesh's reader and hands over its buffers.
Handle openmesh_read(const std::filesystem::path &path);

struct Field {
    std::vector<double> d1, d2, ratio, face_d2;
    ar_summary summary;
};

// The paper's profile, else defaults.
ar_compute_options options();
// Computes and copies everything out.
Field compute(const Handle &mesh, const ar_compute_options &how = options());
std::vector<double> distance(const Handle &mesh, std::uint32_t source);
ar_diagnostics diagnostics(const Handle &mesh);

// Statistics over the places where both are finite; "relative" is |a - b| / |b|, zeros of b left out.
double rms_relative(const std::vector<double> &a, const std::vector<double> &b); // of the 2-norms
double mean_relative(const std::vector<double> &a, const std::vector<double> &b);
double median_relative(const std::vector<double> &a, const std::vector<double> &b);
double worst_relative(const std::vector<double> &a, const std::vector<double> &b);
double median_quotient(const std::vector<double> &a, const std::vector<double> &b);
double pearson(const std::vector<double> &a, const std::vector<double> &b);
double spearman(const std::vector<double> &a, const std::vector<double> &b);
// Standard deviation over mean.
double variation(const std::vector<double> &a);
double largest(const std::vector<double> &a);
double smallest(const std::vector<double> &a);

// A folder that goes away with the object.
class TemporaryFolder {
  public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder &) = delete;
    TemporaryFolder &operator=(const TemporaryFolder &) = delete;
    // Writes a file and returns its path.
    std::filesystem::path file(const std::string &name, const std::string &content) const;
    std::filesystem::path operator/(const std::string &name) const { return path_ / name; }

  private:
    std::filesystem::path path_;
};

} // namespace support
