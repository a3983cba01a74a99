#include "controls/toml_text.h"

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/terminal.h"

namespace assay {

std::string toml_text(const std::string& text) {
  if (!is_utf8(text)) {
    throw InputError(
        fmt::format("'{}' cannot stand in a TOML file, because its bytes are not UTF-8: rename it", printable(text)));
  }
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (static_cast<unsigned char>(c) < ' ') {
      quoted += fmt::format("\\u{:04x}", static_cast<int>(c));
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

}  // namespace assay
