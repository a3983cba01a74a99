// The measure 'raw_speed': the time of the engine's own step calls (measures/step_time.h).
#include "measures/measure.h"

namespace assay {

Measure raw_speed_measure() {
  using namespace rows;
  return {
      .name = "raw_speed",
      .reads = Reads::kSteps,
      .version = 2,  // windows start from the run at the timed timestep
      .values = {{"raw_speed", "kHz", "Raw speed", "raw speed", kHigh, kNo, kNo,
                  "the engine's own step calls per second", 10},
                 {"step_time", "us", "Step time", "step time", kLow, kNo, kNo,
                  "time of one call of the engine's step, in the mean over the run", 10},
                 {"realtime_factor", "1", "Realtime factor", "speed", kHigh, kNo, kNo,
                  "simulated seconds per second of computing: timestep divided by step time", 10},
                 {"step_p50", "us", "Step time, median", "median step", kLow, kNo, kNo,
                  "median over the run's steps, each timed by itself; the clock's own cost is included", 10},
                 {"step_p99", "us", "Step time, 99th percentile", "99th percentile step", kLow, kNo, kNo,
                  "time that 99 of 100 steps of the run do not exceed, each timed by itself", 10},
                 {"step_worst", "us", "Step time, worst", "worst step", kLow, kNo, kNo,
                  "longest step of the run; of each step the least of three passes, so that it is the engine's and not "
                  "the machine's",
                  10},
                 {"input_time", "us", "Input time", "input time", kLow, kNo, kNo,
                  "time a step outside the clock: torques, the state that they are computed from, and springs of the "
                  "adapter; an engine's own springs cost step time instead",
                  10},
                 {"coverage", "1", "Coverage", "coverage", kNone, kNo, kNo,
                  "share of the run that was timed; the same windows for all contenders of a system at a timestep", 10},
                 {"aa_ratio", "1", "A/A ratio", "A/A ratio", kNone, kNo, kNo,
                  "step time of one contender measured under two names: its distance from 1 is the error of the timing",
                  14},
                 {"time_ratio", "1", "Step time ratio", "step time ratio", kNone, kNo, kNo,
                  "step time over that of the contender that the campaign names for comparison", 14},
                 {"clock_share", "1", "Clock share", "clock share", kNone, kNo, kNo,
                  "share of the timed span that reading the clock takes", 16},
                 {"engine_share", "1", "Engine share", "engine share", kNone, kNo, kNo,
                  "share of the cell's wall time inside the engine's steps", 16},
                 {"sample_steps", "1", "Steps a window", "steps a window", kNone, kNo, kNo,
                  "engine steps of the shortest window that was timed", 16},
                 {"window_share", "1", "Share of each window", "share of each window", kNone, kNo, kNo,
                  "share of each equal part of the run that was to be timed", 16},
                 {"repeated_rounds", "1", "Repeated turns", "repeated turns", kNone, kNo, kNo,
                  "turns that were taken again because the machine did something else meanwhile", 16},
                 {"disturbed_rounds", "1", "Disturbed rounds", "disturbed rounds", kNone, kNo, kNo,
                  "rounds whose turn was disturbed however often it was repeated; their times count all the same", 16},
                 {"step_clock_share", "1", "Clock share of single steps", "clock share of single steps", kNone, kNo,
                  kNo, "share of the median step, timed by itself, that reading the clock takes", 16}},
      .time = "step_time"};
}

}  // namespace assay
