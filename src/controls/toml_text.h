// Texts in the TOML files that assay writes.
#pragma once

#include <string>

namespace assay {

// A text as a TOML string. Throws InputError for one whose bytes are not UTF-8.
std::string toml_text(const std::string& text);

}  // namespace assay
