#include "results/color.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

namespace assay {
namespace {

double from_gamma(double c) { return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4); }
double with_gamma(double c) {
  const double clamped = std::min(1.0, std::max(0.0, c));
  return clamped <= 0.0031308 ? 12.92 * clamped : 1.055 * std::pow(clamped, 1 / 2.4) - 0.055;
}

Color from_oklab(const std::array<double, 3>& lab) {
  const double l = std::pow(lab[0] + 0.3963377774 * lab[1] + 0.2158037573 * lab[2], 3);
  const double m = std::pow(lab[0] - 0.1055613458 * lab[1] - 0.0638541728 * lab[2], 3);
  const double s = std::pow(lab[0] - 0.0894841775 * lab[1] - 1.2914855480 * lab[2], 3);
  return {with_gamma(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          with_gamma(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          with_gamma(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s)};
}

}  // namespace

std::array<double, 3> to_linear(const Color& color) {
  return {from_gamma(color.r), from_gamma(color.g), from_gamma(color.b)};
}

// B. Ottosson, 2020, bottosson.github.io/posts/oklab
std::array<double, 3> linear_to_oklab(const std::array<double, 3>& linear) {
  const auto& [r, g, b] = linear;
  const double l = std::cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const double m = std::cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const double s = std::cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return {0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s,
          1.9779984951 * l - 2.4285922050 * m + 0.4505937099 * s,
          0.0259040371 * l + 0.7827717662 * m - 0.8086757660 * s};
}

Color parse_color(const std::string& hex) {
  const auto part = [&](size_t at) { return std::strtol(hex.substr(at, 2).c_str(), nullptr, 16) / 255.0; };
  return {part(1), part(3), part(5)};
}

std::string color_text(const Color& color) {
  const auto byte = [](double part) { return static_cast<int>(std::lround(255 * std::clamp(part, 0.0, 1.0))); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(color.r), byte(color.g), byte(color.b));
}

Color mix(const Color& a, const Color& b, double share) {
  const auto from = linear_to_oklab(to_linear(a)), to = linear_to_oklab(to_linear(b));
  return from_oklab(
      {from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1]), from[2] + share * (to[2] - from[2])});
}

}  // namespace assay
