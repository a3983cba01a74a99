#include "load/decomposition.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <dlfcn.h>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string_view>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/hash.h"
#include "base/paths.h"
#include "isolate/child.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

// ---- CoACD's C interface: its package has the library without a header ------------------------------------------------

struct CoacdMesh {
  double* vertices;
  std::uint64_t vertex_count;
  int* triangles;
  std::uint64_t triangle_count;
};
struct CoacdMeshes {
  CoacdMesh* meshes;
  std::uint64_t count;
};
using CoacdRun = CoacdMeshes (*)(const CoacdMesh* mesh, double threshold, int most_hulls, int preprocess_mode,
                                 int preprocess_resolution, int resolution, int nodes, int iterations, int depth,
                                 bool pca, bool merge, bool decimate, int most_vertices, bool extrude,
                                 double extrude_margin, int shape, unsigned int seed, bool real_metric);
using CoacdSetLogLevel = void (*)(const char* level);

// Its defaults, but a smaller search, which takes a fifth of the time, and hulls that every engine can take.
constexpr double kThreshold = 0.05;  // concavity, of the mesh's size
constexpr int kAutomatic = 0, kPreprocessResolution = 50, kResolution = 1000, kNodes = 10, kIterations = 30, kDepth = 3;
constexpr int kMostVertices = 64;
constexpr const char* kSettings = ASSAY_COACD " 0.05 16 50 1000 10 30 3 64";  // changes with the numbers above

// ---- bytes ----------------------------------------------------------------------------------------------------------

template <typename T>
void put(std::string& bytes, const T& value) {
  std::array<char, sizeof value> raw;
  std::memcpy(raw.data(), &value, sizeof value);
  bytes.append(raw.data(), raw.size());
}

template <typename T>
bool take(std::string_view& bytes, T& value) {
  if (bytes.size() < sizeof value) return false;
  std::array<char, sizeof value> raw;
  bytes.copy(raw.data(), raw.size());
  std::memcpy(&value, raw.data(), raw.size());
  bytes.remove_prefix(sizeof value);
  return true;
}

std::string bytes_of(const std::vector<Hull>& hulls) {
  std::string bytes;
  put(bytes, hulls.size());
  for (const Hull& hull : hulls) {
    put(bytes, hull.vertices.size());
    put(bytes, hull.faces.size());
    for (const Vec3& p : hull.vertices) {
      for (const double x : p) put(bytes, x);
    }
    for (const auto& face : hull.faces) put(bytes, face);
  }
  return bytes;
}

std::optional<std::vector<Hull>> hulls_of(std::string_view bytes) {
  size_t count = 0;
  if (!take(bytes, count) || count > kMostHulls) return std::nullopt;
  std::vector<Hull> hulls(count);
  for (Hull& hull : hulls) {
    size_t vertices = 0, faces = 0;
    if (!take(bytes, vertices) || !take(bytes, faces) || vertices > bytes.size() || faces > bytes.size()) {
      return std::nullopt;
    }
    hull.vertices.resize(vertices);
    hull.faces.resize(faces);
    for (Vec3& p : hull.vertices) {
      for (double& x : p) {
        if (!take(bytes, x)) return std::nullopt;
      }
    }
    for (auto& face : hull.faces) {
      if (!take(bytes, face)) return std::nullopt;
    }
  }
  return hulls;
}

// ---- the user's cache: the content address of the rest, and the rest --------------------------------------------------

std::string cached(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  const size_t address = content_hash("").size();
  if (bytes.size() < address || content_hash(std::string_view(bytes).substr(address)) != bytes.substr(0, address)) {
    return "";
  }
  return bytes.substr(address);
}

// A cache that cannot be written costs time only.
void keep(const fs::path& file, const std::string& bytes) {
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  const fs::path partial = file.string() + fmt::format(".{}.partial", ::getpid());
  {
    std::ofstream stream(partial, std::ios::binary);
    stream << content_hash(bytes) << bytes;
  }
  fs::rename(partial, file, error);
  fs::remove(partial, error);
}

