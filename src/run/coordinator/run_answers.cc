#include "run/coordinator/run_answers.h"

namespace assay {

void Answers::note_stored(const Cell& cell) {
  ++stored_;
  engine_s_ += cell.engine_s;
  run_.progress.finished(cell, time_left_.seconds());
}

void Answers::put_failed(const PlannedCell& planned, const Ending& failure) {
  time_left_.finished(planned);
  put_unscored(planned, failure);
}

void Answers::put_unscored(const PlannedCell& planned, const Ending& failure) {
  Cell cell = run_.cell_of(planned, failure);
  cell.started = cell.finished = unix_time();
  run_.store.put_cell(cell);
  note_stored(cell);
}

void Answers::put(const std::vector<const PlannedCell*>& cells, const JobEnd& end) {
  if (end.outside) return;  // nothing is known of them: they are measured at the next start
  std::vector<MeasuredCell> measured;
  for (const PlannedCell* planned : cells) {
    CellResult result = end.result(planned->measure);
    Cell cell = run_.cell_of(*planned, result.ending);
    const double share = 1.0 / static_cast<double>(cells.size());
    cell.wall_s = share * end.wall_s;
    cell.steal = end.steal;
    cell.started = end.started;
    cell.finished = end.finished;
    if (end.answer) {
      cell.cpu_s = share * end.answer->cpu_s;
      cell.engine_s = share * end.answer->engine_s;
    }
    cell.values = std::move(result.values);
    time_left_.finished(*planned);
    measured.push_back({std::move(cell), std::move(result.samples)});
  }
  run_.store.put_cells(measured);
  for (const MeasuredCell& each : measured) note_stored(each.cell);
}

void Answers::put_timed(const std::vector<MeasuredCell>& cells,
                        const std::map<std::string, const PlannedCell*>& planned) {
  run_.store.put_cells(cells);
  time_left_.under_way(0);
  for (const MeasuredCell& each : cells) {
    const auto found = planned.find(each.cell.key);
    if (found == planned.end()) continue;
    time_left_.finished(*found->second);
    note_stored(each.cell);
  }
}

}  // namespace assay
