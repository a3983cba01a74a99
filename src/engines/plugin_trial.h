// Plugins are native code: one that is truncated, aborts or ends the process takes with it whoever loads it. So each is
// loaded in a process of its own first.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace assay {

// Calls `use` with each plugin, in order, in forked processes without output. Returns the plugins with which the
// process did not go on, and why, as the end of a sentence: "ends the process that loads it (signal 7, Bus error)".
// What `use` throws is such a reason too, and so is a process that a plugin leaves behind. The result is left in the
// environment, so that processes which this one starts need not try again. Throws EndedFromOutside when somebody else
// ends the process of one plugin several times: that says nothing of the plugin.
std::map<std::string, std::string> refused_plugins(const std::vector<std::string>& plugins,
                                                   const std::function<void(const std::string&)>& use);

// As if all plugins had been tried and none refused: for a process that should not fork, with the plugins that assay
// brings.
void trust_plugins();

}  // namespace assay
