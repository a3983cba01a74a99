#include "run/coordinator/campaign_run.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include <fmt/format.h>

#include "base/console.h"
#include "base/errors.h"
#include "base/paths.h"
#include "base/text.h"
#include "campaign/campaign.h"
#include "controls/control.h"
#include "engines/engine_files.h"
#include "isolate/activity.h"
#include "isolate/contained.h"
#include "results/store/facts.h"
#include "results/store/store.h"
#include "run/coordinator/pool.h"
#include "run/coordinator/rows.h"

namespace assay {
namespace {

// `folder` in the directory that an environment variable names.
std::optional<std::string> folder_in(const char* variable, const char* folder) {
  const char* value = std::getenv(variable);
  if (value == nullptr || *value == '\0') return std::nullopt;
  return (std::filesystem::path(value) / folder).string();
}

}  // namespace

std::string references_dir(const std::optional<std::string>& given) {
  if (given) return *given == "off" ? "" : *given;
  if (auto folder = folder_in("ASSAY_CACHE", "references")) return *folder;
  if (auto folder = folder_in("XDG_CACHE_HOME", "assay/references")) return *folder;
  return folder_in("HOME", ".cache/assay/references").value_or("");
}

std::string verdicts_dir(const std::optional<std::string>& references) {
  const std::string folder = references_dir(references);
  return folder.empty() ? "" : (std::filesystem::path(folder).parent_path() / "conformance").string();
}

void rehearse_campaign(const std::string& campaign) {
  rehearse(
      fmt::format("reading the campaign '{}'", campaign),
      [&] {
        const Campaign read = load_campaign(find_campaign(campaign));
        for (const CampaignContender& contender : read.contenders) {
          const Activity asking(fmt::format("asking {} what it can do", contender.resolved.name));
          if (contender.absent.empty()) static_cast<void>(contender_row(contender));
        }
        for (const CampaignSystem& system : read.systems) {
          const Activity trying(fmt::format("trying the control of '{}'", system.name));
          make_control(system.model, system.control)->rehearse();
        }
      },
      model_caches());
}

// A directory has one plan: that of its part. Cells of a second part would be measured and then missed.
void refuse_other_part(const std::string& out, const Shard& shard) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(out + "/assay.sqlite", error)) return;
  const auto text = [](const std::string& part, const std::string& cells) {
    std::string kind = cells == "all" ? "" : fmt::format(" of the {} cells", cells);
    if (cells == "runs") kind = " of the runs that others read";
    if (cells == "after-runs") kind = " of the accuracy cells after their runs";
    return part == "1/1" ? fmt::format("the whole{}", kind.empty() ? " campaign" : kind)
                         : fmt::format("part {}{}", part, kind);
  };
  const std::string wanted = text(shard_text(shard), std::string(shard_cells_text(shard.cells)));
  std::vector<std::string> begun;
  try {
    for (const NodeRow& row : Store::open(out).nodes()) {
      const auto facts = facts_of(row.json);
      if (!facts.contains("shard")) continue;
      std::string part = text(text_fact(facts, "shard"), text_fact(facts, "cells", "all"));
      if (std::ranges::find(begun, part) == begun.end()) begun.push_back(std::move(part));
    }
  } catch (const InputError&) {
    return;  // the run says what is wrong with it, and may mend it
  }
  if (begun.empty() || (begun.size() == 1 && begun.front() == wanted)) return;
  constexpr size_t kFew = 3;
  if (begun.size() > kFew) begun = {fmt::format("{} parts", begun.size())};
  throw InputError(fmt::format(
      "'{}' was begun as {} and cannot go on as {}: give each part an --out of its own, which 'assay merge' unites",
      out, join(begun, ", "), wanted));
}

