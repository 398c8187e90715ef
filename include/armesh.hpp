/// armesh for C++17: RAII handles, exceptions, containers. Header only, over armesh.h, whose conventions hold here too
/// (what D1, D2 and ratio are, what "vertex" and "face" count, what NaN means); link with the same library.
///
///     armesh::mesh part = armesh::mesh::load("part.stl");
///     part.compute();
///     std::vector<double> ratio = part.vertex_ratio();
///
/// Failures are thrown as armesh::error; after one every object is as it was before. A progress function may throw: the
/// call stops, and what it threw comes out of the call. Needs exceptions, works without RTTI. Const member functions may
/// be called by several threads at once; the others need the object for themselves. Handles are move-only; a moved-from
/// one can be destroyed or assigned to, everything else throws AR_E_NULL.
#ifndef ARMESH_HPP
#define ARMESH_HPP

#include "armesh.h"

#include <array>
#include <cstdint>
#include <cstddef>
#include <exception>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace armesh {

// the layout that the library was built with
static_assert(sizeof(ar_error) == 536 && sizeof(ar_finding) == 40 && sizeof(ar_place) == 32, "layout");
static_assert(sizeof(ar_diagnostics) == 560 && sizeof(ar_summary) == 312, "layout");
static_assert(sizeof(ar_accuracy) == 96, "layout");
static_assert(sizeof(void *) != 8 || (sizeof(ar_mesh_desc) == 112 && sizeof(ar_load_options) == 56), "layout");
static_assert(sizeof(void *) != 8 || sizeof(ar_compute_options) == 80, "layout");

/// What a failed call reports. what() is the message: what is wrong and where.
class error : public std::runtime_error {
public:
  explicit error(const ar_error &e) : std::runtime_error(e.message), status_(e.status), count_(e.count) {
    if (e.first_index != AR_NONE) {
      index_ = e.first_index;
    }
  }
  error(ar_status status, const std::string &message) : std::runtime_error(message), status_(status) {}

  /// One of AR_E_*.
  ar_status status() const noexcept { return status_; }
  /// Name of the status, such as "AR_E_INDEX".
  const char *name() const noexcept { return ar_status_name(status_); }
  /// First offending face or vertex (what() says which), if the failure is about any.
  std::optional<std::uint64_t> index() const noexcept { return index_; }
  /// Number of offending faces or vertices.
  std::uint64_t count() const noexcept { return count_; }

private:
  ar_status status_;
  std::uint64_t count_ = 0;
  std::optional<std::uint64_t> index_;
};

/// Pointer and length of somebody else's array, as std::span in C++20. Converts from arrays and from containers with
/// data() and size().
template <class T>
class view {
public:
  constexpr view() noexcept = default;
  constexpr view(T *data, std::size_t size) noexcept : data_(data), size_(size) {}
  template <std::size_t N>
  constexpr view(T (&array)[N]) noexcept : data_(array), size_(N) {}
  template <class C, class = std::enable_if_t<std::is_convertible_v<
                         std::remove_pointer_t<decltype(std::declval<C &>().data())> (*)[], T (*)[]>>>
  constexpr view(C &&container) noexcept : data_(container.data()), size_(container.size()) {}

  constexpr T *data() const noexcept { return data_; }
  constexpr std::size_t size() const noexcept { return size_; }
  constexpr bool empty() const noexcept { return size_ == 0; }
  constexpr T *begin() const noexcept { return data_; }
  constexpr T *end() const noexcept { return data_ + size_; }
  constexpr T &operator[](std::size_t i) const noexcept { return data_[i]; }

private:
  T *data_ = nullptr;
  std::size_t size_ = 0;
};

