#include "isolate/machine_lack.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <new>
#include <string_view>
#include <sys/resource.h>
#include <system_error>

#include <fmt/format.h>

#include "base/errors.h"

namespace assay {
namespace {

// Errors of system calls that another machine, or the same one at another time, would not give.
constexpr std::array kLacks = {ENOMEM, ENOSPC, EDQUOT, EMFILE, ENFILE, EAGAIN};

// Least memory of a worker (run/coordinator/process.h); a limit below was set by somebody else.
constexpr rlim_t kLeastOfWorker = rlim_t{1} << 30;

rlim_t limit_of(__rlimit_resource resource) {
  rlimit limit{};
  return ::getrlimit(resource, &limit) == 0 ? limit.rlim_cur : RLIM_INFINITY;
}

std::string mebibytes(rlim_t bytes) { return fmt::format("{} MiB", bytes >> 20U); }

bool is_lack(int code) { return std::ranges::find(kLacks, code) != kLacks.end(); }

}  // namespace

std::string inherited_memory_limit() {
  const rlim_t addresses = limit_of(RLIMIT_AS), data = limit_of(RLIMIT_DATA);
  if (addresses != RLIM_INFINITY) return fmt::format("{} of addresses (ulimit -v)", mebibytes(addresses));
  if (data < kLeastOfWorker) return fmt::format("{} of data (ulimit -d)", mebibytes(data));
  return "";
}

std::string machine_lack(const std::exception& error) {
  const std::string limit = inherited_memory_limit();
  if (dynamic_cast<const UnsupportedError*>(&error) != nullptr) return "";
  if (!limit.empty()) return fmt::format("this shell allows {}: {}", limit, error.what());
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) return "no memory was left";
  if (dynamic_cast<const SystemError*>(&error) != nullptr) return error.what();
  if (const auto* system = dynamic_cast<const std::system_error*>(&error)) {
    return is_lack(system->code().value()) ? error.what() : "";
  }
  // Engines and interpreters put the system's sentence into their own errors.
  const std::string_view text = error.what();
  const bool says_so =
      std::ranges::any_of(kLacks, [&](int code) { return text.find(std::strerror(code)) != std::string_view::npos; });
  return says_so ? std::string(text) : "";
}

}  // namespace assay
