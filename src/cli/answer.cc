#include "cli/answer.h"

#include <utility>

namespace assay::cli {

void Answer::table(std::vector<std::string> headings, std::vector<std::vector<std::string>> rows,
                   std::vector<size_t> right) {
  Part& own = parts_.back();
  own.columns = std::move(headings);
  own.rows = std::move(rows);
  own.right = std::move(right);
}

void Answer::print() const {
  for (const Part& part : parts_) {
    const bool first = &part == &parts_.front();
    if (!first) assay::print("\n");
    assay::print(paragraph(heading(part.heading) + (first ? "" : ":"), 2));
    for (const std::string& text : part.lines) assay::print(paragraph("  " + text, 4));
    if (!part.columns.empty()) assay::print(assay::table(part.columns, part.rows, part.right));
  }
}

Json Answer::json() const {
  Json parts = Json::array();
  for (const Part& part : parts_) {
    parts.push_back({{"heading", part.heading},
                     {"lines", part.lines},
                     {"columns", part.columns},
                     {"rows", part.rows},
                     {"right", part.right}});
  }
  return parts;
}

}  // namespace assay::cli
