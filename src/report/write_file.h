#pragma once

#include <string>

namespace assay {

// Writes the file whole or not at all: what was there before stays until the new one is complete. Throws SystemError.
void write_file(const std::string& path, const std::string& content);

}  // namespace assay
