#include "cli/answer.h"

#include "base/console.h"

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

}  // namespace assay
