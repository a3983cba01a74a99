// Kept runs, packed for the report's page, which plays them.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "model/state.h"

namespace assay {

class Store;

struct ReplayOptions {
  size_t most_contenders = 12;            // of a system; the line-up's first (results/line_up.h)
  double least_frame_ms = 15;             // no more frames a second than a screen shows
  size_t most_bytes = 5'000'000;          // of all packed states together; the references come first
  size_t most_picture_bytes = 2'000'000;  // of all packed meshes together, which lose triangles to fit
  double position_step_m = 1e-5;          // of the quantised positions
  double rotation_step = 1.0 / 16384;     // of the quantised quaternions' components
};

// An array with an object for each system that has a kept run:
//   {"system", "scene": see results/store/scene.h, "frame_ms", "frames", "bodies", "position_step_m", "rotation_step",
//    "position_error_m", "rotation_error_rad",          what the packing changed at the most
//    "pictures": {"data"} or {"like": number of another replay}, where there are meshes to draw,
//    "runs": [{"contender", "timestep_ms", "frames", "distance_m", "data"}], "left_out": ["x", "y at 4 ms"] without
//    room}
// "data" of pictures is base64 of a zlib stream of JSON, results/store/pictures.h's; replays of one robot have it once.
// "distance_m" is, frame by frame, the mean distance of the bodies from the first run's, unpacked.
// Runs are ordered by timestep, then by the line-up; one that ended early has fewer frames. All runs of a system share
// the clock: frame f is at f * frame_ms. `data` is base64 of a zlib stream of whole numbers:
// body by body, and of each the columns x, y, z (of the centre of mass, in steps) and qw, qx, qy, qz (of the body
// frame, in steps, not normalised, of the sign that is nearer to the frame before); each column frame by frame as
// second differences (of a column that starts with two zeros), zigzag coded in bytes of 7 bits, the least first, 0x80
// set in all but a number's last. Depends on the results alone: equal ones give equal bytes.
nlohmann::json replays_data(const Store& store, const ReplayOptions& options = {});

// Runs of one system, of at least two states each and equally spaced; the first one is the reference.
struct ReplayRun {
  std::string contender;
  double timestep_ms = 0;
  std::vector<State> states;
};
struct ReplaySource {
  std::string system;
  std::string scene;  // text of results/store/scene.h; one that cannot be read has no replay
  std::vector<ReplayRun> runs;
};
nlohmann::json replays_data(const std::vector<ReplaySource>& sources, const ReplayOptions& options = {});

// The bytes in digits of a page.
std::string base64(const std::string& bytes);

}  // namespace assay
