// The text of an MJCF file beside MuJoCo's parser: the faults that keep MuJoCo from compiling it and have one obvious
// mend, all of them with their lines, where MuJoCo names the first.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "model/problems.h"
#include "model/repair.h"

namespace assay {

// Inertias that are not positive or break the triangle inequality, and ranges whose bounds are swapped, in the file at
// `path` and those that it includes. `path` is where relative names count from.
std::vector<Problem> mjcf_faults(const std::string& text, const std::string& path);

// Where an element of an included file is: the file as the <include> writes it, and the line in it.
struct IncludedPlace {
  std::string file;
  int line = 0;
};

struct DocumentPlaces {
  // The named elements of included files by their labels, "joint 'knee'", "coupling 'fingers'"; MuJoCo's parser keeps
  // no lines of them.
  std::map<std::string, IncludedPlace> included;
  // The files of models that are assets, as the <model> writes them, by the assets' names.
  std::map<std::string, std::string> models;

  // Of an element that was attached from the model asset `name`; its name where the file is not known.
  std::string file_of_model(const std::string& name) const;
};
DocumentPlaces places_in(const std::string& text, const std::string& path);

// Where a fault in an included file is, of which MuJoCo's parser names the element without the file: "unrecognized
// attribute: 'colour' Element 'geom', line 0". Line 0 where it is not found.
IncludedPlace place_of_fault(const std::string& text, const std::string& path, const std::string& message);

// The text without those faults, for mended_model().
std::string mend_mjcf(const std::string& text, const std::string& path, const std::string& out,
                      std::vector<Mend>& mends);

}  // namespace assay