std::string summary_text(const RunSummary& summary, const std::string& out) {
  std::string text;
  std::vector<std::string> outcomes;
  outcomes.reserve(summary.outcomes.size());
  for (const auto& [outcome, count] : summary.outcomes) outcomes.push_back(fmt::format("{} {}", count, outcome));
  const auto line = [&](const std::string& words) { text += paragraph(words, 2); };
  const auto print_not_scored = [&] {
    for (const Missing& each : summary.failed_gate) line(fmt::format("not scored: {} ({})", each.name, each.why));
  };
  if (summary.makes_runs) {
    const int left = summary.runs - summary.runs_made - summary.runs_failed;
    line(fmt::format("runs that other parts read: {} of {}, in {}{}{}", summary.runs_made, summary.runs,
                     duration_label(summary.wall_s),
                     summary.runs_failed > 0
                         ? fmt::format("; {} failed, as the parts that read them will find again", summary.runs_failed)
                         : "",
                     left > 0 ? fmt::format("; {} were ended from outside", left) : ""));
    print_not_scored();
    return text;
  }
  line(fmt::format("{} in {}: {} ({} now, {} before)", counted(static_cast<size_t>(summary.cells), "cell"),
                   duration_label(summary.wall_s), outcomes.empty() ? "none" : join(outcomes, ", "), summary.done_now,
                   summary.done_before));
  print_not_scored();
  for (const std::string& contender : summary.left_out) line("left out: " + contender);
  const auto print_pairs = [&](const std::vector<TimePair>& pairs, const char* what) {
    for (const TimePair& pair : pairs) {
      line(fmt::format("{}: {} / {} on {} at {} ms: {:.4f} ({:.4f} to {:.4f})", what, pair.b, pair.a, pair.system,
                       timestep_label(pair.timestep_ms), pair.ratio, pair.low, pair.high));
    }
  };
  constexpr size_t kFew = 6;
  if (summary.aa.size() <= kFew) print_pairs(summary.aa, "ratio of step times of one contender under two names");
  if (!summary.aa.empty()) {
    const TwinSummary twins = summarised(summary.aa);
    line(
        fmt::format("one contender under two names: {} of {} ratios of step times within 1 % of 1, {} told apart "
                    "(interval without 1)",
                    twins.within_1_percent, twins.cells, twins.told_apart));
  }
  print_pairs(summary.ratios, "ratio of step times");
  for (const std::string& warning : summary.warnings) line("warning: " + warning);
  if (summary.engine_share_timing > 0) {
    line(fmt::format("inside engine steps: {:.1f} % of the timing cells' time", 100 * summary.engine_share_timing));
  }
  if (summary.engine_share_cpu > 0) {
    line(fmt::format("inside engine steps: {:.1f} % of the campaign's processor time of {}",
                     100 * summary.engine_share_cpu, duration_label(summary.cpu_s)));
  }
  line("results: " + (std::filesystem::path(out) / "assay.sqlite").string());
  return text;
}

std::string stopped_text(const RunSummary& summary, const std::string& command, const std::string& out,
                         const std::string& references) {
  const bool runs = summary.makes_runs;
  return fmt::format(
      "stopped by {}: {} of {} are stored in '{}'; '{}' resumes", strsignal(summary.signal),
      runs ? summary.runs_made : summary.done_before + summary.done_now,
      runs ? counted(static_cast<size_t>(summary.runs), "run") : counted(static_cast<size_t>(summary.cells), "cell"),
      runs ? references : out, command);
}

std::string unmeasured_text(const RunSummary& summary, const std::string& command) {
  if (summary.unmeasured == 0) return "";
  const std::string cells = counted(static_cast<size_t>(summary.unmeasured), "cell is", "cells are");
  if (!summary.lack.empty()) {
    return fmt::format(
        "{} not measured, because the machine lacks what they take ({}): raise the limit or free memory "
        "and room; '{}' then "
        "measures them",
        cells, summary.lack, command);
  }
  return fmt::format(
      "{} not measured: their workers were ended from outside, {} times each (out of memory?); '{}' "
      "tries them again, --jobs 1 needs the least memory",
      cells, Pool::kMostTries, command);
}

}  // namespace assay
