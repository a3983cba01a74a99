// What a worker does: one run, one cell's pieces, the gate, a timing session. Jobs and answers are JSON (worker.cc says
// how they travel); they hold names, paths and numbers alone.
#pragma once

#include <functional>
#include <string>

#include <nlohmann/json.hpp>

namespace assay {

// Does the job and returns the answer:
//   {"cells": [{"measure", "outcome", "reason", "values": [...], "samples": [...]}], "engine_s", ...}   or
//   {"error": "...", "kind": "input"|"system"}
// `report` sends a message of its own on the way (results of the gate, test by test). Timing sessions go on until
// `next` has no command any more.
nlohmann::json do_job(const nlohmann::json& job, const std::function<void(const nlohmann::json&)>& report,
                      const std::function<nlohmann::json()>& next);

}  // namespace assay
