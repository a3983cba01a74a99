// Which parts of a run are timed: the same simulated time for every contender, however fast it is.
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace assay {

// The run is divided into equal strata; each window is a part of one of them.
struct TimingWindow {
  long long state = -1;   // index of the stored state that it starts from; -1: it goes on where the window before ended
  long long untimed = 0;  // steps from there to the window: they warm caches and warm starts
  long long steps = 1;    // of the window itself
  double begin_s = 0;     // since the run's start
  double weight = 0;      // share of the run that the window stands for; the sum is 1
};

struct WindowLayout {
  double duration_s = 0;   // of the run
  double sample_ms = 0;    // distance of the stored states; the first one is the run's start
  double timestep_ms = 0;  // of the timed steps
  int windows = 32;        // wanted; fewer where the run is too short for them
  int warmup = 5;          // untimed steps behind a stored state, where there is room for them
  double share = 1;        // of each stratum that is timed, more than 0
  bool restart = false;    // every window starts from a stored state, even when the windows leave no gap
};

// In the order of time. A whole share without restarts is one continuous run from its start. Else each window lies in
// the middle of its stratum, as nearly as the stored states allow.
std::vector<TimingWindow> timing_windows(const WindowLayout& layout);

// Simulated time of the windows over the duration of the run. Above 1 where steps are longer than what was asked for.
double coverage(const std::vector<TimingWindow>& windows, const WindowLayout& layout);

// How the time of a system's timing at one timestep is spent. All contenders time the same share of the run; those that
// need much longer for it than the others get fewer rounds.
struct TimingShare {
  double share = 1;         // a power of two, so that repeated measurements time the same windows
  std::vector<int> rounds;  // of each contender in each of its processes
};
// `run_s`: seconds that each contender needs for the whole run; `turn_s`: seconds of a turn in the mean over contenders
// and rounds; `rounds`: of a process, at most; `given`: a share that is already decided.
TimingShare timing_share(std::span<const double> run_s, double turn_s, int rounds,
                         std::optional<double> given = std::nullopt);

}  // namespace assay
