// D2 by Embree 3: the same rays as armesh's (Eqs. 10-13 of the paper, the cone of src/thickness/cone.rs), one at a time,
// each shortened to what could still make the smallest sphere smaller, and begun with a sphere a little larger than the
// neighbour's, as armesh does.
//
//   embree MESH THREADS RAYS   prints seconds, seconds of processor time, and the mean of D2
//
// MESH is what `peers mesh` writes. Building the tree counts, reading does not: as for armesh.
#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <numeric>
#include <thread>
#include <vector>

namespace {

using Point = std::array<double, 3>;
using Triangle = std::array<std::uint32_t, 3>;

constexpr double PI = 3.14159265358979323846;
constexpr double INF = std::numeric_limits<double>::infinity();
constexpr double GUESS = 1.15;
constexpr std::size_t CHUNK = 256;

Point sub(const Point &a, const Point &b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Point &a, const Point &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point cross(const Point &a, const Point &b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Point unit(const Point &a) {
    const double length = std::sqrt(dot(a, a));
    return {a[0] / length, a[1] / length, a[2] / length};
}

struct Mesh {
    std::vector<Point> points;
    std::vector<Triangle> triangles;
};

bool read(const char *path, Mesh &mesh) {
    std::FILE *file = std::fopen(path, "rb");
    std::uint64_t counts[2] = {};
    if (file == nullptr || std::fread(counts, sizeof counts, 1, file) != 1) {
        return false;
    }
    mesh.points.resize(counts[0]);
    mesh.triangles.resize(counts[1]);
    const bool good = std::fread(mesh.points.data(), sizeof(Point), counts[0], file) == counts[0] &&
                      std::fread(mesh.triangles.data(), sizeof(Triangle), counts[1], file) == counts[1];
    return std::fclose(file) == 0 && good;
}

// Faces along a curve that fills space, so that rays which follow each other are near each other: armesh's order is that
// of its tree.
std::vector<std::uint32_t> along_a_curve(const Mesh &mesh) {
    Point lo = mesh.points[0], hi = lo;
    for (const Point &p : mesh.points) {
        for (int a = 0; a < 3; ++a) {
            lo[a] = std::min(lo[a], p[a]);
            hi[a] = std::max(hi[a], p[a]);
        }
    }
    std::vector<std::uint64_t> key(mesh.triangles.size());
    for (std::size_t f = 0; f < key.size(); ++f) {
        for (int bit = 20; bit-- > 0;) {
            for (int a = 0; a < 3; ++a) {
                double middle = 0;
                for (std::uint32_t v : mesh.triangles[f]) {
                    middle += mesh.points[v][a] / 3;
                }
                const auto cell = static_cast<std::uint64_t>((middle - lo[a]) / (hi[a] - lo[a]) * 1048575.0);
                key[f] = key[f] << 1 | (cell >> bit & 1);
            }
        }
    }
    std::vector<std::uint32_t> order(key.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t f, std::uint32_t g) { return key[f] < key[g]; });
    return order;
}

std::vector<Point> cone(unsigned count) {
    const double cap = 1 - std::cos(PI / 3), golden = PI * (3 - std::sqrt(5.0));
    std::vector<Point> out;
    for (unsigned k = 0; k < count; ++k) {
        const double z = k == 0 ? 1 : 1 - cap * (k + 0.5) / count, r = std::sqrt(std::max(0.0, 1 - z * z));
        out.push_back({r * std::cos(k * golden), r * std::sin(k * golden), z});
    }
    return out;
}

class Tracer {
  public:
    Tracer(const Mesh &mesh, unsigned rays) : mesh_(mesh), cone_(cone(rays)) {
        device_ = rtcNewDevice(nullptr);
        scene_ = rtcNewScene(device_);
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto *to = static_cast<float *>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                3 * sizeof(float), mesh.points.size()));
        for (std::size_t i = 0; i < mesh.points.size(); ++i) {
            for (int a = 0; a < 3; ++a) {
                to[3 * i + a] = static_cast<float>(mesh.points[i][a]);
            }
        }
        void *index = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle),
                                              mesh.triangles.size());
        std::copy(mesh.triangles.begin(), mesh.triangles.end(), static_cast<Triangle *>(index));
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_MEDIUM);
        rtcCommitScene(scene_);
    }
    Tracer(const Tracer &) = delete;
    ~Tracer() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }

    // D2 of some faces one after the other.
    void widths(const std::uint32_t *begin, const std::uint32_t *end, std::vector<double> &out) const {
        double guess = INF;
        for (; begin != end; ++begin) {
            double d = width(*begin, guess);
            if (d == INF && guess < INF) {
                d = width(*begin, INF);
            }
            guess = d * GUESS;
            out[*begin] = d;
        }
    }

  private:
    double width(std::uint32_t face, double reach) const {
        const Triangle &t = mesh_.triangles[face];
        const Point &a = mesh_.points[t[0]], &b = mesh_.points[t[1]], &c = mesh_.points[t[2]];
        const Point n = unit(cross(sub(c, a), sub(b, a))), x = unit(sub(b, a)), y = cross(n, x);
        double best = INF;
        for (const Point &d : cone_) {
            RTCIntersectContext context;
            rtcInitIntersectContext(&context);
            RTCRayHit ray = {};
            ray.ray.org_x = static_cast<float>((a[0] + b[0] + c[0]) / 3);
            ray.ray.org_y = static_cast<float>((a[1] + b[1] + c[1]) / 3);
            ray.ray.org_z = static_cast<float>((a[2] + b[2] + c[2]) / 3);
            ray.ray.dir_x = static_cast<float>(d[0] * x[0] + d[1] * y[0] + d[2] * n[0]);
            ray.ray.dir_y = static_cast<float>(d[0] * x[1] + d[1] * y[1] + d[2] * n[1]);
            ray.ray.dir_z = static_cast<float>(d[0] * x[2] + d[1] * y[2] + d[2] * n[2]);
            ray.ray.tnear = 1e-4f; // single precision: the face itself would be met
            ray.ray.tfar = static_cast<float>(reach * d[2]);
            ray.ray.mask = ~0u;
            ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            rtcIntersect1(scene_, &context, &ray);
            if (ray.hit.geomID != RTC_INVALID_GEOMETRY_ID && ray.ray.tfar / d[2] < best) {
                reach = best = ray.ray.tfar / d[2];
            }
        }
        return best;
    }

    const Mesh &mesh_;
    std::vector<Point> cone_;
    RTCDevice device_;
    RTCScene scene_;
};

} // namespace

int main(int argc, char **argv) {
    Mesh mesh;
    if (argc != 4 || !read(argv[1], mesh)) {
        std::fprintf(stderr, "usage: embree MESH THREADS RAYS\n");
        return 2;
    }
    const auto threads = static_cast<unsigned>(std::atoi(argv[2]));
    const std::vector<std::uint32_t> order = along_a_curve(mesh);
    const auto wall = std::chrono::steady_clock::now();
    const std::clock_t processor = std::clock();
    const Tracer tracer(mesh, static_cast<unsigned>(std::atoi(argv[3])));
    std::vector<double> width(order.size());
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
        for (std::size_t at; (at = next.fetch_add(CHUNK)) < order.size();) {
            tracer.widths(&order[at], order.data() + std::min(at + CHUNK, order.size()), width);
        }
    };
    std::vector<std::thread> others;
    for (unsigned k = 1; k < threads; ++k) {
        others.emplace_back(work);
    }
    work();
    for (std::thread &t : others) {
        t.join();
    }
    std::printf("%.6f %.6f %.9g\n",
                std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count(),
                static_cast<double>(std::clock() - processor) / CLOCKS_PER_SEC,
                std::accumulate(width.begin(), width.end(), 0.0) / static_cast<double>(width.size()));
}
