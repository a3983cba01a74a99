// Cells of a campaign's run whose figure is a time: alone on the machine, contenders interleaved.
#pragma once

#include <map>
#include <string>

#include "run/coordinator/run_answers.h"
#include "run/coordinator/sessions.h"

namespace assay {

// What the timings say of the machine.
struct TimingNotes {
  TimingFacts facts;
  std::map<std::string, std::string> devices;  // what engines say of them, by name
};

// Whole runs for scaling, then steps, then many worlds, each until an interrupt.
TimingNotes measure_times(RunShared& run, const Work& work, TimeLeft& time_left, Answers& answers);

}  // namespace assay
