// Builds of an engine from the same sources (setup/builds.txt). The baseline runs on every x86-64 processor and is what
// a contender's name means; another build is a plugin `<engine>@<build>` with contenders `<contender>@<build>`.
#pragma once

#include <string>
#include <string_view>

namespace assay {

inline constexpr const char* kBaseline = "baseline";

// "v3" of "ode-quick@v3" or "ode@v3"; kBaseline of names without a build.
std::string build_of(std::string_view name);

// "ode-quick" of "ode-quick@v3".
std::string without_build(std::string_view name);

// `name`, a contender's or engine's without a build, in `build`.
std::string in_build(const std::string& name, const std::string& build);

// What this processor lacks to run `build`, as part of a sentence ("AVX2 and FMA"); "" if nothing.
std::string lacking_for(std::string_view build);

}  // namespace assay
