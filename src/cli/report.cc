// `assay report`: a results directory as one page.
#include "report/report.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/text.h"
#include "cli/campaign_run.h"
#include "cli/commands.h"
#include "cli/compare.h"
#include "cli/report_parts.h"
#include "match/folder.h"
#include "report/kept_replays.h"
#include "report/match_page.h"
#include "report/views.h"
#include "results/compare/history.h"
#include "results/results.h"
#include "results/store/store.h"

namespace assay::cli {
namespace {

struct ReportOptions {
  std::string dir;
  std::vector<std::string> replays;  // timesteps as given
  std::optional<std::string> against;
  std::vector<std::string> history, systems;
  std::optional<std::string> size;
  CompareFlags compare;
  std::vector<std::string> claims;  // the file; empty: the paper's
  bool json = false, markdown = false, verdicts = false, transfer = false;
};

// Sections about other results than the page's own.
nlohmann::json sections(const ReportOptions& options) {
  nlohmann::json more = nlohmann::json::object();
  const CompareOptions how = compare_options(options.compare);
  if (options.against) {
    more["changes"] = comparison_json(compare(Store::open(*options.against), Store::open(options.dir), how));
  }
  if (options.history.empty()) return more;
  std::vector<std::string> dirs = options.history;
  const auto is_this = [&](const std::string& dir) {
    std::error_code error;
    return std::filesystem::equivalent(dir, options.dir, error);
  };
  if (std::ranges::none_of(dirs, is_this)) dirs.push_back(options.dir);
  more["history"] = history_json(history(dirs, how));
  return more;
}

// A part of it, printed; nothing is written.
int print_part(const ReportOptions& options) {
  if (options.verdicts && options.transfer) throw InputError("--claims and --transfer were both given: choose one");
  if (options.transfer) {
    if (options.systems.size() > 1) throw InputError("--transfer takes one system: give one in --systems, or none");
    print_transfer(options.dir, options.systems.empty() ? std::nullopt : std::optional(options.systems.front()),
                   options.json);
    return kDone;
  }
  const bool of_paper = options.claims.empty() || options.claims.front().empty();
  print_verdicts(options.dir, of_paper ? std::nullopt : std::optional(options.claims.front()), options.json,
                 options.markdown);
  return kDone;
}

// What the page shows, for programs that draw: without what only the page can draw, and with the paper's line-up.
int print_data(const ReportOptions& options) {
  if (!options.replays.empty()) throw InputError("--json and --replays were both given: choose one");
  const nlohmann::json more = sections(options);
  const Store store = Store::open(options.dir);
  nlohmann::json data = report_data(store, {.systems = options.systems, .most_bytes = SIZE_MAX});
  for (const char* part : {"pictures", "replays"}) data.erase(part);
  for (nlohmann::json& cell : data["cells"]) cell.erase("samples");
  data.update(more);
  data["papers"] = Results(store).papers();
  data["paper_figures"] = paper_figures_data();
  print(dump_json(data, 1) + "\n");
  return kDone;
}

// Of measured motion there is one page, without a choice.
int report_match(const ReportOptions& options) {
  const std::vector<std::pair<const char*, bool>> given = {
      {"--replays", !options.replays.empty()}, {"--against", options.against.has_value()},
      {"--history", !options.history.empty()}, {"--systems", !options.systems.empty()},
      {"--size", options.size.has_value()},    {"--claims", options.verdicts},
      {"--transfer", options.transfer}};
  for (const auto& [name, is_given] : given) {
    if (is_given) {
      throw InputError(fmt::format("{} is for results of a campaign, and '{}' holds those of assay match: leave it out",
                                   name, options.dir));
    }
  }
  if (options.json) {
    nlohmann::json data = match_report_data(options.dir);
    data.erase("replays");
    print(dump_json(data, 1) + "\n");
    return kDone;
  }
  print(paragraph("report: " + write_match_report(options.dir), 2));
  return kDone;
}

}  // namespace

void add_replays(CLI::App& command, std::vector<std::string>& replays) {
  command
      .add_option("--replays", replays,
                  "Timesteps in ms: runs the replayed contenders again at "
                  "these and keeps their states in DIR")
      ->delimiter(',')
      ->type_name("MS,...")
      ->allow_extra_args(false);
}

std::vector<double> parse_replays(const std::vector<std::string>& replays) {
  std::vector<double> timesteps;
  timesteps.reserve(replays.size());
  for (const std::string& text : replays) timesteps.push_back(parse_positive("--replays", text, "milliseconds"));
  return timesteps;
}

void add_report(CLI::App& app, Action& action) {
  CLI::App* command =
      add_command(app, "report", "Write DIR/report.html, one file that works offline",
                  {{"assay report results", "also while the campaign is running: shows the results so far"},
                   {"assay report results --replays 1,4,16", "also replays runs at these timesteps"},
                   {"assay report after --against before", "with a section on what changed"},
                   {"assay report matched", "also of a folder of assay match"},
                   {"assay report results --claims", "only prints the verdicts on the paper's claims"},
                   {"assay report cart_pole-results --transfer", "only prints in which engines a policy works"}});
  const auto options = std::make_shared<ReportOptions>();
  command->add_option("DIR", options->dir, "Results directory")->required()->type_name("");
  add_replays(*command, options->replays);
  command->add_option("--against", options->against, "Earlier results: adds a section on what changed since then")
      ->type_name("DIR");
  command
      ->add_option("--history", options->history,
                   "Other results of the same campaign: adds the contenders' courses over all")
      ->type_name("DIR");
  command->add_option("--systems", options->systems, "Systems to show (default: all, or those that fit into --size)")
      ->delimiter(',')
      ->type_name("NAME,...")
      ->allow_extra_args(false);
  command
      ->add_option(
          "--size", options->size,
          "Largest size of the page (default: 10); beyond it go hidden digits, distributions of samples, replays, then "
          "systems")
      ->type_name("MB");
  add_compare_flags(*command, options->compare);
  CLI::Option* claims = command
                            ->add_option("--claims", options->claims,
                                         "Print the verdicts on the paper's claims, or on those of FILE; write nothing")
                            ->type_name("[FILE]")
                            ->expected(0, 1);
  command
      ->add_flag("--transfer", options->transfer,
                 "Print in which engines the policies work as they did in training; write nothing")
      ->disable_flag_override();
  command->add_flag("--markdown", options->markdown, "Print Markdown, with --claims")->disable_flag_override();
  command->add_flag("--json", options->json, "Print what the page shows as JSON, without pictures; write nothing")
      ->disable_flag_override();
  command->callback([&action, options, claims] {
    options->verdicts = claims->count() > 0;
    if (options->markdown && !options->verdicts) throw CLI::RequiresError("--markdown", "--claims");
    action = [options] {
      if (match::is_match_folder(options->dir)) return report_match(*options);
      if (options->verdicts || options->transfer) return print_part(*options);
      if (options->json) return print_data(*options);
      assay::ReportOptions page{.systems = options->systems};
      if (options->size)
        page.most_bytes = static_cast<size_t>(std::min(1e6 * parse_positive("--size", *options->size, "MB"), 1e12));
      const nlohmann::json more = sections(*options);  // refused before anything is written
      keep_replays(options->dir, parse_replays(options->replays));
      write_report_of(options->dir, more, page);
      return kDone;
    };
  });
}

}  // namespace assay::cli
