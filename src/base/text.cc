#include "base/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

namespace assay {
namespace {

size_t edit_distance(std::string_view a, std::string_view b) {
  // optimal string alignment over three rolling rows
  std::vector<size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t cost = a[i - 1] == b[j - 1] ? 0 : 1;
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + cost});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

}  // namespace

std::optional<std::string> nearest_name(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string* best = nullptr;
  size_t best_distance = std::max<size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const size_t distance = edit_distance(word, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = &candidate;
    }
  }
  if (best == nullptr) return std::nullopt;
  return *best;
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates) {
  if (candidates.empty()) return "";
  if (auto nearest = nearest_name(word, candidates)) return fmt::format(" (did you mean '{}'?)", *nearest);
  return fmt::format(" (known: {})", join(candidates, ", "));
}

std::string shortest(double value) { return fmt::format("{}", value); }

std::string digits17(double value) { return fmt::format("{:.17g}", value); }

std::optional<double> parse_number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<long long> parse_integer(std::string_view text) {
  long long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> parse_fraction(std::string_view text) {
  const size_t slash = text.find('/');
  if (slash == std::string_view::npos) return parse_number(text);
  const auto numerator = parse_number(text.substr(0, slash));
  const auto denominator = parse_number(text.substr(slash + 1));
  if (!numerator || !denominator || *denominator == 0) return std::nullopt;
  return *numerator / *denominator;
}

std::string timestep_label(double timestep_ms) {
  const double inverse = 1 / timestep_ms;
  if (timestep_ms < 1 && inverse <= 65536 && inverse == std::floor(inverse) &&
      std::exp2(std::round(std::log2(inverse))) == inverse) {
    return fmt::format("1/{}", static_cast<long long>(inverse));
  }
  return shortest(timestep_ms).ends_with(".0") ? fmt::format("{:.0f}", timestep_ms) : shortest(timestep_ms);
}

bool same_timestep(double a_ms, double b_ms) { return std::abs(a_ms - b_ms) <= 1e-9 * std::max(a_ms, b_ms); }

std::string duration_label(double seconds) {
  const auto s = std::llround(std::max(0.0, seconds));
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {} s", s / 60, s % 60);
  return fmt::format("{} h {} min", s / 3600, s % 3600 / 60);
}

std::string counted(size_t count, const std::string& singular, const std::string& plural) {
  if (count == 1) return "1 " + singular;
  return fmt::format("{} {}", count, plural.empty() ? singular + "s" : plural);
}

std::string join(const std::vector<std::string>& parts, std::string_view separator) {
  return fmt::format("{}", fmt::join(parts, separator));
}

}  // namespace assay