/// Which vertices become one (AR_WELD_*).
enum class weld : std::uint32_t { exact = AR_WELD_EXACT, none = AR_WELD_NONE, tolerance = AR_WELD_TOLERANCE };
/// How many distance fields D1 is taken from (AR_D1_*).
enum class d1_method : std::uint32_t { certified = AR_D1_CERTIFIED, all_vertices = AR_D1_ALL_VERTICES };
/// What the numbers are for (AR_PROFILE_*).
enum class profile : std::uint32_t { print = AR_PROFILE_PRINT, paper = AR_PROFILE_PAPER };
/// How D2 is measured (AR_D2_*).
enum class d2_method : std::uint32_t {
  of_profile = AR_D2_PROFILE,
  inscribed = AR_D2_INSCRIBED,
  wall = AR_D2_WALL,
  sdf = AR_D2_SDF
};
/// A result, for histograms and colours.
enum class quantity : std::uint32_t { d1 = AR_D1, d2 = AR_D2, ratio = AR_RATIO };
/// What a call is doing (AR_STAGE_*).
enum class stage : std::uint32_t {
  mesh = AR_STAGE_MESH,
  surface = AR_STAGE_SURFACE,
  thickness = AR_STAGE_THICKNESS,
  factor = AR_STAGE_FACTOR,
  geodesic = AR_STAGE_GEODESIC,
  segment = AR_STAGE_SEGMENT
};

/// Name of a stage, such as "thickness".
inline const char *name(stage s) noexcept { return ar_stage_name(static_cast<std::uint32_t>(s)); }
/// Version of the library, "major.minor.patch".
inline const char *version() noexcept { return ar_version(); }
/// True if the loaded library has the interface that this header describes.
inline bool abi_matches() noexcept { return ar_abi_version() == AR_ABI_VERSION; }

/// Called on the thread that made the call, with the fraction done (0..1, never falling); false cancels.
using progress_function = std::function<bool(double fraction, stage now)>;

namespace detail {

/// An ar_error that throws itself when a call failed.
class outcome {
public:
  outcome() noexcept { ar_error_init(&error_); }
  operator ar_error *() noexcept { return &error_; }
  void check(ar_status status) const {
    if (status == AR_OK) {
      return;
    }
    if (error_.status != status) {
      throw error(status, ar_status_name(status));
    }
    throw error(error_);
  }

private:
  ar_error error_;
};

/// Carries what a progress function threw past the C frames.
struct bridge {
  const progress_function *function;
  std::exception_ptr thrown;

  void check(const outcome &o, ar_status status) const {
    if (thrown) {
      std::rethrow_exception(thrown);
    }
    o.check(status);
  }
};

extern "C" inline std::int32_t armesh_hpp_progress(void *user, double fraction, std::uint32_t now) {
  bridge *b = static_cast<bridge *>(user);
  try {
    return (*b->function)(fraction, static_cast<stage>(now)) ? 0 : 1;
  } catch (...) {
    b->thrown = std::current_exception();
    return 1;
  }
}

struct deleter {
  void operator()(ar_mesh *m) const noexcept { ar_mesh_free(m); }
  void operator()(ar_cancel_token *t) const noexcept { ar_cancel_token_free(t); }
};

template <class T>
constexpr std::uint32_t float_type() {
  using V = std::remove_const_t<T>;
  static_assert(std::is_same_v<V, float> || std::is_same_v<V, double>, "coordinates are float or double");
  return std::is_same_v<V, float> ? AR_FLOAT32 : AR_FLOAT64;
}

template <class T>
constexpr std::uint32_t index_type() {
  static_assert(std::is_integral_v<T> && sizeof(T) == 4, "indices are 32-bit integers");
  return std::is_signed_v<T> ? AR_INT32 : AR_UINT32;
}

} // namespace detail

/// Stops calls from another thread.
class cancel_token {
public:
  cancel_token() {
    ar_cancel_token *made = nullptr;
    detail::outcome o;
    o.check(ar_cancel_token_new(&made, o));
    handle_.reset(made);
  }
  /// Makes calls that were given this token, running or to come, throw AR_E_CANCELLED soon.
  void cancel() const {
    detail::outcome o;
    o.check(ar_cancel_token_cancel(handle_.get(), o));
  }
  /// Makes the token usable again.
  void reset() const {
    detail::outcome o;
    o.check(ar_cancel_token_reset(handle_.get(), o));
  }
  const ar_cancel_token *get() const noexcept { return handle_.get(); }

private:
  std::unique_ptr<ar_cancel_token, detail::deleter> handle_;
};

/// What any long call may use, and how it talks to its caller.
struct run_options {
  /// Threads to work on; 0 = one per core. Results do not depend on it.
  std::uint32_t threads = 0;
  /// Bytes that the call may use at its peak, about; 0 = no limit.
  std::uint64_t memory_budget = 0;
  /// Empty = none.
  progress_function progress = {};
  /// Token that can stop the call; must outlive it. nullptr = none.
  const cancel_token *cancel = nullptr;
};

