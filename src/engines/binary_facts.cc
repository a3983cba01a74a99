#include "engines/binary_facts.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace assay {
namespace {

using nlohmann::json;

// The widest of which there is more than a trace: some libraries hold a few functions for wider processors too, which
// they choose when they run.
std::string instruction_set(const json& counts) {
  const auto count = [&](const char* name) { return counts.at(name).get<double>(); };
  const double sse = count("scalar") + count("vector"), avx = count("avx"), avx256 = count("avx256");
  const double avx512 = count("avx512"), all = sse + avx + avx256 + avx512;
  if (all == 0) return "none";
  constexpr double kTrace = 0.05;
  const std::string fma = count("fma") > 0 ? ", FMA" : "";
  if (avx512 >= kTrace * all) return "AVX-512" + fma;
  if (avx256 + avx512 >= kTrace * all) return "AVX 256 bit" + fma;
  if (avx + avx256 + avx512 >= kTrace * all) return "AVX 128 bit" + fma;
  const std::string narrow = count("beyond_sse2") > 0.01 * sse ? "SSE4" : "SSE2";
  const double wider = 100 * (all - sse) / all;
  return wider > 0 ? fmt::format("{} ({:.1f} % AVX)", narrow, wider) : narrow;
}

// Shares below half a per cent are left out: error messages and progress bars compute too.
std::string arithmetic(const json& counts) {
  const double one = counts.at("single").get<double>(), two = counts.at("double").get<double>();
  if (one + two == 0) return "none";
  std::vector<std::string> parts;
  std::array<std::pair<const char*, double>, 2> shares = {
      {{"single", one / (one + two)}, {"double", two / (one + two)}}};
  if (shares[1].second > shares[0].second) std::swap(shares[0], shares[1]);
  for (const auto& [name, share] : shares) {
    if (share >= 0.995) return name;
    if (share >= 0.005) parts.push_back(fmt::format("{} {:.0f} %", name, 100 * share));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string checks(const json& assertions) {
  std::vector<std::string> parts = assertions.at("functions").get<std::vector<std::string>>();
  const auto messages = assertions.at("messages").get<long long>();
  if (messages > 0) parts.push_back(fmt::format("{} messages", messages));
  return parts.empty() ? "none" : fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace

json binary_facts(const std::string& plugin_path) {
  std::ifstream file(std::filesystem::path(plugin_path).replace_extension(".json"));
  if (!file) return nullptr;
  try {
    json facts = json::parse(file);
    facts["instruction_set"] = instruction_set(facts.at("counts"));
    facts["arithmetic"] = arithmetic(facts.at("counts"));
    facts["checks"] = checks(facts.at("assertions"));
    return facts;
  } catch (const json::exception&) {
    return nullptr;  // half written, or not this program's
  }
}

}  // namespace assay
