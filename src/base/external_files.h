// Campaigns and results are shared. What in them asks to read files from outside a model's folder
// (allow_external_files) is obeyed only where the user has agreed, by --allow-external-files or
// ASSAY_ALLOW_EXTERNAL_FILES=1.
#pragma once

namespace assay {

// Of this process, and of those that it starts: it sets the variable. Call it before there are other threads.
void agree_to_external_files();
bool agreed_to_external_files();

}  // namespace assay