/// How a mesh is taken in.
struct mesh_options : run_options {
  armesh::weld weld = armesh::weld::exact;
  /// With weld::tolerance: the distance, coordinate units.
  double weld_tolerance = 0.0;
  /// Leave out faces with a vertex that is not finite or does not exist, instead of throwing.
  bool skip_invalid = false;
};

/// How D1 and D2 are computed.
struct compute_options : run_options {
  /// print: on any triangulation; paper: Eqs. 1-13 on the mesh as given.
  armesh::profile profile = armesh::profile::print;
  /// Rays a face; 0 = 20, with d2_method::sdf 25.
  std::uint32_t rays = 0;
  /// Full opening angle of the cone of rays, radians; 0 = 2 pi / 3.
  double cone_angle = 0.0;
  armesh::d2_method d2_method = armesh::d2_method::of_profile;
  /// m in the time step m * h^2 of the heat method; 0 = 1.
  double time_factor = 0.0;
  armesh::d1_method d1_method = armesh::d1_method::certified;
  /// With d1_method::certified: the relative gap at which D1 of a vertex counts as known; 0 = 0.05, paper 0.02.
  double d1_tolerance = 0.0;
};

/// How segment() finds the parts; AR_SEGMENT_* in armesh.h.
enum class segment_method : std::uint32_t {
  creases = AR_SEGMENT_CREASES,
  paper = AR_SEGMENT_PAPER,
  landmarks = AR_SEGMENT_LANDMARKS
};

/// What segment() does; zero means the default documented at ar_segment_options.
struct segment_options : run_options {
  segment_method method = segment_method::creases;
  /// Number of segments; 0 = automatic.
  std::uint32_t count = 0;
  /// AR_CRITERION_*.
  std::uint32_t criterion = AR_CRITERION_CREASES;
  double min_area = 0;
  double alpha = 0, beta = 0, gamma = 0, epsilon = 0;
};

/// What find_features() does; zero means the default documented at ar_feature_options.
struct feature_options : run_options {
  double min_area = 0;
};

/// What features are judged by; at a limit counts. See ar_limits.
struct limits {
  double warn_ratio = 5;
  double error_ratio = 8;
  /// 0 = widths are not judged.
  double min_width = 0;
};

/// Limits of a process, AR_PROCESS_*; widths in millimetres.
inline limits limits_of_process(std::uint32_t process) {
  ar_limits found;
  ar_limits_init(&found);
  detail::outcome o;
  o.check(ar_limits_of_process(process, &found, o));
  return {found.warn_ratio, found.error_ratio, found.min_width};
}

/// What write_features_ply() colours by; AR_COLOUR_*.
enum class colour_by : std::uint32_t {
  feature = AR_COLOUR_FEATURE,
  ratio = AR_COLOUR_RATIO,
  width = AR_COLOUR_WIDTH
};

/// A distribution: share[k] of the vertices have edges[k] <= value < edges[k + 1].
struct histogram {
  std::vector<double> edges;
  std::vector<double> share;
};

/// A checked, welded triangle mesh and the results of the latest successful compute() and segment().
class mesh {
public:
  /// From flat arrays of your own: x, y, z (float or double) and three indices a face (32 bits, signed or not), both a
  /// multiple of three long. Nothing of them is kept.
  template <class Positions, class Triangles>
  static mesh from_arrays(const Positions &xyz, const Triangles &ijk, const mesh_options &options = {}) {
    const view positions(xyz.data(), xyz.size());
    const view triangles(ijk.data(), ijk.size());
    if (positions.size() % 3 != 0 || triangles.size() % 3 != 0) {
      throw error(AR_E_ARGUMENT, "the arrays are not a multiple of three long");
    }
    return from_buffers(positions.data(), positions.size() / 3, 0, triangles.data(), triangles.size() / 3, 0, options);
  }

  /// From buffers with strides in bytes (0 = tight): rows of x, y, z (float or double) and of three 32-bit indices.
  template <class Real, class Index>
  static mesh from_buffers(const Real *positions, std::size_t vertex_count, std::size_t position_stride,
                           const Index *triangles, std::size_t face_count, std::size_t triangle_stride,
                           const mesh_options &options = {}) {
    ar_mesh_desc desc;
    ar_mesh_desc_init(&desc);
    desc.positions = positions;
    desc.vertex_count = vertex_count;
    desc.position_stride = position_stride;
    desc.position_type = detail::float_type<Real>();
    desc.triangles = triangles;
    desc.face_count = face_count;
    desc.triangle_stride = triangle_stride;
    desc.index_type = detail::index_type<Index>();
    return take_in(desc, options, [&](ar_mesh **made, ar_error *e) { return ar_mesh_new(&desc, made, e); });
  }

