// Which contender at which timestep: the one rule for the command line and the report's page.
//
// A point is a contender, with its settings, at a timestep. It is sound when every cell of that contender at that
// timestep, and at every smaller one that was measured, ended well and held what it was to hold. It is a candidate when
// it is sound and its speed was timed there, or between two timed timesteps. Its error is the largest at its timestep
// or any smaller one, so that no luck of phase wins.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "results/front.h"
#include "results/results.h"
#include "results/values.h"

namespace assay {

// The largest of a value at a timestep and all smaller ones.
struct Worst {
  Interval value;         // `high` is the largest upper end of all these timesteps
  double at_ms = 0;       // where it is from
  bool is_bound = false;  // the value is an upper bound (results.h: bound_of)
};

struct Point {
  std::string contender;
  double timestep_ms = 0;
  std::optional<Speed> speed;  // absent where it was not timed
  bool sound = true;
  std::string why;                          // it is not sound: "grasp: the object was dropped at 3.2 s"
  double fails_ms = 0;                      // the smallest timestep that is not; 0: none up to this one
  std::map<std::string, Worst> worst = {};  // of each value that can be limited and was measured at this timestep
  // Probability of holding the object, where several initial states were tried: the one with the smallest lower end at
  // this timestep and all smaller ones.
  std::optional<Interval> held = {};
  std::string varies = {};  // the contender that this one is a setting of, else its own name
};

struct Candidate {
  size_t point = 0;                    // index into SystemAnswers::points
  Speed speed;                         // the point's
  std::map<std::string, Worst> worst;  // of each value that can be limited and was measured at its timestep
  std::string margin;                  // "fails at 4 times this step (16 ms): ...", or that it is at an end of the grid
  // "largest" or "smallest" where it is at that end of the timesteps that its contender was run at: what lies beyond
  // was not tried. "" elsewhere.
  std::string end_of_grid = {};
};

struct Excluded {
  size_t point = 0;  // index into SystemAnswers::points
  std::string why;
};

// A limit on contacts that every question has that names no other one and does not do without: soft contacts are easy
// to repeat, so an error alone rewards them.
struct UsualLimit {
  std::string option;  // that changes it: "penetration" or "slip"
  std::string value;   // that it limits
  double largest = 0;
};
inline constexpr double kUsualPenetration = 5e-3;  // m, where the measure has stored no limit
inline constexpr double kUsualSlip = 5e-3;         // m

// The option whose limit a limit of this value takes the place of; "" for none.
std::string_view usual_option(std::string_view value);

// Everything about one system that an answer rests on.
struct SystemAnswers {
  std::string system;
  std::vector<ValueInfo> values;                           // measured here, or tried; in the catalogue's order
  std::vector<std::string> errors;                         // of these the ones that can be limited and have a figure
  std::string main;                                        // the error that a plot begins with; "" when there is none
  std::vector<std::string> mains;                          // that one; of several systems together each one's
  std::vector<Point> points;                               // by contender as listed, then timestep
  std::vector<Candidate> candidates;                       // the fastest first
  std::map<std::string, std::vector<FrontMember>> fronts;  // of candidates, by error; FrontMember::point into `points`
  std::map<std::string, std::vector<SettingChange>> changes;  // by contender: what differs from its adapter's defaults
  // Of contenders whose settings a sweep varied: the front of each over all its timesteps and settings, by error, then
  // by the contender that was varied.
  std::map<std::string, std::map<std::string, std::vector<FrontMember>>> swept;
  std::vector<Excluded> excluded;  // points that are no candidates
  std::vector<UsualLimit> usual;   // none without contacts
  double start_overlap = 0;        // m: shapes overlap by at least this at the start, so no penetration is below it
  // Of values that stand for others that these results lack: what they are, in one sentence.
  std::map<std::string, std::string> stand_ins;

  const Point& at(const Candidate& candidate) const { return points[candidate.point]; }
};

SystemAnswers answers_of(const Results& results, const std::string& system);

// One answer for all of `systems`, under the name `name`: a point is a candidate when it is sound on each of them, has
// an error on each, and its speed is known on those that were timed, of which the slowest counts. Its errors are the
// largest over the systems. Texts name the system where they speak of one.
SystemAnswers answers_together(const Results& results, const std::vector<std::string>& systems,
                               const std::string& name);

struct Limits {
  std::vector<std::pair<std::string, double>> largest;  // value, the largest that is accepted, in its unit
  std::optional<double> realtime;                       // the least realtime factor
};

// A limit that would let a question have an answer if it were this one, and all others as they are.
struct Relaxation {
  std::string value;     // "" for the least realtime factor
  double to = 0;         // rounded to three digits, so that the candidate is within it
  std::string text;      // as a user gives it: "2.41 mm"; of the realtime factor "2.41"
  size_t candidate = 0;  // index into SystemAnswers::candidates: the fastest within these limits
};

struct Recommendation {
  std::optional<size_t> best;       // index into SystemAnswers::candidates: the fastest within all limits
  std::vector<size_t> contenders;   // each contender's fastest within them, the fastest first; of what a sweep varied
                                    // the fastest of all its settings
  std::vector<size_t> alike;        // of these, but for the best, whose speed's interval reaches into the best's
  std::optional<size_t> certain;    // the fastest whose intervals lie within the limits as a whole
  std::optional<size_t> nearest;    // when nothing is within them: the one that misses by the least factor
  std::vector<Relaxation> relaxed;  // and by limit, as asked, the least that it has to give way alone, where it can
  std::vector<size_t> beyond;       // of each contender with candidates but none within the limits: the one that misses
                                    // by the least factor, the least first
};

Recommendation recommend(const SystemAnswers& answers, const Limits& limits);

// A limit that a contender exceeds at a timestep.
struct Exceeded {
  double timestep_ms = 0;
  std::string value;  // the first of the limited values that is above its limit
  Worst worst;        // what it is there
};

// Where the candidate's contender first exceeds a limit of an error above the candidate's timestep; absent where none
// of its larger candidates does. The smallest step at which it fails altogether is the candidate's `margin`.
std::optional<Exceeded> first_exceeded(const SystemAnswers& answers, const Candidate& candidate, const Limits& limits);

// What bounds a candidate's place among the timesteps of its contender.
enum class End {
  kNone,      // a timestep beyond it fails, exceeds a limit, or is no better
  kTried,     // no timestep beyond it was run
  kTimed,     // those beyond it were not timed
  kMeasured,  // not all limited values were measured beyond it
  kBetween    // nor at some timesteps between it and the first that tells
};
struct Edge {
  End larger = End::kNone, smaller = End::kNone;  // the latter is never kBetween
  std::vector<double> between_ms = {};            // of kBetween
};
Edge edge_of(const SystemAnswers& answers, const Candidate& candidate, const Limits& limits);

// A limit as a user gives it, with three digits, in the largest unit in which it is at least 1: "2.41 mm".
std::string limit_text(double largest, const std::string& unit);

// Beyond what a limit in other units can lose by rounding: 10 µm are within "10µm".
bool exceeds(double figure, double limit);

// 0 for a candidate within all limits, else the largest factor by which it misses one. Absent when a limited value was
// not measured there. With `whole` the upper ends of the errors and the lower end of the speed count.
std::optional<double> excess(const Candidate& candidate, const Limits& limits, bool whole = false);

}  // namespace assay
