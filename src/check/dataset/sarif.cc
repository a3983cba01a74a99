#include "check/dataset/sarif.h"

#include <map>
#include <string_view>

#include <fmt/format.h>

#include "base/build_info.h"
#include "base/hash.h"

namespace assay::dataset {
namespace {

constexpr const char* kRoot = "%SRCROOT%";

const char* level_of(Rank rank) {
  switch (rank) {
    case Rank::kRefused:
      return "error";
    case Rank::kMend:
      return "warning";
    case Rank::kKnow:
      break;
  }
  return "note";
}

Json location_of(const FileReport& report, const Record& record) {
  const std::string uri = uri_of(record.file.empty() ? report.path : record.file);
  Json physical = {{"artifactLocation", {{"uri", uri}, {"uriBaseId", kRoot}}}};
  if (record.line > 0) physical["region"] = {{"startLine", record.line}};
  Json location = {{"physicalLocation", physical}};
  if (!record.element.empty()) {
    Json logical = Json::array();
    logical.push_back({{"fullyQualifiedName", record.element}});
    location["logicalLocations"] = logical;
  }
  return location;
}

}  // namespace

std::string uri_of(const std::string& path) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/";
  std::string uri;
  for (const char c : path) {
    if (kPlain.find(c) != std::string_view::npos) {
      uri += c;
    } else {
      uri += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
  }
  return uri;
}

Json sarif_json(const Report& report) {
  Json rules = Json::array(), results = Json::array();
  std::map<std::string, size_t> rule_of;
  for (const KindCount& each : report.kinds()) {
    rule_of.emplace(each.kind, rules.size());
    rules.push_back({{"id", each.kind},
                     {"shortDescription", {{"text", each.title}}},
                     {"defaultConfiguration", {{"level", level_of(each.worst)}}}});
  }
  for (const FileReport& file : report.files) {
    std::map<std::string, size_t> seen;  // of alike ones the first has the same fingerprint in every run
    for (const Record& record : file.records) {
      const std::string alike = fmt::format("{}\n{}\n{}", file.file, record.kind, record.subject);
      Json locations = Json::array();
      locations.push_back(location_of(file, record));
      Json result = {
          {"ruleId", record.kind},
          {"ruleIndex", rule_of.at(record.kind)},
          {"level", level_of(record.rank)},
          {"message", {{"text", record.message}}},
          {"locations", locations},
          {"partialFingerprints", {{"assayFinding/v1", content_hash(fmt::format("{}\n{}", alike, seen[alike]++))}}}};
      if (report.has_baseline) result["baselineState"] = record.known ? "unchanged" : "new";
      results.push_back(std::move(result));
    }
  }
  const Json driver = {{"name", "assay"}, {"version", kVersion}, {"rules", rules}};
  Json runs = Json::array();
  runs.push_back({{"tool", {{"driver", driver}}}, {"columnKind", "unicodeCodePoints"}, {"results", results}});
  return {{"$schema", "https://json.schemastore.org/sarif-2.1.0.json"}, {"version", "2.1.0"}, {"runs", runs}};
}

}  // namespace assay::dataset
