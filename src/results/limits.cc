#include "results/limits.h"

#include <algorithm>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/option_values.h"
#include "base/quantity.h"
#include "base/text.h"
#include "results/answer.h"

namespace assay {
namespace {

// A value of the system that can be limited, by its name or its measure's.
const ValueInfo& limitable(const SystemAnswers& answers, const std::string& name) {
  const std::string named = value_named(name, answers.values), own = named.empty() ? name : named;
  const auto known = std::ranges::find(answers.values, own, &ValueInfo::name);
  const std::string near = did_you_mean(name, answers.errors);
  if (known == answers.values.end()) {
    throw InputError(fmt::format("'{}' was not measured by '{}'{}", answers.system, name, near));
  }
  if (std::ranges::find(answers.errors, own) == answers.errors.end()) {
    throw InputError(fmt::format("'{}' cannot be limited: it is no error that was measured on '{}' (known: {})", own,
                                 answers.system, join(answers.errors, ", ")));
  }
  return *known;
}

}  // namespace

Question read_limits(const LimitOptions& options, const std::vector<std::string>& errors, const FindValue& find) {
  Question question;
  const auto ask = [&](const std::string& option, const std::string& name, const std::string& text) {
    const ValueInfo value = find(option, name);
    const std::string what = option == "--limit" ? option + " " + name : option;
    const double largest = parse_quantity(what, text, value.unit);
    if (std::ranges::any_of(question.asked, [&](const Asked& asked) { return asked.value.name == value.name; })) {
      throw InputError(fmt::format("'{}' is limited twice: give one limit for it", value.name));
    }
    question.asked.push_back({value, largest, text});
    question.limits.largest.emplace_back(value.name, largest);
  };
  if (options.error && options.measure) {
    ask("--error", *options.measure, *options.error);
  } else if (options.error) {
    for (const std::string& error : errors) ask("--error", error, *options.error);
  }
  if (options.penetration) ask("--penetration", "penetration_max", *options.penetration);
  if (options.slip) ask("--slip", "grasp_slip", *options.slip);
  for (const std::string& limit : options.limits) {
    const size_t equals = limit.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw InputError(fmt::format("--limit is '{}': write NAME=QUANTITY, as in truth_error_max=1mm", limit));
    }
    ask("--limit", limit.substr(0, equals), limit.substr(equals + 1));
  }
  if (options.realtime) question.limits.realtime = parse_positive("--realtime", *options.realtime, "times real time");
  return question;
}

Question question_of(const LimitOptions& options, const SystemAnswers& answers) {
  if (options.measure && !options.error) {
    throw InputError(fmt::format("--measure is '{}' without --error: add the largest error", *options.measure));
  }
  const std::vector<std::string> errors = answers.mains.empty() ? std::vector{answers.main} : answers.mains;
  Question question = read_limits(
      options, errors, [&](const std::string&, const std::string& name) { return limitable(answers, name); });
  if (question.asked.empty() && !question.limits.realtime) {
    throw InputError("no limit was given: add --error, --penetration, --slip, --realtime or --limit");
  }
  return question;
}

std::string limits_text(const Question& question) {
  std::vector<std::string> parts;
  parts.reserve(question.asked.size() + 1);
  for (const Asked& asked : question.asked) {
    parts.push_back(phrase("within", {{"value", asked.value.brief}, {"limit", asked.text}}));
  }
  if (question.limits.realtime) {
    parts.push_back(phrase("at_least", {{"realtime", realtime_text(*question.limits.realtime)}}));
  }
  return join(parts, ", ");
}

}  // namespace assay
