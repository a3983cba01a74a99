#include "base/json.h"

#include <cstdint>

namespace assay {

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
