#include "report/kept_replays.h"

#include <algorithm>

#include <fmt/format.h>

#include "base/console.h"
#include "base/text.h"
#include "report/replays.h"
#include "results/line_up.h"
#include "results/store/store.h"
#include "results/store/trajectory.h"
#include "run/cluster/parts.h"
#include "run/coordinator/rerun.h"

namespace assay {

void keep_replays(const std::string& dir, const std::vector<double>& timesteps) {
  if (timesteps.empty()) return;
  Store store = open_to_write(dir);
  for (const SceneRow& scene : store.scenes()) {
    std::vector<std::string> kept;
    for (const RunRow& run : store.runs()) {
      if (run.system == scene.system && count_states(store.trajectories_dir(), run.address) > 1 &&
          std::ranges::find(kept, run.contender) == kept.end()) {
        kept.push_back(run.contender);
      }
    }
    if (kept.empty()) continue;
    for (const double timestep : timesteps) {
      if (!fits_samples(store, scene.system, timestep)) {
        message(fmt::format("{} has no replay at {} ms, because that does not divide the time between its states",
                            scene.system, timestep_label(timestep)));
        continue;
      }
      const size_t added = keep_runs(store, scene.system, line_up(kept, ReplayOptions{}.most_contenders), timestep);
      if (added > 0) {
        message(fmt::format("{}: {} at {} ms", scene.system, counted(added, "run"), timestep_label(timestep)));
      }
    }
  }
}

}  // namespace assay
