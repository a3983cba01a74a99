// What `assay recommend` and `assay run ROBOT` have in common: limits as users write them, and the answer as text.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "cli/answer.h"
#include "results/recommend.h"

namespace assay::cli {

struct LimitOptions {
  std::optional<std::string> error, measure, penetration, slip, realtime;
  std::vector<std::string> limits;  // NAME=QUANTITY

  bool any() const { return error || penetration || slip || realtime || !limits.empty(); }
};

// Adds --error, --measure, --penetration, --slip, --realtime and --limit.
void add_limits(CLI::App& command, LimitOptions& options);

// A limit as the user wrote it.
struct Asked {
  ValueInfo value;
  double largest = 0;
  std::string text;
};

struct Question {
  std::vector<Asked> asked;
  Limits limits;
};

// What the options ask of `answers`. Throws InputError for a value that was not measured or cannot be limited, a value
// that is limited twice, and a question without limits.
Question question_of(const LimitOptions& options, const SystemAnswers& answers);

// "truth error within 1mm, at least 5 x real time"
std::string limits_text(const Question& question);

// The point that misses the limits by the least, by how much, and what was not measured there, in one sentence.
std::string nearest_text(const SystemAnswers& answers, const Question& question, const Recommendation& found);

// Parts with the best point, its limits, speed, errors, margin and what is not told apart from it, and each contender's
// own best. There has to be a best.
void add_best(const SystemAnswers& answers, const Question& question, const Recommendation& found, Answer& answer);

// "Not considered": contenders, timesteps and reasons.
void print_left_out(const SystemAnswers& answers, const Question& question, const Recommendation& found);

// "mujoco-euler at 4 ms"
std::string place_text(const Point& point);

}  // namespace assay::cli
