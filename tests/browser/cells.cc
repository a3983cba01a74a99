#include "cells.h"

#include <fmt/format.h>

namespace assay {

Cell cell(const std::string& system, const std::string& contender, double timestep_ms, const std::string& measure) {
  Cell made;
  made.key = fmt::format("{}/{}/{}/{}", system, contender, timestep_ms, measure);
  made.system = system;
  made.contender = contender;
  made.timestep_ms = timestep_ms;
  made.measure = measure;
  made.wall_s = 1.2;
  made.cpu_s = 1.19;
  made.engine_s = 1.1;
  made.steal = 0.002;
  return made;
}

void fail(Store& store, Cell cell, Outcome outcome, const std::string& reason) {
  cell.outcome = outcome;
  cell.reason = reason;
  cell.values.clear();
  store.put_cell(cell);
}

void put_speed(Store& store, Cell cell, double kilohertz, double wide, const std::vector<double>& samples) {
  const double us = 1e3 / kilohertz, factor = cell.timestep_ms * kilohertz;
  cell.values = {{"raw_speed", "kHz", kilohertz, kilohertz * (1 - wide), kilohertz * (1 + wide)},
                 {"step_time", "us", us, us / (1 + wide), us / (1 - wide)},
                 {"realtime_factor", "1", factor, factor * (1 - wide), factor * (1 + wide)}};
  store.put_cell(cell, {{"step_time_us", samples}});
}

}  // namespace assay
