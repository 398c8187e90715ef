// armesh.hpp in a project of somebody else's: everything it offers is called once, and what it promises is held.
#include <armesh.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#define CHECK(condition)                                                                                               \
  if (!(condition)) {                                                                                                  \
    std::fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition);                                       \
    std::exit(1);                                                                                                      \
  }

template <class Call>
ar_status status_of(Call call) {
  try {
    call();
  } catch (const armesh::error &e) {
    CHECK(std::string(e.what()).size() > 0 && std::string(e.name()).substr(0, 5) == "AR_E_");
    return e.status();
  }
  return AR_OK;
}

static const std::vector<float> xyz{0, 0, 0, 4, 0, 0, 4, 1, 0, 0, 1, 0, 0, 0, 1, 4, 0, 1, 4, 1, 1, 0, 1, 1};
static const std::vector<std::int32_t> ijk{0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                           1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};

static void measures() {
  armesh::mesh part = armesh::mesh::from_arrays(xyz, ijk);
  CHECK(part.vertex_count() == 8 && part.face_count() == 12);
  CHECK(part.positions()[6][0] == 4.0 && part.triangles()[11][2] == 7);
  CHECK(status_of([&] { part.vertex_d1(); }) == AR_E_NOT_COMPUTED);
  std::vector<double> fractions;
  armesh::compute_options options;
  options.threads = 2;
  options.progress = [&](double fraction, armesh::stage now) {
    CHECK(std::string(armesh::name(now)) != "unknown");
    fractions.push_back(fraction);
    return true;
  };
  part.compute(options);
  CHECK(!fractions.empty() && fractions.back() == 1.0);
  const std::vector<double> d1 = part.vertex_d1(), d2 = part.vertex_d2(), ratio = part.vertex_ratio();
  for (std::size_t v = 0; v < 8; v++) {
    CHECK(part.vertex_reason()[v] == 0 && ratio[v] == d1[v] / d2[v]);
    CHECK(part.vertex_farthest()[v] < 8);
  }
  CHECK(part.face_d2().size() == 12);
  const ar_summary s = part.summary();
  CHECK(s.ratio_max == s.d1_max / s.d2_max && s.d1_max >= 4.0);
  const ar_diagnostics d = part.diagnostics();
  CHECK(d.closed == 1 && std::fabs(d.volume - 4.0) < 1e-9 && d.unit == AR_UNIT_UNKNOWN);
  const armesh::histogram h = part.histogram_of(armesh::quantity::d1, 5);
  CHECK(h.edges.size() == 6 && std::fabs(h.share[0] + h.share[1] + h.share[2] + h.share[3] + h.share[4] - 1) < 1e-12);
  const std::vector<double> from0 = part.geodesic_distance(0);
  CHECK(from0[0] == 0.0 && from0[1] > 0.0);
  CHECK(part.warnings().empty());
}

static void files() {
  armesh::mesh part = armesh::mesh::from_arrays(xyz, ijk);
  part.compute();
  part.write_ply("consumer.ply", armesh::quantity::ratio);
  const armesh::mesh again = armesh::mesh::load("consumer.ply");
  CHECK(again.vertex_count() == 8 && again.face_count() == 12);
  CHECK(status_of([] { armesh::mesh::load("there is no such file.stl"); }) == AR_E_IO);
}

static void failures() {
  armesh::mesh part = armesh::mesh::from_arrays(xyz, ijk);
  std::vector<std::int32_t> bad = ijk;
  bad[16] = -3;
  try {
    armesh::mesh::from_arrays(xyz, bad);
    CHECK(false);
  } catch (const armesh::error &e) {
    CHECK(e.status() == AR_E_INDEX && e.index() == 5u && e.count() == 1);
  }
  bad.pop_back();
  CHECK(status_of([&] { armesh::mesh::from_arrays(xyz, bad); }) == AR_E_ARGUMENT);
  // what a progress function throws comes out as it is, and the mesh is as before
  armesh::compute_options options;
  options.progress = [](double, armesh::stage) -> bool { throw std::string("enough"); };
  try {
    part.compute(options);
    CHECK(false);
  } catch (const std::string &text) {
    CHECK(text == "enough");
  }
  options.progress = [](double, armesh::stage) { return false; };
  CHECK(status_of([&] { part.compute(options); }) == AR_E_CANCELLED);
  armesh::mesh moved = std::move(part);
  CHECK(status_of([&] { part.compute(); }) == AR_E_NULL);
  moved.compute();
  CHECK(moved.vertex_d1().size() == 8);
}

static void cancels() {
  armesh::mesh part = armesh::mesh::from_arrays(xyz, ijk);
  armesh::cancel_token token;
  armesh::compute_options options;
  options.cancel = &token;
  std::thread([&] { token.cancel(); }).join();
  CHECK(status_of([&] { part.compute(options); }) == AR_E_CANCELLED);
  token.reset();
  part.compute(options);
}

static void views() {
  double plain[3] = {1, 2, 3};
  std::array<double, 3> array{4, 5, 6};
  const std::vector<double> vector{7, 8};
  armesh::view<const double> v(plain);
  CHECK(v.size() == 3 && v[2] == 3);
  v = array;
  CHECK(v.begin()[1] == 5);
  v = vector;
  CHECK(v.end() - v.begin() == 2);
  armesh::view<double> writable(array);
  writable[0] = 9;
  CHECK(array[0] == 9);
  // rows of a larger struct, by stride
  struct corner {
    double xyz[3];
    unsigned char colour[5];
  };
  std::vector<corner> corners(8);
  for (std::size_t i = 0; i < 24; i++) {
    corners[i / 3].xyz[i % 3] = static_cast<double>(xyz[i]);
  }
  const armesh::mesh part =
      armesh::mesh::from_buffers(corners[0].xyz, 8, sizeof(corner), ijk.data(), ijk.size() / 3, 0);
  CHECK(part.positions()[1][0] == 4.0);
}

int main() {
  CHECK(armesh::abi_matches());
  measures();
  files();
  failures();
  cancels();
  views();
  std::printf("armesh %s: the package works\n", armesh::version());
}
