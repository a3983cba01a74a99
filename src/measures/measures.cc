#include <algorithm>

#include "measures/batch.h"
#include "measures/measure.h"

namespace assay {

// Each is made by NAME_measure() in a file of this folder. Their order is part of campaigns' hashes.
#define ASSAY_MEASURES(EACH) \
  EACH(fine_run)             \
  EACH(raw_speed)            \
  EACH(consistency)          \
  EACH(truth)                \
  EACH(drift)                \
  EACH(violation)            \
  EACH(grasp)                \
  EACH(agreement)            \
  EACH(scaling)              \
  EACH(transfer)             \
  EACH(batch)                \
  // a new one comes here

#define ASSAY_DECLARED(name) Measure name##_measure();
#define ASSAY_MADE(name) name##_measure(),
ASSAY_MEASURES(ASSAY_DECLARED)

const std::vector<Measure>& measures() {
  static const std::vector<Measure> kAll = [] {
    std::vector<Measure> all = {ASSAY_MEASURES(ASSAY_MADE)};
    for (Measure& measure : all) {
      for (ValueInfo& row : measure.values) row.measure = measure.name;
    }
    return all;
  }();
  return kAll;
}

const Measure* find_measure(std::string_view name) {
  const auto found = std::ranges::find(measures(), name, &Measure::name);
  return found == measures().end() ? nullptr : &*found;
}

const Measure* measure_of(std::string_view stored) { return find_measure(batch_of(stored) ? kBatchMeasure : stored); }

bool reads(std::string_view stored, Reads what) {
  const Measure* measure = measure_of(stored);
  return measure != nullptr && measure->reads == what;
}

bool is_timed(std::string_view stored) {
  const Measure* measure = measure_of(stored);
  return measure != nullptr && is_timed(measure->reads);
}

}  // namespace assay
