// What a stranger's MJCF file may make the program read, before MuJoCo's parser gets it.
#pragma once

#include <string>
#include <vector>

#include "model/load_options.h"
#include "model/problems.h"

namespace assay {

// The folder below which the files of a model have to lie: the model's own, or of a robot in the user's cache its
// package.
std::string model_root(const std::string& path);

// Whether `file`, its links followed, lies below `root`.
bool is_below(const std::string& file, const std::string& root);

// Refusals of an MJCF document that includes or names files outside its folder (unless the options allow them), what is
// no regular file, or a model that contains itself; that holds a class name which MuJoCo would take for a format; or
// whose counts ask for more memory than a model needs. `path` is where relative names count from; empty for a text.
std::vector<Problem> document_refusals(const std::string& text, const std::string& path, const LoadOptions& options);

}  // namespace assay
