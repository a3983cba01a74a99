// What XML's and MuJoCo's parsers say against a document, as problems with the element, its line and the way out: their
// own words name neither.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "load/mjcf_document.h"
#include "load/problems.h"
#include "load/text_edit.h"

namespace assay {

// Why a document is no XML, from tinyxml2's "Error=XML_ERROR_MISMATCHED_ELEMENT ErrorID=14 (0xe) Line number=3: ...",
// whoever wrote it.
Problem xml_problem(const std::string& message);

// What is no text that MuJoCo reads as XML: another encoding than UTF-8, an archive, a binary file.
std::optional<Problem> encoding_problem(const std::string& text);

// A message of MuJoCo's parser or compiler about the document `text`, an MJCF or URDF file at `path` or a text, whose
// path is empty: "XML Error: bad format in attribute 'size'\nElement 'geom', line 2".
Problem parser_problem(const std::string& message, const std::string& text, const std::string& path);

// What MJCF does not know, because it is misspelled, or of another version of MuJoCo.
struct UnknownPart {
  AttributeEdit part;  // an attribute, or an element; `value` is empty
  std::string path;    // of the included file that has it; empty for the model's own
  Problem problem;     // as left out
};

// The part that keeps MuJoCo from reading these elements, from its parser's message; nothing for other messages, and
// where the part cannot be told from others.
std::optional<UnknownPart> unknown_part(const std::string& message, const std::vector<DocumentElement>& elements);

}  // namespace assay
