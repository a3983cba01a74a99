// The contenders of a campaign's file.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "campaign/campaign.h"
#include "campaign/section.h"

namespace assay {

// The contenders that take part in the campaign, each once, in the order of the file.
class Roster {
 public:
  Roster(const Section& root, const Registry& registry);

  // The contenders that the section's list names, as indices into contenders().
  std::vector<int> listed(const Section& section, const toml::node& node);

  // Tables under [[contender]] whose names are in none of `lists`.
  std::vector<int> unlisted(const std::vector<Section>& lists);

  std::vector<CampaignContender> contenders() && { return std::move(contenders_); }

 private:
  int index(const Section& section, const toml::node* node, const std::string& name);

  const Registry& registry_;
  std::map<std::string, Section> derived_;  // by name
  std::vector<std::string> in_order_;       // of the file
  std::map<std::string, int> index_;
  std::vector<CampaignContender> contenders_;
};

}  // namespace assay
