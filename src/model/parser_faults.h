// What XML's and MuJoCo's parsers say against a document, as problems with the element, its line and the way out: their
// own words name neither.
#pragma once

#include <optional>
#include <string>

#include "model/problems.h"

namespace assay {

// Why a document is no XML, from tinyxml2's "Error=XML_ERROR_MISMATCHED_ELEMENT ErrorID=14 (0xe) Line number=3: ...",
// whoever wrote it.
Problem xml_problem(const std::string& message);

// What is no text that MuJoCo reads as XML: another encoding than UTF-8, an archive, a binary file.
std::optional<Problem> encoding_problem(const std::string& text);

// A message of MuJoCo's parser or compiler about the document `text`, an MJCF or URDF file at `path` or a text, whose
// path is empty: "XML Error: bad format in attribute 'size'\nElement 'geom', line 2".
Problem parser_problem(const std::string& message, const std::string& text, const std::string& path);

}  // namespace assay
