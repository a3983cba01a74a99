// Around a campaign's run: the folders that it reuses, the rehearsal of its file, and what is said of its end.
#pragma once

#include <optional>
#include <string>

#include "campaign/shards.h"
#include "run/coordinator/run.h"

namespace assay {

// Where runs are kept for later campaigns, as given ("off" keeps none, which is ""), or by default:
// ASSAY_CACHE/references, else XDG_CACHE_HOME/assay/references, else ~/.cache/assay/references.
std::string references_dir(const std::optional<std::string>& given);

// Where verdicts of the conformance suite are kept, next to the references; "" where these are not.
std::string verdicts_dir(const std::optional<std::string>& references);

// Reads the campaign's file, its models, and what its contenders say of them, in a process of its own
// (isolate/contained.h): throws InputError for what the program itself would not survive.
void rehearse_campaign(const std::string& campaign);

// A directory has one plan: that of its part. Cells of a second part would be measured and then missed: throws
// InputError.
void refuse_other_part(const std::string& out, const Shard& shard);

// Lines for standard output.
std::string summary_text(const RunSummary& summary, const std::string& out);

// A sentence on a run that a signal stopped, and one on cells that could not be measured ("" without any). `command`
// resumes it.
std::string stopped_text(const RunSummary& summary, const std::string& command, const std::string& out,
                         const std::string& references);
std::string unmeasured_text(const RunSummary& summary, const std::string& command);

}  // namespace assay
