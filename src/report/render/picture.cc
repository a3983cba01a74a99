#include "report/render/picture.h"

#include <fmt/format.h>
#include <png.h>

#include "base/errors.h"

namespace assay {

std::string png_bytes(const Picture& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.rgb.data(), 0, nullptr) == 0) {
    throw SystemError(fmt::format("cannot make a PNG of {} x {} pixels: {}", picture.width, picture.height,
                                  static_cast<const char*>(image.message)));
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace assay
