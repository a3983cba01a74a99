#include "base/external_files.h"

#include <cstdlib>
#include <stdlib.h>  // NOLINT(*-deprecated-headers): setenv
#include <string_view>

namespace assay {
namespace {
constexpr const char* kVariable = "ASSAY_ALLOW_EXTERNAL_FILES";
}  // namespace

void agree_to_external_files() { ::setenv(kVariable, "1", 1); }

bool agreed_to_external_files() {
  const char* value = std::getenv(kVariable);
  return value != nullptr && std::string_view(value) == "1";
}

}  // namespace assay
