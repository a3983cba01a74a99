// The measure 'consistency': how far short pieces end from the contender's own motion at the fine timestep, which
// starts anew from the same state, and from its fine-step run, as in the paper.
#include "measures/accuracy.h"
#include "measures/measure.h"

namespace assay {

Measure consistency_measure() {
  using namespace rows;
  return {
      .name = "consistency",
      .reads = Reads::kPieces,
      .version = 1,
      .values =
          {{"consistency_cold", "m", "Self-consistency error", "self-consistency error", kLow, kPlot, kLimit,
            "mean distance of the bodies from the contender's own motion at the fine timestep over short pieces, both "
            "started anew from the same states",
            1},
           {"consistency_cold_median", "m", "Self-consistency error, median", "self-consistency error (median)", kLow,
            kNo, kLimit, "median over the pieces of the self-consistency error", 2},
           {"consistency_cold_share", "1", "Pieces within 1 mm", "pieces within 1 mm", kHigh, kNo, kNo,
            "share of the pieces whose self-consistency error is at most 1 mm", 2},
           {"consistency", "m", "Self-consistency error (the paper's)", "self-consistency error (the paper's)", kLow,
            kPlot, kLimit,
            "mean distance of the bodies from the contender's own fine-step run, over short pieces of it that start "
            "without what the engine keeps between steps",
            2},
           {"restart_floor", "m", "Restart floor", "restart floor", kNone, kNo, kNo,
            "self-consistency error at the fine-step run's own timestep: hidden state and rounding, not integration",
            11},
           {"consistency_floor", "m", "Near the floor", "floor", kNone, kNo, kNo,
            "restart floor, or the error at which the curve stops falling, given where the paper's self-consistency "
            "error is so close to it that it says little of the timestep",
            13},
           {"consistency_bound", "m", "Bound of the paper's self-consistency error", "bound", kNone, kNo, kNo,
            "upper bound of the paper's self-consistency error near the floor: the measured distance and the floor "
            "together",
            13},
           {"consistency_cold_floor", "m", "Near the floor", "floor", kNone, kNo, kNo,
            "the error at which the curve stops falling, given where the self-consistency error is so close to it that "
            "it says little of the timestep",
            13},
           {"consistency_cold_bound", "m", "Bound of the self-consistency error", "bound", kNone, kNo, kNo,
            "upper bound of the self-consistency error near the floor: the measured distance and the floor together",
            13}},
      .of_piece = position_error};
}

}  // namespace assay
