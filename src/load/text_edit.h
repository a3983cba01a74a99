// Changes of single attributes and elements of a model file's text, with the lines that they have in it.
#pragma once

#include <string>
#include <vector>

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

}  // namespace assay
