#include "cli/answer.h"

#include <fmt/format.h>

#include "base/console.h"
#include "base/text.h"

namespace assay {

void print(const Answer& answer) {
  for (const AnswerPart& part : answer.parts()) {
    const bool first = &part == &answer.parts().front();
    if (!first) print("\n");
    print(paragraph(heading(part.heading) + (first ? "" : ":"), 2));
    for (const AnswerLine& line : part.lines) print(paragraph("  " + line.printed(), 4));
    if (!part.columns.empty()) print(table(part.columns, part.rows, part.right));
  }
}

void print_markdown(const Answer& answer) {
  const auto row = [](const std::vector<std::string>& cells) { print(fmt::format("| {} |\n", join(cells, " | "))); };
  for (const AnswerPart& part : answer.parts()) {
    print(fmt::format("### {}\n\n", part.heading));
    for (const AnswerLine& line : part.lines) {
      print(line.label.empty() ? fmt::format("- {}\n", line.text)
                               : fmt::format("- **{}:** {}\n", line.label, line.text));
    }
    print("\n");
    if (part.columns.empty()) continue;
    row(part.columns);
    row(std::vector<std::string>(part.columns.size(), "---"));
    for (const std::vector<std::string>& cells : part.rows) row(cells);
    print("\n");
  }
}

}  // namespace assay
