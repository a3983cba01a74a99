// Files that engines are made of: what a process that runs engines has to be able to read.
#pragma once

#include <string>
#include <vector>

namespace assay {

// Folders of plugins, in the order in which they are searched: those of ASSAY_ENGINE_PATH, then the program's own.
std::vector<std::string> plugin_folders();

// After the plugins are loaded: remembers, also for processes that this one starts, the folders of the libraries that
// they have brought.
void remember_libraries();

// Plugins, their libraries, what set-up has installed, the models that assay brings, and programs: files and folders.
std::vector<std::string> engine_files();

}  // namespace assay
