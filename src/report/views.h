// What the page is told of each system, so that it decides nothing by itself; format 4 of the report's JSON.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "results/looks.h"
#include "results/results.h"

namespace assay {

// [{"name", "unit", "label", "short", "better", "measure", "plot", "limit", "meaning"}], in the order of display;
// values that the results hold and the catalogue lacks come last.
nlohmann::json catalogue_data(const Results& results);

// {stored unit: [{"text": "mm", "scale": 1e-3}]}: what a limit may be typed in, for each unit of an error.
nlohmann::json units_data(const Results& results);

// {"family", "light", "dark", "dash": "7 3", "mark", "first"}
nlohmann::json look_json(const Look& look);
// That of each contender, by name.
nlohmann::json looks_data(const Results& results);

// What the paper's figures show: {"figure3": [{"system", "title"}], "figure4": [{"systems", "value", "title", "axis"}],
// "figure5": [{"title", "contenders"}]}. results/line_up.h
nlohmann::json paper_figures_data();

// [{"term", "meaning"}]
nlohmann::json glossary_data();

// Of each system that has cells, but for those that are a size of a family alone:
//   {"system", "main": value or null, "values": [name], "errors": [name],
//    "points": [{"contender", "timestep_ms", "speed": {"value", "low", "high", "timed", "between": [ms, ms]} or null,
//                "sound", "why", "worst": {error: {"value", "high", "text", "line"}}}],
//    "fronts": {error: [{"point", "equals": [name]}]},
//    "swept": {error: {contender: [point]}},
//    "candidates": [{"point", "realtime", "speed", "note", "held", "margin"}],
//    "left_out": [{"contender", "steps": [ms], "when", "why"}],
//    "columns": {"most", "besides": [error]}, "accuracy": {"limited": [error], "open"},
//    "usual": [{"option", "value", "largest"}], "overlap": see cards.h, "stand_ins": {error: sentence},
//    "card": see cards.h}
// The meaning of each: results/recommend.h; texts and what the page fills them into: results/answer.h. Only sound
// points have "worst". "high" is left out where it is the value, "line" where it is the text, "note" and "held" where
// there is none.
nlohmann::json views_data(const Results& results);
nlohmann::json view_of(const Results& results, const std::string& system);  // of one of viewed_systems()
std::vector<std::string> viewed_systems(const Results& results);

}  // namespace assay
