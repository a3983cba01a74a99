// The contenders of a campaign's file.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "campaign/campaign.h"
#include "campaign/section.h"

namespace assay {

// The contenders that take part in the campaign, each once, in the order of the file. The campaign's key `builds` says
// in which builds of their engines (engines/builds.h) those take part whose name has none: "baseline", another's name,
// or "best", the last one that this machine has and its processor runs.
class Roster {
 public:
  Roster(const Section& root, const Registry& registry);

  // The contenders that the section's list names, as indices into contenders().
  std::vector<int> listed(const Section& section, const toml::node& node);

  // Tables under [[contender]] whose names are in none of `lists`.
  std::vector<int> unlisted(const std::vector<Section>& lists);

  std::vector<CampaignContender> contenders() && { return std::move(contenders_); }

  // One sentence for each contender whose engine does not have a build that the campaign asks for.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  int index(const Section& section, const toml::node* node, const std::string& name);
  void add(std::vector<int>& found, const Section& section, const toml::node* node, const std::string& name);

  const Registry& registry_;
  std::vector<std::string> builds_;
  std::vector<std::string> notes_;
  std::map<std::string, Section> derived_;  // by name
  std::vector<std::string> in_order_;       // of the file
  std::map<std::string, int> index_;
  std::vector<CampaignContender> contenders_;
};

}  // namespace assay
