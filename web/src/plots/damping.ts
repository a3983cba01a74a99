// Hidden damping over the timestep, both logarithmic. A rate that gains energy is negative: its mark is hollow.
import { line } from "d3-shape";

import type { SystemView } from "../data";
import { el, svg } from "../dom";
import { downloads } from "../download";
import { interval, powerOfTen, quantity, timestep } from "../format";
import type { Palette } from "../palette";
import { state } from "../state";
import { roundingRate } from "../tables/damping";
import { frameOf, grid, logScale, ticks } from "./axes";
import { drawContenders, explain, hitArea } from "./canvas";
import { endLabels } from "./labels";

interface Point {
  step: number;
  rate: number;
  low: number | null;
  high: number | null;
  x: number;
  y: number;
}

export function dampingPlot(view: SystemView, palette: Palette): HTMLElement | null {
  const curves = view.contenders.flatMap((contender) => {
    const points = view.timesteps("damping_rate").flatMap((step): Point[] => {
      const value = view.entry(contender, step, "damping_rate")?.value;
      return value?.value ? [{ step, rate: value.value, low: value.low, high: value.high, x: 0, y: 0 }] : [];
    });
    return points.length > 0 ? [{ contender, points }] : [];
  });
  if (curves.length === 0) return null;
  const canvas = el("div", { class: "canvas" });
  const draw = (width: number) => {
    const shown = curves
      .filter((curve) => !state.isHidden(curve.contender))
      .map(({ contender, points }) => ({ contender, points: points.filter((point) => Math.abs(point.rate) > roundingRate(view, contender, point.step)) }));
    const all = shown.flatMap((curve) => curve.points);
    if (all.length === 0) {
      canvas.append(el("p", { class: "quiet empty" }, "No contender that is shown has a rate above what rounding explains."));
      return;
    }
    const height = Math.round(Math.min(420, Math.max(300, width * 0.45)));
    const frame = { left: 74, right: width - 14, top: 12, bottom: height - 46 };
    const x = logScale(all.map((point) => point.step), [frame.left, frame.right], 0.5);
    const y = logScale(all.map((point) => Math.abs(point.rate)), [frame.bottom, frame.top], 1);
    const drawing = svg("svg", {
      class: "damping-plot scaling", width, height, viewBox: `0 0 ${width} ${height}`, role: "img",
      "aria-label": "Size of the hidden damping's rate against the timestep; the table below holds the figures",
    }); // prettier-ignore
    drawing.append(grid(x, "x", frame.top, frame.bottom), grid(y, "y", frame.left, frame.right));
    drawing.append(frameOf(frame));
    for (const value of [...new Set(all.map((point) => point.step))]) {
      drawing.append(svg("text", { class: "tick", x: x(value), y: frame.bottom + 18, "text-anchor": "middle" }, timestep(value)));
    }
    for (const value of ticks(y, 20)) drawing.append(svg("text", { class: "tick", x: frame.left - 8, y: y(value) + 4, "text-anchor": "end" }, powerOfTen(value, 1)));
    drawing.append(
      svg("text", { class: "axis-title", x: frame.right, y: height - 8, "text-anchor": "end" }, "timestep (ms)"),
      svg("text", { class: "axis-title", x: frame.left, y: height - 8 }, "↓ less damping (1/s)"),
    );
    const path = line<Point>((point) => point.x, (point) => point.y); // prettier-ignore
    for (const { contender, points } of shown) {
      const look = palette.look(contender);
      const group = svg("g", { class: "series", "data-contender": contender, style: `--line:${look.color}` });
      for (const point of points) [point.x, point.y] = [x(point.step), y(Math.abs(point.rate))];
      group.append(svg("path", { class: "line", d: path(points) ?? "", "stroke-dasharray": look.dash }));
      for (const point of points) {
        const mark = svg("path", { class: `mark${point.rate < 0 ? " hollow" : ""}`, d: look.path(44), transform: `translate(${point.x},${point.y}) rotate(${look.turn})`, "data-timestep": point.step });
        const hit = hitArea(point.x, point.y);
        explain(hit, contender, contender, () => [
          ["timestep", `${timestep(point.step)} ms`],
          ["rate", quantity(point.rate, "1/s", 2)],
          ["interval", interval("damping_rate", point.low, point.high, "1/s")],
          ["energy", point.rate < 0 ? "gained" : "lost"],
        ]);
        hit.addEventListener("click", () => state.choose({ system: view.system, contender, timestep: point.step }));
        group.append(mark, hit);
      }
      drawing.append(group);
    }
    const lines = shown.filter((curve) => curve.points.length > 0).map(({ contender, points }) => {
      const ends = [points[points.length - 1]!, points[0]!].map((point): [number, number] => [point.x, point.y]);
      return { name: contender, color: palette.look(contender).color, ends };
    });
    drawing.append(endLabels(lines, all.map((point) => [point.x, point.y]), frame));
    canvas.append(drawing);
  };
  drawContenders(canvas, draw);
  const rows = () => [["contender", "timestep_ms", "rate", "unit", "low", "high"], ...curves.filter((curve) => !state.isHidden(curve.contender)).flatMap(({ contender, points }) => points.map((point) => [contender, point.step, point.rate, "1/s", point.low, point.high]))];
  return el(
    "figure",
    { class: "panel" },
    el("figcaption", {}, downloads(() => `${view.system}-hidden-damping`, canvas, rows), el("h3", {}, "Hidden damping"), el("p", { class: "sub" }, "The rate at which velocities decay although nothing damps them. Hollow marks: the motion gains energy. Rates that rounding can cause are left out.")),
    canvas,
  );
}
