// How far a campaign is, over all of its parts.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace assay {

struct PartStatus {
  std::string dir, shard, cells, node;
  size_t planned = 0, done = 0;
  double left_s = 0;
  bool begun = true, running = false;
  bool known = true;  // what it is to measure

  std::string_view state() const {
    if (!begun) return "waiting";
    if (running) return "running";
    return known && done == planned ? "complete" : "stopped";
  }
};

// Of the parts that make the runs which others read. They have no cells.
struct RunsStatus {
  int parts = 0, ended = 0, under_way = 0;
  size_t runs = 0, runs_ended = 0;
  double left_s = 0;  // of the longest that has not ended
  bool are_over = false;
};

struct CampaignStatus {
  std::vector<PartStatus> parts;
  std::vector<RunsStatus> runs;      // of each submission whose accuracy parts wait for them
  std::vector<std::string> missing;  // a phrase each, see run/cluster/parts.h
  size_t planned = 0, done = 0;      // cells
  double left_s = 0;                 // where all parts run side by side
};

// Of results directories, or folders of them, also while they are written. Throws InputError.
CampaignStatus campaign_status(const std::vector<std::string>& dirs);

}  // namespace assay
