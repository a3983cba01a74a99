// Contenders side by side on one clock, as a movie: H.264, or GIF where the file ends so.
#pragma once

#include <string>
#include <vector>

#include "base/console.h"
#include "report/render/shots.h"

namespace assay {

inline constexpr size_t kMostPanels = 12;
inline constexpr double kFrameMs = 1000.0 / 30;  // frames are about this far apart where states are

inline bool is_gif(const std::string& out) { return out.ends_with(".gif"); }

struct MovieRequest {
  std::string dir, system;  // whose figures stand in the panels
  std::string out;
  int width = 0, height = 0;
  bool of_kept_runs = true;  // else they were made for the movie
  double slow_below_s = 0;   // a motion that is shorter is shown at 1/2, 1/4, ... of its speed until it takes this long
};

// Writes the movie and says on standard error what it shows. A status of base/exit_status.h: kFailed where it was
// interrupted (isolate/interruption.h), and then there is no file. Throws InputError where there is nothing to show.
int write_movie(const Scene& scene, const std::vector<Cell>& cells, const std::vector<MoviePart>& parts,
                const MovieRequest& request, ProgressLine& progress);

}  // namespace assay
