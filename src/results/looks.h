// How a contender looks in every plot: one colour a family (an engine and its kind of coordinates), and within a family
// another shade, dash and mark for each contender. Families stay apart for eyes without green cones, too.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "results/color.h"
#include "results/store/store.h"

namespace assay {

enum class Mark { kCircle, kSquare, kTriangle, kDiamond, kTriangleDown, kCross, kStar, kWye };
std::string_view mark_text(Mark mark);  // "triangle-down"

struct Look {
  std::string family;                               // "bullet/joint"
  std::string light = "#1d2126", dark = "#e8e6e1";  // on light and on dark ground
  std::vector<double> dash;                         // lengths of strokes and gaps in pixels; empty for a full line
  Mark mark = Mark::kCircle;
  bool first = true;  // shown when a plot of all contenders opens
};

// The contender of which a sweep made this one by other settings, as its row tells; "" when none did.
std::string variant_of(const ContenderRow& row);

// Of all contenders of a report, by name. What a sweep made looks like the contender that it varies.
std::map<std::string, Look> looks_of(const std::vector<ContenderRow>& all);

// Colours of the families in the order in which engines without a place of their own take them, for tests.
std::vector<std::string> family_colors(bool dark);

}  // namespace assay
