// The text of an MJCF file beside MuJoCo's parser: the faults that keep MuJoCo from compiling it and have one obvious
// mend, all of them with their lines, where MuJoCo names the first.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "load/problems.h"
#include "load/text_edit.h"

namespace assay {

// Inertias that are not positive or break the triangle inequality, and ranges whose bounds are swapped, in the file at
// `path`, those that it includes and the models that are its assets. `path` is where relative names count from.
std::vector<Problem> mjcf_faults(const std::string& text, const std::string& path);

// Where an element of an included file is: the file as the <include> writes it, and the line in it.
struct IncludedPlace {
  std::string file;
  int line = 0;
  std::string path = {};  // of that file, in elements_in() alone
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

// An element of the document, of a file that it includes or of a model that is an asset, for messages about it.
struct DocumentElement {
  std::string tag;
  std::string section;  // what it stands in: "actuator", "equality", "body" for all bodies; empty outside
  std::string name;     // its attribute
  std::string label;    // "geom 'foot'", "a geom of body 'leg'", "<option>"
  IncludedPlace place;  // without a file in the model's own
  std::vector<std::pair<std::string, std::string>> attributes;
  bool attached = false;  // of a model that is an asset: MuJoCo puts a prefix before its name
  int parent = -1;        // the index of the element around it in its file; -1 for a root element

  bool has(const std::string& key) const;
  std::string attribute(const std::string& key) const;  // empty where it has none
};

// The paths of the files that the document includes, and of those that these include, in the order of their names; of
// those alone that MuJoCo finds. Call document_refusals() (outside_files.h) first: it reads them.
std::vector<std::string> included_files(const std::string& text, const std::string& path);

// "a geom", "an actuator"
std::string with_article(const std::string& tag);

// All of them, the model's own first; none for a text that is no XML. `texts` are those of included files, by path,
// where they are others than the files'.
std::vector<DocumentElement> elements_in(const std::string& text, const std::string& path,
                                         const std::map<std::string, std::string>& texts = {});

// The texts without those faults of the models that are assets, by path, where they have any.
std::map<std::string, std::string> mended_assets(const std::string& text, const std::string& path,
                                                 std::vector<Mend>& mends);

// The text without those faults, for mended_model().
std::string mend_mjcf(const std::string& text, const std::string& path, const std::string& out,
                      std::vector<Mend>& mends);

}  // namespace assay
