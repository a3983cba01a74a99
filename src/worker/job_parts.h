// What the jobs of a worker have in common.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "store/store.h"
#include "store/trajectory.h"
#include "worker/stepper.h"

namespace assay::jobs {

using Report = std::function<void(const nlohmann::json&)>;
using Next = std::function<nlohmann::json()>;

// ---- the jobs; each says above its definition what it is given ------------------------------------------------------

// job_accuracy.cc
nlohmann::json do_run(const nlohmann::json& job);
nlohmann::json do_truth(const nlohmann::json& job);
nlohmann::json do_pieces(const nlohmann::json& job);
nlohmann::json do_agreement(const nlohmann::json& job);
// job_timing.cc
nlohmann::json do_scaling(const nlohmann::json& job);
nlohmann::json do_timing(const nlohmann::json& job, const Report& report, const Next& next);
// job_gate.cc
nlohmann::json do_gate(const nlohmann::json& job, const Report& report);
nlohmann::json do_probe(const nlohmann::json& job);

// ---- what they are made of ------------------------------------------------------------------------------------------

double thread_cpu_seconds();  // of the processor, of the calling thread
double cpu_seconds();         // of the whole process

ResolvedContender contender_of(const nlohmann::json& contender);
// Throws InputError when the model's file is no longer what the campaign read.
Model model_of(const nlohmann::json& job);
Subject subject_of(const nlohmann::json& job);
// What can be said without a run: throws UnsupportedError.
void check_supported(const Subject& subject, double timestep_s);

struct Verdict {
  Outcome outcome = Outcome::kOk;
  std::string reason;
};

nlohmann::json value_json(const std::string& name, const std::string& unit, std::optional<double> value,
                          std::optional<double> low = {}, std::optional<double> high = {});
nlohmann::json cell_json(const std::string& measure, const Verdict& verdict,
                         nlohmann::json values = nlohmann::json::array(),
                         nlohmann::json samples = nlohmann::json::object());
nlohmann::json answer_json(nlohmann::json cells, double engine_s);

// A run that is sampled at a fixed distance.
struct Run {
  Trajectory trajectory;  // up to where it went
  Verdict verdict;        // ok, unstable (of its last state), diverged
  double engine_s = 0;    // of the processor's time, for runs share the machine with others
};

// Takes `samples` times `per_sample` steps from `start`. EngineError from create() is the caller's.
Run run_sampled(const Subject& subject, const State& start, double timestep_ms, long long samples,
                long long per_sample);

// Same file, same bytes: who comes second need not wait for the first.
void save(const std::string& dir, const std::string& address, const Trajectory& trajectory);
// Throws SystemError for a damaged file, and removes it.
Trajectory load(const std::string& dir, const std::string& address);

}  // namespace assay::jobs
