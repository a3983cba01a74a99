// The catalogue of values: what each stored figure is called and what may be done with it. A new value is a row of
// values.cc; a name without a row is shown by its words and cannot be limited.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace assay {

enum class Better { kLow, kHigh, kNone };
std::string_view better_text(Better better);  // "low", "high", "none"

struct ValueInfo {
  std::string name;   // as stored: "truth_error"
  std::string unit;   // as stored: "m"; "1" for ratios
  std::string label;  // on axes and in tables: "Error against the reference solution"
  std::string brief;  // in a sentence, where room is short: "error"
  Better better = Better::kNone;
  std::string measure;  // whose cells hold it
  bool plot = false;    // can be the error axis of a plot
  bool limit = false;   // an error: can be limited from above
  std::string meaning;
};

// In the order of display.
const std::vector<ValueInfo>& value_catalogue();

// The catalogue's row of a value; null when it has none.
// Whether a measure's figures are times: they scatter, and compare only on one machine; and the name of the value that
// is compared. Its others are the same time in other units, or describe the measurement.
bool is_timing(std::string_view measure);
std::string_view time_of(std::string_view measure);

const ValueInfo* find_value_info(std::string_view name);

// The values that a contender cannot have for what its engine gives of contact forces (ContenderRow::contact_forces).
std::vector<std::string> values_not_given(std::string_view contact_forces);

// Whether the catalogue says that the value can be limited.
bool can_limit(std::string_view name);

// The row of a value; one that is made of its name's words where the catalogue has none.
ValueInfo value_info(std::string_view name);

// The value that `name` stands for: a value's own name, else the first value of the measure of this name ("truth").
// Empty when it is neither.
std::string value_named(std::string_view name);
// The same among values that were measured: of a measure the first that is there. When none is, as above.
std::string value_named(std::string_view name, const std::vector<ValueInfo>& measured);

// The one rule by which error a contender is judged where none is named, for recommendations, the report and claims:
// the first of these that the results have.
// 1. The largest error against the reference solution over the run. A limit is a promise for the whole motion, and the
//    error of one instant is luck of phase: an oscillating error passes through small values at any timestep. The root
//    mean square is stored beside it; it hides short excursions, and shrinks when a run is extended by a quiet end.
// 2. That error at the run's end, in results of before version 0.2, which have no other.
// 3. The self-consistency error, where there is no reference solution.
inline constexpr std::string_view kTruthError = "truth_error_max";
inline constexpr std::array<std::string_view, 3> kJudgedErrors = {kTruthError, "truth_error", "consistency"};

// The terms of docs/glossary.md.
struct Term {
  std::string_view term, meaning;
};
const std::vector<Term>& glossary();

}  // namespace assay
