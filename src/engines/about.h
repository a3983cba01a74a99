// What assay knows of engines without their plugins, so that results of an engine that is not built look and sort as
// others: the files src/engines/*/about.toml, compiled in.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace assay {

// How plots draw a family: its place among the colours, and the mark of its first contender.
struct FamilyLook {
  size_t hue = 0;
  std::string mark;  // as in mark_text()
};

struct EngineAbout {
  std::string folder;        // in src/engines: the family, which is the first word of its engines' names
  std::optional<int> order;  // among families in tables and reports
  std::optional<FamilyLook> look;
  std::optional<FamilyLook> joint_look;  // of its contenders in joint coordinates, where others are in maximal ones
};

const std::vector<EngineAbout>& engines_about();

// Null for a folder without such a file.
const EngineAbout* about_engine(std::string_view folder);

}  // namespace assay
