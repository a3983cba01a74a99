// Plugins are native code: one that is truncated, aborts or ends the process takes with it whoever loads it. So each is
// loaded in a process of its own first.
#pragma once

#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace assay {

// What came of the trial, by plugin.
struct PluginTrial {
  // With which the process did not go on, and why, as the end of a sentence: "ends the process that loads it (signal 7,
  // Bus error)".
  std::map<std::string, std::string> refused;
  std::map<std::string, std::string> told;  // what `use` gave, where that is a text
};

// Thrown by `use`: the text is the reason as it stands.
class RefusedPlugin : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Calls `use` with each plugin, in order, in forked processes without output. What it returns is a line without tabs.
// What `use` throws is a reason to refuse the plugin, and so is a process that a plugin leaves behind. Which ones are
// refused is left in the environment, so that processes which this one starts try only those of `unknown`, which they
// know nothing of. Throws EndedFromOutside when somebody else ends the process of one plugin several times: that says
// nothing of the plugin.
PluginTrial try_plugins(const std::vector<std::string>& plugins, const std::vector<std::string>& unknown,
                        const std::function<std::string(const std::string&)>& use);

// As if all plugins had been tried and none refused: for a process that should not fork, with the plugins that assay
// brings.
void trust_plugins();

}  // namespace assay
