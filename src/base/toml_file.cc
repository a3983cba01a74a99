#include "base/toml_file.h"

#include <fmt/format.h>

#include "base/errors.h"

namespace assay {
namespace {

void refuse_nul(std::string_view text, const toml::source_region& where, const std::string& source) {
  const size_t at = text.find('\0');
  if (at == std::string_view::npos) return;
  throw InputError(fmt::format("{}:{}: a text has a NUL character (\\u0000) behind '{}': remove it", source,
                               where.begin.line, text.substr(0, at)));
}

void refuse_nul(const toml::node& node, const std::string& source) {
  if (const auto* text = node.as_string()) refuse_nul(text->get(), node.source(), source);
  if (const toml::array* array = node.as_array()) {
    for (const toml::node& entry : *array) refuse_nul(entry, source);
  }
  if (const toml::table* table = node.as_table()) {
    for (const auto& [key, value] : *table) {
      refuse_nul(key.str(), key.source(), source);
      refuse_nul(value, source);
    }
  }
}

}  // namespace

toml::table toml_table(std::string_view text, const std::string& source) {
  toml::table table;
  try {
    table = toml::parse(text, source);
  } catch (const toml::parse_error& error) {
    throw InputError(
        fmt::format("{}:{}: this is not TOML: {}", source, error.source().begin.line, error.description()));
  }
  refuse_nul(table, source);
  return table;
}

}  // namespace assay
