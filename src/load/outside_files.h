// What a stranger's MJCF file may make the program read, before MuJoCo's parser gets it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "load/load_options.h"
#include "load/problems.h"

namespace assay {

// The folder below which the files of a model have to lie, as one unpacks it:
// - the nearest folder upward that has a package.xml;
// - else, of a robot in the user's cache, its package;
// - else, of a robot in an installed Python package, that package;
// - else the nearest folder upward, at most three above, that looks like the top of what somebody published (a licence,
//   a README, a repository);
// - else the model's own folder, or the one around it where that is called urdf, mjcf or the like.
// It is never a folder for which is_personal() holds.
std::string model_root(const std::string& path);

// Whether `folder` (absolute) holds more than one package: the user's home, the folder of temporary files, and all
// above them.
bool is_personal(const std::filesystem::path& folder);

// Whether `file`, its links followed, lies below `root`.
bool is_below(const std::string& file, const std::string& root);

// The folder that names in the model's file at `path` count from: its own, links to the folder followed, not those of
// the file; the current one for a text, whose path is empty.
std::filesystem::path model_folder(const std::string& path);

// `name` in `folder` as MuJoCo joins them: an absolute name is kept, backslashes are slashes, and "NAME/.." is dropped
// whatever links NAME goes through.
std::string joined_path(const std::string& folder, const std::string& name);

// The file that MuJoCo opens for an <include> of `name` in a file of `folder`: it looks in `first`, the folder of the
// model's own file, before that. Empty where there is none.
std::string included_file(const std::string& first, const std::string& folder, const std::string& name);

// Refusals of an MJCF document that includes or names files outside its folder (unless the options allow them), what is
// no regular file, an archive, or a model that contains itself; that holds a class name which MuJoCo would take for a
// format; or whose counts ask for more memory than a model needs. The same of all that it includes. `path` is where
// relative names count from; empty for a text.
std::vector<Problem> document_refusals(const std::string& text, const std::string& path, const LoadOptions& options);

}  // namespace assay
