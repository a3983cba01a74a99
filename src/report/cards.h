// The report's first screen: the answers that a system's readers come for.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "results/recommend.h"

namespace assay {

// {"answers": [{"id", "question", "text", "figures", "contender", "timestep_ms", "limits": {value: largest},
// "realtime"}], "caveat": "..."}: contender and timestep are null where nobody qualifies. Limits and "realtime" (null:
// any) are those of the question, for the picker.
nlohmann::json card_data(const Results& results, const SystemAnswers& answers);

// What engines are not to be blamed for: that the model's own shapes overlap where it starts; "" up to 1 mm.
std::string overlap_text(const SystemAnswers& answers);

}  // namespace assay
