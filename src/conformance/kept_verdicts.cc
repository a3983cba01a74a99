#include "conformance/kept_verdicts.h"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>

#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/hash.h"
#include "base/json.h"
#include "base/paths.h"
#include "base/regular_file.h"
#include "base/write_file.h"

namespace assay {

using nlohmann::json;

namespace {

// Of a row: [test, status, figure, tolerance, unit, note, [[timestep, status, figure, tolerance], ...]].
constexpr size_t kResultColumns = 7, kTimestepColumns = 4;

// A file has the hash of its name and of what follows, a line break, and an array of rows. A changed word would leave a
// contender out.
std::string file_text(const std::string& path, const std::vector<ConformanceResult>& results) {
  json kept = json::array();
  for (const ConformanceResult& each : results) {
    json timesteps = json::array();
    for (const TimestepResult& at : each.timesteps) {
      timesteps.push_back({at.timestep, status_text(at.status), at.figure, at.tolerance});
    }
    kept.push_back({each.test, status_text(each.status), each.figure, each.tolerance, each.unit, each.note, timesteps});
  }
  const std::string text = dump_json(kept);
  return content_hash(std::filesystem::path(path).filename().string() + text) + "\n" + text;
}

std::optional<ConformanceStatus> kept_status(const json& text) {
  if (!text.is_string()) return std::nullopt;
  const auto name = text.get<std::string>();
  const ConformanceStatus status = parse_conformance_status(name);
  if (status == ConformanceStatus::kNotRun || status_text(status) != name) return std::nullopt;
  return status;
}

// JSON has no number that is not finite.
std::optional<double> kept_number(const json& number) {
  if (number.is_null()) return std::numeric_limits<double>::quiet_NaN();
  return number.is_number() ? std::optional(number.get<double>()) : std::nullopt;
}

std::optional<TimestepResult> kept_timestep(const json& row) {
  if (!row.is_array() || row.size() != kTimestepColumns || !row[0].is_number()) return std::nullopt;
  const auto status = kept_status(row[1]);
  const auto figure = kept_number(row[2]), tolerance = kept_number(row[3]);
  if (!status || !figure || !tolerance) return std::nullopt;
  return TimestepResult{row[0].get<double>(), *status, *figure, *tolerance};
}

std::optional<ConformanceResult> kept_result(const json& row) {
  if (!row.is_array() || row.size() != kResultColumns || !row[6].is_array()) return std::nullopt;
  if (!row[0].is_string() || !row[4].is_string() || !row[5].is_string()) return std::nullopt;
  const auto status = kept_status(row[1]);
  const auto figure = kept_number(row[2]), tolerance = kept_number(row[3]);
  if (!status || !figure || !tolerance) return std::nullopt;
  ConformanceResult result{row[0].get<std::string>(), *status, *figure, *tolerance, row[4].get<std::string>(),
                           row[5].get<std::string>()};
  for (const json& at : row[6]) {
    const auto timestep = kept_timestep(at);
    if (!timestep) return std::nullopt;
    result.timesteps.push_back(*timestep);
  }
  return result;
}

}  // namespace

std::string kept_verdicts_file(const std::string& folder, const std::string& content, bool long_series) {
  static const std::string program = file_hash(program_path());
  const std::string series = long_series ? "long" : "";
  return (std::filesystem::path(folder) / (content_hash(program + content + series) + ".json")).string();
}

std::vector<ConformanceResult> kept_verdicts(const std::string& path) {
  constexpr std::uintmax_t kMostBytes = 1 << 20;  // some 20 KiB are usual
  const RegularFile file(path);
  std::string text;
  if (file.error() != 0 || !file.other().empty() || file.size() > kMostBytes || file.read(text, kMostBytes) != 0) {
    return {};
  }
  const size_t end = text.find('\n');
  if (end == std::string::npos) return {};
  const std::string content = text.substr(end + 1);
  if (content_hash(std::filesystem::path(path).filename().string() + content) != text.substr(0, end)) return {};
  const json kept = json::parse(content, nullptr, /*allow_exceptions=*/false);
  if (!kept.is_array()) return {};
  std::vector<ConformanceResult> results;
  for (const json& row : kept) {
    auto result = kept_result(row);
    if (!result) return {};
    results.push_back(std::move(*result));
  }
  return results;
}

void keep_verdicts(const std::string& path, const std::vector<ConformanceResult>& results) {
  const bool started = std::ranges::any_of(results, [](const ConformanceResult& each) {
    return each.status == ConformanceStatus::kPass || each.status == ConformanceStatus::kDeviation;
  });
  if (!started) return;
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), error);
  try {
    write_file(path, file_text(path, results));
  } catch (const SystemError&) {  // NOLINT(bugprone-empty-catch): a folder that cannot be written keeps nothing
  }
}

}  // namespace assay
