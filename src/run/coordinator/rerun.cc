#include "run/coordinator/rerun.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/external_files.h"
#include "base/hash.h"
#include "base/json.h"
#include "base/paths.h"
#include "base/text.h"
#include "engines/registry.h"
#include "load/mjcf.h"
#include "results/store/scene.h"
#include "run/coordinator/pool.h"
#include "run/coordinator/subject.h"
#include "run/coordinator/temporary_folder.h"

namespace assay {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

template <typename Row>
const Row& row_named(const std::vector<Row>& rows, const std::string& name, std::string Row::* key, const char* what) {
  const auto found = std::ranges::find(rows, name, key);
  if (found != rows.end()) return *found;
  std::vector<std::string> names;
  names.reserve(rows.size());
  for (const Row& row : rows) names.push_back(row.*key);
  throw InputError(fmt::format("the results have no {} '{}'{}", what, name, did_you_mean(name, names)));
}

bool is_whole(double ratio) { return std::abs(ratio - std::round(ratio)) <= 1e-9 * ratio && std::round(ratio) >= 1; }

// What `work` makes of the stored facts of a system.
template <typename Work>
auto with_facts(const Store& store, const std::string& system, const Work& work) {
  const std::vector<SystemRow> rows = store.systems();
  const SystemRow& row = row_named(rows, system, &SystemRow::name, "system");
  try {
    return work(json::parse(row.json));
  } catch (const json::exception& error) {
    throw InputError(
        fmt::format("the results describe the system '{}' in a way that this assay cannot read ({}): "
                    "measure it again",
                    system, error.what()));
  }
}

double sample_ms_of(const Store& store, const std::string& system) {
  return with_facts(store, system, [](const json& facts) { return facts.at("sample_ms").get<double>(); });
}

// The system as the campaign had it.
CampaignSystem system_of(const Store& store, const std::string& name, const json& facts) {
  const std::vector<SceneRow> scenes = store.scenes();
  const Scene scene = parse_scene(row_named(scenes, name, &SceneRow::system, "scene of the system").json);
  // A robot's results hold their campaign, which knows where its model is.
  if (const fs::path own = fs::path(store.trajectories_dir()).parent_path() / "campaign.toml"; fs::exists(own)) {
    for (CampaignSystem& system : load_campaign(own.string()).systems) {
      if (system.name == name && system.model.hash == facts.at("model_hash").get<std::string>()) {
        return std::move(system);
      }
    }
  }
  CampaignSystem system;
  system.name = name;
  system.duration_s = facts.at("duration_s");
  system.sample_ms = facts.at("sample_ms");
  system.control = scene.control;
  // A system that comes with assay is found by its name, another one by its file in the current folder.
  const std::string file = facts.at("model");
  const std::string stem = fs::path(file).stem().string();
  const std::vector<std::string> known = system_names();
  std::string found = "./" + file;
  if (std::ranges::find(known, stem) != known.end() || capsules_named(stem)) {
    found = stem;
  } else if (file.starts_with("robots:")) {
    found = file;
  }
  system.model_path = find_model(found);
  if (const auto states = facts.find("initial_states"); states != facts.end()) {
    system.initial_states.count = states->at("count");
    system.initial_states.seed = states->at("seed");
    for (const PerturbationPart& part : kPerturbationParts) {
      system.initial_states.around.*part.member = states->at(part.name).get<double>();
    }
  }
  if (const auto push = facts.find("push"); push != facts.end()) {
    system.pushes = {push->at("velocity"), push->at("every_s"), push->at("joint"), push->at("seed")};
  }
  system.push_sample_ms = system.sample_ms;
  if (const auto load = facts.find("load"); load != facts.end()) {
    visit_load_fields(system.load, [&](const LoadField& field, auto& value) {
      if (const auto stored = load->find(field.key); stored != load->end()) stored->get_to(value);
    });
    system.load.allow_external_files = system.load.allow_external_files && agreed_to_external_files();
  }
  system.model = load_model(system.model_path, system.load);
  ModelVariant& variant = system.variant;
  variant.contacts = facts.at("contacts");
  variant.smooth = facts.value("smooth", variant.smooth);
  variant.above_ground_m = facts.value("above_ground_m", variant.above_ground_m);
  variant.start_rates = facts.value("start_rates", variant.start_rates);
  for (const json& pair : facts.value("exclude", json::array())) variant.exclude.push_back({pair.at(0), pair.at(1)});
  const json& g = facts.at("gravity");
  const bool weightless = Vec3(g.at(0).get<double>(), g.at(1).get<double>(), g.at(2).get<double>()).isZero(0);
  variant.gravity = !weightless || system.model.gravity.isZero(0);
  system.model = variant_of(std::move(system.model), variant);
  if (system.model.hash != facts.at("model_hash").get<std::string>()) {
    throw InputError(
        fmt::format("'{}' is not the model that '{}' was measured with: put that one back, or measure it again",
                    system.model_path, name));
  }
  return system;
}

// The contender with its stored settings, on the engine as it is installed now.
CampaignContender contender_of(const std::vector<ContenderRow>& rows, const std::string& name) {
  const ContenderRow& row = row_named(rows, name, &ContenderRow::name, "contender");
  CampaignContender contender;
  for (const SettingChange& change : row.changes) contender.overrides[change.setting] = change.value;
  contender.resolved = Registry::instance().resolve(row.base, contender.overrides);
  contender.resolved.name = name;
  if (const std::string now = settings_text(*contender.resolved.engine, contender.resolved.settings);
      now != row.settings) {
    throw InputError(fmt::format("'{}' was measured with the settings '{}' and has '{}' here: leave it out", name,
                                 row.settings, now));
  }
  return contender;
}

}  // namespace

