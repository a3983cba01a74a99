#include "bisect/bisect.h"

#include <algorithm>
#include <cassert>
#include <optional>

namespace assay {
namespace {

bool is_run(const ReleaseResult& result) { return !result.bits.empty() || !result.failure.empty(); }

class Search {
 public:
  Search(size_t count, const RunReleases& run) : run_(run), results_(count) {}

  void make(std::vector<size_t> which) {
    std::erase_if(which, [&](size_t i) { return is_run(results_[i]); });
    if (which.empty()) return;
    std::vector<ReleaseResult> made = run_(which);
    assert(made.size() == which.size());
    for (size_t i = 0; i < which.size(); ++i) results_[which[i]] = std::move(made[i]);
  }

  // The usable release from `from` towards `to` that is nearest to `from`.
  std::optional<size_t> usable(size_t from, size_t to) {
    for (size_t i = from;; i += from < to ? 1 : -1) {
      make({i});
      if (results_[i].usable()) return i;
      if (i == to) return std::nullopt;
    }
  }

  // Halves what is between two usable releases until every change is between two neighbours.
  void halve(size_t low, size_t high) {
    if (high - low < 2 || results_[low].bits == results_[high].bits) return;
    const size_t middle = (low + high) / 2;
    auto found = usable(middle, high - 1);
    if (!found && middle - 1 > low) found = usable(middle - 1, low + 1);
    if (!found) return;
    halve(low, *found);
    halve(*found, high);
  }

  std::vector<ReleaseResult> take() { return std::move(results_); }

 private:
  const RunReleases& run_;
  std::vector<ReleaseResult> results_;
};

}  // namespace

ReleaseCourse find_course(size_t count, bool quick, double noise, const RunReleases& run, const ReleaseDistance& distance) {
  ReleaseCourse course;
  if (count == 0) return course;
  Search search(count, run);
  if (quick) {
    const auto low = search.usable(0, count - 1);
    const auto high = low ? search.usable(count - 1, *low) : std::nullopt;
    if (low && high) search.halve(*low, *high);
  } else {
    std::vector<size_t> all;
    for (size_t i = 0; i < count; ++i) all.push_back(i);
    search.make(all);
  }
  course.results = search.take();
  std::optional<size_t> last;
  for (size_t i = 0; i < count; ++i) {
    const ReleaseResult& result = course.results[i];
    if (!is_run(result) || !result.usable()) continue;
    const bool same = last && result.bits == course.results[*last].bits;
    double size = 0;
    bool beyond = false;
    if (last && !same) {
      size = distance(*last, i);
      beyond = noise == 0 || size > noise;
    }
    if (last && (same || !beyond)) {
      ReleaseGroup& group = course.groups.back();
      for (size_t k = *last + 1; k < i; ++k) group.inferred = group.inferred || !is_run(course.results[k]);
      group.last = i;
    } else {
      course.groups.push_back({.first = i, .last = i});
      if (last) course.changes.push_back({*last, i, size, beyond});
    }
    last = i;
  }
  return course;
}

}  // namespace assay
