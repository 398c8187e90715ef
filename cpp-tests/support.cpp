#include "support.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>
#include <random>
#include <stdexcept>

namespace support {
namespace {

template <class T, class Getter> std::vector<T> copy_out(Getter getter, const Handle &mesh) {
    Error error;
    std::size_t count = 0;
    check(getter(mesh.get(), nullptr, 0, &count, &error), error);
    std::vector<T> out(count);
    check(getter(mesh.get(), out.data(), out.size(), &count, &error), error);
    return out;
}

using Pairs = std::vector<std::pair<double, double>>;

Pairs finite(const std::vector<double> &a, const std::vector<double> &b) {
    if (a.size() != b.size()) {
        throw std::runtime_error("two fields of different length");
    }
    Pairs out;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (std::isfinite(a[i]) && std::isfinite(b[i])) {
            out.emplace_back(a[i], b[i]);
        }
    }
    if (out.empty()) {
        throw std::runtime_error("nothing finite to compare");
    }
    return out;
}

std::vector<double> relative(const std::vector<double> &a, const std::vector<double> &b) {
    std::vector<double> out;
    for (const auto &[x, y] : finite(a, b)) {
        if (y != 0) {
            out.push_back(std::fabs(x - y) / std::fabs(y));
        }
    }
    return out;
}

double median(std::vector<double> v) {
    std::nth_element(v.begin(), v.begin() + v.size() / 2, v.end());
    return v[v.size() / 2];
}

double correlation(const Pairs &pairs) {
    double ma = 0, mb = 0, ab = 0, aa = 0, bb = 0;
    for (const auto &[x, y] : pairs) {
        ma += x / pairs.size();
        mb += y / pairs.size();
    }
    for (const auto &[x, y] : pairs) {
        ab += (x - ma) * (y - mb);
        aa += (x - ma) * (x - ma);
        bb += (y - mb) * (y - mb);
    }
    return ab / std::sqrt(aa * bb);
}

// Mean ranks, so that ties do not depend on the order.
std::vector<double> ranks(const std::vector<double> &v) {
    std::vector<std::size_t> order(v.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t k) { return v[i] < v[k]; });
    std::vector<double> out(v.size());
    for (std::size_t i = 0; i < order.size();) {
        std::size_t k = i;
        while (k < order.size() && v[order[k]] == v[order[i]]) {
            ++k;
        }
        for (std::size_t j = i; j < k; ++j) {
            out[order[j]] = 0.5 * (i + k - 1);
        }
        i = k;
    }
    return out;
}

} // namespace

void check(ar_status status, const ar_error &error) {
    if (status != AR_OK) {
        throw std::runtime_error(std::string(ar_status_name(status)) + ": " + error.message);
    }
}

Handle direct(const shapes::Mesh &mesh, ar_error &error, std::uint32_t flags) {
    ar_mesh_desc desc;
    ar_mesh_desc_init(&desc);
    desc.flags = flags;
    desc.positions = mesh.points.data();
    desc.vertex_count = mesh.points.size();
    desc.position_type = AR_FLOAT64;
    desc.triangles = mesh.triangles.data();
    desc.face_count = mesh.triangles.size();
    desc.index_type = AR_UINT32;
    ar_mesh *out = nullptr;
    const ar_status status = ar_mesh_new(&desc, &out, &error);
    if ((status == AR_OK) != (out != nullptr)) {
        throw std::runtime_error("ar_mesh_new: status and handle disagree");
    }
    return Handle(out);
}

ar_compute_options options() {
    ar_compute_options how;
    ar_compute_options_init(&how);
    how.profile = AR_PROFILE_PAPER;
    return how;
}

Field compute(const Handle &mesh, const ar_compute_options &how) {
    Error error;
    check(ar_compute(mesh.get(), &how, &error), error);
    Field out;
    out.d1 = copy_out<double>(ar_get_vertex_d1, mesh);
    out.d2 = copy_out<double>(ar_get_vertex_d2, mesh);
    out.ratio = copy_out<double>(ar_get_vertex_ratio, mesh);
    out.face_d2 = copy_out<double>(ar_get_face_d2, mesh);
    ar_summary_init(&out.summary);
    check(ar_get_summary(mesh.get(), &out.summary, &error), error);
    return out;
}

std::vector<double> distance(const Handle &mesh, std::uint32_t source) {
    Error error;
    std::size_t count = 0;
    check(ar_geodesic_distance(mesh.get(), source, nullptr, nullptr, 0, &count, &error), error);
    std::vector<double> out(count);
    check(ar_geodesic_distance(mesh.get(), source, nullptr, out.data(), out.size(), &count, &error), error);
    return out;
}

ar_diagnostics diagnostics(const Handle &mesh) {
    Error error;
    ar_diagnostics out;
    ar_diagnostics_init(&out);
    check(ar_mesh_get_diagnostics(mesh.get(), &out, &error), error);
    return out;
}

double rms_relative(const std::vector<double> &a, const std::vector<double> &b) {
    double gap = 0, size = 0;
    for (const auto &[x, y] : finite(a, b)) {
        gap += (x - y) * (x - y);
        size += y * y;
    }
    return std::sqrt(gap / size);
}

double mean_relative(const std::vector<double> &a, const std::vector<double> &b) {
    const std::vector<double> r = relative(a, b);
    return std::accumulate(r.begin(), r.end(), 0.0) / static_cast<double>(r.size());
}

double median_relative(const std::vector<double> &a, const std::vector<double> &b) { return median(relative(a, b)); }
double worst_relative(const std::vector<double> &a, const std::vector<double> &b) { return largest(relative(a, b)); }

double median_quotient(const std::vector<double> &a, const std::vector<double> &b) {
    std::vector<double> q;
    for (const auto &[x, y] : finite(a, b)) {
        q.push_back(x / y);
    }
    return median(q);
}

double pearson(const std::vector<double> &a, const std::vector<double> &b) { return correlation(finite(a, b)); }

double spearman(const std::vector<double> &a, const std::vector<double> &b) {
    std::vector<double> x, y;
    for (const auto &[p, q] : finite(a, b)) {
        x.push_back(p);
        y.push_back(q);
    }
    const std::vector<double> rx = ranks(x), ry = ranks(y);
    return correlation(finite(rx, ry));
}

double variation(const std::vector<double> &a) {
    double mean = 0, square = 0;
    for (const auto &[x, _] : finite(a, a)) {
        mean += x / a.size();
    }
    for (const auto &[x, _] : finite(a, a)) {
        square += (x - mean) * (x - mean) / a.size();
    }
    return std::sqrt(square) / mean;
}

double largest(const std::vector<double> &a) { return *std::max_element(a.begin(), a.end()); }
double smallest(const std::vector<double> &a) { return *std::min_element(a.begin(), a.end()); }

TemporaryFolder::TemporaryFolder() {
    std::random_device random;
    path_ = std::filesystem::temp_directory_path() / ("armesh-test-" + std::to_string(random()) + std::to_string(random()));
    std::filesystem::create_directory(path_);
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

std::filesystem::path TemporaryFolder::file(const std::string &name, const std::string &content) const {
    std::ofstream out(path_ / name, std::ios::binary);
    out.write(content.data(), static_cast<std::streamsize>(content.size()));
    if (!out.flush()) {
        throw std::runtime_error("cannot write a test file");
    }
    return path_ / name;
}

} // namespace support
