// What the coordinator and its workers say to each other: one JSON object a line over the worker's socket, its "kind"
// first. The first line that a worker is sent is a secret, the second one its job. It answers with kJobTaken, then with
// any number of TestResult, then with JobDone, JobError or JobCrash. A timing session answers with SessionReady, and
// then each command with Prepared, Sampled or SingleSteps. Before each of its lines the worker writes the secret and a
// space: an engine that writes to the socket does not know it.
//
// to_line() and the parsers are the only code that knows the JSON. The parsers refuse unknown, missing and mistyped
// fields.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/errors.h"
#include "controls/control.h"
#include "load/load_options.h"
#include "measures/grasp.h"
#include "measures/initial_states.h"
#include "measures/pushes.h"
#include "model/variant.h"
#include "results/store/store.h"

namespace assay {

// The descriptors on which a worker finds its socket, and the pipe for its exit status (an int as waitpid() gives it),
// which its guard writes.
inline constexpr int kWorkerSocket = 3, kWorkerStatus = 4;

// What a worker says first, as soon as it has its job. What ends it before that is the machine's fault, for no engine
// has been near it.
inline constexpr std::string_view kJobTaken = "taken";

// A line that is not a message. The text names the kind and the field.
class MessageError : public SystemError {
 public:
  using SystemError::SystemError;
};

// ---- what is simulated ----------------------------------------------------------------------------------------------

struct ModelSpec {
  std::string path;
  std::string hash;  // of the model as the campaign read it and changed it
  LoadOptions load;
  ModelVariant variant;
};

struct ContenderSpec {
  std::string name, base;
  std::map<std::string, std::string> overrides;  // settings that differ from the base's
};

struct SubjectSpec {
  ModelSpec model;
  ControlSpec control;
  ContenderSpec contender;
  double duration_s = 0, sample_ms = 0;
  InitialStates states;  // of the unchanged model
  Pushes pushes = {};
  double push_sample_ms = 0;              // pushes are at multiples of it, whatever the samples are
  std::vector<std::string> changes = {};  // of the model and its control (controls/changes/change.h)
};

// ---- jobs: coordinator to worker ------------------------------------------------------------------------------------
// `trajectories` is a folder; trajectories in it are named by their addresses (results/store/trajectory.h).

// Runs from initial states of the subject, and the measures that read them. A value over several states is their mean
// with an interval.
struct RunJob {
  SubjectSpec subject;
  double timestep_ms = 0;
  std::vector<std::string> measures;  // as stored
  std::string trajectories;
  int state = 0, states = 1;  // the first of the initial states, and how many
  // Address under which the run is kept, "" for not at all; of several states with "-" and the state's number behind
  // it.
  std::string save;
  // Of each state the address of its run when it exists already, "" to make it; empty: all are made. A run that is
  // used may have more samples than the subject asks for.
  std::vector<std::string> use;
  std::string truth;  // address of the reference solution, "" when no measure reads it
  std::uint64_t seed = 1;
  GraspBodies grasp;
  bool partial = false;  // keep a run that diverges too, as far as it went
  // For Reads::kRunPairs, of each state the address of the run of the contender that the policy was trained in, ""
  // where it has none; empty: compared with nothing.
  std::vector<std::string> against = {};
  // Address under which the run from the initial state `keep_state` is kept for replays, "" for not at all: as far as
  // it went.
  std::string keep = {};
  int keep_state = 0;
  // Of each state the address of what is seen of its run between samples: found with one that is used, kept with one
  // that is saved; "" or missing: nobody keeps it.
  std::vector<std::string> watched = {};
  std::string solution = {};  // the certified solution of the motion, "" where none is named
};

// The reference solution of a smooth system, at the moments of a run's samples: no engine takes part. The answer has a
// cell, of this name, only where there is no solution.
inline constexpr const char* kTruthJobCell = "truth";
struct TruthJob {
  ModelSpec model;
  std::string solution;  // as in campaigns
  double duration_s = 0, sample_ms = 0;
  std::string trajectories, save;
};

// Self-consistency: pieces of reference runs, each started from one of their states. At the reference's own timestep
// the pieces are what those of all other timesteps are compared with: motions that start as these do.
struct PiecesJob {
  std::string measure;
  SubjectSpec subject;
  double timestep_ms = 0;
  std::string trajectories;
  std::vector<std::string> references;   // addresses, one of each initial state
  int pieces = 0;                        // over all initial states
  std::vector<double> piece_ms;          // lengths, the main one first
  double reference_ms = 0, grid_ms = 0;  // of the reference runs: timestep, distance of their samples
  std::uint64_t seed = 1;
  std::string cold;  // address of the ends of the pieces at the reference's timestep: kept there, read elsewhere
};

// One contender's reference run against those of others.
struct AgreementJob {
  struct Other {
    std::string name, address;
  };
  std::string measure, trajectories, own;
  std::vector<Other> others;
};

// Whole runs whose time is the figure: up to `most_runs`, until `enough_s` were spent in engine steps.
struct ScalingJob {
  std::string measure;
  SubjectSpec subject;
  double timestep_ms = 0;
  std::uint64_t seed = 1;
  std::string trajectories, save;  // `save`: address of the last state, "" for not at all
  int most_runs = 1;
  double enough_s = 0;
};

struct ConformanceJob {
  ContenderSpec contender;
  std::vector<std::string> tests;
};

// The time of a step, for the estimate of the campaign's time.
struct ProbeJob {
  SubjectSpec subject;
  double timestep_ms = 0;
  bool whole_run = false;  // the mean over all steps of a run, not of some moments
};

// A timing session: it stays for commands until its socket is closed.
struct TimingJob {
  SubjectSpec subject;
  std::string trajectories;
  std::string reference;  // address of the run that the saved states come from, "" for the initial state alone
  int warmup = 0;         // untimed steps behind a saved state
};

// A session of the measure 'batch': many worlds at one timestep. It answers with SessionReady, then PrepareCommand with
// BatchPrepared and BatchSampleCommand with BatchSampled, until its socket is closed.
struct BatchJob {
  SubjectSpec subject;
  double timestep_ms = 0;
  int worlds = 1;
  std::string device = "cpu";
  int warmup = 0;          // untimed steps behind a start
  std::uint64_t seed = 1;  // of the worlds that are compared, and the torques
};

// What a log says of the joints' drives, by hinge and slide of the model; empty for a joint that nothing drives.
struct MatchDrive {
  std::vector<double> times;                 // s, ascending; in between numbers are interpolated
  std::vector<std::vector<double>> torques;  // Nm, N, as measured
  std::vector<std::vector<double>> targets;  // rad, m, of a drive
  std::vector<double> stiffness, damping;    // of the drives, by joint
};

// Samples of a free body from a window's start on, from which its first state follows for each candidate
// (measures/first_state.h).
struct MatchFlight {
  int body = 0;
  std::vector<double> times;      // s, from the start on
  std::vector<double> positions;  // of the body's frame, three numbers a sample, m
  std::vector<double> rotations;  // w, x, y, z
  std::vector<double> offset;     // added to the state: position, velocity, rotation vector, angular velocity; or empty
};

// A stretch of a log that is simulated from its own first state.
struct MatchWindow {
  int drive = -1;                          // index into MatchJob::drives; -1: nothing drives
  double start_s = 0;                      // in the log's time
  std::vector<double> times;               // of the samples that are asked for, s from the start on
  std::vector<double> position, velocity;  // at the start, of the model's hinges and slides
  std::vector<MatchFlight> flights;
};

// A session that simulates measured motion: it answers with SessionReady, then each MatchCommand with MatchSimulated,
// until its socket is closed.
struct MatchJob {
  SubjectSpec subject;  // its control and states do not matter
  double timestep_ms = 0;
  std::vector<MatchDrive> drives;
  std::vector<MatchWindow> windows;
};

// How a turn at a timestep is taken (measures/windows.h).
struct TurnPlan {
  double timestep_ms = 0;
  int windows = 0;
  double share = 0;      // of each window's part of the run
  bool restart = false;  // every window starts from a saved state
  int passes = 1;        // over all windows
  // Address of the contender's own run at this timestep, whose states the windows start from; the session makes it
  // where it is not there yet. Empty: they start from those of TimingJob::reference.
  std::string run = {};
};

// Several runs of one measure each, one after the other, each in a process of its own: what one does not survive, the
// others do. The answer has a cell for each, in their order; a TestResult comes after each.
struct RunsJob {
  std::vector<RunJob> runs;
  std::string trajectories;  // the folder of all of them
  double limit_s = 600;      // of each, without what it waits for a processor
};

// Asks for the time of a step.
struct PrepareCommand {
  double timestep_ms = 0;
};

struct SampleCommand {
  TurnPlan how;
};

// Asks for the time of each single step.
struct SingleStepsCommand {
  TurnPlan how;
};

struct BatchSampleCommand {
  long long steps = 1;   // at once
  int single_steps = 0;  // that follow, each synchronized
};

// One candidate: all of these windows with the changes (controls/changes/change.h) and settings of the contender.
struct MatchCommand {
  std::vector<std::string> changes;
  std::map<std::string, std::string> settings;
  std::vector<int> windows;
  // Of each window what is added to the positions, then to the velocities of its first state; empty: of none.
  std::vector<std::vector<double>> offsets;
};

using Request = std::variant<RunJob, TruthJob, PiecesJob, AgreementJob, ScalingJob, ConformanceJob, ProbeJob, TimingJob,
                             PrepareCommand, SampleCommand, SingleStepsCommand, RunsJob, BatchJob, BatchSampleCommand,
                             MatchJob, MatchCommand>;

// ---- replies: worker to coordinator ---------------------------------------------------------------------------------

// How a run, or what reads it, ended.
struct Ending {
  Outcome outcome = Outcome::kOk;
  std::string reason;
};

// What a job found for one measure.
struct CellResult {
  std::string measure;
  Ending ending;
  std::vector<Value> values;
  std::vector<SampleSeries> samples;
};

// The answer to every job but a timing session.
struct JobDone {
  std::vector<CellResult> cells;
  double engine_s = 0, cpu_s = 0;
  // Of a ProbeJob: the time of a step, 0 when the engine failed, processor time until the first one was done, and that
  // of another instance with its first step.
  double step_us = 0, start_s = 0, instance_s = 0;
};

// One test of the conformance suite has ended. A figure that is not finite is absent.
struct TestResult {
  std::string test, status;
  std::optional<double> figure, tolerance;
  std::string unit, note;
};

// The job cannot be done, and no contender is at fault: the campaign stops.
struct JobError {
  std::string text;
  bool input = false;  // an InputError, else a SystemError
};

// The contender's fault: an adapter threw what it must not.
struct JobCrash {
  std::string reason;
};

struct SessionReady {
  int core = -1;       // that it is pinned to, -1 for none
  double clock_s = 0;  // that reading the clock takes
};

struct Prepared {
  Ending ending;
  double engine_s = 0;
  double step_s = 0;  // in the mean over saved states
};

// Of one turn.
struct Sampled {
  Ending ending;
  double engine_s = 0, cpu_s = 0, wall_s = 0;
  double clock_share = 0;       // of the timed span, spent reading the clock
  double input_us = 0;          // a step, outside the clock: torques, springs of the adapter, angles for them
  long long switches = 0;       // involuntary context switches
  std::vector<double> step_us;  // of each window, the median over the passes
};

// Steps timed one by one: of each the least of several passes, without the clock's own cost taken off.
struct SingleSteps {
  Ending ending;
  double engine_s = 0;
  double p50_us = 0, p99_us = 0, worst_us = 0;
};

struct BatchPrepared {
  Ending ending;
  double engine_s = 0;
  double step_s = 0;           // of all worlds, roughly
  std::string device, driver;  // as the engine names them, "" where it does not
  double memory_bytes = 0, compile_s = 0;
  int processes = 0;  // of an engine that steps one world, 0 of one that steps many
  double equivalence_m = 0, bound_m = 0;
  int compared = 0;  // worlds
};

// Of one turn.
struct BatchSampled {
  Ending ending;
  double engine_s = 0, wall_s = 0;
  double step_us = 0;     // of all worlds, in the mean over the steps that were taken at once
  double latency_us = 0;  // of a single one, the median
};

// Of one window the samples as far as the run went: of each the positions of hinges and slides, then of each flight's
// body the position of its frame and its rotation (w, x, y, z).
struct MatchRun {
  Ending ending;
  std::vector<double> samples;
};

struct MatchSimulated {
  std::vector<MatchRun> runs;  // of the command's windows
  double engine_s = 0;
};

using Reply = std::variant<JobDone, TestResult, JobError, JobCrash, SessionReady, Prepared, Sampled, SingleSteps,
                           BatchPrepared, BatchSampled, MatchSimulated>;

// ---- the lines ------------------------------------------------------------------------------------------------------

// With the line's end. Bytes that are not UTF-8, which an engine's messages may hold, are replaced.
std::string to_line(const Request& message);
std::string to_line(const Reply& message);

// Throw MessageError.
Request parse_request(std::string_view line);
Reply parse_reply(std::string_view line);

// "run", "done", ...
std::string_view kind_of(const Reply& message);

}  // namespace assay
