// What a search is for: the limits of a command or of a campaign's table [search].
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "campaign/campaign.h"
#include "results/limits.h"

namespace assay {

// The values that --error limits: each system's error against the reference solution, else its self-consistency error.
std::vector<std::string> errors_of(const Campaign& campaign);

// What questions limit of contacts on the campaign's systems, before anything is measured: what the measures will
// store.
std::vector<UsualLimit> usual_limits(const Campaign& campaign);

// Limits on what the campaign measures. Throws InputError as read_limits(), and for a value that no system measures: it
// would end in no answer after the whole budget.
Question question_of(const Campaign& campaign, const LimitOptions& options);

LimitOptions limits_in(const SearchTable& table);

// One set of limits, or, where neither an error nor a speed is asked for, one for each of the usual errors, of which
// that at kShownGoal is answered in full. Limits of contacts are of each of them.
std::vector<LimitOptions> goals_of(const LimitOptions& options);
inline constexpr size_t kShownGoal = 1;

}  // namespace assay
