// Linear axes of plots over time.
import { scaleLinear, type ScaleLinear } from "d3-scale";

import { svg } from "../dom";
import { plain } from "../format";
import type { Box } from "./labels";

export type LinearScale = ScaleLinear<number, number>;

// A scale over all of `values`, widened a little; a range that is too narrow for it is made `least` wide.
export function linearScale(values: number[], range: [number, number], least: number, margin = 0.06): LinearScale {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) [low, high] = [Math.min(low, value), Math.max(high, value)];
  if (!(low <= high)) [low, high] = [0, 0];
  const grow = Math.max(margin * (high - low), (least - (high - low)) / 2);
  return scaleLinear().domain([low - grow, high + grow]).range(range);
}

function tickText(value: number): string {
  return value === 0 ? "0" : plain(value, 3).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "");
}

// Lines and numbers of the axis at the left; `spacing` in px.
export function leftAxis(y: LinearScale, box: Box, spacing: number): SVGGElement {
  const group = svg("g", { class: "grid" });
  for (const value of y.ticks(Math.max(2, Math.floor((box.bottom - box.top) / spacing)))) {
    const at = Math.round(y(value)) + 0.5;
    group.append(svg("line", { class: value === 0 ? "major zero" : "major", x1: box.left, x2: box.right, y1: at, y2: at }));
    group.append(svg("text", { class: "tick", x: box.left - 6, y: at + 4, "text-anchor": "end" }, tickText(value)));
  }
  return group;
}

// Lines of the axis below, and its numbers where `numbers` says so.
export function timeAxis(x: LinearScale, box: Box, numbers: boolean): SVGGElement {
  const group = svg("g", { class: "grid" });
  for (const value of timeTicks(x)) {
    const at = Math.round(x(value)) + 0.5;
    group.append(svg("line", { class: "minor", x1: at, x2: at, y1: box.top, y2: box.bottom }));
  }
  if (numbers) group.append(timeNumbers(x, box.bottom));
  return group;
}

function timeTicks(x: LinearScale): number[] {
  const [left = 0, right = 0] = x.range();
  return x.ticks(Math.max(2, Math.floor((right - left) / 90)));
}

export function timeNumbers(x: LinearScale, bottom: number): SVGGElement {
  return svg("g", {}, ...timeTicks(x).map((value) => svg("text", { class: "tick", x: Math.round(x(value)) + 0.5, y: bottom + 17, "text-anchor": "middle" }, `${tickText(value)} s`)));
}
