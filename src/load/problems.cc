#include "load/problems.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace assay {

std::string place_text(const std::string& file, int line) {
  if (line <= 0) return "";
  return file.empty() ? fmt::format("line {}", line) : fmt::format("{}, line {}", file, line);
}

std::string problem_text(const Problem& problem) {
  std::string text = problem.element;
  if (problem.line > 0) {
    text += fmt::format("{}({})", text.empty() ? "" : " ", place_text(problem.file, problem.line));
  }
  if (!text.empty()) text += ' ';
  text += problem.message;
  if (problem.severity == Severity::kLeftOut) return text;
  if (!problem.mend.empty()) text += "; " + problem.mend;
  if (!problem.option.empty()) {
    text += fmt::format("{} {}", problem.mend.empty() ? ";" : ", or", problem.option);
  }
  return text;
}

bool LoadReport::refused() const {
  return std::ranges::any_of(problems, [](const Problem& p) { return p.severity == Severity::kRefused; });
}

void LoadReport::refuse(std::string message, std::string mend) {
  Problem problem;
  problem.message = std::move(message);
  problem.mend = std::move(mend);
  problems.push_back(std::move(problem));
}

}  // namespace assay
