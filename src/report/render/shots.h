// What pictures and movies show of a results directory.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/state.h"
#include "results/store/scene.h"
#include "results/store/store.h"

namespace assay {

// The stored scene of a system. Throws InputError for a name that the results do not have, with the nearest one, and
// for results that have no scenes.
Scene scene_named(const Store& store, const std::string& system);

// "1/64 ms, 3.1 x realtime\nconsistency 1.2e-05 m": what was measured of a contender at a timestep.
std::string figures_text(const std::vector<Cell>& cells, const std::string& system, const std::string& contender,
                         double timestep_ms);

struct Shot {
  Scene scene;
  std::vector<State> states;  // that the view is chosen for
  size_t shown = 0;           // index into them
};

// A state of the kept run of `contender`, by default of the first one, that is nearest to `time` (s, as given; default:
// the first). Says on standard error where a run has one state alone. Throws InputError.
Shot kept_shot(const Store& store, const std::string& system, const std::optional<std::string>& contender,
               const std::optional<std::string>& time);

// One contender's part of a movie.
struct MoviePart {
  std::string contender;
  double timestep_ms = 0;
  std::vector<State> states;
  std::string failure;
};

// Of the kept runs. A contender without one has a reason.
std::vector<MoviePart> stored_parts(const Store& store, const Scene& scene, const std::string& system,
                                    const std::vector<std::string>& contenders);

}  // namespace assay
