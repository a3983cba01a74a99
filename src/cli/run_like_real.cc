// `assay run ROBOT --like-real DIR`: which contender is the fastest that moves as the robot did.
#include <algorithm>
#include <filesystem>
#include <optional>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/paths.h"
#include "base/quantity.h"
#include "base/text.h"
#include "base/write_file.h"
#include "campaign/campaign.h"
#include "campaign/load_keys.h"
#include "cli/answer.h"
#include "cli/run_robot.h"
#include "load/mjcf.h"
#include "match/like_real.h"
#include "results/results.h"
#include "run/search/programme_file.h"

namespace assay::cli {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostRows = 24;
constexpr const char* kDefaultOut = "-like-real";

// A point with the speed that was measured.
struct Timed {
  match::RealPoint point;
  std::optional<Speed> speed;
  std::string why;  // there is none
};

void refuse_other_questions(const RobotRequest& request) {
  const LimitOptions& limits = request.limits;
  if (request.policy.any() || request.control || request.seeds || request.seconds || request.push ||
      request.push_every || request.push_joint || !request.timesteps.empty() || request.minutes || limits.measure ||
      limits.penetration || limits.slip || !limits.limits.empty() || request.plan_only) {
    throw InputError(
        "--like-real asks for speed within an error to measured motion: beside it only --error, --realtime, "
        "--contenders, --out and how the model is read can be given");
  }
}

// Those of the contenders that --contenders names. Throws InputError where that is none.
std::vector<match::RealPoint> asked_points(const RobotRequest& request, const match::RealMatch& found) {
  std::vector<match::RealPoint> points;
  for (const match::RealPoint& point : found.points) {
    const auto of = std::ranges::find(found.contenders, point.contender, &match::RealContender::name);
    if (request.contenders.empty() || std::ranges::any_of(request.contenders, [&](const std::string& pattern) {
          return match::matches_pattern(of->base, pattern);
        })) {
      points.push_back(point);
    }
  }
  if (!points.empty()) return points;
  std::vector<std::string> names;
  for (const match::RealContender& contender : found.contenders) names.push_back(contender.base);
  throw InputError(fmt::format("--contenders {}: the match fitted none of them; it fitted {}",
                               join(request.contenders, ","), join(names, ", ")));
}

// Of `asked` the points that are within the limit. Throws InputError where there are none, with what is nearest.
std::vector<match::RealPoint> within(const std::vector<match::RealPoint>& asked, const match::RealMatch& found,
                                     const match::RealLimit& limit) {
  std::vector<match::RealPoint> points;
  const match::RealPoint* nearest = nullptr;
  for (const match::RealPoint& point : asked) {
    if (match::is_within(point, limit, found)) points.push_back(point);
    if (point.failed == 0 && (nearest == nullptr || point.score < nearest->score)) nearest = &point;
  }
  if (!points.empty()) return points;
  throw InputError(fmt::format(
      "nothing that was asked is {}: {}", limit.text,
      nearest == nullptr ? "with every contender some held-out motion ends early"
                         : fmt::format("the nearest is {} at {} ms, which is off by {}", nearest->contender,
                                       timestep_label(nearest->timestep_ms), match::figures_text(nearest->error))));
}

std::string speed_text(const Timed& timed) {
  if (!timed.speed) return timed.why;
  const Interval& factor = timed.speed->factor;
  return fmt::format("{} ({} to {})", realtime_text(factor.value), number_text(factor.low), number_text(factor.high));
}

Json json_of(const Timed& timed) {
  Json json = {{"contender", timed.point.contender}, {"timestep_ms", timed.point.timestep_ms}};
  const match::ErrorFigures& error = timed.point.error;
  if (error.joints_deg) json["joints_deg"] = *error.joints_deg;
  if (error.position_percent) json["position_percent"] = *error.position_percent;
  if (error.rotation_deg) json["rotation_deg"] = *error.rotation_deg;
  if (timed.speed) {
    const Interval& factor = timed.speed->factor;
    json["realtime_factor"] = {{"value", factor.value}, {"low", factor.low}, {"high", factor.high}};
  }
  return json;
}

Answer answer_of(const std::string& robot, const std::vector<Timed>& points, const match::RealMatch& found,
                 const match::RealLimit& limit, std::optional<double> least, bool& any) {
  Answer answer;
  answer.part(fmt::format("{}: the fastest that moves as measured", robot));
  const Timed& best = points.front();
  any = best.speed && (!least || best.speed->factor.value >= *least);
  if (!best.speed) {
    answer.line(fmt::format("no speed was measured: {}", best.why));
  } else if (!any) {
    answer.line(fmt::format("nothing {} is at least {} real time; the fastest is {} at {} ms, {}", limit.text,
                            realtime_text(*least), best.point.contender, timestep_label(best.point.timestep_ms),
                            realtime_text(best.speed->factor.value)));
  } else {
    answer.line(fmt::format("{} at {} ms, {} real time: held-out motion is off by {}", best.point.contender,
                            timestep_label(best.point.timestep_ms), realtime_text(best.speed->factor.value),
                            match::figures_text(best.point.error)));
    std::vector<std::string> alike;
    for (const Timed& other : points) {
      if (&other != &best && other.speed && other.speed->factor.high >= best.speed->factor.low) {
        alike.push_back(fmt::format("{} at {} ms", other.point.contender, timestep_label(other.point.timestep_ms)));
      }
    }
    if (!alike.empty()) answer.line("no figure tells its speed from that of " + join(alike, ", "));
    double largest = 0;
    for (const match::RealPoint& point : found.points) {
      if (point.contender == best.point.contender) largest = std::max(largest, point.timestep_ms);
    }
    if (best.point.timestep_ms == largest) {
      answer.remark("edge",
                    fmt::format("{} ms is the largest timestep at which the match judged its fits: a larger one "
                                "may do, too",
                                timestep_label(largest)));
    }
  }
  answer.remark("limit", limit.text + "; of a timestep counts the largest error at it and all smaller ones");
  answer.remark("fitted at",
                fmt::format("{} ms; speeds are of the model as its file has it, with the settings that were "
                            "fitted, at rest but for gravity",
                            timestep_label(found.timestep_ms)));
  if (!found.to_do.empty()) answer.remark("not fitted yet", join(found.to_do, ", "));
  std::vector<std::vector<std::string>> rows;
  for (const Timed& timed : points) {
    if (rows.size() == kMostRows) break;
    rows.push_back({timed.point.contender, timestep_label(timed.point.timestep_ms) + " ms", speed_text(timed),
                    match::figures_text(timed.point.error)});
  }
  answer.table({"contender", "timestep", "times real time", "held out"}, std::move(rows));
  if (points.size() > kMostRows) answer.line(fmt::format("and {} more, in like_real.json", points.size() - kMostRows));
  for (const match::RealContender& contender : found.contenders) {
    if (contender.settings.empty()) continue;
    std::vector<std::string> settings;
    for (const auto& [name, value] : contender.settings) settings.push_back(name + "=" + value);
    answer.fact(contender.name, fmt::format("{} with {}", contender.base, join(settings, ", ")));
  }
  return answer;
}

}  // namespace

