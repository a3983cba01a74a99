// Pixels, and PNG files of them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace assay {

struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // 3 bytes a pixel, rows from the top
};

// The picture as a PNG file's bytes. Throws SystemError.
std::string png_bytes(const Picture& picture);

}  // namespace assay
