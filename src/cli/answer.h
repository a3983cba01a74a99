// An answer in parts: what `assay run ROBOT` prints, and the report's page shows.
#pragma once

#include <string>
#include <vector>

#include "cli/cli.h"

namespace assay::cli {

class Answer {
 public:
  // Begins a part; lines and a table go to the last one.
  void part(const std::string& heading) { parts_.push_back({heading, {}, {}, {}, {}}); }
  void line(const std::string& text) { parts_.back().lines.push_back(text); }
  // Columns in `right` hold numbers.
  void table(std::vector<std::string> headings, std::vector<std::vector<std::string>> rows,
             std::vector<size_t> right = {});

  void print() const;
  // [{"heading", "lines": [text], "columns": [text], "rows": [[text]], "right": [column]}]
  Json json() const;

 private:
  struct Part {
    std::string heading;
    std::vector<std::string> lines;
    std::vector<std::string> columns;
    std::vector<std::vector<std::string>> rows;
    std::vector<size_t> right;
  };
  std::vector<Part> parts_;
};

}  // namespace assay::cli