  /// From an STL, OBJ, PLY or 3MF file.
  static mesh load(const std::string &path, const mesh_options &options = {}) {
    ar_load_options how;
    ar_load_options_init(&how);
    return take_in(how, options, [&](ar_mesh **made, ar_error *e) { return ar_mesh_load(path.c_str(), &how, made, e); });
  }

  /// Computes D1, D2 and ratio of every vertex, which the functions below return.
  void compute(const compute_options &options = {}) {
    run(options, [&](const ar_compute_options *how, ar_error *e) { return ar_compute(handle_.get(), how, e); });
  }

  /// Partitions the mesh into segments and measures them. Needs no compute().
  void segment(const segment_options &options = {}) {
    detail::bridge bridge{&options.progress, nullptr};
    ar_segment_options how;
    ar_segment_options_init(&how);
    set_run(how, options, bridge);
    how.method = static_cast<std::uint32_t>(options.method);
    how.count = options.count;
    how.criterion = options.criterion;
    how.min_area = options.min_area;
    how.alpha = options.alpha;
    how.beta = options.beta;
    how.gamma = options.gamma;
    how.epsilon = options.epsilon;
    detail::outcome o;
    const ar_status status = ar_segment(handle_.get(), &how, o);
    bridge.check(o, status);
  }
  /// Segment of every face, from 0 by falling area; UINT32_MAX for faces that take no part. After segment().
  std::vector<std::uint32_t> face_segment() const { return copy<std::uint32_t, std::uint32_t>(ar_get_face_segment); }
  /// The segments. After segment().
  std::vector<ar_segment_info> segments() const {
    std::vector<ar_segment_info> out(count<ar_segment_info>(ar_get_segments));
    if (!out.empty()) {
      ar_segment_info_init(out.data());
      detail::outcome o;
      o.check(ar_get_segments(handle_.get(), out.data(), out.size(), nullptr, o));
    }
    return out;
  }
  /// The segments that share an edge with one, ascending.
  std::vector<std::uint32_t> segment_neighbours(std::uint32_t segment) const {
    std::size_t n = 0;
    detail::outcome o;
    o.check(ar_get_segment_neighbours(handle_.get(), segment, nullptr, 0, &n, o));
    std::vector<std::uint32_t> out(n);
    detail::outcome again;
    again.check(ar_get_segment_neighbours(handle_.get(), segment, out.data(), n, nullptr, again));
    return out;
  }

  /// Finds and measures the features. Needs neither compute() nor segment().
  void find_features(const feature_options &options = {}) {
    detail::bridge bridge{&options.progress, nullptr};
    ar_feature_options how;
    ar_feature_options_init(&how);
    set_run(how, options, bridge);
    how.min_area = options.min_area;
    detail::outcome o;
    const ar_status status = ar_find_features(handle_.get(), &how, o);
    bridge.check(o, status);
  }
  /// Feature of every face, from 0 by falling area; -1 for faces that take no part. After find_features().
  std::vector<std::int32_t> face_feature() const { return copy<std::int32_t, std::int32_t>(ar_get_face_feature); }
  /// The features, judged. After find_features().
  std::vector<ar_feature_info> features(const armesh::limits &by = {}) const {
    const ar_limits judge = given(by);
    std::size_t n = 0;
    detail::outcome o;
    o.check(ar_get_features(handle_.get(), &judge, nullptr, 0, &n, o));
    std::vector<ar_feature_info> out(n);
    if (n > 0) {
      ar_feature_info_init(out.data());
      detail::outcome again;
      again.check(ar_get_features(handle_.get(), &judge, out.data(), n, nullptr, again));
    }
    return out;
  }
  /// The features as JSON, docs/report-schema.json. After find_features().
  std::string report(const armesh::limits &by = {}) const {
    const ar_limits judge = given(by);
    std::size_t n = 0;
    detail::outcome o;
    o.check(ar_get_report(handle_.get(), &judge, nullptr, 0, &n, o));
    std::string text(n, '\0');
    detail::outcome again;
    again.check(ar_get_report(handle_.get(), &judge, &text[0], n, nullptr, again));
    text.pop_back(); // the NUL
    return text;
  }
  /// Writes the mesh with its faces coloured. After find_features().
  void write_features_ply(const std::string &path, colour_by by = colour_by::feature) const {
    detail::outcome o;
    o.check(ar_features_write_ply(handle_.get(), path.c_str(), static_cast<std::uint32_t>(by), o));
  }

