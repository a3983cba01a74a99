#include "explain/robots.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "check/parity/certificate.h"
#include "check/parity/examination.h"
#include "controls/changes/change.h"

namespace assay {
namespace {

using Json = nlohmann::ordered_json;

// A side's contender, which is given the side's model: its changes of the model are the engine's fault to parity.
struct FaultyContender {
  explicit FaultyContender(const Side& side) {
    Recipe recipe = recipe_of(side);
    std::erase_if(recipe.changes, [](const RunChange& change) { return change.kind == ChangeKind::kDampers; });
    engine = changed_engine(*recipe.contender.engine, recipe.changes);
    contender = std::move(recipe.contender);
    contender.name = side.contender;
    contender.engine = engine.get();
  }
  std::unique_ptr<Engine> engine;
  ResolvedContender contender;
};

// The certificate of one side, by itself or beside the other one.
Json examined(const ExplainQuestion& question, const Side& side, const parity::Bench& bench,
              const Side* beside = nullptr) {
  auto certificate = parity::examined_apart(question.model, side.contender, "", [&] {
    const FaultyContender own(side);
    const std::optional<FaultyContender> other =
        beside != nullptr ? std::optional<FaultyContender>(*beside) : std::nullopt;
    return parity::examine(question.model, bench, own.contender, other ? &other->contender : nullptr);
  });
  if (!certificate) throw SystemError("interrupted: nothing was found out");
  return std::move(*certificate);
}

// "joint 'knee'" -> "knee", "body 'shank' of joint 'knee'" -> "shank".
std::string quoted_name(const std::string& element) {
  const size_t first = element.find('\'');
  if (first == std::string::npos) return "";
  const size_t of = element.find("' of joint '", first);
  const size_t last = of == std::string::npos ? element.rfind('\'') : of;
  return last > first ? element.substr(first + 1, last - first - 1) : "";
}

bool is_open(const Json& certificate) { return certificate.at("verdict") == "not settled"; }

bool same_engine(const Side& a, const Side& b) {
  return recipe_of(a).contender.engine == recipe_of(b).contender.engine;
}

std::vector<SeenParameter> seen_in(const Json& certificate, bool in_b) {
  std::vector<SeenParameter> seen;
  if (certificate.at("verdict") != "differs") return seen;
  for (const Json& cause : certificate.at("causes")) {
    const std::string element = quoted_name(cause.at("element").get<std::string>());
    if (element.empty()) continue;
    seen.push_back({in_b, cause.at("parameter").get<std::string>(), element, cause.at("change").get<double>(),
                    cause.at("alike").get<std::vector<std::string>>()});
  }
  return seen;
}

// The same robot in both: one certificate says it.
bool same_robot(const Side& a, const Side& b) {
  return a.contender == b.contender && a.overrides == b.overrides && a.changes == b.changes;
}

Json interval_json(const Interval& interval) {
  return {{"value", interval.value}, {"low", interval.low}, {"high", interval.high}};
}

Json rate_json(const std::optional<double>& rate) { return rate ? Json(*rate) : Json(); }

Json side_json(const Side& side) {
  Json settings = Json::object();
  for (const auto& [name, value] : side.overrides) settings[name] = value;
  return {{"contender", side.contender}, {"settings", settings}, {"changes", change_texts(side.changes)}};
}

Json result_json(const SwapResult& result) {
  const bool measured = result.failure.empty();
  return {{"cause", result.swap.cause},
          {"swap", result.swap.words},
          {"advice", result.swap.advice},
          {"changes_a", change_texts(result.swap.a)},
          {"changes_b", change_texts(result.swap.b)},
          {"share", measured ? interval_json(result.share) : Json()},
          {"gap_m", measured ? interval_json(result.gap) : Json()},
          {"starts", result.starts},
          {"closes", result.closes()},
          {"fall_rate_a", rate_json(result.fall_rate_a)},
          {"fall_rate_b", rate_json(result.fall_rate_b)},
          {"failure", result.failure}};
}

}  // namespace

std::vector<SeenParameter> seen_parameters(const ExplainQuestion& question, Json& certificates,
                                           const std::function<void(const Side&)>& progress) {
  std::vector<SeenParameter> seen;
  if (question.model.dof() == 0) return seen;
  const parity::Bench bench(question.model, {.samples = 2});
  for (const Side* side : {&question.a, &question.b}) {
    const bool in_b = side == &question.b;
    progress(*side);
    const bool same = in_b && same_robot(question.a, question.b);
    certificates.push_back(same ? certificates[0] : examined(question, *side, bench));
    const bool open = in_b && !same && (is_open(certificates[0]) || is_open(certificates[1]));
    if (open && same_engine(question.a, question.b)) {
      certificates[1] = examined(question, question.b, bench, &question.a);
    }
    for (SeenParameter& each : seen_in(certificates.back(), in_b)) seen.push_back(std::move(each));
  }
  return seen;
}

// What rounding explains, of a run of some seconds.
double rounding_gap(const ExplainQuestion& question) {
  constexpr double kDouble = 1e-7, kSingle = 1e-5;  // m
  for (const Side* side : {&question.a, &question.b}) {
    const ResolvedContender contender = recipe_of(*side).contender;
    if (contender.engine->capabilities(contender.settings).precision == Precision::kSingle) return kSingle;
  }
  return kDouble;
}

Json explanation_json(const ExplainQuestion& question, const Explanation& found, const Swaps& swaps, double tolerance,
                      const Json& certificates) {
  Json causes = Json::array(), where = Json::array(), advice = Json::array(), not_possible = Json::array();
  for (const SwapResult& result : found.causes) causes.push_back(result_json(result));
  for (const SwapResult& result : found.where) where.push_back(result_json(result));
  for (const AdviceStep& step : found.advice) {
    const Swap& swap = found.causes[step.result].swap;
    advice.push_back({{"cause", swap.cause},
                      {"advice", swap.advice},
                      {"changes_a", change_texts(swap.a)},
                      {"changes_b", change_texts(swap.b)},
                      {"share_with_those_before", interval_json(step.share)}});
  }
  Json known = Json::array();
  for (const KnownDeviation& each : found.concerned) {
    known.push_back({{"side", each.in_b ? "B" : "A"}, {"of", each.of}, {"reason", each.reason}});
  }
  for (const NoSwap& each : swaps.not_possible) not_possible.push_back({{"cause", each.cause}, {"why", each.why}});
  return {{"system", question.model.name},
          {"model", question.spec.path},
          {"model_hash", question.model.hash},
          {"notes", question.model.notes},
          {"a", side_json(question.a)},
          {"b", side_json(question.b)},
          {"control", question.control->description()},
          {"timestep_ms", question.timestep_ms},
          {"seconds", question.seconds()},
          {"sample_ms", question.sample_ms},
          {"starts", question.starts},
          {"seed", question.states.seed},
          {"far_m", kFarMetres},
          {"tolerance_m", tolerance},
          {"verdict", gap_verdict_text(found.verdict)},
          {"gap_m", interval_json(found.gap)},
          {"gaps_m", found.gaps},
          {"parted", found.parted},
          {"timestep_gap_m", found.timestep_gap},
          {"ended_early_a", found.early_a},
          {"ended_early_b", found.early_b},
          {"fall_rate_a", rate_json(found.fall_rate_a)},
          {"fall_rate_b", rate_json(found.fall_rate_b)},
          {"parity", certificates},
          {"causes", causes},
          {"where", where},
          {"not_possible", not_possible},
          {"known_deviations", known},
          {"wrong", found.wrong_is_b ? Json(*found.wrong_is_b ? "B" : "A") : Json()},
          {"advice", advice},
          {"remaining_m", interval_json(found.remaining)}};
}

}  // namespace assay
