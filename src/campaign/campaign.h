// A campaign: which systems, contenders, timesteps and measures. Read from a TOML file; campaigns/quick.toml is an
// example, and campaign/keys.h has its keys.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "controls/control.h"
#include "engines/registry.h"
#include "load/load_options.h"
#include "measures/grasp.h"
#include "measures/initial_states.h"
#include "measures/measure.h"
#include "measures/pushes.h"
#include "model/model.h"
#include "model/variant.h"

namespace assay {

struct TimingOptions {
  int rounds = 24;
  int processes = 8;
  double batch_ms = 100;
  int windows = 32;
  int warmup = 5;
  bool common_states = false;
};

struct CampaignContender;

struct CampaignSystem {
  std::string name;
  std::string model_name;  // as the campaign names it
  std::string model_path;
  Model model;  // as measured: changed where the campaign says so
  LoadOptions load;
  ModelVariant variant;
  double duration_s = 0;
  double sample_ms = 0;
  int pieces = 10;
  double piece_ms = 128;               // the main length
  std::vector<double> more_pieces_ms;  // other lengths, as the file lists them
  InitialStates initial_states;
  Pushes pushes;
  double push_sample_ms = 0;  // sample_ms as the campaign has it: reruns may take more samples
  ControlSpec control;
  GraspBodies grasp;
  std::vector<int> worlds;  // of 'batch', ascending
  // What `truth` compares with: the name of a certified solution, the path of a file (.csv), or "" for the reference
  // solution of smooth systems.
  std::string solution;
  std::vector<State> solution_states;    // of a file: its states at the samples, but for the initial one
  std::string solution_hash;             // of a file: its content's
  std::string family;                    // of systems that differ only in size, "" for none
  std::vector<const Measure*> measures;  // in the order of measures()
  std::vector<double> timesteps_ms;      // ascending, the reference's among them where consistency is measured
  std::vector<double> timing_ms;         // ascending
  // Some of timesteps_ms, ascending, for measures with a key of their own for them, by this key.
  std::map<std::string, std::vector<double>, std::less<>> own_timesteps_ms;
  std::vector<int> contenders;  // indices into Campaign::contenders, ascending
  double reference_ms = 1.0 / 64;
  // Index of the contender from whose reference runs 'transfer' tells when others part: the one that the policy was
  // trained in; -1: it does not take part.
  int trained_in = -1;
  int states_of = -1;  // index of the contender whose states all timings start from; -1: each from its own
  double reference_single_ms = 1.0 / 64;  // of contenders in single precision

  bool has(Reads reads) const;  // whether a measure that reads this is measured
  // Those at which the measure has cells, but for cells of fine-step runs.
  const std::vector<double>& timesteps_of(const Measure& measure) const;
  // Timestep of the contender's reference runs, at which it declares to lose no slow motions.
  double reference_of(const CampaignContender& contender) const;
  // Distance of the samples of reference runs, ms: sample_ms, or a part of it that the shortest pieces need.
  double grid_ms() const;
  // The initial state whose run under a policy is kept for replays: the first perturbed one, because a robot at rest
  // may stay there; the model's own where there is no other, or where reference runs are kept anyway.
  int shown_state() const;
};

struct CampaignContender {
  ResolvedContender resolved;  // engine is null when it is absent
  std::map<std::string, std::string> overrides;
  std::string plugin_hash;                 // content address of the adapter's library
  std::string absent;                      // why the contender cannot be run here, "" when it can
  std::optional<AbsentEngine> needs = {};  // the engine that it would take, where that is absent
  bool twin = false;                       // the same as another one: only timed, to show the error of the timing
  std::string varies;                      // the contender of which a sweep made it by other settings; "" when none did

  // Everything that decides what it computes except the timestep, as text; names do not count.
  std::string content() const;
};

// What the campaign's hash and the stored results have in common of a system.
nlohmann::json system_content(const CampaignSystem& system);
// What decides the solution beside the model: a name or a file's content; "" where none is named.
std::string solution_content(const CampaignSystem& system);
// Everything that decides which states they are, but for the model.
nlohmann::json initial_states_content(const InitialStates& states);
// The same of pushes; null for none.
nlohmann::json pushes_content(const Pushes& pushes);

// What a search is to find (run/search/search.h), as written in the file. It does not change what the cells give.
struct SearchTable {
  double minutes = 10;
  std::map<std::string, std::string> limits;  // "error", "penetration", "slip", "realtime": 1mm, 5
  std::vector<std::string> other_limits;      // NAME=QUANTITY
};

struct Campaign {
  std::string name, title;
  std::string source;  // the file
  std::vector<CampaignSystem> systems;
  std::vector<CampaignContender> contenders;  // the campaign's list, then what its systems add
  std::map<std::string, std::string> ratios;  // step time of the first over that of the second; not part of the hash
  TimingOptions timing;
  double time_limit_s = 600;
  long long seed = 1;
  std::optional<SearchTable> search;  // not part of the hash
  std::string device = "cpu";         // of engines that step many worlds: not of the file, nor part of the hash
  std::vector<std::string> notes;     // what a reader should know before it runs: one sentence each

  // Content address of everything that decides which cells there are and what they give: systems by content, contenders
  // with their adapters' builds, timesteps, measures.
  std::string hash() const;
};

// The text of a campaign's file, of at most 4 MiB. Throws InputError.
std::string campaign_text(const std::string& path);

// Reads a campaign's file, loads its models and resolves its contenders. Throws InputError for whatever cannot be used:
// one sentence with file, line, value and the nearest known name. A contender of a known engine that is not installed
// is no error: it is marked as absent.
Campaign load_campaign(const std::string& path, const Registry& registry = Registry::instance());

// The same for text; `source` stands for the file in messages, and relative model paths start from its folder.
Campaign parse_campaign(const std::string& toml, const std::string& source,
                        const Registry& registry = Registry::instance());

}  // namespace assay
