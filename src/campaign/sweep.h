// Settings as curve parameters: contenders that differ from one of the campaign's in the settings that a table varies.
// A table makes every combination of its values; several tables add up. A combination that changes nothing is the
// contender itself. campaign/keys.h has the keys of [[sweep]].
#pragma once

#include <string>
#include <vector>

#include "campaign/campaign.h"
#include "campaign/section.h"

namespace assay {

// The name of what varies `of` by `changes`: "mujoco-euler it=4 contact_timeconst=0.005". The only owner of such names.
std::string variant_name(const std::string& of, const std::vector<Setting>& declared, const Settings& own,
                         const Settings& varied);

// Puts the variants that the file's sweeps ask for behind the contenders that they vary, in the campaign and in its
// systems, and what a pattern matches but cannot be varied into the campaign's notes. Throws InputError where a
// contender that a sweep names cannot be varied.
void add_variants(const Section& root, const Registry& registry, Campaign& campaign);

}  // namespace assay
