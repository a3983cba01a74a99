#include "base/json.h"

#include <algorithm>
#include <cstdint>

#include <fmt/format.h>

#include "base/text.h"

namespace assay {

std::string without_steering(std::string json) {
  const auto plain = [](char c) { return static_cast<unsigned char>(c) < 0x7f; };
  if (std::ranges::all_of(json, plain)) return json;
  std::string out;
  out.reserve(json.size());
  for (size_t at = 0; at < json.size();) {
    const auto first = static_cast<unsigned char>(json[at]);
    size_t bytes = 1;
    for (const unsigned least : {0xc0U, 0xe0U, 0xf0U}) bytes += first >= least ? 1 : 0;
    char32_t code = first & (bytes == 1 ? 0x7fU : 0x7fU >> bytes);
    for (size_t i = 1; i < bytes && at + i < json.size(); ++i) {
      code = code << 6U | (static_cast<unsigned char>(json[at + i]) & 0x3fU);
    }
    if (steers(code)) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(code));
    } else {
      out.append(json, at, bytes);
    }
    at += bytes;
  }
  return out;
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const auto first = static_cast<unsigned char>(text.front());
    // bytes of the character, and the least code that needs so many
    size_t bytes = 1;
    std::uint32_t code = first, least = 0;
    if (first >= 0xf0 && first < 0xf8) {
      bytes = 4;
      code = first & 0x07U;
      least = 0x10000;
    } else if (first >= 0xe0 && first < 0xf0) {
      bytes = 3;
      code = first & 0x0fU;
      least = 0x800;
    } else if (first >= 0xc0 && first < 0xe0) {
      bytes = 2;
      code = first & 0x1fU;
      least = 0x80;
    } else if (first >= 0x80) {
      return false;
    }
    if (text.size() < bytes) return false;
    for (const char c : text.substr(1, bytes - 1)) {
      const auto next = static_cast<unsigned char>(c);
      if ((next & 0xc0U) != 0x80) return false;
      code = code << 6U | (next & 0x3fU);
    }
    const bool is_surrogate = code >= 0xd800 && code < 0xe000;
    if (code < least || code > 0x10ffff || is_surrogate) return false;
    text.remove_prefix(bytes);
  }
  return true;
}

}  // namespace assay
