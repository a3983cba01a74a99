#include "run/cluster/parts.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/console.h"
#include "base/errors.h"
#include "base/text.h"
#include "campaign/shards.h"
#include "results/store/facts.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

// A process that was killed at its start may have left an empty file.
bool has_results(const fs::path& dir) {
  std::error_code error;
  return fs::is_regular_file(dir / "assay.sqlite", error) && fs::file_size(dir / "assay.sqlite", error) > 0 && !error;
}

std::vector<std::string> results_in(const fs::path& dir) {
  std::vector<std::string> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(dir, error)) {
    if (has_results(entry.path())) found.push_back(entry.path().string());
  }
  std::ranges::sort(found);
  return found;
}

std::vector<std::string> results_inside(const std::string& dir) {
  std::vector<std::string> inside = results_in(fs::path(dir) / "shards");
  return inside.empty() ? results_in(dir) : inside;
}

// The parts of a division that are there, and what they lack.
struct Division {
  std::set<int> present;
  std::map<int, size_t> lacking;  // cells by part
};

// The divisions that a directory's nodes worked on, with the parts. Where one was to measure all cells, the plan is of
// all.
std::map<DivisionKind, std::set<int>> divisions_of(const Store& store) {
  std::map<DivisionKind, std::set<int>> divisions;
  for (const NodeRow& row : store.nodes()) {
    const auto facts = facts_of(row.json);
    if (!facts.contains("shard")) continue;
    const std::string text = text_fact(facts, "shard", "1/1");
    const size_t slash = text.find('/');
    const auto index = parse_integer(text.substr(0, slash));
    const auto count = slash == std::string::npos ? std::nullopt : parse_integer(text.substr(slash + 1));
    if (!index || !count || *index < 1 || *index > *count || *count > kMostShards) continue;
    const std::string cells = text_fact(facts, "cells", "all");
    if (cells == shard_cells_text(ShardCells::kRuns)) continue;  // has none
    divisions[{cells, static_cast<int>(*count)}].insert(static_cast<int>(*index));
  }
  if (const auto whole = divisions.find({"all", 1}); whole != divisions.end()) return {*whole};
  return divisions;
}

bool fits(const DivisionKind& division, bool accuracy) {
  return division.first == "all" || (division.first != "timing") == accuracy;
}

// Whether other divisions that are there in all their parts have the same cells: beside a whole run, the second part of
// two is not missing.
bool is_covered(const DivisionKind& kind, const std::map<DivisionKind, Division>& divisions) {
  const auto has_all = [&](bool accuracy) {
    return std::ranges::any_of(divisions, [&](const auto& other) {
      return other.first != kind && std::cmp_equal(other.second.present.size(), other.first.second) &&
             fits(other.first, accuracy);
    });
  };
  return (!fits(kind, true) || has_all(true)) && (!fits(kind, false) || has_all(false));
}

std::vector<std::string> missing_text(const std::map<DivisionKind, Division>& divisions) {
  std::vector<std::string> missing;
  for (const auto& [kind, division] : divisions) {
    const bool is_whole = std::cmp_equal(division.present.size(), kind.second);
    if (!is_whole && is_covered(kind, divisions)) continue;
    const std::string what =
        kind.first == "all" ? "" : fmt::format(" of the {} cells", kind.first == "timing" ? "timing" : "accuracy");
    std::vector<std::string> absent;
    for (int part = 1; part <= kind.second; ++part) {
      if (!division.present.contains(part)) absent.push_back(std::to_string(part));
    }
    if (!absent.empty()) {
      missing.push_back(
          fmt::format("{} {} of {}{}", absent.size() == 1 ? "part" : "parts", join(absent, ", "), kind.second, what));
    }
    for (const auto& [part, cells] : division.lacking) {
      missing.push_back(fmt::format("{} in part {} of {}{}", counted(cells, "cell"), part, kind.second, what));
    }
  }
  return missing;
}

// Cells that a directory has, and that it was to measure.
struct Keys {
  Keys() = default;
  explicit Keys(const Store& store) {
    for (std::string& key : store.cell_keys()) cells.insert(std::move(key));
    for (PlanRow& row : store.plan()) planned.insert(std::move(row.key));
  }
  void add(const Keys& more) {
    cells.insert(more.cells.begin(), more.cells.end());
    planned.insert(more.planned.begin(), more.planned.end());
  }
  bool have(const Keys& other) const {
    const auto all_in = [](const auto& keys, const auto& set) {
      return std::ranges::all_of(keys, [&](const std::string& key) { return set.contains(key); });
    };
    return all_in(other.cells, cells) && all_in(other.planned, planned);
  }

