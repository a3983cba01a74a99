// Which files of a folder may be models. Reads names alone, no file.
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace assay::dataset {

// ".xml" of "Robot.XML".
std::string ending_of(const std::string& file);

// Names count from the folder, with slashes, and are sorted by their bytes.
struct Listing {
  std::vector<std::string> files = {};        // .urdf, .sdf, .xml and .mjcf, in small or large letters
  std::vector<std::string> unreadable = {};   // folders that cannot be listed
  std::map<std::string, size_t> others = {};  // files of robots that assay does not read, by ending: ".xacro"
  size_t links_out = 0;                       // symbolic links that lead out of the folder or nowhere
};

// All below `folder`. Hidden files and folders (".git") are passed over, and links to folders, too: what they lead to
// within the folder is found without them. A link to a file within the folder is listed where that file is not. Throws
// InputError where the folder itself cannot be listed.
Listing list_files(const std::string& folder);

// Of files that include others, by what each includes with all that these include: the files that are part of another
// and no robot of their own, with the first that includes them. Two that include each other are none: the parser says
// what is wrong with them.
std::map<std::string, std::string> included_parts(const std::map<std::string, std::set<std::string>>& includes);

}  // namespace assay::dataset
