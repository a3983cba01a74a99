// The catalogue of values: what each stored figure is called and what may be done with it. Its rows are the measures'
// own (measures/measure.h); a name without a row is shown by its words and cannot be limited.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "measures/value.h"

namespace assay {

std::string_view better_text(Better better);  // "low", "high", "none"

// In the order of display.
const std::vector<ValueInfo>& value_catalogue();

// Of a measure with figures that are times: the value that is compared. Its others are the same time in other units, or
// describe the measurement. "" for other measures.
std::string_view time_of(std::string_view measure);

// The catalogue's row of a value; null when it has none.
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
// 3. The self-consistency error, where there is no reference solution: both sides of a piece started anew.
// 4. The paper's, in results that have no other: its pieces start without what the engine keeps between steps, and the
//    motion that they are compared with has it.
inline constexpr std::string_view kTruthError = "truth_error_max";
inline constexpr std::array<std::string_view, 4> kJudgedErrors = {kTruthError, "truth_error", "consistency_cold",
                                                                  "consistency"};

// The terms of docs/methodology.md.
struct Term {
  std::string_view term, meaning;
};
const std::vector<Term>& glossary();

}  // namespace assay
