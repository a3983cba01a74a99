#include "base/hash.h"

#include <fstream>
#include <sstream>

#include <fmt/format.h>
#include <xxhash.h>

#include "base/errors.h"

namespace assay {

std::string content_hash(std::string_view bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

std::string file_hash(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  if (!file) throw SystemError(fmt::format("cannot read '{}': check that it exists and is readable", path));
  return content_hash(bytes.str());
}

}  // namespace assay
