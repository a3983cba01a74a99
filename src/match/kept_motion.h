// Motion that is kept of a few held-out logs, to be looked at: what was measured, and what the contenders make of it.
// docs/files.md has the format of motion.json.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "match/windows.h"
#include "model/state.h"

namespace assay::match {

inline constexpr size_t kMostKeptContenders = 6;  // the best ones
inline constexpr const char* kMotionFile = "motion.json";
inline constexpr const char* kMotionFolder = "motion";  // states of the runs, as results/store/trajectory.h writes them
inline constexpr const char* kMeasured = "measured";    // names the measured motion among runs
// Why a log is kept.
inline constexpr const char *kWorst = "worst", *kMedian = "median", *kSeparating = "separating";

// A run over all windows of a log that are kept, one after the other.
struct KeptRun {
  std::string contender;     // kMeasured for what was measured
  bool fitted = true;        // else the model as it is
  std::vector<double> rows;  // sample by sample all joints of the model and 7 numbers of each flight, as MatchRun
                             // has them; NaN where a run ended early and for joints that were not measured
  std::string ended;         // why the first window that ended early did, "" for none
};

struct KeptWindow {
  size_t first = 0;    // sample
  double start_s = 0;  // in the log's time
  bool scored = true;  // else the noise of its first state grows too large
};

struct KeptLog {
  std::string log;
  std::vector<std::string> roles;   // kWorst, kMedian, kSeparating
  std::vector<double> time;         // of each sample, s, the log's
  std::vector<KeptWindow> windows;  // neighbours in time
  std::optional<double> impact;     // s, the end of free flight; of whole motions
  std::vector<int> joints;          // of the model, that were measured
  std::vector<int> bodies;          // of the flights
  std::vector<KeptRun> runs;        // what was measured comes first
};

// Samples of the windows that are kept of a log: neighbours around `worst` (an index into `windows`, all of one log,
// ascending in time) up to `most` samples, every n-th of a window that has more. Sets time, windows, impact, joints,
// bodies and the measured run; `chosen` are the windows' indices and `stride` is n.
KeptLog kept_log(const Model& model, const Windows& windows, const std::vector<size_t>& of_log, size_t worst,
                 size_t most, std::vector<size_t>& chosen, size_t& stride);

// A contender's run over the windows of `log`, from what a worker answered for `chosen`.
KeptRun kept_run(const KeptLog& log, size_t joints, const std::vector<MatchRun>& answers, size_t stride);

// Writes motion.json and the states into `dir` and removes those of an earlier run. `scene` is that of a store
// (results/store/scene.h). States are left out where a log does not say where all bodies are. Throws SystemError.
void write_motion(const std::string& dir, const Model& model, const nlohmann::json& scene, double timestep_ms,
                  const std::vector<KeptLog>& logs);

// motion.json of `dir`; null where there is none. Throws InputError for a file that is none.
nlohmann::json read_motion(const std::string& dir);

// States of one of its runs, equally spaced from 0 s on; empty where they are not kept. Throws InputError for what is
// not of the scene.
std::vector<State> motion_states(const std::string& dir, const nlohmann::json& motion, const nlohmann::json& run);

// Of motion.json the log of this name or role; null where there is none.
const nlohmann::json* kept_log_named(const nlohmann::json& motion, const std::string& name);

}  // namespace assay::match
