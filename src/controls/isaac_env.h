// The environment of a training in Isaac Lab as a policy's configuration (policy_config.h).
//
// Isaac Lab writes what an environment was made from as params/env.yaml beside the checkpoints: a dump of Python
// objects by PyYAML. Its manager-based environments say there what observations, actions and drives are; those of the
// direct workflow compute them in Python, and no file says it. policy_import.h says what becomes of what has no equal.
//
// Joints: Isaac Lab's names are regular expressions of Python, of which one has to match the whole name. Its order is
// that of PhysX, breadth first: all joints of one depth of the tree before those of the next.
#pragma once

#include <string>
#include <string_view>

#include "controls/policy_import.h"
#include "model/model.h"

namespace assay {

// `text` is the file's content, `path` its name for messages: an env.yaml, or what deploy_file.h reads. Throws
// InputError with path and line: no YAML, another framework's, a part that is missing, a pattern that matches no joint
// of the robot, what has no equal here. The result still has to be read back with parse_policy_config().
PolicyImport import_isaac_env(const Model& model, std::string_view text, const std::string& path,
                              const PolicyImportOptions& options);

}  // namespace assay
