// libFuzzer's entry. ASSAY_FUZZ_TARGET in the environment names the target.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "targets.h"

namespace {
assay::fuzz::Target target = nullptr;
}

extern "C" int LLVMFuzzerInitialize(int* /*argc*/, char*** /*argv*/) {
  const char* name = std::getenv("ASSAY_FUZZ_TARGET");
  const auto& all = assay::fuzz::targets();
  const auto found = all.find(name == nullptr ? "" : name);
  if (found == all.end()) {
    std::fprintf(stderr, "set ASSAY_FUZZ_TARGET to one of:");
    for (const auto& [each, function] : all) std::fprintf(stderr, " %s", each.c_str());
    std::fputc('\n', stderr);
    std::exit(2);
  }
  target = found->second;
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  target({reinterpret_cast<const char*>(data), size});
  return 0;
}
