// Repeats runs of stored results at any timestep, in worker processes, for pictures and movies.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "campaign/campaign.h"
#include "results/store/store.h"
#include "results/store/trajectory.h"

namespace assay {

struct Rerun {
  std::string contender;
  std::optional<Trajectory> trajectory;  // up to where it went; empty when there was no first step
  std::string failure;                   // "diverged by 1.2 s: ...", "" when it reached the end
};

// A system and a contender of `store` as its campaign had them, on the engines as they are installed now. Throw
// InputError for one that there is not, and for one that is not what was measured.
CampaignSystem stored_system(const Store& store, const std::string& system);
CampaignContender stored_contender(const Store& store, const std::string& name);

// Runs `contenders` of `store` on `system` from its initial state over its whole duration, in worker processes, and
// keeps a state each `sample_ms`, a whole number of timesteps of which the duration holds a whole number. `progress`
// gets the number of finished runs. Throws InputError when the model, the control or a contender is not what was
// measured, SystemError when no worker can be started. An interrupt returns what is there.
std::vector<Rerun> run_again(const Store& store, const std::string& system, const std::vector<std::string>& contenders,
                             double timestep_ms, double sample_ms, const std::function<void(size_t)>& progress = {});

// Runs `contenders` of `store` on `system` again at `timestep_ms`, sampled as the stored runs are, and adds their
// states to the store, as far as each went, for the report's replays. States that the store has stay. Returns
// how many were added; those that took no step are not kept. Throws as run_again() does, and SystemError when the
// results cannot be written.
size_t keep_runs(Store& store, const std::string& system, const std::vector<std::string>& contenders,
                 double timestep_ms, const std::function<void(size_t)>& progress = {});

// Whether the time between two stored states of `system` is a whole number of timesteps.
bool fits_samples(const Store& store, const std::string& system, double timestep_ms);

// The sampling that `system` of `store` has, halved until it is at most `most_ms` or cannot be halved into whole
// timesteps. Throws InputError when the timestep does not fit into its samples.
double finer_sample_ms(const Store& store, const std::string& system, double timestep_ms, double most_ms);

}  // namespace assay
