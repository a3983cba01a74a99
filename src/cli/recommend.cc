// `assay recommend`: the fastest contender and timestep within limits.
#include "cli/recommend.h"

#include <algorithm>
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "cli/answer.h"
#include "cli/commands.h"
#include "results/store/store.h"

namespace assay::cli {
namespace {

struct RecommendOptions : LimitOptions {
  std::vector<std::string> where;  // SYSTEM, or DIR SYSTEM
  bool json = false;
};

std::string results_dir(const std::vector<std::string>& where) {
  if (where.size() == 2) return where.front();
  return std::filesystem::exists("assay.sqlite") ? "." : "results";
}

// The name that stands for all systems together.
constexpr const char* kAll = "all";

SystemAnswers answers_in(const std::string& dir, const std::string& system) {
  const Store store = Store::open(dir);
  const Results results(store);
  const bool named = std::ranges::find(results.systems(), system) != results.systems().end();
  if (system == kAll && !named) return answers_together(results, results.systems(), kAll);
  if (!named) {
    throw InputError(fmt::format("'{}' has no system '{}'{}", dir, system, did_you_mean(system, results.systems())));
  }
  return answers_of(results, system);
}

int recommend_to(const RecommendOptions& options) {
  const SystemAnswers answers = answers_in(results_dir(options.where), options.where.back());
  const Question question = question_of(options, answers);
  const Recommendation found = recommend(answers, question.limits);
  if (options.json) {
    print_json(recommendation_json(answers, question, found));
  } else if (found.best) {
    print(best_answer(answers, question, found));
  } else {
    message(none_text(answers, question, found));
    for (const std::string& sentence : grounds(answers, question)) message("note: " + sentence);
  }
  return found.best ? kDone : kFailed;
}

}  // namespace

void add_limits(CLI::App& command, LimitOptions& options) {
  command.add_option("--error", options.error, "The largest error, with its unit: 1mm, 0.5deg, 2%")->type_name("E");
  command
      .add_option(
          "--measure", options.measure,
          "Measure or value that --error limits (default: the error against the reference solution where it was "
          "measured, else self-consistency)")
      ->type_name("NAME");
  command
      .add_option("--penetration", options.penetration,
                  "The largest penetration beyond the overlap at the start: 2mm, or 'any' (default with contacts: the "
                  "system's, at most 5mm)")
      ->type_name("E");
  command
      .add_option("--slip", options.slip,
                  "The largest slip of a grasped object: 2mm, or 'any' (default where one is held: 5mm)")
      ->type_name("E");
  command.add_option("--realtime", options.realtime, "The least realtime factor: 5")->type_name("FACTOR");
  command.add_option("--limit", options.limits, "The largest of any error, by its value's name")
      ->type_name("NAME=E")
      ->allow_extra_args(false);
}

void add_recommend(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "recommend", "Recommend the fastest contender and timestep within limits",
      {{"assay recommend results humanoid --error 1mm", "by the reference solution, else by self-consistency"},
       {"assay recommend results planar-chain --error 1mm --measure consistency --realtime 5", "by self-consistency"},
       {"assay recommend results grasp --error 1mm --penetration 2mm --slip 5mm", "several limits at once"},
       {"assay recommend results planar-chain --limit energy_drift_relative=0.1%", "any measured error"}});
  const auto options = std::make_shared<RecommendOptions>();
  command
      ->add_option("SYSTEM", options->where,
                   "System, or 'all' for all of them at once, after the results directory (default: results, or here)")
      ->required()
      ->expected(1, 2)
      ->type_name("[DIR] SYSTEM");
  add_limits(*command, *options);
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  command->callback([&action, options] { action = [options] { return recommend_to(*options); }; });
}

}  // namespace assay::cli
