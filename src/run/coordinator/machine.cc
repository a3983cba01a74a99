#include "run/coordinator/machine.h"

#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>
#include <sys/utsname.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/build_info.h"
#include "isolate/sandbox.h"

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

std::string cpu_value(const std::string& key) { return proc_value("/proc/cpuinfo", key); }

// Virtual machines hide the processor's name behind "Intel(R) Xeon(R) Processor" or "AMD EPYC"; these numbers tell
// which it is.
std::string cpu_model() {
  const std::string vendor = cpu_value("vendor_id"), family = cpu_value("cpu family"), stepping = cpu_value("stepping"),
                    microcode = cpu_value("microcode");
  // the key "model" begins that of the name, too, which comes after it
  const std::string model = cpu_value("model\t");
  if (vendor.empty() || family.empty() || model.empty()) return "";
  return fmt::format("{}, family {}, model {}, stepping {}, microcode {}", vendor, family, model, stepping, microcode);
}

// The widest vectors that it has.
std::string cpu_vectors() {
  const std::string flags = cpu_value("flags") + " ";
  for (const char* name : {"avx512f", "avx2", "avx", "sse4_2"}) {
    if (flags.find(fmt::format(" {} ", name)) != std::string::npos) return name;
  }
  return "";
}

// Whether the clock may rise above the nominal one; "" where the kernel does not say.
std::string turbo() {
  const std::string none = first_line("/sys/devices/system/cpu/intel_pstate/no_turbo");
  if (!none.empty()) return none == "0" ? "on" : "off";
  const std::string boost = first_line("/sys/devices/system/cpu/cpufreq/boost");
  return boost.empty() ? "" : boost == "1" ? "on" : "off";
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
      {"cpu_model", or_unknown(cpu_model())},
      {"cpu_mhz", or_unknown(cpu_value("cpu MHz"))},
      {"cpu_cache", or_unknown(cpu_value("cache size"))},
      {"cpu_vectors", or_unknown(cpu_vectors())},
      {"turbo", or_unknown(turbo())},
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

std::string date_text(double unix_seconds) {
  const auto seconds = static_cast<std::time_t>(unix_seconds);
  std::tm utc{};
  ::gmtime_r(&seconds, &utc);
  return fmt::format("{:04}-{:02}-{:02} {:02}:{:02}:{:02} UTC", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday,
                     utc.tm_hour, utc.tm_min, utc.tm_sec);
}

}  // namespace assay