int run_like_real(const RobotRequest& request) {
  refuse_other_questions(request);
  RunRequest run = request.run;
  const std::string file = find_model(run.campaign);
  if (run.out.empty()) run.out = fs::path(file).stem().string() + kDefaultOut;
  const LoadOptions how = load_options(request.model);
  const Model model = load_model(file, how);
  const match::RealMatch found = match::read_real_match(request.like_real);
  if (found.model_hash != model.hash) {
    throw InputError(
        fmt::format("the match in '{}' is of another model than '{}': give the file that was matched, read "
                    "the same way",
                    request.like_real, run.campaign));
  }
  const match::RealLimit limit = match::real_limit(request.limits.error, found);
  std::optional<double> least;
  if (request.limits.realtime) least = parse_positive("--realtime", *request.limits.realtime, "times real time");
  const std::vector<match::RealPoint> points = within(asked_points(request, found), found, limit);

  const Programme programme{.toml = match::timing_campaign(
                                found, points, model.name, relative_path(file, run.out),
                                load_lines(how, [&](const std::string& path) { return relative_path(path, run.out); })),
                            .systems = {},
                            .contenders = {},
                            .refusals = {}};
  run.campaign = write_programme(run.out, programme, message);
  print(paragraph("programme: " + run.campaign, 2));
  flush_output();
  if (!run_and_summarize(run)) return kFailed;

  const Store store = Store::open(run.out);
  const Results results(store);
  std::vector<Timed> timed;
  for (const match::RealPoint& point : points) {
    Timed& each = timed.emplace_back(point, results.speed(model.name, point.contender, point.timestep_ms), "");
    if (!each.speed) each.why = results.why_missing(model.name, point.contender, "step_time", point.timestep_ms);
  }
  std::ranges::stable_sort(timed, std::greater(),
                           [](const Timed& each) { return each.speed ? each.speed->factor.value : -1.0; });
  bool any = false;
  print("\n");
  print(answer_of(model.name, timed, found, limit, least, any));
  Json json = {{"limit", limit.text}, {"match", request.like_real}, {"points", Json::array()}};
  for (const Timed& each : timed) json["points"].push_back(json_of(each));
  write_file((fs::path(run.out) / "like_real.json").string(), dump_json(json, 1) + "\n");
  return any ? kDone : kFailed;
}

}  // namespace assay::cli
