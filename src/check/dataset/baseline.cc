#include "check/dataset/baseline.h"

#include <cstdint>
#include <exception>
#include <optional>
#include <tuple>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/json.h"

namespace assay::dataset {
namespace {

constexpr const char* kFormat = "assay check baseline";
constexpr int kFormatVersion = 1;
constexpr std::uintmax_t kMostBytes = std::uintmax_t{256} << 20;
constexpr const char* kMakeOne = "make one with assay check DIR --write-baseline FILE";

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw InputError(fmt::format("--baseline '{}' {}; {}", path, why, kMakeOne));
}

Known known_of(const Json& json, const std::string& path, size_t number) {
  const auto text = [&](const char* key) {
    const auto found = json.is_object() ? json.find(key) : json.end();
    if (found == json.end() || !found->is_string()) {
      refuse(path, fmt::format("has a finding ({}) without the text '{}'", number, key));
    }
    return found->get<std::string>();
  };
  Known known = {.file = text("file"), .kind = text("kind"), .subject = text("subject")};
  const std::string level = text("level");
  const std::optional<Rank> rank = rank_named(level);
  if (!rank) refuse(path, fmt::format("has a finding ({}) of level '{}', not refused, mend or know", number, level));
  known.rank = *rank;
  if (const auto count = json.find("count"); count != json.end()) {
    if (!count->is_number_unsigned() || count->get<size_t>() == 0) {
      refuse(path, fmt::format("has a finding ({}) with a 'count' that is no whole number from 1", number));
    }
    known.count = count->get<size_t>();
  }
  return known;
}

}  // namespace

Baseline Baseline::read(const std::string& path) {
  return parse(input_file(path, "the baseline", "a file of --write-baseline", kMostBytes), path);
}

Baseline Baseline::parse(const std::string& text, const std::string& path) {
  const Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) refuse(path, "is not JSON");
  if (!json.is_object() || json.value("format", Json()) != kFormat) refuse(path, "is no baseline");
  const auto version = json.find("version");
  if (version == json.end() || !version->is_number_integer()) refuse(path, "has no 'version'");
  if (version->get<long long>() > kFormatVersion) {
    throw InputError(
        fmt::format("--baseline '{}' has version {} of the format, and this assay reads version {}: use a "
                    "newer assay, or write it again with --write-baseline",
                    path, version->get<long long>(), kFormatVersion));
  }
  const auto findings = json.find("findings");
  if (findings == json.end() || !findings->is_array()) refuse(path, "has no list of 'findings'");
  Baseline baseline;
  size_t number = 0;
  for (const Json& each : *findings) {
    const Known known = known_of(each, path, ++number);
    baseline.files_[known.file][{known.kind, known.subject}][known.rank] += known.count;
  }
  return baseline;
}

void Baseline::mark(FileReport& report) {
  const auto file = files_.find(report.file);
  if (file == files_.end()) return;
  met_ = true;
  // the worst come first, and each takes the mildest that is no milder than itself
  for (Record& record : report.records) {
    const auto same = file->second.find({record.kind, record.subject});
    if (same == file->second.end()) continue;
    std::map<Rank, size_t>& counts = same->second;
    auto rank = counts.upper_bound(record.rank);
    while (rank != counts.begin()) {
      if ((--rank)->second == 0) continue;
      --rank->second;
      record.known = true;
      break;
    }
  }
}

std::vector<Known> Baseline::left() const {
  std::vector<Known> found;
  for (const auto& [file, findings] : files_) {
    for (const auto& [key, counts] : findings) {
      for (const auto& [rank, count] : counts) {
        if (count > 0) {
          found.push_back({.file = file, .rank = rank, .kind = key.first, .subject = key.second, .count = count});
        }
      }
    }
  }
  return found;
}

std::string baseline_text(const std::vector<FileReport>& files) {
  std::map<std::tuple<std::string, Rank, std::string, std::string>, size_t> counts;
  for (const FileReport& report : files) {
    for (const Record& record : report.records) {
      ++counts[{report.file, record.rank, record.kind, record.subject}];
    }
  }
  std::string text = fmt::format("{{\n  \"format\": {},\n  \"version\": {},\n  \"findings\": [",
                                 dump_json(Json(kFormat)), kFormatVersion);
  bool first = true;
  for (const auto& [key, count] : counts) {
    const auto& [file, rank, kind, subject] = key;
    Json finding = {{"file", file}, {"level", rank_text(rank)}, {"kind", kind}, {"subject", subject}};
    if (count > 1) finding["count"] = count;
    text += fmt::format("{}\n    {}", first ? "" : ",", dump_json(finding));
    first = false;
  }
  return text + (first ? "]\n}\n" : "\n  ]\n}\n");
}

}  // namespace assay::dataset
