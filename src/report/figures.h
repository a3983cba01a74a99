// The paper's figures 3, 4 and 5 and its table of grasps, laid out as there, from a results directory.
#pragma once

#include <string>
#include <vector>

namespace assay {

class Store;

// Writes figure3, figure4, figure5 and grasp-table, each as .svg and .pdf, into `folder`, which it makes, and returns
// the files' paths. A figure is left out when the results hold nothing of it; a part of a figure that was not measured
// is empty and says so. Depends on the results alone. Throws SystemError when a file cannot be written.
//
// Shown are today's versions of the paper's contenders, as far as they were measured.
std::vector<std::string> write_figures(const Store& store, const std::string& folder);

}  // namespace assay
