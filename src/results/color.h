// Colours in sRGB.
#pragma once

#include <array>
#include <string>

namespace assay {

struct Color {
  double r = 0, g = 0, b = 0;  // 0 to 1, sRGB
  double opacity = 1;
};

Color parse_color(const std::string& hex);   // "#1463c4"
std::string color_text(const Color& color);  // the same, without the opacity

// `share` of `b` in `a`, mixed in Oklab as CSS's color-mix(in oklab, ...) does.
Color mix(const Color& a, const Color& b, double share);

// In linear light, and in Oklab (lightness, green-red, blue-yellow), where distances are about as large as they look.
std::array<double, 3> to_linear(const Color& color);
std::array<double, 3> linear_to_oklab(const std::array<double, 3>& linear);

}  // namespace assay