  /// What is wrong with the mesh and where, and how big it is. Needs no compute().
  ar_diagnostics diagnostics() const { return filled<ar_diagnostics>(ar_diagnostics_init, ar_mesh_get_diagnostics); }
  /// The part in a few numbers.
  ar_summary summary() const { return filled<ar_summary>(ar_summary_init, ar_get_summary); }
  /// How right D1 is, and what was left out.
  ar_accuracy accuracy() const { return filled<ar_accuracy>(ar_accuracy_init, ar_get_accuracy); }

  /// Positions of the vertices, coordinate units.
  std::vector<std::array<double, 3>> positions() const {
    return copy<std::array<double, 3>, double>(ar_mesh_get_positions);
  }
  /// Vertices of the faces; UINT32_MAX for those that take no part.
  std::vector<std::array<std::uint32_t, 3>> triangles() const {
    return copy<std::array<std::uint32_t, 3>, std::uint32_t>(ar_mesh_get_triangles);
  }
  /// D1 of every vertex, coordinate units; NaN where undefined.
  std::vector<double> vertex_d1() const { return copy<double, double>(ar_get_vertex_d1); }
  /// Lower and upper bound of D1 of every vertex, coordinate units; NaN where undefined.
  std::pair<std::vector<double>, std::vector<double>> vertex_d1_bounds() const {
    const std::size_t n = count<double>(ar_get_vertex_d1);
    std::pair<std::vector<double>, std::vector<double>> out{std::vector<double>(n), std::vector<double>(n)};
    detail::outcome o;
    std::size_t filled = 0;
    o.check(ar_get_vertex_d1_bounds(handle_.get(), out.first.data(), out.second.data(), n, &filled, o));
    return out;
  }
  /// D2 of every vertex, coordinate units; NaN where undefined.
  std::vector<double> vertex_d2() const { return copy<double, double>(ar_get_vertex_d2); }
  /// D1 / D2 of every vertex; NaN where undefined.
  std::vector<double> vertex_ratio() const { return copy<double, double>(ar_get_vertex_ratio); }
  /// Why a value is NaN: AR_REASON_* bits, 0 where all are numbers.
  std::vector<std::uint32_t> vertex_reason() const { return copy<std::uint32_t, std::uint32_t>(ar_get_vertex_reason); }
  /// The vertex that is D1 away from each; UINT32_MAX where D1 is NaN.
  std::vector<std::uint32_t> vertex_farthest() const {
    return copy<std::uint32_t, std::uint32_t>(ar_get_vertex_farthest);
  }
  /// D2 of every face, coordinate units; NaN where undefined.
  std::vector<double> face_d2() const { return copy<double, double>(ar_get_face_d2); }

  /// Distribution of a result over the welded vertices, in equal bins from its least to its greatest value.
  histogram histogram_of(quantity which, std::size_t bins) const {
    histogram h{std::vector<double>(bins + 1), std::vector<double>(bins)};
    detail::outcome o;
    const auto q = static_cast<std::uint32_t>(which);
    o.check(ar_get_histogram(handle_.get(), q, h.edges.data(), h.share.data(), bins, o));
    return h;
  }

  /// Geodesic distance from `source` to every vertex, coordinate units; NaN in other components. Needs no compute().
  std::vector<double> geodesic_distance(std::uint32_t source, const compute_options &options = {}) const {
    std::vector<double> out(vertex_count());
    run(options, [&](const ar_compute_options *how, ar_error *e) {
      return ar_geodesic_distance(handle_.get(), source, how, out.data(), out.size(), nullptr, e);
    });
    return out;
  }

  /// Writes a binary PLY with d1, d2 and ratio, coloured by one of them.
  void write_ply(const std::string &path, quantity colour = quantity::ratio) const {
    detail::outcome o;
    o.check(ar_mesh_write_ply(handle_.get(), path.c_str(), static_cast<std::uint32_t>(colour), o));
  }

