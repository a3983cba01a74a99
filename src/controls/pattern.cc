#include "controls/pattern.h"

#include <array>

#include <fmt/format.h>

#define PCRE2_CODE_UNIT_WIDTH 8
#include <pcre2.h>

namespace assay {
namespace {

std::string message_of(int error) {
  constexpr size_t kLongest = 256;
  std::array<PCRE2_UCHAR, kLongest> text{};
  pcre2_get_error_message(error, text.data(), text.size());
  return reinterpret_cast<const char*>(text.data());
}

PCRE2_SPTR units_of(const std::string& text) { return reinterpret_cast<PCRE2_SPTR>(text.data()); }

}  // namespace

struct Pattern::Code {
  std::unique_ptr<pcre2_code, decltype(&pcre2_code_free)> code{nullptr, &pcre2_code_free};
  std::unique_ptr<pcre2_match_context, decltype(&pcre2_match_context_free)> limits{pcre2_match_context_create(nullptr),
                                                                                   &pcre2_match_context_free};
};

Pattern::Pattern(const std::string& text) {
  int error = 0;
  PCRE2_SIZE at = 0;
  auto made = std::make_shared<Code>();
  made->code.reset(
      pcre2_compile(units_of(text), text.size(), PCRE2_ANCHORED | PCRE2_ENDANCHORED, &error, &at, nullptr));
  if (!made->code) throw PatternError(fmt::format("{} (at character {})", message_of(error), at + 1));
  constexpr unsigned kMostMemory = 16 * 1024;  // KiB
  pcre2_set_match_limit(made->limits.get(), kMostSteps);
  pcre2_set_heap_limit(made->limits.get(), kMostMemory);
  code_ = std::move(made);
}

bool Pattern::matches(const std::string& name) const {
  const std::unique_ptr<pcre2_match_data, decltype(&pcre2_match_data_free)> found(pcre2_match_data_create(1, nullptr),
                                                                                  &pcre2_match_data_free);
  const int result =
      pcre2_match(code_->code.get(), units_of(name), name.size(), 0, 0, found.get(), code_->limits.get());
  if (result >= 0) return true;
  if (result == PCRE2_ERROR_NOMATCH) return false;
  throw PatternError(message_of(result));
}

}  // namespace assay
