// `assay compare` and `assay history`: what changed between results.
#include "results/compare/compare.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/output_file.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/compare.h"
#include "results/compare/history.h"

namespace assay::cli {
namespace {

struct CompareCommand {
  std::string a, b;
  CompareFlags flags;
  std::optional<std::string> format, out, fail;
  bool allow_gaps = false;
};

struct HistoryCommand {
  std::vector<std::string> dirs;
  CompareFlags flags;
  std::optional<std::string> format, out;
};

void write(const std::optional<std::string>& out, const std::string& text) {
  OutputFile file(out.value_or("-"));
  file.write(text);
  file.finish();
}

std::string row_text(const CellChange& row) {
  std::string ratio = fmt::format("{} → {}", row.outcome_a, row.outcome_b);
  if (row.value != "outcome") {
    ratio = row.ratio ? fmt::format("{:.3f}", row.ratio->value)
                      : fmt::format("{:.3g} → {:.3g}", row.a.value_or(0), row.b.value_or(0));
    if (row.ratio && std::isfinite(row.ratio->low)) {
      ratio += fmt::format(" [{:.3f}, {:.3f}]", row.ratio->low, row.ratio->high);
    }
  }
  return fmt::format("{} of {} on {} at {} ms: {}", row.value, row.contender, row.system,
                     timestep_label(row.timestep_ms), ratio);
}

std::string text_of(const Comparison& found, const std::string& format) {
  if (format == "json") return dump_json(comparison_json(found), 1) + "\n";
  return format == "csv" ? comparison_csv(found) : comparison_markdown(found);
}

int run_compare(const CompareCommand& command) {
  const std::string format = command.format.value_or("markdown");
  if (format != "markdown" && format != "json" && format != "csv") {
    throw InputError(fmt::format("--format is '{}': use markdown, json or csv", format));
  }
  const std::optional<double> limit =
      command.fail ? std::optional(parse_share("--fail-on-regression", *command.fail)) : std::nullopt;
  CompareOptions options = compare_options(command.flags);
  // what the caller wants to be told cannot be too small to count
  if (limit) options.threshold = std::min(options.threshold, *limit);
  const Comparison found = compare(Store::open(command.a), Store::open(command.b), options);
  write(command.out, text_of(found, format));
  if (!limit) return kDone;
  const std::vector<const CellChange*> worse = regressions(found, *limit);
  std::vector<const CellChange*> open, uneven;
  for (const CellChange* row : undecided(found, *limit)) (row->time ? open : uneven).push_back(row);
  if (!worse.empty()) {
    message(fmt::format("{} by at least {:.3g} %, the first is {}",
                        counted(worse.size(), "value is worse", "values are worse"), 100 * *limit,
                        row_text(*worse.front())));
  }
  if (!open.empty()) {
    message(
        fmt::format("{} undecided: the samples do not exclude that it is slower by {:.3g} %; the first is {}; "
                    "measure with more processes or on a quieter machine",
                    counted(open.size(), "time is", "times are"), 100 * *limit, row_text(*open.front())));
  }
  if (!uneven.empty()) {
    message(
        fmt::format("{} undecided: worse by {:.3g} %, but not alike in the initial states; the first is {}; measure "
                    "from more initial states",
                    counted(uneven.size(), "value is", "values are"), 100 * *limit, row_text(*uneven.front())));
  }
  if (!worse.empty()) return kFailed;
  if (const std::string why = gaps(found); !why.empty() && !command.allow_gaps) {
    throw InputError(fmt::format("that nothing is worse cannot be said: {}; --allow-gaps accepts that", why));
  }
  return kDone;
}

int run_history(const HistoryCommand& command) {
  const std::string format = command.format.value_or("markdown");
  if (format != "markdown" && format != "json") {
    throw InputError(fmt::format("--format is '{}': use markdown or json", format));
  }
  const History found = history(command.dirs, compare_options(command.flags));
  write(command.out, format == "json" ? dump_json(history_json(found), 1) + "\n" : history_markdown(found));
  return kDone;
}

}  // namespace

void add_compare_flags(CLI::App& command, CompareFlags& flags) {
  command.add_option("--threshold", flags.threshold, "Smaller changes do not count, as in 2% or 0.02 (default: 2%)")
      ->type_name("SHARE");
  command
      .add_option(
          "--control", flags.control,
          "A contender that did not change: times are divided by its own, so that a slower machine does not count")
      ->type_name("CONTENDER");
  command.add_flag("--across-machines", flags.across_machines, "Compare accuracy alone, measured on any machine")
      ->disable_flag_override();
  command.add_flag("--across-programs", flags.across_programs, "Accept another version or build of assay")
      ->disable_flag_override();
}

CompareOptions compare_options(const CompareFlags& flags) {
  CompareOptions options;
  if (flags.threshold) options.threshold = parse_share("--threshold", *flags.threshold);
  options.control = flags.control;
  options.across_machines = flags.across_machines;
  options.across_programs = flags.across_programs;
  return options;
}

void add_compare(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "compare", "Tell what changed between two results directories, beyond the noise",
      {{"assay compare before after", "changes as a document, with intervals and p-values"},
       {"assay compare before after --fail-on-regression 5%", "in a CI: status 1 when anything got worse by 5 %"},
       {"assay compare before after --control ode-step", "times relative to a contender that did not change"},
       {"assay compare laptop cluster --across-machines --format csv", "accuracy alone, as a table"}});
  const auto options = std::make_shared<CompareCommand>();
  command->add_option("A", options->a, "Results directory: before")->required()->type_name("");
  command->add_option("B", options->b, "Results directory: after")->required()->type_name("");
  add_compare_flags(*command, options->flags);
  command
      ->add_option(
          "--fail-on-regression", options->fail,
          "End with status 1 when a value is worse by at least this share (5% or 0.05), with 2 when B lacks what A "
          "has")
      ->type_name("SHARE");
  command
      ->add_flag("--allow-gaps", options->allow_gaps,
                 "With --fail-on-regression: judge what both have, whatever cells B lacks and times do not compare")
      ->disable_flag_override();
  command->add_option("--format", options->format, "Default: markdown")->type_name("markdown|json|csv");
  command->add_option("--out", options->out, "File to write (default: standard output)")->type_name("PATH");
  command->callback([&action, options] { action = [options] { return run_compare(*options); }; });
}

void add_history(CLI::App& app, Action& action) {
  CLI::App* command = add_command(app, "history", "Follow contenders over results in the order of time",
                                  {{"assay history nightly/*", "the changes of all contenders"},
                                   {"assay history nightly/* --control ode-step --format json",
                                    "times relative to a contender that did not change"}});
  const auto options = std::make_shared<HistoryCommand>();
  command->add_option("DIR", options->dirs, "Results directories, in any order")->required()->type_name("");
  add_compare_flags(*command, options->flags);
  command->add_option("--format", options->format, "Default: markdown")->type_name("markdown|json");
  command->add_option("--out", options->out, "File to write (default: standard output)")->type_name("PATH");
  command->callback([&action, options] { action = [options] { return run_history(*options); }; });
}

}  // namespace assay::cli
