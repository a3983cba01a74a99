// Writing into folders that may be a stranger's: nothing that lies there, as a symbolic link, leads it elsewhere.
#pragma once

#include <string>

namespace assay {

// Writes the file whole or not at all: what was there before stays until the new one is complete. A link of that name
// is replaced, not followed. Throws SystemError.
void write_file(const std::string& path, const std::string& content);

// Throws InputError where `folder`, a part of a results folder, is a symbolic link.
void refuse_linked_folder(const std::string& folder);

// Makes such a folder, if it is not there. Throws InputError as above, SystemError where it cannot be made.
void make_own_folder(const std::string& folder);

}  // namespace assay
