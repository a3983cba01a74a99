// The measure 'consistency': how far short pieces end from the contender's own fine-step run.
#include "measures/accuracy.h"
#include "measures/measure.h"

namespace assay {

Measure consistency_measure() {
  using namespace rows;
  return {
      .name = "consistency",
      .reads = Reads::kPieces,
      .values =
          {{"consistency", "m", "Self-consistency error", "self-consistency error", kLow, kPlot, kLimit,
            "mean distance of the bodies from the contender's own fine-step run, over short pieces of it", 1},
           {"restart_floor", "m", "Restart floor", "restart floor", kNone, kNo, kNo,
            "self-consistency error at the fine-step run's own timestep: hidden state and rounding, not integration",
            11},
           {"consistency_floor", "m", "Near the floor", "floor", kNone, kNo, kNo,
            "restart floor, or the error at which the curve stops falling, given where the self-consistency error is "
            "so close to it that it says little of the timestep",
            13},
           {"consistency_bound", "m", "Bound of the self-consistency error", "bound", kNone, kNo, kNo,
            "upper bound of the self-consistency error near the floor: the measured distance and the floor together",
            13}},
      .of_piece = position_error};
}

}  // namespace assay
