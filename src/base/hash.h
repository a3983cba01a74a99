// Content addresses: equal bytes have equal names across machines and runs.
#pragma once

#include <string>
#include <string_view>

namespace assay {

// XXH3 128-bit of the bytes as 32 lower-case hexadecimal digits. Not cryptographic: it names content and
// does not protect it.
std::string content_hash(std::string_view bytes);

// The same for a file's content. Throws SystemError when the file cannot be read.
std::string file_hash(const std::string& path);

}  // namespace assay
