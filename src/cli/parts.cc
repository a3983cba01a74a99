#include "cli/parts.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/text.h"
#include "campaign/shards.h"
#include "cli/terminal.h"
#include "store/facts.h"

namespace assay::cli {
namespace {

namespace fs = std::filesystem;

bool has_results(const fs::path& dir) {
  std::error_code error;
  return fs::is_regular_file(dir / "assay.sqlite", error);
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

// Of each kind of division ("all", "accuracy", "timing" in so many parts), the parts that are there and their cells.
struct Division {
  std::set<int> present;
  std::map<int, size_t> lacking;  // cells by part
};

void add_divisions(const Store& store, std::map<std::pair<std::string, int>, Division>& divisions) {
  // A plan's row says its part, and a node which division it worked on; parts of one division share its count.
  std::set<std::pair<std::string, int>> here;
  for (const NodeRow& row : store.nodes()) {
    const auto facts = facts_of(row.json);
    if (!facts.contains("shard")) continue;
    const std::string text = text_fact(facts, "shard", "1/1");
    const size_t slash = text.find('/');
    const auto index = parse_integer(text.substr(0, slash));
    const auto count = slash == std::string::npos ? std::nullopt : parse_integer(text.substr(slash + 1));
    if (!index || !count || *index < 1 || *index > *count || *count > kMostShards) continue;
    const std::pair division(text_fact(facts, "cells", "all"), static_cast<int>(*count));
    here.insert(division);
    divisions[division].present.insert(static_cast<int>(*index));
  }
  if (here.empty()) return;
  for (const Store::PartDone& part : store.plan_done()) {
    for (const auto& division : here) {
      const bool fits = division.first == "all" || (division.first == "accuracy") == part.accuracy;
      if (fits && part.done < part.cells) divisions[division].lacking[part.shard] += part.cells - part.done;
    }
  }
}

std::vector<std::string> missing_text(const std::map<std::pair<std::string, int>, Division>& divisions) {
  std::vector<std::string> missing;
  for (const auto& [kind, division] : divisions) {
    const std::string what = kind.first == "all" ? "" : fmt::format(" of the {} cells", kind.first);
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

}  // namespace

std::vector<std::string> parts_of(const std::vector<std::string>& dirs) {
  std::vector<std::string> parts;
  for (const std::string& dir : dirs) {
    if (has_results(dir)) {
      parts.push_back(dir);
      continue;
    }
    std::vector<std::string> inside = results_in(fs::path(dir) / "shards");
    if (inside.empty()) inside = results_in(dir);
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

std::vector<std::string> missing_parts(const Store& store) {
  std::map<std::pair<std::string, int>, Division> divisions;
  add_divisions(store, divisions);
  return missing_text(divisions);
}

std::vector<std::string> missing_parts(const std::vector<std::string>& dirs) {
  std::map<std::pair<std::string, int>, Division> divisions;
  for (const std::string& dir : dirs) add_divisions(Store::open(dir), divisions);
  return missing_text(divisions);
}

}  // namespace assay::cli
