// `assay explain`: why two contenders part on one robot, and which setting closes the gap.
#include "explain/explain.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <memory>
#include <optional>
#include <tuple>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/quantity.h"
#include "base/text.h"
#include "check/parity/certificate.h"
#include "cli/answer.h"
#include "cli/commands.h"
#include "cli/explain_options.h"
#include "explain/robots.h"
#include "explain/runs.h"

namespace assay::cli {
namespace {

using ProgressClock = std::chrono::steady_clock;

// ---- words --------------------------------------------------------------------------------------------------------------

std::string side_text(const Side& side) {
  std::vector<std::string> parts = {side.contender};
  for (const auto& [name, value] : side.overrides) parts.push_back(fmt::format("{}={}", name, value));
  for (const RunChange& change : side.changes) parts.push_back(change_text(change));
  return join(parts, ", ");
}

std::string percents(const Interval& share) {
  return fmt::format("{:.0f} % [{:.0f}, {:.0f}]", 100 * share.value, 100 * share.low, 100 * share.high);
}

std::string metres(double gap) { return gap < 1e-9 ? "< 1 nm" : quantity_text(gap, "m"); }

std::string metres(const Interval& gap) {
  return gap.high < 1e-9 ? "< 1 nm" : fmt::format("{} [{}, {}]", metres(gap.value), metres(gap.low), metres(gap.high));
}

std::string capitalised(std::string text) {
  if (!text.empty()) text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}

std::vector<std::string> option_texts(const Swap& swap) {
  std::vector<std::string> texts;
  for (const std::string& text : change_texts(swap.a)) texts.push_back("--change-a " + text);
  for (const std::string& text : change_texts(swap.b)) texts.push_back("--change-b " + text);
  return texts;
}

std::string falls_text(const std::optional<double>& a, const std::optional<double>& b) {
  if (!a || !b) return "";
  return fmt::format("falls: {:.0f} % of the runs in A, {:.0f} % in B", 100 * *a, 100 * *b);
}

// ---- the answer ---------------------------------------------------------------------------------------------------------

void add_verdict(const ExplainQuestion& question, const Explanation& found, double tolerance, Answer& answer) {
  const std::string gap = metres(found.gap);
  switch (found.verdict) {
    case GapVerdict::kNoDifference:
      answer.line(fmt::format("No difference: the runs agree to {}, and up to {} is rounding.", metres(found.gap.value),
                              quantity_text(tolerance, "m")));
      return;
    case GapVerdict::kTimestepAlone:
      answer.line(
          fmt::format("No difference beyond the timestep: the gap of {} is within what halving the timestep "
                      "moves a contender by itself ({}), and shrinks with it.",
                      gap, quantity_text(found.timestep_gap, "m")));
      return;
    case GapVerdict::kExplained:
    case GapVerdict::kPartlyExplained:
    case GapVerdict::kUnexplained:
      break;
  }
  answer.line(fmt::format("The bodies are {} apart in the mean until they are {} apart; {} of {} starts come to that.",
                          gap, quantity_text(kFarMetres, "m", 2), found.parted, question.starts));
  if (found.verdict == GapVerdict::kUnexplained) answer.line("No swap that was tried closes the gap.");
  for (size_t i = 0; i < found.advice.size(); ++i) {
    const AdviceStep& step = found.advice[i];
    const SwapResult& result = found.causes[step.result];
    answer.line(fmt::format("{}. {}: {}. {} closes {} of the gap{}.", i + 1, capitalised(result.swap.cause),
                            result.swap.advice, result.swap.words, percents(result.share),
                            i == 0 ? "" : fmt::format("; with those before {}", percents(step.share))));
  }
}

void add_certificates(const Json& certificates, Answer& answer) {
  if (certificates.empty()) return;
  answer.part("The robot in each (assay parity)");
  for (size_t i = 0; i < certificates.size(); ++i) {
    const Json& certificate = certificates[i];
    const auto verdict = certificate.at("verdict").get<std::string>();
    const bool beside = !certificate.at("beside").get<std::string>().empty();
    std::string line = fmt::format("{}: {}{}", i == 0 ? "A" : "B", verdict, beside ? " from A" : "");
    if (const auto failure = certificate.at("failure").get<std::string>(); !failure.empty()) line += ": " + failure;
    std::vector<std::string> causes;
    for (const Json& cause : certificate.at("causes")) {
      causes.push_back(parity::cause_text(cause));
    }
    if (!causes.empty()) line += ": " + join(causes, "; ");
    answer.line(line);
  }
}

// Those that do something, at most 12; the others are counted.
void add_swaps(const Explanation& found, Answer& answer) {
  constexpr size_t kMost = 12;
  if (found.causes.empty()) return;
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> failed;
  size_t rest = 0;
  for (size_t i = 0; i < found.causes.size(); ++i) {
    const SwapResult& result = found.causes[i];
    const bool advised = std::ranges::find(found.advice, i, &AdviceStep::result) != found.advice.end();
    if (!result.failure.empty()) {
      failed.push_back(fmt::format("{}: {}", result.swap.words, result.failure));
    } else if (!advised && (!result.closes() || rows.size() >= kMost)) {
      ++rest;
    } else {
      rows.push_back({fmt::format("{}{}", result.swap.words, advised ? " *" : ""), result.swap.cause,
                      fmt::format("{:.0f} %", 100 * result.share.value),
                      fmt::format("{:.0f} to {:.0f}", 100 * result.share.low, 100 * result.share.high),
                      metres(result.gap.value)});
    }
  }
  answer.part("Swaps, one at a time");
  if (rest > 0) {
    answer.line(fmt::format("{} {} less, or nothing that is told from 0", counted(rest, "further one", "further ones"),
                            rest == 1 ? "closes" : "close"));
  }
  for (const std::string& each : failed) answer.line("not measured: " + each);
  if (!rows.empty()) answer.table({"swap", "cause", "closes", "95 %", "gap left"}, std::move(rows), {2, 4});
  answer.part("Where the gap arises");
  std::vector<std::string> where;
  for (const SwapResult& result : found.where) {
    if (result.closes())
      where.push_back(fmt::format("{}: {} of it is gone", result.swap.words, percents(result.share)));
  }
  if (where.empty()) where.emplace_back("in nothing that can be taken out of both at once");
  for (const std::string& each : where) answer.line(each);
}

void add_remaining(const Explanation& found, Answer& answer) {
  std::vector<std::string> options;
  for (const AdviceStep& step : found.advice) {
    for (std::string& text : option_texts(found.causes[step.result].swap)) options.push_back(std::move(text));
  }
  answer.part("The advice, checked");
  if (options.empty()) {
    answer.line(fmt::format("there is none; the gap stays {}", metres(found.remaining)));
    return;
  }
  answer.line(fmt::format("with {} a gap of {} remains, {:.0f} % of it", join(options, " "), metres(found.remaining),
                          100 * found.remaining.value / found.gap.value));
}

// ---- the command --------------------------------------------------------------------------------------------------------

int run_explain(const ExplainOptions& options) {
  const ExplainRequest request = request_of(options);
  const ExplainQuestion question = read_question(request);
  const Pairing pairing = question.pairing();
  const double tolerance = rounding_gap(question);
  ProgressLine progress;
  ProgressClock::time_point since = ProgressClock::now();
  RunPlan plan = question.plan();
  plan.progress = [&](size_t done, size_t of) {
    if (done <= 1) since = ProgressClock::now();
    if (!progress.due() || done == 0) return;
    const double spent_s = std::chrono::duration<double>(ProgressClock::now() - since).count();
    const auto left = static_cast<double>(of - done) / static_cast<double>(done);
    progress.show(
        fmt::format("{}: {} of {} runs, {} left", question.model.name, done, of, duration_label(spent_s * left)));
  };
  const MakeRuns runner = worker_runner(plan);
  Swaps swaps;
  Json certificates = Json::array();
  const auto candidates = [&] {
    swaps = swaps_for(pairing, seen_parameters(question, certificates, [&](const Side& side) {
                        if (progress.due())
                          progress.show(fmt::format("{}: the robot of {}", question.model.name, side.contender));
                      }));
    return swaps.swaps;
  };
  const Explanation found = explain(pairing, candidates, runner,
                                    {.starts = question.starts,
                                     .samples = static_cast<size_t>(question.samples) + 1,
                                     .tolerance = tolerance,
                                     .known = known_deviations(pairing)});
  progress.clear();
  if (options.json) {
    print_json(explanation_json(question, found, swaps, tolerance, certificates));
    return kDone;
  }
  Answer answer;
  answer.part(fmt::format("{}: {}", question.model.name, gap_verdict_text(found.verdict)));
  answer.line(fmt::format("A: {}; B: {}", side_text(question.a), side_text(question.b)));
  answer.line(fmt::format("{}; {} of {} s at {} ms", question.control->description(),
                          counted(static_cast<size_t>(question.starts), "start", "starts"),
                          shortest(question.seconds()), timestep_label(question.timestep_ms)));
  add_verdict(question, found, tolerance, answer);
  for (const KnownDeviation& each : found.concerned) {
    answer.line(fmt::format("{} is known to depart from the model here ({}): {}.", each.in_b ? "B" : "A", each.of,
                            each.reason));
  }
  if (found.wrong_is_b) {
    answer.line(fmt::format("{0} declares nothing of the kind: leave {0} as it is.", *found.wrong_is_b ? "A" : "B"));
  }
  for (const auto& [side, early] : {std::pair("A", found.early_a), std::pair("B", found.early_b)}) {
    if (!early.empty()) answer.line(fmt::format("Runs of {} ended early: {}", side, early));
  }
  if (const std::string falls = falls_text(found.fall_rate_a, found.fall_rate_b); !falls.empty()) answer.line(falls);
  add_certificates(certificates, answer);
  add_swaps(found, answer);
  if (!swaps.not_possible.empty()) {
    answer.part("Not possible to swap");
    for (const NoSwap& each : swaps.not_possible) answer.line(fmt::format("{}: {}", each.cause, each.why));
  }
  if (found.verdict != GapVerdict::kNoDifference) add_remaining(found, answer);
  print(answer);
  return kDone;
}

}  // namespace

void add_explain(CLI::App& app, Action& action) {
  CLI::App* command =
      add_command(app, "explain", "Find why two contenders part, and which setting closes the gap",
                  {{"assay explain cart_pole.xml mujoco-euler dart --policy-config policy.toml", "under a policy"},
                   {"assay explain cart_pole-results mujoco-euler bullet-mb",
                    "as assay run cart_pole.xml --policy-config measured it"},
                   {"assay explain humanoid ode-quick ode-step --control hold --timestep 2", "under another control"},
                   {"assay explain my_robot.xml dart dart --change-b damping=2", "what one change does"}});
  const auto options = std::make_shared<ExplainOptions>();
  ExplainRequest& request = options->request;
  add_robot(*command, *options, "MODEL");
  command->add_option("A", request.a, "Contender")->required()->type_name("");
  command->add_option("B", request.b, "Contender that parts from it")->required()->type_name("");
  add_run_options(*command, *options);
  for (const auto& [name, changes, meaning] :
       {std::tuple("--change-a", &request.changes_a,
                   "Changes A, as in armature=off, gear:knee=-1, set:iterations=50; may be repeated"),
        std::tuple("--change-b", &request.changes_b, "The same of B")}) {
    command->add_option(name, *changes, meaning)->type_name("CHANGE")->allow_extra_args(false);
  }
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  add_load_options(*command, options->model);
  command->callback([&action, options] { action = [options] { return run_explain(*options); }; });
}

}  // namespace assay::cli
