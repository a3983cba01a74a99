#include "engines/builds.h"

#include <vector>

#include "base/text.h"

namespace assay {

std::string build_of(std::string_view name) {
  const size_t at = name.rfind('@');
  return at == std::string_view::npos ? kBaseline : std::string(name.substr(at + 1));
}

std::string without_build(std::string_view name) { return std::string(name.substr(0, name.rfind('@'))); }

std::string in_build(const std::string& name, const std::string& build) {
  return build == kBaseline ? name : name + "@" + build;
}

std::string lacking_for(std::string_view build) {
  std::string missing;
#ifdef __x86_64__
  const auto need = [&missing](bool has, const char* feature) {
    if (!has) missing += (missing.empty() ? "" : ", ") + std::string(feature);
  };
  if (build == "v3") {  // x86-64-v3 of the System V ABI, less what every processor with these has
    need(__builtin_cpu_supports("avx2") != 0, "AVX2");
    need(__builtin_cpu_supports("fma") != 0, "FMA");
    need(__builtin_cpu_supports("bmi2") != 0, "BMI2");
  }
#else
  if (build == "v3") missing = "x86-64";
#endif
  return missing;
}

}  // namespace assay
