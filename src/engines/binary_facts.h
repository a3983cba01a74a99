// What an engine's binaries say of its build: read from the machine code when the plugin is built
// (cmake/binary_facts.py), so that no text can differ from what runs.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace assay {

// The facts that lie beside the plugin, with texts for tables: "instruction_set" ("SSE2", "AVX 256 bit, FMA",
// "SSE2 (0.7 % AVX)"),
// "arithmetic" ("double", "single 98 %, double 2 %"), "checks" ("none", "__assert_fail, 266 messages"). Null where a
// plugin has none, as those that were built outside of this tree.
nlohmann::json binary_facts(const std::string& plugin_path);

}  // namespace assay
