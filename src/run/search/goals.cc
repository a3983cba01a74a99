#include "run/search/goals.h"

#include <algorithm>
#include <array>
#include <optional>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "measures/violation.h"

namespace assay {
namespace {

constexpr std::array<const char*, 3> kUsualErrors = {"10mm", "1mm", "0.1mm"};

constexpr const char* kPenetration = "penetration_added_max";
constexpr const char* kSlip = "grasp_slip";

bool measures_value(const CampaignSystem& system, const std::string& value) {
  const std::string measure = value_info(value).measure;
  return std::ranges::any_of(system.measures, [&](const Measure* each) { return each->name == measure; });
}

bool touches(const CampaignSystem& system) {
  return measures_value(system, kPenetration) && !system.model.contacts.empty();
}

bool is_measured(const Campaign& campaign, const ValueInfo& value) {
  return std::ranges::any_of(campaign.systems,
                             [&](const CampaignSystem& system) { return measures_value(system, value.name); });
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
    const std::string_view value = system.has(Reads::kSolution) ? kTruthError : "consistency_cold";
    if (std::ranges::find(values, value) == values.end()) values.emplace_back(value);
  }
  return values;
}

std::vector<UsualLimit> usual_limits(const Campaign& campaign) {
  std::optional<double> depth;
  bool holds = false;
  for (const CampaignSystem& system : campaign.systems) {
    holds = holds || measures_value(system, kSlip);
    if (!touches(system) || !Separations(system.model).has_all()) continue;
    const double own = usual_penetration_limit(system.model).value_or(kUsualPenetration);
    depth = std::min(depth.value_or(own), own);
  }
  std::vector<UsualLimit> usual;
  if (depth) usual.push_back({"penetration", kPenetration, *depth});
  if (holds) usual.push_back({"slip", kSlip, kUsualSlip});
  return usual;
}

Question question_of(const Campaign& campaign, const LimitOptions& options) {
  Askable of = {.errors = errors_of(campaign),
                .usual = usual_limits(campaign),
                .where = fmt::format("on any system of '{}'", campaign.name)};
  for (const CampaignSystem& system : campaign.systems) {
    if (!touches(system)) continue;
    of.start_overlap = std::max(of.start_overlap, Separations(system.model).deepest(system.model.initial).whole);
  }
  return read_limits(options, of, [&](const std::string& option, const std::string& name) {
    return limitable_in(campaign, option, name);
  });
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
  if (options.error || options.realtime || !options.limits.empty()) return {options};
  std::vector<LimitOptions> goals(kUsualErrors.size(), options);
  for (size_t i = 0; i < goals.size(); ++i) goals[i].error = kUsualErrors[i];
  return goals;
}

}  // namespace assay
