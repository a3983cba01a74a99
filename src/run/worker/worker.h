// The child process of a campaign.
#pragma once

namespace assay {

// Entry point of the hidden subcommand `worker`: reads one job from descriptor 3, writes its answer there, and ends.
// Returns the exit status.
int worker_main(int argc, char** argv);

}  // namespace assay