  std::unordered_set<std::string> cells, planned;
};

}  // namespace

std::vector<std::string> parts_of(const std::vector<std::string>& dirs) {
  std::vector<std::string> parts;
  for (const std::string& dir : dirs) {
    if (has_results(dir)) {
      parts.push_back(dir);
      continue;
    }
    const std::vector<std::string> inside = results_inside(dir);
    if (inside.empty()) {
      std::error_code error;
      throw InputError(fs::is_directory(dir, error)
                           ? fmt::format("'{}' holds no results: give directories that `assay run` made", dir)
                           : fmt::format("there is no directory '{}': give one that `assay run` made", dir));
    }
    parts.insert(parts.end(), inside.begin(), inside.end());
  }
  return parts;
}

bool has_parts(const std::string& dir) { return has_results(dir) || !results_inside(dir).empty(); }

std::vector<std::string> parts_ahead(const std::vector<std::string>& dirs) {
  std::vector<std::string> parts;
  for (const std::string& dir : dirs) {
    if (!has_results(dir)) {
      std::ranges::move(parts_of({dir}), std::back_inserter(parts));
      continue;
    }
    const std::vector<std::string> inside = results_in(fs::path(dir) / "shards");
    if (inside.empty()) {
      parts.push_back(dir);
      continue;
    }
    const Keys united(Store::open(dir));
    bool ahead = false;
    Keys apart;
    for (const std::string& part : inside) {
      const Keys keys(Store::open(part));
      ahead |= Store::is_written(part) || !united.have(keys);
      apart.add(keys);
    }
    if (!ahead || !apart.have(united)) parts.push_back(dir);
    if (ahead) parts.insert(parts.end(), inside.begin(), inside.end());
  }
  return parts;
}

std::vector<std::string> missing_parts(const Store& store) {
  // A plan's row says its part, and a node which division it worked on; parts of one division share its count.
  std::map<DivisionKind, Division> divisions;
  for (const auto& [kind, present] : divisions_of(store)) divisions[kind].present = present;
  for (const Store::PartDone& part : store.plan_done()) {
    for (auto& [kind, division] : divisions) {
      if (fits(kind, part.accuracy) && part.done < part.cells) division.lacking[part.shard] += part.cells - part.done;
    }
  }
  return missing_text(divisions);
}

void Coverage::add(const Store& store) {
  const std::string campaign = store.manifest("campaign").value_or("");
  const std::string hash = store.manifest("campaign_hash").value_or("");
  if (dir_.empty()) {
    dir_ = store.dir();
    campaign_ = campaign;
    campaign_hash_ = hash;
  } else if (campaign != campaign_) {
    throw InputError(fmt::format("'{}' has the campaign '{}' and '{}' has '{}': give the directories of one campaign",
                                 dir_, campaign_, store.dir(), campaign));
  } else if (hash != campaign_hash_) {
    throw InputError(
        fmt::format("'{}' and '{}' have the campaign '{}' in two states, so their cells do not add up: give the "
                    "directories of one",
                    dir_, store.dir(), campaign));
  }
  const auto here = divisions_of(store);
  for (const auto& [kind, present] : here) present_[kind].insert(present.begin(), present.end());
  const std::vector<PlanRow> plan = store.plan();
  for (const PlanRow& row : plan) {
    planned_.insert(row.key);
    for (const auto& [kind, present] : here) {
      if (fits(kind, row.accuracy)) cells_[kind][row.key] = row.shard;
    }
  }
  for (std::string& key : store.cell_keys()) {
    if (plan.empty()) planned_.insert(key);
    stored_.insert(std::move(key));
  }
}

bool Coverage::has_part(const DivisionKind& division, int part) const {
  const auto found = present_.find(division);
  return found != present_.end() && found->second.contains(part);
}

size_t Coverage::done() const {
  return static_cast<size_t>(std::ranges::count_if(planned_, [&](const auto& key) { return stored_.contains(key); }));
}

std::vector<std::string> Coverage::missing() const {
  std::map<DivisionKind, Division> divisions;
  for (const auto& [kind, present] : present_) {
    divisions[kind].present = present;
    const auto cells = cells_.find(kind);
    if (cells == cells_.end()) continue;
    for (const auto& [key, part] : cells->second) {
      if (!stored_.contains(key)) ++divisions[kind].lacking[part];
    }
  }
  return missing_text(divisions);
}

Store open_to_write(const std::string& dir) {
  const Store store = Store::open(dir);
  return Store::create(dir, {store.manifest("campaign").value_or(""), store.manifest("campaign_hash").value_or("")});
}

}  // namespace assay
