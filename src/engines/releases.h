// Releases of an engine as contenders: "mujoco-euler@3.3.7" is the contender in release 3.3.7 of its engine, as
// "mujoco-euler@v3" is one in another build (engines/builds.h). src/engines/NAME/releases.txt lists them, compiled in;
// `./assay setup mujoco@3.3.7` makes the plugin, and the registry loads it when a contender of it is named.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace assay {

// Whether "3.3.7" of "mujoco-euler@3.3.7" is a release and not a build: it begins with a digit.
bool is_release(std::string_view build);

// Old to new; empty for an engine without such a list.
std::vector<std::string> releases_of(const std::string& engine);

// The releases whose plugins are in the cache and fit this program, old to new.
std::vector<std::string> releases_ready(const std::string& engine);

// Where the engine's authors say what is new in `release`: an address; empty where the list names none.
std::string changelog_of(const std::string& engine, const std::string& release);

// The plugin `engine`@`release`, made for this program by set-up: a library, or the folder of an adapter in Python with
// an environment of its own; empty where it is not there.
std::string release_plugin(const std::string& engine, const std::string& release);

}  // namespace assay
