// Numbers with units, as people write and read them. The page formats alike (web/src/format.ts).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace assay {

// Of lengths and angles, m and rad; 0 for other units. A smaller one is rounding, and says only that it is smaller.
double least_quantity(std::string_view unit);

// Three significant digits (or `digits`), with an SI prefix where the unit takes one: "4.34 mm", "1.03 MHz",
// "2.10 × 10⁻⁶ kg m²/s"; without a unit for "1": "0.250". "below 1 pm" for what is less than least_quantity() and not
// 0. "–" for a number that is not finite.
std::string quantity_text(double value, std::string_view unit, int digits = 3);

// A number without exponent below a million: "12.3"; else "2.10 × 10⁶".
std::string number_text(double value, int digits = 3);

// "120×": times real time.
std::string realtime_text(double factor);

// How a unit is shown: "us" -> "µs", "m^2" -> "m²", "1" -> "".
std::string unit_text(std::string_view unit);

// A unit that a quantity may be given in, and its size in the stored unit. The first is the handiest.
struct InputUnit {
  std::string text;  // "" for a plain number
  double scale = 1;
};
std::vector<InputUnit> input_units(std::string_view unit);

// "1mm", "0.5 deg", "2%", "3" (of "1" only) in the stored unit `unit`; not negative. `what` is named in the error, as
// in
// "--error". Throws InputError that names the units when the unit is missing or of another kind, or the number is none.
double parse_quantity(std::string_view what, std::string_view text, std::string_view unit);

}  // namespace assay