// ---- a process of its own, because the library brings its own runtime, and a crash of it must be an error --------------

// Writes the hulls' bytes to `out`. The exit status of the child.
int run_coacd(const std::string& library, std::vector<double>& vertices, std::vector<int>& triangles, int out) {
  void* handle = ::dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_DEEPBIND);
  const auto run = handle == nullptr ? nullptr : reinterpret_cast<CoacdRun>(::dlsym(handle, "CoACD_run"));
  const auto set_log_level =
      handle == nullptr ? nullptr : reinterpret_cast<CoacdSetLogLevel>(::dlsym(handle, "CoACD_setLogLevel"));
  if (run == nullptr || set_log_level == nullptr) return 2;
  set_log_level("off");
  const CoacdMesh mesh = {vertices.data(), vertices.size() / 3, triangles.data(), triangles.size() / 3};
  const CoacdMeshes parts = run(&mesh, kThreshold, kMostHulls, kAutomatic, kPreprocessResolution, kResolution, kNodes,
                                kIterations, kDepth, false, true, true, kMostVertices, false, 0.01, 0, 0, false);
  std::vector<Hull> hulls(parts.count);
  for (size_t i = 0; i < hulls.size(); ++i) {
    const CoacdMesh& part = parts.meshes[i];
    for (size_t v = 0; v < part.vertex_count; ++v) {
      const double* p = part.vertices + 3 * v;
      hulls[i].vertices.emplace_back(p[0], p[1], p[2]);
    }
    for (size_t t = 0; t < part.triangle_count; ++t) {
      const int* k = part.triangles + 3 * t;
      hulls[i].faces.push_back({k[0], k[1], k[2]});
    }
  }
  constexpr int kNotSent = 3;
  return write_all(out, bytes_of(hulls)) ? 0 : kNotSent;
}

std::string coacd_bytes(const std::string& library, const std::vector<Vec3>& vertices,
                        const std::vector<std::array<int, 3>>& faces) {
  std::vector<double> points;
  points.reserve(3 * vertices.size());
  for (const Vec3& p : vertices) points.insert(points.end(), p.begin(), p.end());
  std::vector<int> triangles;
  triangles.reserve(3 * faces.size());
  for (const auto& face : faces) triangles.insert(triangles.end(), face.begin(), face.end());

  Pipe pipe = make_pipe();
  const pid_t child = start_child([&] { return run_coacd(library, points, triangles, pipe.writing.get()); });
  pipe.writing.close();
  const std::string bytes = read_to_end(pipe.reading.get());
  const int status = wait_for(child);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0 ? bytes : "";
}

}  // namespace

std::vector<Hull> decomposed(const std::vector<Vec3>& vertices, const std::vector<std::array<int, 3>>& faces) {
  std::string key = kSettings;
  for (const Vec3& p : vertices) {
    for (const double x : p) put(key, x);
  }
  for (const auto& face : faces) put(key, face);
  const fs::path cache = cache_dir();
  const fs::path file = cache / "hulls" / content_hash(key);
  if (auto hulls = hulls_of(cached(file))) return std::move(*hulls);

  const fs::path library = cache / "libraries" / ASSAY_COACD / "coacd" / "lib_coacd.so";
  if (std::error_code error; !fs::exists(library, error)) {
    throw InputError(
        fmt::format("cannot be decomposed, because '{}' is not there; fetch it with setup/setup.sh (Python package: "
                    "assay.fetch()), or leave out --decompose",
                    library.string()));
  }
  const std::string bytes = coacd_bytes(library, vertices, faces);
  auto hulls = hulls_of(bytes);
  if (!hulls || hulls->empty()) {
    throw InputError("cannot be decomposed: CoACD fails with it; close its holes, or leave out --decompose");
  }
  keep(file, bytes);
  return std::move(*hulls);
}

}  // namespace assay
