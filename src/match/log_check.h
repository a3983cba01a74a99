// What measured logs can tell before anything is fitted: their rates, noise and mistakes (`assay match --check`).
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "match/log.h"
#include "results/answer.h"

namespace assay::match {

enum class FindingSeverity {
  kWrong,    // a fit would be wrong: units, signs
  kWarning,  // parts are unusable or the result will be weak
  kRemark,   // worth knowing
};

struct LogFinding {
  FindingSeverity severity = FindingSeverity::kWarning;
  std::string kind = {};    // "degrees", "torque sign", "gap", "hands", ...: stable names, for JSON and tests
  std::string log = {};     // "": of all
  std::string source = {};  // the file
  size_t line = 0;          // 0: of the whole log
  std::string column = {};  // quantity, "": none
  TimeSpan span = {};       // where; both 0 for the whole log
  std::string text = {};    // a sentence with the offending value
  std::string fix = {};     // what to do about it, imperative; "": nothing
};

// A time in which the motion is not the robot's alone (hands), not measured (gaps), or tells nothing (rest): windows
// that touch it are not scored.
struct SpoiledSpan {
  size_t log = 0;  // index into the logs
  TimeSpan span;
  std::string reason;  // kind of the finding
};

// Of one quantity of one log.
struct ChannelFacts {
  std::string quantity;  // "elbow.torque"
  double lower = 0, upper = 0;
  double noise = 0;     // standard deviation about a smooth course, in its unit
  double step = 0;      // quantisation: the smallest difference of neighbours; 0 for none
  double glitches = 0;  // share of samples
};

struct LogFacts {
  std::string name, source;
  size_t samples = 0;
  double duration = 0, rate = 0, jitter = 0;  // s, Hz, standard deviation of the sample time over the median
  std::vector<ChannelFacts> channels;
};

struct LogCheck {
  std::vector<LogFacts> logs;
  std::vector<LogFinding> findings;  // worst first
  std::vector<SpoiledSpan> spoiled;
};

LogCheck check_logs(const Model& model, const MatchConfig& config, const std::vector<MeasuredLog>& logs);

// "run, line 17: 'knee' ...; fix"
std::string finding_text(const LogFinding& finding);

// What was found, in words; the same as {"logs", "findings", "spoiled"}.
Answer check_answer(const LogCheck& check);
nlohmann::ordered_json check_json(const LogCheck& check);

}  // namespace assay::match
