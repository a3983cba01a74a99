// What a search found, in words and pictures.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "campaign/campaign.h"
#include "results/answer.h"
#include "results/store/store.h"
#include "run/search/programme.h"
#include "run/search/search.h"

namespace assay {

struct SearchAnswer {
  Answer answer;
  std::optional<std::string> best;  // the contender of the goal that is answered in full
  bool any = false;                 // whether any goal has an answer
};

// The answer that the results of `store` give to the goals of a search (run/search/goals.h), how sure it is, what the
// best contender approximates, and what did not qualify.
SearchAnswer answer_of_search(const Store& store, const Campaign& campaign, const std::vector<LimitOptions>& goals,
                              const SearchSummary& done);

// A part with the engines that refuse the robot, if any does.
void add_refusals(const std::vector<Refusal>& refusals, Answer& answer);

// For the report: the answer, and runs of one contender of each engine on the first system, those of `best` first,
// which the search had no reason to keep. They take seconds. Throws InputError where nothing was measured.
void keep_answer(Store& store, const Answer& answer);
void keep_pictures(Store& store, const Campaign& campaign, const std::optional<std::string>& best);

}  // namespace assay
