// Changes of a model file's text that make it valid: what `assay check --repair` writes.
#pragma once

#include <string>
#include <vector>

#include "load/load_options.h"

namespace assay {

// One change, for the user.
struct Mend {
  int line = 0;      // of the file; 0 for the file as a whole
  std::string what;  // "inertia of link 'foot': ..."
};

// A new value of an attribute: of the element `element` that begins in `line`, the one with this index among those of
// its name that begin there. Without an attribute, `value` is what is added as its first child.
struct AttributeEdit {
  int line = 0, index = 0;
  std::string element, attribute, value;
};

// `text` with these changes and nothing else changed; a missing attribute is added. The number of lines stays. Throws
// InputError when there is no such element.
std::string edited(std::string text, const std::vector<AttributeEdit>& edits);

// `text` without that attribute, or without an attribute the whole element; the number of lines stays. As it is when
// there is no such element.
std::string without(std::string text, const AttributeEdit& part);

// Where an element begins in a document: at its "<". npos when it is not there. Comments are skipped.
size_t element_begin(const std::string& text, int line, int index, const std::string& element);
// Where the tag that begins at `begin` ends: at its ">".
size_t tag_end(const std::string& text, size_t begin);

// The mended text of the URDF or MJCF file at `path`, to be written to `out`: an inertia that is not positive or breaks
// the triangle inequality becomes the nearest valid one about the same principal axes, swapped limits are swapped back,
// a joint of a URDF file that moves no mass becomes fixed. Names of files that would not be found from `out` become
// absolute; `options` say where files lie. Included files are written into the text where they need a change or `out`
// lies in another folder. Without anything to mend, `mends` stays empty and the text as it is. Throws InputError for a
// file that cannot be mended.
std::string mended_model(const std::string& text, const std::string& path, const std::string& out,
                         std::vector<Mend>& mends, const LoadOptions& options = {});

}  // namespace assay
