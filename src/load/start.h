// What --qpos, --within-limits, --ground and --no-ground do to a model that is loaded.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"

namespace assay {

// Starts the model at rest in the configuration of the text of `file`: all numbers of MuJoCo's qpos in their order
// (free joint: position of the body frame and quaternion w x y z; ball: quaternion; hinge or slide: one number),
// separated by blanks, commas or lines; or lines JOINT=VALUE for hinges and slides, where the others keep theirs,
// except those that couplings move with the named ones. `#` begins a comment. Throws InputError with the line, also
// where a joint is named twice.
void start_from(Model& model, const std::string& text, const std::string& file);

// A joint that started beyond its limits.
struct Clamped {
  size_t joint = 0;
  double was = 0;  // rad, m
};

// Puts hinges and slides whose initial position lies more than 1 mrad or 1 mm beyond their limits at the limit, and
// joints that couplings move with them where they belong: a group whose joints one leads is moved until all are within
// their limits, as far as there is such a position. Names the former. The base and velocities stay as they are.
std::vector<Clamped> start_within_limits(Model& model);

// The lowest point of the collision shapes in the initial state, planes and height fields apart, m. Zero without any.
double lowest_point(const Model& model);

// The same for each body and, behind them, for what is fixed to the world; infinite without shapes that collide.
std::vector<double> lowest_points(const Model& model);

// Lowers or raises the static plane `name` to the lowest point of all others.
void put_under(Model& model, const std::string& name);

void remove_planes(Model& model);

}  // namespace assay
