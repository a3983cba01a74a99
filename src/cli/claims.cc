// `assay claims`: what the results say about the paper's findings.
#include "results/claims/claims.h"

#include <algorithm>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/report_parts.h"
#include "results/results.h"
#include "results/store/store.h"

namespace assay::cli {
namespace {

struct ClaimsOptions {
  std::string dir;
  std::optional<std::string> file;
  bool json = false, markdown = false;
};

std::vector<Judgement> judgements(const std::string& dir, const std::optional<std::string>& file) {
  const std::optional<std::string> path = file ? file : paper_claims_file();
  if (!path) throw InputError("assay's data folder has no campaigns/paper_claims.toml: name a file with --claims");
  const ClaimsFile claims = load_claims(*path);
  const Store store = Store::open(dir);
  return judge(claims, Results(store));
}

std::string counts(const std::vector<Judgement>& all) {
  std::vector<std::string> parts;
  for (const Verdict verdict : {Verdict::kHolds, Verdict::kChanged, Verdict::kNotSettled, Verdict::kNotMeasurable}) {
    const auto count = std::ranges::count_if(all, [&](const Judgement& each) { return each.verdict == verdict; });
    parts.push_back(fmt::format("{} {}", count, verdict_words(verdict)));
  }
  return join(parts, ", ");
}

}  // namespace

void print_verdicts(const std::string& dir, const std::optional<std::string>& file, bool json, bool markdown) {
  if (json && markdown) throw InputError("--json and --markdown were both given: choose one");
  const std::vector<Judgement> all = judgements(dir, file);
  if (json) return print_json(claims_json(all));
  if (markdown) return print(claims_markdown(all));
  for (const Judgement& each : all) {
    print(paragraph(heading(fmt::format("{}. {}", each.claim.number, each.claim.title)) + ": " +
                        status(verdict_words(each.verdict)),
                    3));
    const auto line = [](const std::string& what, const std::string& text) {
      constexpr size_t kIndent = 5;
      if (!text.empty()) print(paragraph(fmt::format("   {} {}", what, text), kIndent));
    };
    if (!each.now.empty()) line("now:", fmt::format("{} Needed: {}", each.now.substr(kNow.size()), each.threshold));
    line("paper:", each.claim.paper);
    line("measured:", each.summary);
    line("why not:", each.reason);
    line("today:", each.today);
  }
  print(fmt::format("\n{}\n", counts(all)));
}

void print_claims(const std::string& dir) {
  if (!paper_claims_file()) return;
  const std::vector<Judgement> all = judgements(dir, std::nullopt);
  std::vector<std::vector<std::string>> rows;
  rows.reserve(all.size());
  for (const Judgement& each : all) {
    rows.push_back({std::to_string(each.claim.number), verdict_words(each.verdict), each.claim.title, each.key});
  }
  print(fmt::format("\nThe paper's claims ({}):\n{}", counts(all),
                    table({"", "verdict", "claim", "figures"}, rows, {0})));
}

void add_claims(CLI::App& app, Action& action) {
  CLI::App* command =
      add_command(app, "claims",
                  "Judge the paper's findings by measured results: until 1.0 another name of 'assay report --claims'",
                  {{"assay claims results", "a verdict on each, with the figures"},
                   {"assay claims results --markdown > claims.md", "the same as a document"}});
  const auto options = std::make_shared<ClaimsOptions>();
  command->add_option("DIR", options->dir, "Results directory")->required()->type_name("");
  command->add_option("--claims", options->file, "Another claims file (default: the paper's)")->type_name("FILE");
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  command->add_flag("--markdown", options->markdown, "Print Markdown")->disable_flag_override();
  command->callback([&action, options] {
    action = [options] {
      print_verdicts(options->dir, options->file, options->json, options->markdown);
      return kDone;
    };
  });
}

}  // namespace assay::cli
