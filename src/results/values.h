// The catalogue of values: what each stored figure is called and what may be done with it. A new value is a row of
// values.cc; a name without a row is shown by its words and cannot be limited.
#pragma once

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
const ValueInfo* find_value_info(std::string_view name);

// Whether the catalogue says that the value can be limited.
bool can_limit(std::string_view name);

// The row of a value; one that is made of its name's words where the catalogue has none.
ValueInfo value_info(std::string_view name);

// The value that `name` stands for: a value's own name, else the first value of the measure of this name ("truth").
// Empty when it is neither.
std::string value_named(std::string_view name);

// The terms of docs/glossary.md.
struct Term {
  std::string_view term, meaning;
};
const std::vector<Term>& glossary();

}  // namespace assay
