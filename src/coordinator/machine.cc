#include "coordinator/machine.h"

#include <cstdlib>
#include <fstream>
#include <string>
#include <sys/utsname.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/build_info.h"
#include "base/sandbox.h"

namespace assay {
namespace {

std::string first_line(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

// The value of the first "key : value" line of a file of /proc.
std::string proc_value(const std::string& path, const std::string& key) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with(key)) continue;
    const size_t colon = line.find(':');
    const size_t start = colon == std::string::npos ? colon : line.find_first_not_of(" \t", colon + 1);
    if (start != std::string::npos) return line.substr(start);
  }
  return "";
}

std::string or_unknown(const std::string& text) { return text.empty() ? std::string("unknown") : text; }

}  // namespace

std::vector<ManifestEntry> machine_facts() {
  utsname system{};
  ::uname(&system);
  const std::string governor = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  const bool hypervisor = proc_value("/proc/cpuinfo", "flags").find(" hypervisor") != std::string::npos;
  return {
      {"cpu", or_unknown(proc_value("/proc/cpuinfo", "model name"))},
      {"cores", std::to_string(::sysconf(_SC_NPROCESSORS_ONLN))},
      {"governor", governor.empty() ? "unknown" : governor},
      {"virtual_machine", hypervisor ? "yes" : "no"},
      {"memory", or_unknown(proc_value("/proc/meminfo", "MemTotal"))},
      {"kernel", fmt::format("{} {} {}", system.sysname, system.release, system.machine)},
      {"sandbox", offered_sandbox().text()},
      {"assay_version", kVersion},
      {"commit", kGitCommit},
      {"compiler", ASSAY_BUILD_COMPILER},
      {"flags", ASSAY_BUILD_FLAGS},
      {"build_type", ASSAY_BUILD_TYPE},
  };
}

std::string node_name() {
  for (const char* variable : {"ASSAY_NODE", "SLURMD_NODENAME", "NODE_NAME"}) {
    const char* name = std::getenv(variable);
    if (name != nullptr && *name != '\0') return name;
  }
  utsname system{};
  ::uname(&system);
  return or_unknown(system.nodename);
}

}  // namespace assay
