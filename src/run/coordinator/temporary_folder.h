// A folder that is removed with its content when the object goes.
#pragma once

#include <filesystem>
#include <stdlib.h>  // NOLINT(*-deprecated-headers): mkdtemp
#include <string>

#include "base/errors.h"

namespace assay {

class TemporaryFolder {
 public:
  // Throws SystemError.
  TemporaryFolder() : path_((std::filesystem::temp_directory_path() / "assay-XXXXXX").string()) {
    if (::mkdtemp(path_.data()) == nullptr) throw SystemError("cannot make the folder '" + path_ + "'");
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace assay
