#include "check/dataset/dataset.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "base/json.h"
#include "check/findings_text.h"

namespace assay::dataset {
namespace {

Json text_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

Json record_json(const Record& record) {
  return {{"level", rank_text(record.rank)},
          {"kind", record.kind},
          {"element", text_or_null(record.element)},
          {"line", line_json(record.line)},
          {"file", text_or_null(record.file)},
          {"message", record.message},
          {"known", record.known}};
}

Json file_json(const FileReport& report) {
  Json findings = Json::array();
  for (const Record& record : report.records) findings.push_back(record_json(record));
  Json model = nullptr;
  if (report.model) {
    model = {{"name", report.model->name},
             {"bodies", report.model->bodies},
             {"dof", report.model->dof},
             {"mass", report.model->mass}};
  }
  return {{"file", report.file},
          {"verdict", report.verdict()},
          {"model", model},
          {"findings", findings},
          {"notes", report.notes},
          {"repairs", report.repairs},
          {"repaired", text_or_null(report.repaired)}};
}

}  // namespace

const char* rank_text(Rank rank) {
  switch (rank) {
    case Rank::kRefused:
      return "refused";
    case Rank::kMend:
      return "mend";
    case Rank::kKnow:
      break;
  }
  return "know";
}

std::optional<Rank> rank_named(std::string_view name) {
  const auto* found = std::ranges::find(kRanks, name, rank_text);
  return found == kRanks.end() ? std::nullopt : std::optional(*found);
}

bool FileReport::has(Rank rank) const { return std::ranges::find(records, rank, &Record::rank) != records.end(); }

const char* FileReport::verdict() const {
  if (has(Rank::kRefused)) return rank_text(Rank::kRefused);
  return has(Rank::kMend) ? rank_text(Rank::kMend) : "ok";
}

bool Report::fails(const Record& record) const { return !record.known && fail_on && record.rank <= *fail_on; }

size_t Report::failing() const {
  size_t count = 0;
  for (const FileReport& each : files) {
    count += static_cast<size_t>(std::ranges::count_if(each.records, [&](const Record& r) { return fails(r); }));
  }
  return count;
}

size_t Report::count(const char* verdict) const {
  return static_cast<size_t>(std::ranges::count_if(
      files, [&](const FileReport& each) { return std::string_view(each.verdict()) == verdict; }));
}

std::vector<KindCount> Report::kinds() const {
  std::map<std::string, KindCount> counts;
  for (const FileReport& each : files) {
    std::set<std::string> seen;
    for (const Record& record : each.records) {
      KindCount& count = counts[record.kind];
      ++count.findings;
      if (!record.known) ++count.fresh;
      if (seen.insert(record.kind).second) ++count.files;
      count.worst = std::min(count.worst, record.rank);
    }
  }
  std::vector<KindCount> sorted;
  for (auto& [kind, count] : counts) {
    const auto title = titles.find(kind);
    count.kind = kind;
    count.title = title == titles.end() ? kind : title->second;
    sorted.push_back(count);
  }
  std::ranges::stable_sort(sorted, {}, &KindCount::worst);
  return sorted;
}

Json report_json(const Report& report) {
  Json files = Json::array(), kinds = Json::array(), included = Json::array(), baseline = nullptr;
  for (const FileReport& each : report.files) files.push_back(file_json(each));
  size_t fresh = 0, findings = 0;
  for (const KindCount& each : report.kinds()) {
    fresh += each.fresh;
    findings += each.findings;
    kinds.push_back({{"kind", each.kind},
                     {"level", rank_text(each.worst)},
                     {"title", each.title},
                     {"findings", each.findings},
                     {"files", each.files},
                     {"new", each.fresh}});
  }
  for (const auto& [file, by] : report.parts) included.push_back({{"file", file}, {"by", text_or_null(by)}});
  if (report.has_baseline) {
    Json gone = Json::array();
    for (const Known& each : report.gone) {
      gone.push_back({{"file", each.file},
                      {"level", rank_text(each.rank)},
                      {"kind", each.kind},
                      {"subject", each.subject},
                      {"count", each.count}});
    }
    baseline = {{"known", findings - fresh}, {"new", fresh}, {"gone", gone}};
  }
  Json not_read = Json::object();
  for (const auto& [ending, count] : report.not_read) not_read[ending] = count;
  return {{"folder", report.folder},
          {"files", files},
          {"kinds", kinds},
          {"not_checked",
           {{"included", included},
            {"other_xml", report.other_xml},
            {"not_read", not_read},
            {"links_out", report.links_out}}},
          {"baseline", baseline},
          {"fail_on", report.fail_on ? Json(rank_text(*report.fail_on)) : Json(nullptr)},
          {"failing", report.failing()}};
}

std::string utf8_text(const std::string& bytes) {
  if (is_utf8(bytes)) return bytes;
  return Json::parse(dump_json(Json(bytes))).get<std::string>();
}

}  // namespace assay::dataset
