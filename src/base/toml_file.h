// TOML that users write.
#pragma once

#include <string>
#include <string_view>

#include <toml++/toml.h>

namespace assay {

// The file's table. Throws InputError with file and line for what is not TOML, and for a text or key with a NUL: the
// system ends names and paths there, so that another file than the one written would be read.
toml::table toml_table(std::string_view text, const std::string& source);

}  // namespace assay
