// A row for each system: its picture, raw speed, consistency against speed.
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
#include "report/figures/picture.h"
#include "report/figures/speed_accuracy.h"
#include "results/line_up.h"

namespace assay::figures {
namespace {

std::string speed_text(double kilohertz) {
  return kilohertz >= 100 ? fmt::format("{:.0f}", kilohertz) : fmt::format("{:.3g}", kilohertz);
}

void speed_bars(Canvas& canvas, const Results& results, const Box& box, const std::string& system) {
  struct Bar {
    std::string contender;
    Interval speed;
  };
  // Of the timesteps the one nearest to 1 ms at which the most contenders were timed.
  std::map<double, std::vector<Bar>> by_step;
  for (const std::string& contender : results.papers()) {
    for (const auto& [step, cell] : results.cells(system, contender, "raw_speed")) {
      if (const auto speed = interval_of(*cell, "raw_speed")) by_step[step].push_back({contender, *speed});
    }
  }
  if (by_step.empty()) {
    empty_plot(canvas, box, "not timed");
    return;
  }
  const auto best = std::ranges::max_element(
      by_step, {}, [](const auto& entry) { return std::pair(entry.second.size(), -std::abs(std::log(entry.first))); });
  std::vector<Bar> bars = best->second;
  std::ranges::stable_sort(bars, std::ranges::greater(), [](const Bar& bar) { return bar.speed.value; });
  double names = 0, most = 0;
  for (const Bar& bar : bars) {
    names = std::max(names, canvas.text_width(bar.contender, kSmall));
    most = std::max({most, bar.speed.value, bar.speed.high});
  }
  const double from = box.left + names + 4, to = box.right - 24,
               row = std::min(14.0, box.height() / static_cast<double>(bars.size()));
  const double top = box.bottom - row * static_cast<double>(bars.size());
  for (const double tick : linear_ticks(most, 4)) {
    const double at = from + (to - from) * tick / most;
    canvas.line(at, top, at, box.bottom, kFaint, 0.5);
    canvas.text(fmt::format("{:g}", tick), {at, box.bottom + 8}, kSmall, Align::kMiddle, kInk);
  }
  for (size_t i = 0; i < bars.size(); ++i) {
    const Bar& bar = bars[i];
    const double y = top + row * static_cast<double>(i), middle = y + row / 2;
    const auto along = [&](double value) { return from + (to - from) * value / most; };
    canvas.fill_rectangle(from, y + 0.18 * row, along(bar.speed.value) - from, 0.64 * row,
                          ink_of(results, bar.contender).color);
    if (bar.speed.low < bar.speed.high) {
      canvas.line(along(bar.speed.low), middle, along(bar.speed.high), middle, kInk, 0.5);
      for (const double end : {bar.speed.low, bar.speed.high}) {
        canvas.line(along(end), middle - 1.5, along(end), middle + 1.5, kInk, 0.5);
      }
    }
    canvas.text(bar.contender, {from - 3, middle + 2}, kSmall, Align::kRight, kInk);
    canvas.text(speed_text(bar.speed.value), {along(std::max(bar.speed.value, bar.speed.high)) + 3, middle + 2}, kSmall,
                Align::kLeft, kSoft);
  }
  canvas.line(from, top, from, box.bottom, kSoft, 0.5);
  canvas.text(fmt::format("raw speed at {} ms (kHz)", timestep_label(best->first)), {to, box.bottom + 17}, kSmall,
              Align::kRight, kSoft);
}

}  // namespace

std::optional<Drawing> figure3(const Results& results) {
  const bool any = std::ranges::any_of(paper_figures().comparisons, [&](const auto& row) {
    return std::ranges::any_of(results.papers(), [&](const std::string& contender) {
      return !results.cells(row.system, contender, "raw_speed").empty() ||
             !results.cells(row.system, contender, "consistency").empty();
    });
  });
  if (!any) return std::nullopt;
  constexpr double kRow = 138;
  const double legend = legend_height(results);
  return Drawing{4 * kRow + legend + 6, [&results](Canvas& canvas) {
                   double top = 6;
                   for (const auto& [system, title] : paper_figures().comparisons) {
                     canvas.text(title, {6, top + 8}, kTitle, Align::kLeft, kInk, true);
                     const double dof = results.fact(system, "dof");
                     if (dof > 0) canvas.text(fmt::format("{:g} DOF", dof), {6, top + 17}, kSmall, Align::kLeft, kSoft);
                     start_picture(canvas, results, {8, top + 22, 104, top + kRow - 16}, system);
                     speed_bars(canvas, results, {112, top + 6, 290, top + kRow - 26}, system);
                     speed_accuracy(canvas, results, {336, top + 4, 502, top + kRow - 26}, system, "consistency",
                                    "consistency", "consistency error (m)");
                     top += kRow;
                   }
                   draw_legend(canvas, results);
                 }};
}

}  // namespace assay::figures