  /// What was odd in the file, a sentence each.
  std::vector<std::string> warnings() const {
    std::vector<std::string> lines;
    std::string line;
    for (char c : copy<char, char>(ar_mesh_get_warnings)) {
      if (c == '\n') {
        lines.push_back(std::exchange(line, {}));
      } else {
        line += c;
      }
    }
    return lines;
  }

  /// Number of vertices: the length of the vertex results.
  std::size_t vertex_count() const { return count<double>(ar_mesh_get_positions); }
  /// Number of faces: the length of the face results.
  std::size_t face_count() const { return count<std::uint32_t>(ar_mesh_get_triangles); }

  /// The handle, for the functions of armesh.h; it stays this object's.
  ar_mesh *get() noexcept { return handle_.get(); }
  const ar_mesh *get() const noexcept { return handle_.get(); }

private:
  template <class T>
  using getter = ar_status (*)(const ar_mesh *, T *, std::size_t, std::size_t *, ar_error *);

  explicit mesh(ar_mesh *handle) noexcept : handle_(handle) {}

  static ar_limits given(const armesh::limits &by) {
    ar_limits judge;
    ar_limits_init(&judge);
    judge.warn_ratio = by.warn_ratio;
    judge.error_ratio = by.error_ratio;
    judge.min_width = by.min_width;
    return judge;
  }

  /// Sets what the option structs of C have in common.
  template <class Options>
  static void set_run(Options &to, const run_options &from, detail::bridge &bridge) {
    to.threads = from.threads;
    to.memory_budget = from.memory_budget;
    to.cancel = from.cancel != nullptr ? from.cancel->get() : nullptr;
    if (from.progress) {
      to.progress = detail::armesh_hpp_progress;
      to.user = &bridge;
    }
  }

  template <class Options, class Make>
  static mesh take_in(Options &how, const mesh_options &options, Make make) {
    detail::bridge bridge{&options.progress, nullptr};
    set_run(how, options, bridge);
    how.flags = options.skip_invalid ? AR_MESH_SKIP_INVALID : 0;
    how.weld = static_cast<std::uint32_t>(options.weld);
    how.weld_tolerance = options.weld_tolerance;
    ar_mesh *made = nullptr;
    detail::outcome o;
    const ar_status status = make(&made, o);
    mesh result(made);
    bridge.check(o, status);
    return result;
  }

  template <class Call>
  static void run(const compute_options &options, Call call) {
    detail::bridge bridge{&options.progress, nullptr};
    ar_compute_options how;
    ar_compute_options_init(&how);
    set_run(how, options, bridge);
    how.profile = static_cast<std::uint32_t>(options.profile);
    how.rays = options.rays;
    how.cone_angle = options.cone_angle;
    how.d2_method = static_cast<std::uint32_t>(options.d2_method);
    how.time_factor = options.time_factor;
    how.d1_method = static_cast<std::uint32_t>(options.d1_method);
    how.d1_tolerance = options.d1_tolerance;
    detail::outcome o;
    const ar_status status = call(&how, o);
    bridge.check(o, status);
  }

  template <class T>
  std::size_t count(getter<T> fill) const {
    std::size_t n = 0;
    detail::outcome o;
    o.check(fill(handle_.get(), nullptr, 0, &n, o));
    return n;
  }

  /// One element of the result is one Element, which is one or more Scalars.
  template <class Element, class Scalar>
  std::vector<Element> copy(getter<Scalar> fill) const {
    static_assert(sizeof(Element) % sizeof(Scalar) == 0, "elements are made of scalars");
    std::vector<Element> out(count(fill));
    detail::outcome o;
    // an element is an array of scalars, so the address of the first is that of its first scalar
    o.check(fill(handle_.get(), reinterpret_cast<Scalar *>(out.data()), out.size(), nullptr, o));
    return out;
  }

  template <class Struct>
  Struct filled(ar_status (*init)(Struct *), ar_status (*fill)(const ar_mesh *, Struct *, ar_error *)) const {
    Struct out;
    init(&out);
    detail::outcome o;
    o.check(fill(handle_.get(), &out, o));
    return out;
  }

  std::unique_ptr<ar_mesh, detail::deleter> handle_;
};

} // namespace armesh

#endif // ARMESH_HPP
