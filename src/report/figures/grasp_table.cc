// At which timesteps the object stays in the hand.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/text.h"
#include "report/figures/axes.h"
#include "report/figures/drawing.h"

namespace assay::figures {
namespace {

enum class Grip { kHeld, kDropped, kFailed, kNone };

Grip grip_of(const Cell& cell) {
  if (cell.outcome == Outcome::kUnsupported) return Grip::kNone;
  if (cell.outcome != Outcome::kOk) return Grip::kFailed;
  const auto held = interval_of(cell, "grasp_held");
  if (!held) return Grip::kNone;
  return held->value == 1 ? Grip::kHeld : Grip::kDropped;
}

void draw_grip(Canvas& canvas, Canvas::Point at, Grip grip) {
  if (grip == Grip::kHeld) canvas.mark(Mark::kCircle, at, 6, parse_color("#1463c4"));
  if (grip == Grip::kDropped) canvas.mark(Mark::kTriangleDown, at, 5.5, parse_color("#d4590c"), false);
  if (grip == Grip::kFailed) canvas.cross(at, 5.5, kInk);
}

}  // namespace

std::optional<Drawing> grasp_table(const Results& results) {
  constexpr const char* kSystem = "grasp";
  std::set<double> steps;
  std::vector<std::string> contenders;
  for (const std::string& contender : results.papers()) {
    const auto cells = results.cells(kSystem, contender, "grasp");
    if (!cells.empty()) contenders.push_back(contender);
    for (const auto& [step, cell] : cells) steps.insert(step);
  }
  if (contenders.empty()) return std::nullopt;
  constexpr double kRow = 15;
  return Drawing{
      44 + kRow * static_cast<double>(contenders.size()) + 18, [&results, steps, contenders](Canvas& canvas) {
        constexpr double kLeft = 96, kLast = 430;
        const double column = (kLast - kLeft) / static_cast<double>(steps.size());
        canvas.text("timestep (ms)", {kLeft, 12}, kSmall, Align::kLeft, kSoft);
        canvas.text("largest that", {canvas.width() - 8, 12}, kSmall, Align::kRight, kSoft);
        canvas.text("holds (ms)", {canvas.width() - 8, 21}, kSmall, Align::kRight, kSoft);
        double x = kLeft + column / 2;
        for (const double step : steps) {
          canvas.text(timestep_label(step), {x, 22}, kText, Align::kMiddle, kInk);
          x += column;
        }
        canvas.line(8, 27, canvas.width() - 8, 27, kSoft, 0.7);
        double y = 38;
        for (const std::string& contender : contenders) {
          canvas.text(contender, {8, y + 2.5}, kText, Align::kLeft, kInk);
          x = kLeft + column / 2;
          std::string largest = "–";
          for (const double step : steps) {
            const auto cells = results.cells(kSystem, contender, "grasp");
            if (const auto cell = cells.find(step); cell != cells.end()) {
              draw_grip(canvas, {x, y}, grip_of(*cell->second));
              if (interval_of(*cell->second, "largest_stable_timestep")) largest = timestep_label(step);
            }
            x += column;
          }
          canvas.text(largest, {canvas.width() - 8, y + 2.5}, kText, Align::kRight, kInk, true);
          y += kRow;
        }
        canvas.line(8, y - 7, canvas.width() - 8, y - 7, kSoft, 0.7);
        x = kLeft;
        for (const auto& [grip, word] : {std::pair{Grip::kHeld, "held"}, std::pair{Grip::kDropped, "dropped"},
                                         std::pair{Grip::kFailed, "unstable or failed"}}) {
          draw_grip(canvas, {x, y + 3}, grip);
          canvas.text(word, {x + 7, y + 5.5}, kText, Align::kLeft, kInk);
          x += 24 + canvas.text_width(word, kText);
        }
      }};
}

}  // namespace assay::figures
