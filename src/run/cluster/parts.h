// Parts of a campaign in several results directories.
#pragma once

#include <map>
#include <set>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "results/store/store.h"

namespace assay {

// The results directories that `dirs` name: each itself, or, where it holds no results, the directories in it that do,
// by name; "shards" in it counts too. Throws InputError for one without results.
std::vector<std::string> parts_of(const std::vector<std::string>& dirs);

bool has_parts(const std::string& dir);  // whether parts_of() finds any in it

// As parts_of(), but where the parts in a directory's "shards" have more than its union (cells, planned cells, or a
// process that measures), they stand for it; the union comes with them when it has cells that they lack.
std::vector<std::string> parts_ahead(const std::vector<std::string>& dirs);

// What the plan has and the results lack, a phrase each: "part 3 of 4", "12 cells of part 2".
std::vector<std::string> missing_parts(const Store& store);

// A division of a campaign: its kind ("all", "accuracy", "timing", "after-runs") and the number of parts.
using DivisionKind = std::pair<std::string, int>;

// The same for results that lie in several directories, with each cell counted once.
class Coverage {
 public:
  // Throws InputError for a store of another campaign than those before.
  void add(const Store& store);
  bool has_part(const DivisionKind& division, int part) const;
  size_t planned() const { return planned_.size(); }
  size_t done() const;
  std::vector<std::string> missing() const;

 private:
  std::string dir_, campaign_, campaign_hash_;  // of the first
  std::unordered_set<std::string> planned_, stored_;
  std::map<DivisionKind, std::set<int>> present_;
  std::map<DivisionKind, std::map<std::string, int>> cells_;  // part by key
};

// Opens a results directory for writing, under the campaign that it holds.
Store open_to_write(const std::string& dir);

}  // namespace assay
