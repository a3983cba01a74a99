#include "base/quantity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"

namespace assay {
namespace {

constexpr const char* kThinSpace = "\u2009";
constexpr const char* kMinus = "\u2212";

struct Prefix {
  double factor;
  const char* text;
};
constexpr std::array kPrefixes = {Prefix{1e9, "G"},  Prefix{1e6, "M"},   Prefix{1e3, "k"},
                                  Prefix{1, ""},     Prefix{1e-3, "m"},  Prefix{1e-6, "µ"},
                                  Prefix{1e-9, "n"}, Prefix{1e-12, "p"}, Prefix{1e-15, "f"}};

// A unit that takes prefixes: its size in the unit without one.
struct Prefixable {
  const char *unit, *base;
  double scale;
};
constexpr std::array kPrefixable = {
    Prefixable{"m", "m", 1},     Prefixable{"J", "J", 1},     Prefixable{"s", "s", 1},     Prefixable{"us", "s", 1e-6},
    Prefixable{"ms", "s", 1e-3}, Prefixable{"ns", "s", 1e-9}, Prefixable{"rad", "rad", 1}, Prefixable{"N", "N", 1},
    Prefixable{"Nm", "Nm", 1},   Prefixable{"kHz", "Hz", 1e3}};

// What a quantity may be given in, by the stored unit; the first is offered first.
struct Given {
  const char *unit, *text;
  double scale;
};
constexpr double kDegree = 0.017453292519943295;
constexpr std::array kGiven = {
    Given{"m", "mm", 1e-3}, Given{"m", "µm", 1e-6}, Given{"m", "um", 1e-6},       Given{"m", "nm", 1e-9},
    Given{"m", "cm", 1e-2}, Given{"m", "m", 1},     Given{"rad", "deg", kDegree}, Given{"rad", "mrad", 1e-3},
    Given{"rad", "rad", 1}, Given{"J", "mJ", 1e-3}, Given{"J", "µJ", 1e-6},       Given{"J", "uJ", 1e-6},
    Given{"J", "J", 1},     Given{"s", "ms", 1e-3}, Given{"s", "us", 1e-6},       Given{"s", "s", 1},
    Given{"ms", "ms", 1},   Given{"ms", "s", 1e3},  Given{"us", "us", 1},         Given{"us", "ms", 1e3},
    Given{"us", "s", 1e6},  Given{"kHz", "kHz", 1}, Given{"kHz", "Hz", 1e-3},     Given{"1", "%", 1e-2},
    Given{"1", "", 1}};

// To so many significant digits; a tie goes up, as in JavaScript.
double rounded(double value, int digits) {
  constexpr double kTieUp = 1 + 4e-16;
  return std::strtod(fmt::format("{:.{}e}", value * kTieUp, digits - 1).c_str(), nullptr);
}

int exponent_of(double value) { return static_cast<int>(std::floor(std::log10(std::abs(value)) + 1e-9)); }

std::string superscript(std::string_view text) {
  constexpr std::array kDigits = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string out;
  for (const char c : text) out += c == '-' ? "⁻" : kDigits.at(static_cast<size_t>(c - '0'));
  return out;
}

// Without an exponent; whole parts of more than four digits in groups.
std::string plain(double value, int digits) {
  const double shown = rounded(value, digits);
  if (shown == 0) return "0";
  std::string text = fmt::format("{:.{}f}", std::abs(shown), std::max(0, digits - 1 - exponent_of(shown)));
  const size_t whole = std::min(text.find('.'), text.size());
  for (size_t at = whole; whole > 4 && at > 3; at -= 3) text.insert(at - 3, kThinSpace);
  return (shown < 0 ? kMinus : "") + text;
}

// A mantissa from 1 to 1000 and a power of ten that is a multiple of three.
std::string with_power(double value, int digits) {
  const double shown = rounded(value, digits);
  if (shown == 0) return "0";
  const int exponent = 3 * static_cast<int>(std::floor(exponent_of(shown) / 3.0));
  if (exponent == 0) return plain(shown, digits);
  return fmt::format("{}{}×{}10{}", plain(shown / std::pow(10, exponent), digits), kThinSpace, kThinSpace,
                     superscript(std::to_string(exponent)));
}

std::string units_text(std::string_view unit) {
  std::vector<std::string> names;
  for (const InputUnit& each : input_units(unit)) names.push_back(each.text.empty() ? "a plain number" : each.text);
  return join(names, ", ");
}

}  // namespace

std::string unit_text(std::string_view unit) {
  if (unit == "1") return "";
  if (unit == "us") return "µs";
  std::string text;
  for (size_t i = 0; i < unit.size(); ++i) {
    if (unit[i] != '^') {
      text += unit[i];
      continue;
    }
    const size_t end = std::min(unit.find_first_not_of("-0123456789", i + 1), unit.size());
    text += superscript(unit.substr(i + 1, end - i - 1));
    i = end - 1;
  }
  return text;
}

std::string number_text(double value, int digits) {
  if (!std::isfinite(value)) return "–";
  const double size = std::abs(value);
  return size == 0 || (size >= 1e-3 && size < 1e6) ? plain(value, digits) : with_power(value, digits);
}

double least_quantity(std::string_view unit) { return unit == "m" || unit == "rad" ? 1e-12 : 0; }

std::string quantity_text(double value, std::string_view unit, int digits) {
  if (!std::isfinite(value)) return "–";
  const double least = least_quantity(unit);
  if (value != 0 && std::abs(value) < least * (1 - 1e-9)) return "below " + quantity_text(least, unit, 1);
  const auto* scaled = std::ranges::find(kPrefixable, unit, [](const Prefixable& each) { return each.unit; });
  if (scaled == kPrefixable.end()) {
    const std::string suffix = unit_text(unit);
    return number_text(value, digits) + (suffix.empty() ? "" : " " + suffix);
  }
  const double base = value * scaled->scale, size = std::abs(rounded(base, digits));
  if (base == 0) return fmt::format("0 {}", scaled->base);
  for (const auto& [factor, text] : kPrefixes) {
    if (size < factor * (1 - 1e-12)) continue;
    if (size / factor >= 1000) break;
    return fmt::format("{} {}{}", plain(base / factor, digits), text, scaled->base);
  }
  return fmt::format("{} {}", with_power(base, digits), scaled->base);
}

std::string realtime_text(double factor) { return std::isfinite(factor) ? number_text(factor) + "×" : "–"; }

std::vector<InputUnit> input_units(std::string_view unit) {
  std::vector<InputUnit> units;
  for (const Given& each : kGiven) {
    if (each.unit == unit) units.push_back({each.text, each.scale});
  }
  if (units.empty()) units.push_back({std::string(unit), 1});
  return units;
}

double parse_quantity(std::string_view what, std::string_view text, std::string_view unit) {
  const auto refusal = [&](const std::string& why) {
    return InputError(fmt::format("{} is '{}': {}", what, text, why));
  };
  // The number is the longest beginning that reads as one: "1e-3m", "2 %".
  size_t end = text.size();
  std::optional<double> number;
  for (; end > 0 && !number; --end) number = parse_number(text.substr(0, end));
  if (!number) throw refusal(fmt::format("give a number with a unit ({})", units_text(unit)));
  std::string given(text.substr(end + 1));
  given.erase(0, std::min(given.find_first_not_of(' '), given.size()));
  if (!(*number >= 0)) throw refusal("give a number that is not negative");
  const std::vector<InputUnit> units = input_units(unit);
  const auto found = std::ranges::find(units, given, &InputUnit::text);
  if (found != units.end()) return *number * found->scale;
  if (!given.empty()) throw refusal(fmt::format("'{}' is no unit of it; use {}", given, units_text(unit)));
  throw refusal(fmt::format("add a unit ({}), as in {}{}", units_text(unit), text, units.front().text));
}

}  // namespace assay