CampaignSystem stored_system(const Store& store, const std::string& system) {
  return with_facts(store, system, [&](const json& facts) { return system_of(store, system, facts); });
}

CampaignContender stored_contender(const Store& store, const std::string& name) {
  return contender_of(store.contenders(), name);
}

bool fits_samples(const Store& store, const std::string& system, double timestep_ms) {
  return is_whole(sample_ms_of(store, system) / timestep_ms);
}

size_t keep_runs(Store& store, const std::string& system, const std::vector<std::string>& contenders,
                 double timestep_ms, const std::function<void(size_t)>& progress) {
  std::vector<RunRow> rows = store.runs();
  const auto same = [&](const RunRow& row, const std::string& contender) {
    return row.system == system && row.contender == contender && same_timestep(row.timestep_ms, timestep_ms);
  };
  std::vector<std::string> missing;
  for (const std::string& contender : contenders) {
    const auto found = std::ranges::find_if(rows, [&](const RunRow& row) { return same(row, contender); });
    if (found != rows.end() && has_trajectory(store.trajectories_dir(), found->address)) continue;
    if (found != rows.end()) rows.erase(found);
    missing.push_back(contender);
  }
  if (missing.empty()) return 0;
  const double sample_ms = sample_ms_of(store, system);
  const std::string facts = row_named(store.systems(), system, &SystemRow::name, "system").json;
  const std::vector<ContenderRow> described = store.contenders();
  size_t added = 0;
  for (const Rerun& rerun : run_again(store, system, missing, timestep_ms, sample_ms, progress)) {
    if (!rerun.trajectory || rerun.trajectory->states.size() < 2) continue;
    const ContenderRow& contender = row_named(described, rerun.contender, &ContenderRow::name, "contender");
    const json content = {{"kept", 1},
                          {"system", facts},
                          {"contender", {contender.base, contender.settings, contender.build_json}},
                          {"timestep_ms", timestep_ms}};
    const std::string address = content_hash(dump_json(content));
    write_trajectory(store.trajectories_dir(), address, *rerun.trajectory);
    rows.push_back({address, system, rerun.contender, timestep_ms});
    ++added;
  }
  store.set_runs(rows);
  return added;
}

double finer_sample_ms(const Store& store, const std::string& system, double timestep_ms, double most_ms) {
  double sample_ms = sample_ms_of(store, system);
  if (!is_whole(sample_ms / timestep_ms)) {
    throw InputError(
        fmt::format("--timestep is {} ms, of which the {} ms between two states of '{}' are no whole "
                    "number: use a timestep that divides them",
                    timestep_label(timestep_ms), timestep_label(sample_ms), system));
  }
  while (sample_ms > most_ms && is_whole(sample_ms / 2 / timestep_ms)) sample_ms /= 2;
  return sample_ms;
}

std::vector<Rerun> run_again(const Store& store, const std::string& system, const std::vector<std::string>& contenders,
                             double timestep_ms, double sample_ms, const std::function<void(size_t)>& progress) {
  CampaignSystem described = stored_system(store, system);
  described.sample_ms = sample_ms;
  // the start of the runs that are kept
  const int shown = with_facts(store, system, [](const json& facts) { return facts.value("shown_state", 0); });
  const std::vector<ContenderRow> rows = store.contenders();
  const TemporaryFolder folder;
  std::vector<Rerun> reruns(contenders.size());
  const Interrupts interrupts;
  Pool pool(program_path(), static_cast<int>(std::max(1U, std::thread::hardware_concurrency())), interrupts);
  size_t done = 0;
  for (size_t i = 0; i < contenders.size(); ++i) {
    reruns[i].contender = contenders[i];
    reruns[i].failure = "was not run";
    Job job;
    const std::string address = fmt::format("{}", i);
    RunJob run;
    run.subject = subject_spec(described, contender_of(rows, contenders[i]));
    run.timestep_ms = timestep_ms;
    run.measures = {kFineRunCell};
    run.state = shown;
    run.trajectories = folder.path();
    run.save = address;
    run.partial = true;
    job.request = std::move(run);
    job.title = contenders[i];
    job.cost = 1;
    job.on_end = [&, i, address](const JobEnd& end) {
      Rerun& rerun = reruns[i];
      const auto [outcome, reason] = end.result(kFineRunCell).ending;
      const bool ended = outcome == Outcome::kOk || outcome == Outcome::kUnstable;
      rerun.failure = ended ? "" : fmt::format("{} {}", outcome_text(outcome), reason);
      rerun.trajectory = read_trajectory(folder.path(), address);
      if (progress) progress(++done);
    };
    pool.add(std::move(job));
  }
  pool.run({});
  return reruns;
}

}  // namespace assay
