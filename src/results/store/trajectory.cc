#include "results/store/trajectory.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <limits>
#include <string_view>
#include <type_traits>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/hash.h"
#include "base/regular_file.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

// File: magic, the address (its length as u64, then its bytes), counts of states, bodies and hinges (u64, little-endian
// as the machines this runs on), then for each state its time, 13 numbers a body (position, quaternion w x y z,
// velocity, angular velocity), angles, rates, all double; at the end the content_hash of everything before it. The
// older format has no address.
constexpr std::string_view kMagic = "assay-trajectory-2\n";
constexpr std::string_view kOlderMagic = "assay-trajectory-1\n";
static_assert(kMagic.size() == kOlderMagic.size());
constexpr std::uint64_t kMostBytes = std::uint64_t{4} << 30;  // of a file: what a worker may write
constexpr std::uint64_t kMostAddress = 255;                   // bytes: it is a file's name
constexpr std::uint64_t kMostCount = 1 << 24;                 // bodies and hinges of a model
constexpr size_t kHashDigits = 32;
constexpr size_t kBodyNumbers = 13;
constexpr const char* kOlderFormat = "is of an older format, which does not say whose run it holds";

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

std::string encode(const Trajectory& trajectory, const std::string& address) {
  std::string out(kMagic);
  put<std::uint64_t>(out, address.size());
  out += address;
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

// What stands before the states.
struct Header {
  std::string fault;  // as trajectory_fault()
  bool older = false;
  std::string address;
  std::uint64_t count = 0, bodies = 0, hinges = 0;
  size_t bytes = 0;  // of the file up to the states
};
constexpr size_t kCountBytes = 3 * sizeof(std::uint64_t);
constexpr size_t kMostHeaderBytes = kMagic.size() + sizeof(std::uint64_t) + kMostAddress + kCountBytes;

std::string damaged_fault(const std::string& how) { return fmt::format("is damaged ({})", how); }

// From the first bytes of a file of `size`: whether it can be a trajectory is known before the rest is read.
Header read_header(std::string_view bytes, std::uint64_t size) {
  Header header;
  const auto faulty = [&](const char* how) {
    header.fault = damaged_fault(how);
    return header;
  };
  header.older = bytes.starts_with(kOlderMagic);
  if (!header.older && !bytes.starts_with(kMagic)) return faulty("it does not begin as a trajectory does");
  if (size < kMagic.size() + sizeof(std::uint64_t) + kCountBytes + kHashDigits ||
      bytes.size() < std::min<std::uint64_t>(size, kMostHeaderBytes)) {
    return faulty("it is cut off");
  }
  std::string_view rest = bytes.substr(kMagic.size());
  if (!header.older) {
    const auto length = Reader(rest).take<std::uint64_t>();
    rest.remove_prefix(sizeof(std::uint64_t));
    if (length > kMostAddress || length > rest.size()) return faulty("its address is longer than that of a run");
    header.address = rest.substr(0, length);
    rest.remove_prefix(length);
  }
  if (rest.size() < kCountBytes) return faulty("it is cut off");
  Reader reader(rest);
  header.count = reader.take<std::uint64_t>();
  header.bodies = reader.take<std::uint64_t>();
  header.hinges = reader.take<std::uint64_t>();
  header.bytes = bytes.size() - rest.size() + kCountBytes;
  if (header.bodies > kMostCount || header.hinges > kMostCount) {
    return faulty("it counts more bodies than a model has");
  }
  // Each would take far more memory than its bytes in the file.
  if (header.bodies == 0 && header.count > 0) return faulty("it counts states of no bodies");
  const std::uint64_t state_bytes = sizeof(double) * (1 + kBodyNumbers * header.bodies + 2 * header.hinges);
  const std::uint64_t others = header.bytes + kHashDigits;
  if (size < others || (size - others) / state_bytes != header.count || (size - others) % state_bytes != 0) {
    return faulty("its size is not that of its states");
  }
  return header;
}

// A file's content up to its states.
struct Opened {
  bool is_there = true;
  std::string fault;  // as trajectory_fault()
  Header header;
  std::string bytes;
  std::string_view states() const {
    return std::string_view(bytes).substr(header.bytes, bytes.size() - header.bytes - kHashDigits);
  }
};

Trajectory decode(const Opened& opened) {
  Reader reader(opened.states());
  const Header& header = opened.header;
  Trajectory trajectory;
  trajectory.states.resize(header.count);
  for (State& state : trajectory.states) {
    state.time = reader.take<double>();
    state.bodies.resize(header.bodies);
    for (BodyState& body : state.bodies) {
      body.p_WBcm = reader.take_vec3();
      const auto w = reader.take<double>(), x = reader.take<double>(), y = reader.take<double>(),
                 z = reader.take<double>();
      body.q_WB = Quat(w, x, y, z);
      body.v_WBcm = reader.take_vec3();
      body.w_WB = reader.take_vec3();
    }
    state.position.resize(header.hinges);
    state.velocity.resize(header.hinges);
    for (double& angle : state.position) angle = reader.take<double>();
    for (double& rate : state.velocity) rate = reader.take<double>();
  }
  return trajectory;
}

// What in decoded states cannot be.
std::string states_fault(const Trajectory& trajectory) {
  double time = -std::numeric_limits<double>::infinity();
  for (const State& state : trajectory.states) {
    std::string fault = state_value_fault(state);
    if (fault.empty() && state.time < time) fault = "time that runs backwards";
    if (!fault.empty()) return damaged_fault(fmt::format("it has {}", fault));
    time = state.time;
  }
  return "";
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

Opened open_trajectory(const std::string& dir, const std::string& address) {
  const std::string path = trajectory_path(dir, address);
  const RegularFile file(path);
  Opened opened;
  const auto faulty = [&](std::string fault) {
    opened.fault = std::move(fault);
    return std::move(opened);
  };
  if (file.error() == ENOENT || file.error() == ENOTDIR) {
    opened.is_there = false;
    return opened;
  }
  if (file.error() != 0) fail("read", path, file.error());
  if (!file.other().empty()) return faulty(damaged_fault(fmt::format("it is {} and not a regular file", file.other())));
  if (file.size() > kMostBytes) {
    return faulty(
        damaged_fault(fmt::format("it has {} MiB, and a run at most {}", file.size() >> 20, kMostBytes >> 20)));
  }
  int error = file.read(opened.bytes, kMostHeaderBytes);
  if (error != 0) fail("read", path, error);
  opened.header = read_header(opened.bytes, file.size());
  if (!opened.header.fault.empty()) return faulty(opened.header.fault);
  opened.bytes.reserve(file.size());
  error = file.read(opened.bytes, file.size() - std::min<std::uint64_t>(opened.bytes.size(), file.size()));
  if (error != 0) fail("read", path, error);
  if (opened.bytes.size() != file.size()) return faulty(damaged_fault("it is cut off"));  // meanwhile
  const std::string_view content = std::string_view(opened.bytes).substr(0, opened.bytes.size() - kHashDigits);
  if (content_hash(content) != opened.bytes.substr(content.size()))
    return faulty(damaged_fault("its checksum is wrong"));
  if (opened.header.older) return faulty(kOlderFormat);
  if (opened.header.address != address) return faulty(fmt::format("holds the run {}", opened.header.address));
  return opened;
}

}  // namespace

std::string trajectory_path(const std::string& dir, const std::string& address) { return dir + "/" + address + ".bin"; }

void write_trajectory(const std::string& dir, const std::string& address, const Trajectory& trajectory) {
  std::error_code error;
  fs::create_directories(dir, error);
  if (error) fail("make the directory", dir, error.value());
  const std::string path = trajectory_path(dir, address);
  const std::string temporary = fmt::format("{}.{}.tmp", path, ::getpid());
  ::unlink(temporary.c_str());
  const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (file < 0) fail("write", temporary, errno);
  try {
    write_all(file, encode(trajectory, address), temporary);
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
  const Opened opened = open_trajectory(dir, address);
  if (!opened.is_there) return std::nullopt;
  if (!opened.fault.empty() && opened.fault != kOlderFormat) return std::nullopt;
  Trajectory trajectory = decode(opened);
  if (!states_fault(trajectory).empty()) return std::nullopt;
  return trajectory;
}

std::string trajectory_fault(const std::string& dir, const std::string& address) {
  const Opened opened = open_trajectory(dir, address);
  if (!opened.is_there) return "";
  return opened.fault.empty() ? states_fault(decode(opened)) : opened.fault;
}

std::string run_fault(const Trajectory& trajectory, size_t bodies, std::optional<size_t> joints) {
  constexpr double kLeastStep = 1e-9, kLatest = 1e9;  // s; readers divide by the one, and count steps up to the other
  const std::vector<State>& states = trajectory.states;
  if (states.empty()) return "has no states";
  for (const State& state : states) {
    const size_t own = state.position.size();
    if (!state_shape_fault(state, bodies, joints.value_or(own)).empty()) return "is another system's";
    if (std::abs(state.time) > kLatest) return "has times that no run reaches";
  }
  for (size_t i = 1; i < states.size(); ++i) {
    if (states[i].time - states[i - 1].time < kLeastStep) return "has times that do not increase";
  }
  return "";
}

std::optional<Trajectory> read_run(const std::string& dir, const std::string& address, size_t bodies,
                                   std::optional<size_t> joints) {
  auto trajectory = read_trajectory(dir, address);
  if (!trajectory || !run_fault(*trajectory, bodies, joints).empty()) return std::nullopt;
  return trajectory;
}

bool has_trajectory(const std::string& dir, const std::string& address) {
  return ::access(trajectory_path(dir, address).c_str(), R_OK) == 0;
}

size_t count_states(const std::string& dir, const std::string& address) {
  const RegularFile file(trajectory_path(dir, address));
  std::string bytes;
  if (file.error() != 0 || !file.other().empty() || file.read(bytes, kMostHeaderBytes) != 0) return 0;
  const Header header = read_header(bytes, file.size());
  return !header.fault.empty() || (!header.older && header.address != address) ? 0 : header.count;
}

}  // namespace assay
