// The folder of a match: what is in it beside the kept fits of each contender (contenders/, evaluations/).
//   manifest.json  the machine, the program, when the match began, and the contenders that it asks
//   logs.json      what was found in the logs, as check_json() has it
//   match.json     the answer, also while contenders are to do
//   models/        the fitted models; motion.json and motion/: motion to look at (kept_motion.h)
#pragma once

#include <string>
#include <vector>

#include "match/match.h"

namespace assay::match {

inline constexpr const char *kAnswerFile = "match.json", *kManifestFile = "manifest.json", *kLogsFile = "logs.json";

// Makes the folder of the question with manifest and logs; a match that goes on keeps the time at which it began.
void begin_folder(const MatchQuestion& question);

// Writes the answer, and with nothing left to do models and motion, too. Returns a sentence for each model that cannot
// be written.
std::vector<std::string> write_answer(const MatchQuestion& question, const MatchAnswer& answer);

// Whether a match was begun there.
bool is_match_folder(const std::string& dir);

}  // namespace assay::match
