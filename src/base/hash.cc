#include "base/hash.h"

#include <fstream>
#include <memory>
#include <vector>

#include <fmt/format.h>
#include <xxhash.h>

#include "base/errors.h"

namespace assay {

namespace {

std::string text_of(const XXH128_hash_t& hash) { return fmt::format("{:016x}{:016x}", hash.high64, hash.low64); }

}  // namespace

std::string content_hash(std::string_view bytes) { return text_of(XXH3_128bits(bytes.data(), bytes.size())); }

std::string file_hash(const std::string& path) {
  constexpr size_t kPiece = size_t{1} << 18U;  // so that a large file takes no memory
  std::ifstream file(path, std::ios::binary);
  std::vector<char> piece(kPiece);
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), &XXH3_freeState);
  XXH3_128bits_reset(state.get());
  while (file) {
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    XXH3_128bits_update(state.get(), piece.data(), static_cast<size_t>(file.gcount()));
  }
  if (!file.eof()) throw SystemError(fmt::format("cannot read '{}': check that it exists and is readable", path));
  return text_of(XXH3_128bits_digest(state.get()));
}

}  // namespace assay
