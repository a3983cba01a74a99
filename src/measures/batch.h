// The measure 'batch': many worlds of one contender, stepped together on one device, or in one process a core where the
// engine steps one world. Each number of worlds and each device is a measure of its own, "batch-256" and
// "batch-256-cuda:0", so that no reader takes one for another, nor any for the speed of one world.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "measures/initial_states.h"
#include "model/model.h"

namespace assay {

struct BatchOf {
  int worlds = 1;
  std::string device;  // "cpu", "cuda:0"
};
inline constexpr std::string_view kBatchMeasure = "batch";  // in campaigns
std::string batch_name(const BatchOf& batch);               // as stored
std::optional<BatchOf> batch_of(std::string_view measure);  // as stored; nothing for another measure

// ---- where worlds start ---------------------------------------------------------------------------------------------

// Worlds start at moments that are spread over the contender's own run of one world, so that any number of steps meets
// all phases of the motion, as in training: this many moments, in an order in which the first ones are spread evenly,
// too (radical inverse in base 2).
inline constexpr int kBatchMoments = 64;
int batch_moment(int world);  // its number, from 0

// States of `worlds` worlds: at those moments of `run`, which has kBatchMoments states, with rates drawn anew around
// them as `states` says, and time 0. World 0 is run.front() itself.
std::vector<State> batch_states(const Model& model, const std::vector<State>& run, const InitialStates& states,
                                int worlds);

// ---- equivalence ----------------------------------------------------------------------------------------------------

// Of each world that is compared: this many steps in the batch, and as many of one world from the same state.
inline constexpr int kEquivalenceSteps = 32;
inline constexpr int kMostCompared = 16;

// The first, the last and seeded others; all of them where there are few. Ascending.
std::vector<int> compared_worlds(int worlds, std::uint64_t seed);

// m, the largest distance of a body's centre that rounding explains. The arithmetic of a world is the same in a batch,
// but its order may differ. A world that was mixed up is off by far more: neighbours move at other speeds.
double equivalence_bound(bool single_precision);

// Seeded torques of one step, one a joint of each world, that change rates by up to 0.1 rad/s: worlds that got each
// other's would part. Zero for massless bodies.
std::vector<double> batch_torques(const Model& model, int worlds, double timestep_s, std::uint64_t seed);

// Largest distance of the centres of two states of one model, m.
double centre_distance(const State& a, const State& b);

}  // namespace assay
