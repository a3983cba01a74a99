// A campaign: which systems, contenders, timesteps and measures. Read from a TOML file (campaigns/quick.toml is
// an example).
//
//   name = "quick"
//   title = "..."                                  # optional
//   contenders = ["mujoco-euler", "A", "ode-*"]    # names of contenders or of the tables below, or patterns (* and ?)
//                                                  # that match contenders of the installed engines
//   timesteps_ms = ["1/64", "1/4", 1, 4]           # numbers, or fractions as text
//   reference_ms = "1/64"                          # timestep of the reference runs; default 1/64
//   reference_single_ms = "1/16"                   # the same of contenders in single precision; default: as above.
//                                                  # A contender that declares a longer finest timestep has the next of
//                                                  # timesteps_ms
//   measures = ["raw_speed", "consistency"]        # raw_speed, consistency, truth, drift, violation, grasp, agreement,
//                                                  # scaling, transfer, batch
//   time_limit_s = 600                             # of one cell (isolate/time_limit.h); default 600
//   seed = 1                                       # order of the contenders within a timing round, bootstrap
//
//   [timing]                                       # all optional
//   rounds = 24                                    # in each of which every contender is measured once
//   processes = 8                                  # of a contender; each measures a row of rounds
//   batch_ms = 100                                 # time in the engine's steps of a turn, in the mean over contenders
//   windows = 32                                   # parts of the run that all contenders time
//   warmup = 5                                     # untimed steps behind a saved state
//   states = "own"                                 # where windows start: in states of each contender's own run at the
//                                                  # timed timestep, or "common": of one contender's fine-step run
//   states_of = "mujoco-euler"                     # which; default: the system's first one in joint coordinates
//   twins = ["mujoco-euler"]                       # contenders that are timed twice, under NAME and NAME-twin
//
//   [search]                                       # optional: measures only what can still win, the rest never
//   minutes = 10                                   # the budget
//   error = "1mm"                                  # limits, all optional: error, penetration, slip, realtime
//   realtime = "5"
//   limits = ["joint_dislocation=0.1mm"]           # of any error
//
//   [[system]]
//   name = "planar-chain"
//   model = "planar-chain"                         # a system that comes with assay, or a file; default: the name
//   duration_s = 2                                 # a whole number of samples
//   sample_ms = 16                                 # distance of the states that drift reads; default: largest timestep
//   pieces = 10                                    # consistency; default 10
//   piece_ms = 128                                 # default 128; or a list: the main length first, and others, whose
//                                                  # values have the length in their names
//   initial_states = 20                            # consistency, violation, drift and grasp start from this many: the
//                                                  # model's own and seeded ones around it; default 1
//   perturbation = {joint_rate = 0.5}              # how far around it (measures/initial_states.h), all optional
//   push = {velocity = 0.5, every_s = 3}           # for 'transfer': pushes of the free body (measures/pushes.h), or of
//                                                  # joint = "slider"; seed = 1
//   control = "passive"                            # or {kind = "sine", amplitude = 2, frequency = 1}; default: passive
//                                                  # "actuators": the model's own, with their sines (load/mjcf.h)
//                                                  # "hold", "random" or {kind = "random", seed = 2, motion = 0.3}
//                                                  # {kind = "file", path = "torques.csv"}, from the campaign's folder
//   grasp = {object = "capsule", hand = "palm"}    # for 'grasp': bodies; drop_m = 0.1: how far the object may slip
//   worlds = [1, 16, 256]                          # for 'batch': how many at once; they start around moments of
//                                                  # the contender's own run, as 'perturbation' says
//   family = "capsules"                            # for 'scaling': systems that differ only in size
//   floating_base = true                           # how the model's file is read, as the options of `assay check`:
//   ground = true                                  # floating_base, fixed_base, ground, no_ground, within_limits,
//   keyframe = "home"                              # decompose, drop_unsupported, repair, keyframe, qpos = "pose.txt",
//                                                  # packages = {my_robot = "../my_robot"}
//   contacts = true                                # false leaves all contact pairs out
//   gravity = true
//   smooth = true                                  # leaves out contact pairs, limits and dry friction
//   exclude = [["thigh", "shank"]]                 # bodies whose contact pairs with each other are left out
//   above_ground_m = 0.05                          # free bodies start with their lowest shape this high above a plane
//   start_rates = 1                                # seeded random joint rates at the start, rad/s or m/s, within +-
//   measures = [...]                               # default: the campaign's
//   timesteps_ms = [...]                           # default: the campaign's
//   timing_ms = [...]                              # timesteps whose speed is measured; default: all
//   violation_ms = [...]                           # timesteps whose violation is measured; default: all
//   reference_ms = "1/64"                          # default: the campaign's; so reference_single_ms
//   contenders = [...]                             # default: the campaign's list; may name others, which then take
//                                                  # part only in the systems that name them
//
//   [[contender]]                                  # optional: a contender derived from another; when no list names
//                                                  # it, it joins the campaign's list
//   name = "A"
//   base = "mujoco-euler"
//   set = {iterations = 50}                        # optional: settings that differ from the base's
//
//   [[sweep]]                                      # optional: contenders over lists of their settings (sweep.h)
//   contenders = ["mujoco-*"]
//   iterations = [2, 10, 50]
//
//   [[ratio]]                                      # optional: a contender's step time over another's, with an interval
//   of = "jolt-f32-wasm"
//   to = "jolt-f32"
#pragma once

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
#include "measures/pushes.h"
#include "model/model.h"
#include "model/variant.h"

namespace assay {

// Run measures (measures/run_measures.h) that nothing here names have no enumerator; they follow the last one.
enum class Measure {
  kRawSpeed,
  kConsistency,
  kTruth,
  kDrift,
  kViolation,
  kGrasp,
  kAgreement,
  kScaling,
  kTransfer,
  kBatch
};
std::string_view measure_text(Measure measure);  // "raw_speed", ...

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
  std::vector<int> worlds;           // of 'batch', ascending
  std::string family;                // of systems that differ only in size, "" for none
  std::vector<Measure> measures;     // in the order of the enum
  std::vector<double> timesteps_ms;  // ascending, the reference's among them where consistency is measured
  std::vector<double> timing_ms;     // ascending
  std::vector<double> violation_ms;  // ascending; some of timesteps_ms
  std::vector<int> contenders;       // indices into Campaign::contenders, ascending
  double reference_ms = 1.0 / 64;
  // Index of the contender from whose reference runs 'transfer' tells when others part: the one that the policy was
  // trained in; -1: it does not take part.
  int trained_in = -1;
  int states_of = -1;  // index of the contender whose states all timings start from; -1: each from its own
  double reference_single_ms = 1.0 / 64;  // of contenders in single precision

  bool has(Measure measure) const;  // whether it is measured
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
