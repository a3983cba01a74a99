// Changes of a model file's text that make it valid: what `assay check --repair` writes.
#pragma once

#include <string>
#include <vector>

#include "load/load_options.h"
#include "load/text_edit.h"

namespace assay {

// The mended text of the URDF or MJCF file at `path`, to be written to `out`: an inertia that is not positive or breaks
// the triangle inequality becomes the nearest valid one about the same principal axes, swapped limits are swapped back,
// a joint of a URDF file that moves no mass becomes fixed. Names of files that would not be found from `out` become
// absolute; `options` say where files lie. Included files are written into the text where they need a change or `out`
// lies in another folder. Without anything to mend, `mends` stays empty and the text as it is. Throws InputError for a
// file that cannot be mended.
std::string mended_model(const std::string& text, const std::string& path, const std::string& out,
                         std::vector<Mend>& mends, const LoadOptions& options = {});

// The same of the file's own text, and of what it includes where that may be read: throws InputError for what
// document_refusals() refuses (outside_files.h), too.
std::string mended_file(const std::string& path, const std::string& out, std::vector<Mend>& mends,
                        const LoadOptions& options = {});

}  // namespace assay
