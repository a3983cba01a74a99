// Regular expressions of configurations, by PCRE2, whose syntax is Python's in all that names of joints need.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

namespace assay {

// What is wrong with a pattern, or that a match would take too long: half a sentence.
struct PatternError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Pattern {
 public:
  // Throws PatternError for a text that is no regular expression.
  explicit Pattern(const std::string& text);

  // Whether the whole of `name` matches. Throws PatternError for a pattern that needs more than kMostSteps of trying.
  bool matches(const std::string& name) const;

  static constexpr unsigned kMostSteps = 100000;

 private:
  struct Code;
  std::shared_ptr<const Code> code_;
};

}  // namespace assay
