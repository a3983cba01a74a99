// Small text helpers that error messages and tables share.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace assay {

// The candidate nearest to `word` by Damerau-Levenshtein distance (optimal string alignment), when it is near enough to
// be a likely misspelling (distance at most a third of the word's length, at least 2).
std::optional<std::string> nearest_name(std::string_view word, const std::vector<std::string>& candidates);

// " (did you mean 'x'?)" for the nearest candidate, else " (known: a, b, c)"; empty when there are no candidates.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);

// Shortest decimal text that reads back as the same double ("0.1", "1e-06").
std::string shortest(double value);

// 17 significant digits, as the CSV of `assay simulate` promises.
std::string digits17(double value);

// Strict parsing of a whole text as one finite number; empty when it is not one.
std::optional<double> parse_number(std::string_view text);
std::optional<long long> parse_integer(std::string_view text);

// A timestep in milliseconds as people write it: "1/64", "0.5", "4". Empty when it is neither a number nor a fraction.
std::optional<double> parse_fraction(std::string_view text);

// Milliseconds as a person reads a power-of-two timestep: 0.015625 -> "1/64", 4 -> "4", 0.3 -> "0.3".
std::string timestep_label(double timestep_ms);

// Equal up to rounding: timesteps are stored as numbers that were read from text.
bool same_timestep(double a_ms, double b_ms);

// "3 s", "4 min 10 s", "2 h 5 min": for progress and plans.
std::string duration_label(double seconds);

// "1 body", "2 bodies"; without `plural` it is `singular` with an s.
std::string counted(size_t count, const std::string& singular, const std::string& plural = "");

// Whether a character is no text but steers what shows it: a control character, or a mark or override of the writing
// direction, by which a name could show as another. Newlines in texts of JSON are escapes already.
constexpr bool steers(char32_t code) {
  return (code >= 0x7f && code < 0xa0) || code == 0x061c || (code >= 0x200e && code <= 0x200f) ||
         (code >= 0x2028 && code <= 0x202e) || (code >= 0x2066 && code <= 0x2069);
}

std::string join(const std::vector<std::string>& parts, std::string_view separator);

}  // namespace assay
