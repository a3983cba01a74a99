#include "report/figures/axes.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace assay::figures {
namespace {

std::string superscript(int number) {
  static const std::array<const char*, 10> kDigits = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = number < 0 ? "⁻" : "";
  for (const char digit : std::to_string(std::abs(number))) text += kDigits.at(static_cast<size_t>(digit - '0'));
  return text;
}

}  // namespace

std::string power_of_ten(int exponent) {
  if (exponent >= -2 && exponent <= 3) return fmt::format("{:g}", std::pow(10, exponent));
  return "10" + superscript(exponent);
}

LogAxis::LogAxis(const std::vector<double>& values, double from, double to) : from_(from), to_(to) {
  const auto [least, most] = std::ranges::minmax(values);
  const double low = std::log10(least), high = std::log10(most);
  const double margin = std::max({0.07 * (high - low), (1 - (high - low)) / 2, 0.12});
  low_ = low - margin;
  high_ = high + margin;
}

std::vector<int> LogAxis::labels(double spacing) const {
  const double decade = std::abs(to_ - from_) / (high_ - low_);
  int stride = 1;
  while (stride * decade < spacing) ++stride;
  std::vector<int> found;
  for (const int exponent : decades()) {
    if (exponent % stride == 0) found.push_back(exponent);
  }
  return found;
}

std::vector<int> LogAxis::decades() const {
  std::vector<int> found;
  for (int e = static_cast<int>(std::ceil(low_)); e <= static_cast<int>(std::floor(high_)); ++e) found.push_back(e);
  return found;
}

std::vector<double> linear_ticks(double most, int count) {
  const double raw = most / count, power = std::pow(10, std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double digit : {5, 2, 1}) {
    if (digit * power >= raw) step = digit * power;
  }
  std::vector<double> ticks;
  for (int i = 0; i * step <= most * (1 + 1e-9); ++i) ticks.push_back(i * step);
  return ticks;
}

void empty_plot(Canvas& canvas, const Box& box, const std::string& why) {
  canvas.outline_rectangle(box.left, box.top, box.width(), box.height(), kRule, 0.5);
  canvas.text(why, {(box.left + box.right) / 2, (box.top + box.bottom) / 2}, kText, Align::kMiddle, kSoft);
}

}  // namespace assay::figures
