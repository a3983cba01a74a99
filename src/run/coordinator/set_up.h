// Engines that a clone has not set up yet: named where they would have taken part, and set up for a campaign that names
// their contenders.
#pragma once

#include <string>
#include <vector>

#include "campaign/campaign.h"
#include "engines/registry.h"

namespace assay {

// Those that `./assay setup` would add here, in the registry's order. Empty for a program that no clone's launcher
// started: there set-up is no help.
std::vector<AbsentEngine> obtainable(const std::vector<AbsentEngine>& absent);

// "dart (6 minutes of compiling), drake (420 MB)", and the command that sets them up.
std::string obtainable_text(const std::vector<AbsentEngine>& engines);
std::string set_up_command(const std::vector<AbsentEngine>& engines);

// Sets up the releases that `contenders` name ("mujoco-euler@3.3.7") and that are not there, as obtain_engines() does.
// Names of no release are passed over.
void obtain_releases(const std::vector<std::string>& contenders);

// Says which engines of the campaign's contenders are not set up, and what they take, and starts the launcher again,
// which sets them up and then repeats this command. Returns where there is nothing to do, where it was tried already,
// or where no launcher started this program. With `contenders` only engines of these count.
void obtain_engines(const Campaign& campaign, const std::vector<std::string>* contenders = nullptr);

}  // namespace assay
