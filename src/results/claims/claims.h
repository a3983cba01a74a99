// The paper's findings as data (campaigns/paper_claims.toml) and the verdict of measured results on each.
//
// "The paper" is Erez, Tassa, Todorov: Simulation Tools for Model-Based Robotics: Comparison of Bullet, Havok, MuJoCo,
// ODE and PhysX, ICRA 2015. How each kind of test decides: docs/lab/claims.md.
//
// The file:
//
//   [engines]                              # which contenders stand for an engine, of several the one that does best;
//   "Mine" = ["mine-f32", "mine-f64"]      # without this table the paper's, results/line_up.h
//
//   [[claim]]
//   number = 1
//   title = "..."                          # a few words
//   statement = "..."                      # one sentence
//   paper = "..."                          # what the paper measured, with its figures and where they stand
//   [[claim.test]]                         # all have to hold
//   kind = "at-timestep"                   # and the rest of ClaimTest, whose fields are the keys
//
// As JSON (report_data()'s "claims", `assay report --claims --json`), in the file's order:
//
//   [{"number": 1, "title": "...", "statement": "...", "paper": "...",
//     "verdict": "holds" | "changed" | "not-settled" | "not-measurable",
//     "now": "...",         what is true today: "Now: PhysX is 2.31 times (2.15 to 2.35) faster than ODE."
//     "threshold": "...",   what the claim asks of that figure: "above 1"
//     "summary": "...",     one to three sentences with figures; "" when nothing was measured
//     "reason": "...",      why it is not measurable; "" when it is
//     "today": "...",       about all contenders of the results, not only the paper's; "" when there is nothing to say
//     "key": "...",         the figures that decide, in a few words; "" when there are none
//     "figures": [{"label": "ODE / MuJoCo Euler", "contender": "ode-quick", "system": "humanoid",
//                  "timestep_ms": 1 | null, "measure": "step_time", "value": 2.5, "unit": "us" | "1",
//                  "low": 2.4 | null, "high": 2.6 | null}]}]      95 % intervals
//
// A figure with a "/" in its label is the ratio of `measure` of the first engine over the second's, unit "1"; at no
// single timestep (null) where they are compared at equal speed.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace assay {

class Results;

// What a figure has to be. Figures with an interval are judged by its ends; one that spans the threshold settles
// nothing.
struct ClaimBound {
  enum class Kind {
    kAbove,     // above = x: the whole interval lies above x
    kBelow,     // below = x: the whole interval lies below x
    kBetween,   // between = [x, y]: the whole interval lies inside
    kNotAbove,  // not_above = x: no part of the interval lies above x
  };
  Kind kind = Kind::kAbove;
  double x = 0, y = 0;
};

struct ClaimTest {
  enum class Kind {
    kAtTimestep,   // "at-timestep": ratio of `value` of two contenders at `timestep_ms`
    kEqualSpeed,   // "at-equal-speed": the same at equal realtime factor, the geometric mean over common speeds
    kValue,        // "value": `value` itself of each of `who`
    kSlope,        // "slope": of log `value` over log timestep, of each of `who`
    kUnstable,     // "unstable": each of `who` ends well in `measure` at some timestep, and not at a larger one; with
                   // `against`, at smaller timesteps than each of these; with `always`, at every timestep
    kLargestStep,  // "largest-step": the largest timestep with `value` 1, within a factor of `within` of `expected`
    kOrder,        // "order": that timestep falls from each group of `order` to the next
  };
  Kind kind = Kind::kValue;
  std::vector<std::string> systems;
  std::string family;                // instead: whichever system of the family has the value
  std::string value;                 // a value's name, "step_time"; of kUnstable a measure's, key `measure`
  std::vector<std::string> who;      // engines of the line-up
  std::vector<std::string> against;  // of the first two kinds and kUnstable
  int but = 0;                       // of the first two kinds: so many of `against` may be as good or better
  bool more = false;                 // is = "less" (default) or "more": than each of `against`
  bool each = false;                 // each = true: all of `who`; else one of them is enough, on every system anew
  ClaimBound bound;  // of the ratio that is to be large: theirs over who's ("less"), or who's over theirs
  std::optional<double> timestep_ms;       // kAtTimestep; of kValue: absent for the smallest that was measured
  std::map<std::string, double> expected;  // ms by engine, kLargestStep
  double within = 2;
  bool always = false;                          // kUnstable
  std::vector<std::vector<std::string>> order;  // engines, kOrder
  bool today = true;                            // say where all contenders stand
};

struct Claim {
  int number = 0;
  std::string title, statement, paper;
  std::vector<ClaimTest> tests;
};

struct ClaimsFile {
  std::vector<std::pair<std::string, std::vector<std::string>>> engines;  // name, contenders
  std::vector<Claim> claims;
};

// Reads a claims file. Throws InputError for whatever cannot be used: one sentence with file, line and value.
ClaimsFile load_claims(const std::string& path);
ClaimsFile parse_claims(const std::string& toml, const std::string& source);

// The file that comes with assay; empty when the data folder has none.
std::optional<std::string> paper_claims_file();

enum class Verdict { kHolds, kChanged, kNotSettled, kNotMeasurable };
std::string verdict_text(Verdict verdict);   // as stored: "holds", "changed", "not-settled", "not-measurable"
std::string verdict_words(Verdict verdict);  // "not settled"

struct ClaimFigure {
  std::string label, contender, system;
  std::optional<double> timestep_ms;
  std::string measure;
  double value = 0;
  std::string unit;
  std::optional<double> low, high;
};

// How Judgement::now begins.
inline constexpr std::string_view kNow = "Now: ";

struct Judgement {
  Claim claim;
  Verdict verdict = Verdict::kNotMeasurable;
  std::string now, threshold, summary, reason, today, key;
  std::vector<ClaimFigure> figures;
};

// Depends on the stored values alone, whichever campaign made them.
std::vector<Judgement> judge(const ClaimsFile& file, const Results& results);

// The layout above.
nlohmann::json claims_json(const std::vector<Judgement>& judgements);

// A table of verdicts, then a section for each claim.
std::string claims_markdown(const std::vector<Judgement>& judgements);

}  // namespace assay
