// Limits as users write them, in a command's options or a campaign's table [search], read in one place.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "results/recommend.h"
#include "results/values.h"

namespace assay {

// As given.
struct LimitOptions {
  std::optional<std::string> error, measure, penetration, slip, realtime;
  std::vector<std::string> limits;  // NAME=QUANTITY

  bool any() const { return error || penetration || slip || realtime || !limits.empty(); }
};

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

// The value that a name stands for. Throws InputError for one that cannot be limited; `option` is the option with it.
using FindValue = std::function<ValueInfo(const std::string& option, const std::string& name)>;

// `errors` are the values that --error limits where no measure is named. Throws InputError for what `find` refuses, a
// quantity that cannot be read, and a value that is limited twice.
Question read_limits(const LimitOptions& options, const std::vector<std::string>& errors, const FindValue& find);

// What the options ask of measured results. Throws InputError as read_limits(), and for a question without limits.
Question question_of(const LimitOptions& options, const SystemAnswers& answers);

// "truth error within 1mm, at least 5× real time"
std::string limits_text(const Question& question);

}  // namespace assay
