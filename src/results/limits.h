// Limits as users write them, in a command's options or a campaign's table [search], read in one place.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "results/recommend.h"
#include "results/values.h"

namespace assay {

// In place of the quantity of --penetration and --slip: no limit, instead of the usual one (UsualLimit).
inline constexpr const char* kAnyQuantity = "any";

// As given.
struct LimitOptions {
  std::optional<std::string> error, measure, penetration, slip, realtime;
  std::vector<std::string> limits;  // NAME=QUANTITY

  bool any() const { return error || penetration || slip || realtime || !limits.empty(); }
  // Whether something is limited beside what every question limits of contacts.
  bool asks() const {
    const auto is_limit = [](const std::optional<std::string>& text) { return text && *text != kAnyQuantity; };
    return error || realtime || is_limit(penetration) || is_limit(slip) || !limits.empty();
  }
};

// A limit as the user wrote it.
struct Asked {
  ValueInfo value;
  double largest = 0;
  std::string text;
  bool is_usual = false;  // it is the one that questions have by default, named or not
};

struct Question {
  std::vector<Asked> asked;
  Limits limits;
};

// The value that a name stands for. Throws InputError for one that cannot be limited; `option` is the option with it.
using FindValue = std::function<ValueInfo(const std::string& option, const std::string& name)>;

// What can be asked of a system, or of several together.
struct Askable {
  std::vector<std::string> errors;  // that --error limits where no measure is named
  std::vector<UsualLimit> usual;
  double start_overlap = 0;  // as SystemAnswers::start_overlap
  std::string where;         // "on 'humanoid'"
};

// The limits as given, then the usual ones of what no limit was given for. Throws InputError for what `find` refuses, a
// quantity that cannot be read, a value that is limited twice, and limits that contradict each other or that no run can
// meet by what they mean.
Question read_limits(const LimitOptions& options, const Askable& of, const FindValue& find);

// What the options ask of measured results. Throws InputError as read_limits(), and for a question without limits.
Question question_of(const LimitOptions& options, const SystemAnswers& answers);

std::string limit_of(const Asked& asked);  // "slip within 5 mm (default)"
// "truth error within 1mm, slip within 5 mm (default), at least 5× real time"
std::string limits_text(const Question& question);

}  // namespace assay
