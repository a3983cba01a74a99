// The report's first screen: the answers that a system's readers come for.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "results/recommend.h"

namespace assay {

// {"answers": [{"id", "question", "text", "contender", "timestep_ms", "limits": {value: largest}, "realtime"}],
// "caveat": "..."}: contender and timestep are null where nobody qualifies. Limits and "realtime" (null: any) are those
// of the question, for the picker.
nlohmann::json card_data(const Results& results, const SystemAnswers& answers);

// "mujoco-euler at 4 ms: 120× real time, error 0.412 mm".
std::string candidate_text(const SystemAnswers& answers, const Candidate& candidate, const std::string& value);

}  // namespace assay
