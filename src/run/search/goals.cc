#include "run/search/goals.h"

#include <algorithm>
#include <array>
#include <optional>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"

namespace assay {
namespace {

constexpr std::array<const char*, 3> kUsualErrors = {"10mm", "1mm", "0.1mm"};

bool is_measured(const Campaign& campaign, const ValueInfo& value) {
  return std::ranges::any_of(campaign.systems, [&](const CampaignSystem& system) {
    return std::ranges::any_of(system.measures, [&](const Measure* measure) { return measure->name == value.measure; });
  });
}

ValueInfo limitable_in(const Campaign& campaign, const std::string& option, const std::string& given) {
  const std::string named = value_named(given);
  const ValueInfo value = value_info(named.empty() ? given : named);
  const bool measured = is_measured(campaign, value);
  if (value.limit && measured) return value;
  std::vector<std::string> names;
  for (const ValueInfo& each : value_catalogue()) {
    if (each.limit && is_measured(campaign, each)) names.push_back(each.name);
  }
  throw InputError(fmt::format("{}: '{}' {}{}", option, given,
                               measured ? "is no error and cannot be limited"
                                        : fmt::format("is not measured on any system of '{}'", campaign.name),
                               did_you_mean(given, names)));
}

}  // namespace

std::vector<std::string> errors_of(const Campaign& campaign) {
  std::vector<std::string> values;
  for (const CampaignSystem& system : campaign.systems) {
    if (!system.has(Reads::kSolution) && !system.has(Reads::kPieces)) continue;
    const std::string_view value = system.has(Reads::kSolution) ? kTruthError : "consistency";
    if (std::ranges::find(values, value) == values.end()) values.emplace_back(value);
  }
  return values;
}

Limits limits_of(const Campaign& campaign, const LimitOptions& options) {
  return read_limits(
             options, errors_of(campaign),
             [&](const std::string& option, const std::string& name) { return limitable_in(campaign, option, name); })
      .limits;
}

LimitOptions limits_in(const SearchTable& table) {
  LimitOptions options;
  for (const auto& [key, member] : {std::pair("error", &LimitOptions::error),
                                    {"penetration", &LimitOptions::penetration},
                                    {"slip", &LimitOptions::slip},
                                    {"realtime", &LimitOptions::realtime}}) {
    if (const auto found = table.limits.find(key); found != table.limits.end()) options.*member = found->second;
  }
  options.limits = table.other_limits;
  return options;
}

std::vector<LimitOptions> goals_of(const LimitOptions& options) {
  if (options.any()) return {options};
  std::vector<LimitOptions> goals;
  for (const char* error : kUsualErrors) goals.emplace_back().error = error;
  return goals;
}

}  // namespace assay
