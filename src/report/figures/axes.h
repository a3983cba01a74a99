// What the figures are drawn with: inks, sizes of type, axes. Lengths are in points, y downwards.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "report/canvas.h"

namespace assay::figures {

inline constexpr Color kInk{0.11, 0.13, 0.15};
inline constexpr Color kSoft{0.38, 0.41, 0.45};
inline constexpr Color kRule{0.82, 0.82, 0.80};
inline constexpr Color kFaint{0.93, 0.93, 0.91};
inline constexpr double kText = 7;     // pt
inline constexpr double kSmall = 6;    // pt
inline constexpr double kTitle = 8;    // pt
inline constexpr double kWidth = 516;  // pt: two columns of a journal, 182 mm

struct Box {
  double left = 0, top = 0, right = 0, bottom = 0;
  double width() const { return right - left; }
  double height() const { return bottom - top; }
};

// "0.01", "10", "10⁵".
std::string power_of_ten(int exponent);

// From `from` to `to` on the canvas, with a margin around the values, which are positive (at least one).
class LogAxis {
 public:
  LogAxis(const std::vector<double>& values, double from, double to);
  double at(double value) const { return from_ + (std::log10(value) - low_) / (high_ - low_) * (to_ - from_); }

  // Exponents to label, at least `spacing` apart.
  std::vector<int> labels(double spacing) const;
  std::vector<int> decades() const;

 private:
  double from_, to_;
  double low_ = 0, high_ = 1;
};

// 0 and steps of 1, 2 or 5 times a power of ten, about `count` of them.
std::vector<double> linear_ticks(double most, int count);

// Where a plot would be, and why it is not.
void empty_plot(Canvas& canvas, const Box& box, const std::string& why);

}  // namespace assay::figures
