// One file of a folder, in a process of its own (isolate/contained.h): its answers are texts, so that nothing else
// comes out of that process.
#pragma once

#include <map>
#include <set>
#include <string>

#include "check/dataset/dataset.h"
#include "load/load_options.h"

namespace assay::dataset {

// Of an .xml or .mjcf file.
struct Survey {
  enum class Kind {
    kRobot,  // MJCF, or what was meant to be: a text that is no XML and has "<mujoco"
    kPart,   // <mujocoinclude>
    kOther,  // another program's .xml file
  };
  Kind kind = Kind::kRobot;
  std::set<std::string> includes = {};  // files below the folder, with all that these include
};

// `path` is below `folder`. Throws InputError where the file cannot be read.
std::string survey_text(const std::string& folder, const std::string& path, const LoadOptions& options);
// What survey_text() says; a robot that includes nothing where it is no such text.
Survey read_survey(const std::string& text);

// Everything that `assay check` says of the file itself. With `repaired`, the mended file is written there, where there
// is something to mend, and its folder is made; what is left is of the mended file. Throws InputError where the file
// cannot be read.
std::string examination_text(const std::string& folder, const std::string& path, const LoadOptions& options,
                             const std::string& repaired);
// What examination_text() says of the file at `path`; adds titles of kinds that have none. Throws std::exception where
// it is no such text.
FileReport read_examination(const std::string& text, const std::string& path,
                            std::map<std::string, std::string>& titles);

// A file that could not be examined.
FileReport failed_examination(const std::string& path, const char* kind, const std::string& message,
                              std::map<std::string, std::string>& titles);

// A message without lines and without the folder's path, which is another one elsewhere: "ends in line 12" is "ends in
// line". `folder` as its user named it.
std::string without_places(std::string message, const std::string& folder);

}  // namespace assay::dataset
