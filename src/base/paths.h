// Where the program and its data lie, and how a user's MODEL or CAMPAIGN becomes a file.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace assay {

// Absolute path of the running program, symbolic links resolved. Throws SystemError when /proc is missing.
std::string program_path();

// For a process that has assay as a library, as an interpreter has: the program whose engines and data it uses. Called
// before anything else of assay, by one thread.
void set_program_path(const std::string& path);

// The folder that holds `models` and `campaigns`: the environment's ASSAY_DATA, else `../share/assay` beside the
// program's folder (installed), else the source tree this was built from. Throws InputError when there is none.
std::string assay_data_dir();

// Names of the systems (models/*.xml) and of the campaigns (campaigns/*.toml) that come with assay, sorted.
std::vector<std::string> system_names();
std::vector<std::string> campaign_names();

// A system of capsules that needs no file: "capsules-N", "capsules-N-layers-L", "capsules-N-seed-S" or both parts in
// this order, whole numbers without a leading zero; N is 1 to 10000, L and S are 1 to 1000.
struct CapsulesName {
  int count = 0;
  int layers = 0;  // 0: as many as columns and rows, so that it grows with N
  int seed = 27;   // of the orientations
};
std::optional<CapsulesName> capsules_named(std::string_view name);

// The folders that an environment variable lists, separated by colons.
std::vector<std::string> folders_in(const char* variable);

// What users share between clones: ASSAY_CACHE, else assay in XDG_CACHE_HOME, else in ~/.cache. Empty when all of them
// are unset. The folder need not exist.
std::string cache_dir();

// The file of a model: `model` is a system's name, or the path of a file. A word without '/' and without an ending is a
// name first (write ./planar-chain for a file of that name). For a system of capsules without a file the result is the
// path that such a file would have, and load_model() makes its text. robots:PATH is a file of the real robots that
// set-up fetches (`./assay robots`), below robots in cache_dir(). Throws InputError with what is missing and the
// nearest name.
std::string find_model(const std::string& model);

// The same for a campaign: `campaign` is a TOML file's path or the name of one that comes with assay.
std::string find_campaign(const std::string& campaign);

}  // namespace assay
