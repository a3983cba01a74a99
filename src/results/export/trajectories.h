// `assay export --trajectories`: the kept states of a results directory as files that other programs read.
#pragma once

#include <string>

namespace assay {

// Writes `folder`/SYSTEM/CONTENDER.npz (or .csv) for every kept run of `dir` and `folder`/index.csv, whose header is
// file,system,contender,timestep_ms,samples,bodies. docs/files.md describes the files. Damaged
// runs are named and left out, and the status is kFailed then. Returns the status; throws InputError for another
// `format` than npz or csv, a directory without results, or one whose runs are not listed.
int export_trajectories(const std::string& dir, const std::string& format, const std::string& folder);

}  // namespace assay
