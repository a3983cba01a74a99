#include "match/folder.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "base/json.h"
#include "base/write_file.h"
#include "campaign/campaign.h"
#include "load/drawing.h"
#include "results/store/facts.h"
#include "run/coordinator/machine.h"
#include "run/coordinator/pool.h"
#include "run/coordinator/rows.h"

namespace assay::match {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string path_in(const MatchQuestion& question, const char* name) {
  return (fs::path(question.out) / name).string();
}

json contenders_json(const MatchQuestion& question) {
  json rows = json::array();
  for (const std::string& name : question.contenders) {
    CampaignContender contender;
    contender.resolved = Registry::instance().resolve(name);
    const ContenderRow row = contender_row(contender);
    rows.push_back({{"name", row.name},
                    {"engine", row.engine},
                    {"version", row.version},
                    {"base", row.base},
                    {"settings", row.settings},
                    {"capabilities", facts_of(row.capabilities_json)},
                    {"build", facts_of(row.build_json)}});
  }
  return rows;
}

// What draws the model; meshes of its file included.
json scene_of_question(const MatchQuestion& question) {
  CampaignSystem system;
  system.name = question.model.name;
  system.model = question.model;
  return json::parse(scene_row(system, read_drawing(question.spec.path, question.spec.load)).json);
}

// Models of contenders that an earlier question in this folder asked, and this one does not: they are no answer to it.
void remove_other_models(const MatchQuestion& question) {
  std::error_code error;
  for (const auto& kept : fs::directory_iterator(path_in(question, "contenders"), error)) {
    const std::string name = kept.path().stem().string();
    if (kept.path().extension() != ".json" ||
        std::ranges::find(question.contenders, name) != question.contenders.end()) {
      continue;
    }
    for (const char* ending : {".xml", ".urdf"}) fs::remove(fs::path(question.out) / "models" / (name + ending), error);
  }
}

}  // namespace

void begin_folder(const MatchQuestion& question) {
  make_own_folder(question.out);
  json facts = json::object();
  for (const ManifestEntry& fact : machine_facts()) facts[fact.key] = fact.value;
  const std::string key = match_key(question);
  facts["question"] = key;
  facts["started"] = date_text(unix_time());
  if (std::ifstream file(path_in(question, kManifestFile)); file) {
    const json earlier = json::parse(file, nullptr, /*allow_exceptions=*/false);
    if (earlier.is_object() && earlier.value("facts", json::object()).value("question", json()) == key) {
      facts["started"] = earlier["facts"].value("started", facts["started"]);
    }
  }
  const json manifest = {{"facts", facts}, {"contenders", contenders_json(question)}};
  write_file(path_in(question, kManifestFile), dump_json(manifest, 1) + "\n");
  write_file(path_in(question, kLogsFile), dump_json(check_json(question.check)) + "\n");
}

std::vector<std::string> write_answer(const MatchQuestion& question, const MatchAnswer& answer) {
  std::vector<std::string> notes;
  if (answer.to_do.empty()) {
    remove_other_models(question);
    notes = write_fitted_models(question, answer, path_in(question, "models"));
    write_motion(question.out, question.model, scene_of_question(question), question.timestep_ms, answer.motion);
  }
  write_file(path_in(question, kAnswerFile), dump_json(match_json(question, answer), 1) + "\n");
  return notes;
}

bool is_match_folder(const std::string& dir) {
  std::error_code error;
  return fs::is_regular_file(fs::path(dir) / kAnswerFile, error) && !fs::exists(fs::path(dir) / "assay.sqlite", error);
}

}  // namespace assay::match
