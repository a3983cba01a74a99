// How a contender looks in the figures: the same hue, shade, mark and dash as on the page (web/src/palette.ts).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "report/canvas.h"
#include "store/store.h"

namespace assay {

struct Look {
  Color color;
  Mark mark = Mark::kCircle;
  std::vector<double> dash;
};

// Of all contenders of a report, by name: a hue per engine and kind of coordinates, the rest by their order in it.
std::map<std::string, Look> looks_of(const std::vector<ContenderRow>& all);

}  // namespace assay
