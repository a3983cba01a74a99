// Files that engines are made of: what a process that runs engines has to be able to read.
#pragma once

#include <string>
#include <vector>

namespace assay {

// Folders of plugins, in the order in which they are searched: those of ASSAY_ENGINE_PATH, then the program's own.
std::vector<std::string> plugin_folders();

// After the plugins are loaded: remembers, also for processes that this one starts, the folders of the libraries that
// they have brought, and `more`: environments of adapters in Python.
void remember_libraries(const std::vector<std::string>& more = {});

// Plugins, their libraries, what set-up has installed, the models that assay brings, and programs: files and folders.
std::vector<std::string> engine_files();

// What engines write while they start: kernels that they compile for a model, in the cache, for the next process. Makes
// the folder beside the environments of engines whose adapters are in Python; empty where there are none.
std::vector<std::string> engine_caches();

// These, and the folder where convex parts of meshes are kept (load/decomposition.h): what reading a model and asking
// engines about it may write.
std::vector<std::string> model_caches();

}  // namespace assay
