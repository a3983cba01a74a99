#include "results/limits.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

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

bool is_same(double a, double b) { return std::abs(a - b) <= 1e-9 * std::abs(b); }

}  // namespace

Question read_limits(const LimitOptions& options, const Askable& of, const FindValue& find) {
  Question question;
  const auto add = [&](const ValueInfo& value, double largest, const std::string& text) {
    const auto usual = std::ranges::find(of.usual, value.name, &UsualLimit::value);
    question.asked.push_back({value, largest, text, usual != of.usual.end() && is_same(usual->largest, largest)});
    question.limits.largest.emplace_back(value.name, largest);
  };
  const auto ask = [&](const std::string& option, const std::string& name, const std::string& text) {
    const ValueInfo value = find(option, name);
    const std::string what = option == "--limit" ? option + " " + name : option;
    const double largest = parse_quantity(what, text, value.unit);
    if (!(largest > 0))
      throw InputError(fmt::format("{} is '{}': no figure is below 0, give a limit above it", what, text));
    if (std::ranges::any_of(question.asked, [&](const Asked& asked) { return asked.value.name == value.name; })) {
      throw InputError(fmt::format("'{}' is limited twice: give one limit for it", value.name));
    }
    if (value.name == "penetration_max" && largest < of.start_overlap) {
      const bool added = std::ranges::any_of(of.usual, [&](const UsualLimit& usual) {
        return usual.option == "penetration" && usual.value != value.name;
      });
      throw InputError(fmt::format("{} is '{}': shapes {} overlap by {} when they start, so no run is within it; {}",
                                   what, text, of.where, quantity_text(of.start_overlap, "m"),
                                   added ? "--penetration limits what is beyond the start's overlap"
                                         : "give a larger limit, as these results have no other penetration"));
    }
    add(value, largest, text);
  };
  if (options.error && options.measure) {
    ask("--error", *options.measure, *options.error);
  } else if (options.error) {
    for (const std::string& error : of.errors) ask("--error", error, *options.error);
  }
  std::vector<std::string_view> without;  // no limit
  const std::pair<std::string, const std::optional<std::string>&> contacts[] = {{"penetration", options.penetration},
                                                                                {"slip", options.slip}};
  for (const auto& [name, text] : contacts) {
    if (!text) continue;
    if (*text == kAnyQuantity) {
      without.push_back(name);
      continue;
    }
    bool known = false;
    for (const UsualLimit& usual : of.usual) {
      if (usual.option != name) continue;
      ask("--" + name, usual.value, *text);
      known = true;
    }
    if (!known) {
      throw InputError(fmt::format("--{} is '{}', but {} {}: leave it out", name, *text,
                                   name == "slip" ? "nothing is held, or no slip is measured,"
                                                  : "nothing touches, or no penetration is measured,",
                                   of.where));
    }
  }
  for (const std::string& limit : options.limits) {
    const size_t equals = limit.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw InputError(fmt::format("--limit is '{}': write NAME=QUANTITY, as in truth_error_max=1mm", limit));
    }
    ask("--limit", limit.substr(0, equals), limit.substr(equals + 1));
  }
  if (options.realtime) question.limits.realtime = parse_positive("--realtime", *options.realtime, "times real time");
  std::vector<std::string_view> named;  // options in whose place a limit stands
  for (const Asked& asked : question.asked) named.push_back(usual_option(asked.value.name));
  for (const Asked& asked : question.asked) {
    const std::string_view option = usual_option(asked.value.name);
    if (std::ranges::find(without, option) == without.end()) continue;
    throw InputError(fmt::format("--{} is '{}', but '{}' is limited: leave one of the two out", option, kAnyQuantity,
                                 asked.value.name));
  }
  if (question.asked.empty() && !question.limits.realtime) return question;
  for (const UsualLimit& usual : of.usual) {
    const auto has = [&](const std::vector<std::string_view>& list) {
      return std::ranges::find(list, usual.option) != list.end();
    };
    if (has(without) || has(named)) continue;
    const ValueInfo value = find("--" + usual.option, usual.value);
    add(value, usual.largest, limit_text(usual.largest, value.unit));
  }
  return question;
}

Question question_of(const LimitOptions& options, const SystemAnswers& answers) {
  if (options.measure && !options.error) {
    throw InputError(fmt::format("--measure is '{}' without --error: add the largest error", *options.measure));
  }
  const Askable of = {.errors = answers.mains.empty() ? std::vector{answers.main} : answers.mains,
                      .usual = answers.usual,
                      .start_overlap = answers.start_overlap,
                      .where = fmt::format("on '{}'", answers.system)};
  Question question =
      read_limits(options, of, [&](const std::string&, const std::string& name) { return limitable(answers, name); });
  if (question.asked.empty() && !question.limits.realtime) {
    throw InputError("no limit was given: add --error, --penetration, --slip, --realtime or --limit");
  }
  return question;
}

std::string limit_of(const Asked& asked) {
  return phrase(asked.is_usual ? "within_usual" : "within", {{"value", asked.value.brief}, {"limit", asked.text}});
}

std::string limits_text(const Question& question) {
  std::vector<std::string> parts;
  parts.reserve(question.asked.size() + 1);
  for (const Asked& asked : question.asked) {
    parts.push_back(limit_of(asked));
  }
  if (question.limits.realtime) {
    parts.push_back(phrase("at_least", {{"realtime", realtime_text(*question.limits.realtime)}}));
  }
  return join(parts, ", ");
}

}  // namespace assay
