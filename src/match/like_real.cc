#include "match/like_real.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <set>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/quantity.h"
#include "base/text.h"
#include "controls/toml_text.h"
#include "match/folder.h"

namespace assay::match {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kSeconds = 2;                 // of the run that is timed
constexpr const char* kFitted = "-like-real";  // ends the name of a contender whose settings were fitted

std::optional<double> figure(const json& figures, const char* name) {
  const auto found = figures.find(name);
  return found == figures.end() ? std::nullopt : std::optional(found->get<double>());
}

ErrorFigures figures_from(const json& figures) {
  return {figure(figures, "joints_deg"), figure(figures, "position_percent"), figure(figures, "rotation_deg")};
}

void raise(std::optional<double>& figure, const std::optional<double>& other) {
  if (other) figure = std::max(figure.value_or(0), *other);
}

void add_contender(const json& fitted, RealMatch& match) {
  RealContender contender;
  contender.base = fitted.at("contender").get<std::string>();
  contender.settings = fitted.at("settings").get<std::map<std::string, std::string>>();
  contender.name = contender.base + (contender.settings.empty() ? "" : kFitted);
  RealPoint point;  // the largest so far
  for (const json& at : fitted.at("timesteps")) {
    point.contender = contender.name;
    point.timestep_ms = at.at("timestep_ms").get<double>();
    const ErrorFigures error = figures_from(at.at("held_out"));
    raise(point.error.joints_deg, error.joints_deg);
    raise(point.error.position_percent, error.position_percent);
    raise(point.error.rotation_deg, error.rotation_deg);
    point.score = std::max(point.score, at.at("score").at("value").get<double>());
    point.windows = at.at("windows").get<int>();
    point.failed = std::max(point.failed, at.at("failed").get<int>());
    match.points.push_back(point);
  }
  match.contenders.push_back(std::move(contender));
}

RealMatch match_from(const json& answer, const std::string& dir) {
  RealMatch match;
  match.model_hash = answer.at("model_hash").get<std::string>();
  match.timestep_ms = answer.at("timestep_ms").get<double>();
  match.to_do = answer.at("to_do").get<std::vector<std::string>>();
  for (const json& contender : answer.at("contenders")) {
    if (!contender.at("failure").is_null()) continue;
    if (match.contenders.empty()) {
      match.best = contender.at("contender").get<std::string>();
      match.best_high = contender.at("score").at("high").get<double>();
    }
    add_contender(contender, match);
  }
  if (match.points.empty()) {
    throw InputError(
        fmt::format("the match in '{}' has no contender whose held-out motion can be predicted: see "
                    "'assay report {}'",
                    dir, dir));
  }
  return match;
}

}  // namespace

RealMatch read_real_match(const std::string& dir) {
  if (!is_match_folder(dir)) {
    throw InputError(fmt::format("'{}' is no folder of 'assay match': give the one that its --out named", dir));
  }
  std::ifstream file(fs::path(dir) / kAnswerFile);
  const json answer = json::parse(file, nullptr, /*allow_exceptions=*/false);
  try {
    return match_from(answer, dir);
  } catch (const json::exception&) {
    throw InputError(fmt::format("'{}' is of an earlier version of 'assay match', or damaged: start the match again",
                                 (fs::path(dir) / kAnswerFile).string()));
  }
}

RealLimit real_limit(const std::optional<std::string>& given, const RealMatch& match) {
  if (!given) {
    return {{}, {}, fmt::format("as good as {}, the best, within the interval of its error", match.best)};
  }
  const bool percent = given->ends_with('%');
  if (!percent && !given->ends_with("deg")) {
    throw InputError(
        fmt::format("--error '{}': with --like-real it is in % of the body's size or in degrees, as in 5% "
                    "or 2deg",
                    *given));
  }
  const auto has = [&](auto member) {
    return std::ranges::any_of(match.points, [&](const RealPoint& point) { return (point.error.*member).has_value(); });
  };
  RealLimit limit;
  limit.text = "within an error of " + *given;
  constexpr double kPercent = 0.01;
  if (percent) {
    if (!has(&ErrorFigures::position_percent)) {
      throw InputError(fmt::format("--error '{}': the match measured joints alone: give degrees, as in 2deg", *given));
    }
    limit.percent = parse_quantity("--error", *given, "1") / kPercent;
  } else {
    limit.degrees = parse_quantity("--error", *given, "rad") * 180 / std::numbers::pi;
  }
  return limit;
}

bool is_within(const RealPoint& point, const RealLimit& limit, const RealMatch& match) {
  if (point.failed > 0) return false;
  if (!limit.percent && !limit.degrees) return point.score <= match.best_high;
  const auto within = [](const std::optional<double>& error, const std::optional<double>& largest) {
    return !error || !largest || *error <= *largest;
  };
  return within(point.error.position_percent, limit.percent) && within(point.error.joints_deg, limit.degrees) &&
         within(point.error.rotation_deg, limit.degrees);
}

std::string timing_campaign(const RealMatch& match, const std::vector<RealPoint>& points, const std::string& system,
                            const std::string& model, const std::vector<std::string>& model_lines) {
  std::set<double> timesteps;
  std::vector<std::string> names;
  for (const RealPoint& point : points) {
    timesteps.insert(point.timestep_ms);
    if (names.empty() || names.back() != toml_text(point.contender)) names.push_back(toml_text(point.contender));
  }
  std::vector<std::string> steps;
  for (const double timestep_ms : timesteps) steps.push_back(fmt::format("{}", timestep_ms));
  std::string toml = fmt::format(
      "name = \"like-real\"\ntitle = {}\ncontenders = [{}]\nmeasures = [\"raw_speed\"]\ntimesteps_ms = [{}]\n",
      toml_text(system + ": the speed of what moves as measured"), join(names, ", "), join(steps, ", "));
  for (const RealContender& contender : match.contenders) {
    if (contender.settings.empty()) continue;
    if (std::ranges::find(names, toml_text(contender.name)) == names.end()) continue;
    std::vector<std::string> settings;
    for (const auto& [name, value] : contender.settings) settings.push_back(fmt::format("{} = {}", name, value));
    toml += fmt::format("\n[[contender]]\nname = {}\nbase = {}\nset = {{{}}}\n", toml_text(contender.name),
                        toml_text(contender.base), join(settings, ", "));
  }
  toml += fmt::format("\n[[system]]\nname = {}\nmodel = {}\nduration_s = {:g}\n", toml_text(system), toml_text(model),
                      kSeconds);
  for (const std::string& line : model_lines) toml += line + "\n";
  return toml;
}

}  // namespace assay::match
