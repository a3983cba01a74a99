// What the jobs of a worker have in common.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "measures/contact_residuals.h"
#include "measures/watch.h"
#include "results/store/trajectory.h"
#include "run/messages/messages.h"
#include "run/worker/stepper.h"

namespace assay::jobs {

using Report = std::function<void(const Reply&)>;
using Next = std::function<std::optional<Request>()>;

// ---- the jobs -------------------------------------------------------------------------------------------------------

// job_accuracy.cc
JobDone do_job(const RunJob& job);
JobDone do_job(const TruthJob& job);
JobDone do_job(const PiecesJob& job);
JobDone do_job(const AgreementJob& job);
// job_runs.cc
JobDone do_job(const RunsJob& job, const Report& report);
// job_timing.cc
JobDone do_job(const ScalingJob& job);
JobDone do_job(const TimingJob& job, const Report& report, const Next& next);
// job_batch.cc
JobDone do_job(const BatchJob& job, const Report& report, const Next& next);
// job_match.cc
JobDone do_job(const MatchJob& job, const Report& report, const Next& next);
// job_conformance.cc
JobDone do_job(const ConformanceJob& job, const Report& report);
// job_probe.cc
JobDone do_job(const ProbeJob& job);

// ---- what they are made of ------------------------------------------------------------------------------------------

// Processor time of the whole process: an engine may step in a thread of its own, while the caller waits.
double cpu_seconds();

ResolvedContender contender_of(const ContenderSpec& contender);
// Throws InputError when the model's file is no longer what the campaign read.
Model model_of(const ModelSpec& spec);
Subject subject_of(const SubjectSpec& spec);
// Throws UnsupportedError when the engine cannot simulate the subject: known without a run.
void check_supported(const Subject& subject, double timestep_s);

// The answer with the processor time so far.
JobDone job_done(std::vector<CellResult> cells, double engine_s);

// A run that is sampled at fixed intervals.
struct Run {
  Trajectory trajectory;  // up to where it went
  Ending ending;          // ok, unstable (of its last state), diverged
  double engine_s = 0;    // processor time, because runs share the machine
  ControlAccount account = {};
  // Of steps spread over the run; empty where nobody asked, the engine gives none, or nothing touched.
  std::optional<ContactResiduals> contacts = {};
  std::optional<Watched> watched = {};  // empty where nobody asked
  std::vector<State> instants = {};     // its states at those of measures/watch.h; empty where nobody asked
};

// What of a run is looked at beside its samples.
struct Looks {
  bool contacts = false;
  std::optional<GraspBodies> between = {};  // joints, surfaces and this grasp between samples (measures/watch.h)
  std::uint64_t seed = 1;                   // of its intervals
  bool instants = false;                    // the states between samples are kept
};

// Takes `samples` times `per_sample` steps from `start`, with pushes at samples: the state of that sample is the one
// before. Lets create()'s EngineError through.
Run run_sampled(const Subject& subject, const State& start, double timestep_ms, long long samples, long long per_sample,
                const Looks& looks = {}, const std::vector<Push>& pushes = {});

// What was seen of a run between its samples, kept as the only state of a trajectory.
void save_watched(const std::string& dir, const std::string& address, const Watched& watched);
// Absent where it was not kept, or cannot be read.
std::optional<Watched> load_watched(const std::string& dir, const std::string& address);

// Does nothing when the file exists: the same address means the same content.
void save(const std::string& dir, const std::string& address, const Trajectory& trajectory);
// Throws SystemError for a file that is damaged or holds another run, and removes it.
Trajectory load(const std::string& dir, const std::string& address);
// The same for states of another size, or of another number than `states` (0: any).
Trajectory load(const std::string& dir, const std::string& address, size_t bodies, size_t joints);
Trajectory load(const std::string& dir, const std::string& address, const Model& model, long long states = 0);

}  // namespace assay::jobs
