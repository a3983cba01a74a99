#include "store/trajectory.h"

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <sys/stat.h>
#include <type_traits>
#include <unistd.h>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/hash.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

// File: magic, counts of states, bodies and hinges (u64, little-endian as the machines this runs on), then for each
// state its time, 13 numbers a body (position, quaternion w x y z, velocity, angular velocity), angles, rates, all
// double; at the end the content_hash of everything before it.
constexpr std::string_view kMagic = "assay-trajectory-1\n";
constexpr size_t kHashDigits = 32;
constexpr size_t kBodyNumbers = 13;

template <typename T>
void put(std::string& out, T value) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::array<char, sizeof(T)> bytes{};
  std::memcpy(bytes.data(), &value, sizeof(T));
  out.append(bytes.data(), bytes.size());
}

void put(std::string& out, const Vec3& v) {
  for (const double number : {v.x(), v.y(), v.z()}) put(out, number);
}

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}
  size_t left() const { return bytes_.size() - at_; }
  template <typename T>
  T take() {
    T value{};
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  Vec3 take_vec3() {
    const auto x = take<double>(), y = take<double>(), z = take<double>();
    return {x, y, z};
  }

 private:
  std::string_view bytes_;
  size_t at_ = 0;
};

std::string encode(const Trajectory& trajectory) {
  std::string out(kMagic);
  const size_t bodies = trajectory.states.empty() ? 0 : trajectory.states.front().bodies.size();
  const size_t hinges = trajectory.states.empty() ? 0 : trajectory.states.front().position.size();
  out.reserve(out.size() + 64 + trajectory.states.size() * 8 * (1 + kBodyNumbers * bodies + 2 * hinges));
  put<std::uint64_t>(out, trajectory.states.size());
  put<std::uint64_t>(out, bodies);
  put<std::uint64_t>(out, hinges);
  for (const State& state : trajectory.states) {
    put(out, state.time);
    for (const BodyState& body : state.bodies) {
      put(out, body.p_WBcm);
      for (const double number : {body.q_WB.w(), body.q_WB.x(), body.q_WB.y(), body.q_WB.z()}) put(out, number);
      put(out, body.v_WBcm);
      put(out, body.w_WB);
    }
    for (const double angle : state.position) put(out, angle);
    for (const double rate : state.velocity) put(out, rate);
  }
  return out + content_hash(out);
}

std::optional<Trajectory> decode(std::string_view bytes) {
  constexpr size_t kHeader = kMagic.size() + 3 * sizeof(std::uint64_t);
  if (bytes.size() < kHeader + kHashDigits || !bytes.starts_with(kMagic)) return std::nullopt;
  const std::string_view content = bytes.substr(0, bytes.size() - kHashDigits);
  if (content_hash(content) != bytes.substr(content.size())) return std::nullopt;
  Reader reader(content.substr(kMagic.size()));
  const auto count = reader.take<std::uint64_t>(), bodies = reader.take<std::uint64_t>(),
             hinges = reader.take<std::uint64_t>();
  if (reader.left() != count * sizeof(double) * (1 + kBodyNumbers * bodies + 2 * hinges)) return std::nullopt;
  Trajectory trajectory;
  trajectory.states.resize(count);
  for (State& state : trajectory.states) {
    state.time = reader.take<double>();
    state.bodies.resize(bodies);
    for (BodyState& body : state.bodies) {
      body.p_WBcm = reader.take_vec3();
      const auto w = reader.take<double>(), x = reader.take<double>(), y = reader.take<double>(),
                 z = reader.take<double>();
      body.q_WB = Quat(w, x, y, z);
      body.v_WBcm = reader.take_vec3();
      body.w_WB = reader.take_vec3();
    }
    state.position.resize(hinges);
    state.velocity.resize(hinges);
    for (double& angle : state.position) angle = reader.take<double>();
    for (double& rate : state.velocity) rate = reader.take<double>();
  }
  return trajectory;
}

[[noreturn]] void fail(const std::string& what, const std::string& path, int error) {
  throw SystemError(fmt::format("cannot {} '{}': {}", what, path, std::strerror(error)));
}

void write_all(int file, std::string_view bytes, const std::string& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail("write", path, written < 0 ? errno : ENOSPC);
    bytes.remove_prefix(static_cast<size_t>(written));
  }
}

}  // namespace

std::string trajectory_path(const std::string& dir, const std::string& address) { return dir + "/" + address + ".bin"; }

void write_trajectory(const std::string& dir, const std::string& address, const Trajectory& trajectory) {
  std::error_code error;
  fs::create_directories(dir, error);
  if (error) fail("make the directory", dir, error.value());
  const std::string path = trajectory_path(dir, address);
  const std::string temporary = fmt::format("{}.{}.tmp", path, ::getpid());
  const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) fail("write", temporary, errno);
  try {
    write_all(file, encode(trajectory), temporary);
    if (::fsync(file) != 0) fail("write", temporary, errno);
  } catch (...) {
    ::close(file);
    ::unlink(temporary.c_str());
    throw;
  }
  ::close(file);
  if (::rename(temporary.c_str(), path.c_str()) != 0) {
    const int why = errno;
    ::unlink(temporary.c_str());
    fail("write", path, why);
  }
}

std::optional<Trajectory> read_trajectory(const std::string& dir, const std::string& address) {
  const std::string path = trajectory_path(dir, address);
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) {
    if (errno == ENOENT || errno == ENOTDIR) return std::nullopt;
    fail("read", path, errno);
  }
  std::string bytes;
  struct stat facts{};
  if (::fstat(file, &facts) == 0) bytes.reserve(static_cast<size_t>(facts.st_size));
  std::array<char, 1 << 16> buffer{};
  ssize_t got = 0;
  while ((got = ::read(file, buffer.data(), buffer.size())) != 0) {
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      const int why = errno;
      ::close(file);
      fail("read", path, why);
    }
    bytes.append(buffer.data(), static_cast<size_t>(got));
  }
  ::close(file);
  return decode(bytes);
}

bool has_trajectory(const std::string& dir, const std::string& address) {
  return ::access(trajectory_path(dir, address).c_str(), R_OK) == 0;
}

size_t count_states(const std::string& dir, const std::string& address) {
  std::ifstream file(trajectory_path(dir, address), std::ios::binary);
  std::string header(kMagic.size() + sizeof(std::uint64_t), '\0');
  if (!file.read(header.data(), static_cast<std::streamsize>(header.size())) || !header.starts_with(kMagic)) return 0;
  return Reader(std::string_view(header).substr(kMagic.size())).take<std::uint64_t>();
}

}  // namespace assay
