// JSON as text, wherever it goes: a file, a database, a process or a hash.
#pragma once

#include <string>
#include <string_view>

namespace assay {

// `json` with the escapes of such characters, which stand in its texts alone.
std::string without_steering(std::string json);

// `value` on one line, or with `indent` spaces a level. Names come from files, engines and paths, whose bytes need not
// be UTF-8 as JSON demands: those that are not become U+FFFD, where nlohmann's own dump() would throw. Characters that
// could steer a terminal or turn its writing direction stand as "\u202e". A template, because members are sorted in
// some places and keep their order in others.
template <typename Json>
std::string dump_json(const Json& value, int indent = -1) {
  return without_steering(value.dump(indent, ' ', false, Json::error_handler_t::replace));
}

// Whether all bytes are characters of UTF-8, as texts of JSON and TOML have to be.
bool is_utf8(std::string_view text);

}  // namespace assay
