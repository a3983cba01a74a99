// Logarithmic axes with a label at every decade that has room.
import { scaleLog, type ScaleLogarithmic } from "d3-scale";

import { svg } from "../dom";
import { hasPrefixes, quantity, superscript } from "../format";

export type LogScale = ScaleLogarithmic<number, number>;

// A scale over all of `values` (positive), widened to whole tenths of a decade plus a margin.
export function logScale(values: number[], range: [number, number], leastDecades = 1): LogScale {
  let low = Math.log10(Math.min(...values));
  let high = Math.log10(Math.max(...values));
  const margin = Math.max(0.06 * (high - low), (leastDecades - (high - low)) / 2, 0.12);
  low -= margin;
  high += margin;
  return scaleLog().domain([10 ** low, 10 ** high]).range(range);
}

// Values to label: decades, thinned to at least `spacing` pixels between them, or 1, 2 and 5 where there is room.
export function ticks(scale: LogScale, spacing: number): number[] {
  const [low = 1, high = 10] = scale.domain();
  const perDecade = Math.abs(scale(10) - scale(1));
  const stride = [1, 2, 3, 6, 9, 12].find((step) => step * perDecade >= spacing) ?? 15;
  const digits = perDecade * Math.log10(2) >= spacing ? [1, 2, 5] : [1];
  const found: number[] = [];
  for (const e of decades(scale)) {
    if (e % stride !== 0) continue;
    for (const digit of digits) found.push(Number(`${digit}e${e}`));
  }
  return found.filter((value) => value >= low && value <= high);
}

// Exponents from the decade below the scale to its last one.
function decades(scale: LogScale): number[] {
  const [low = 1, high = 10] = scale.domain();
  const all: number[] = [];
  for (let e = Math.floor(Math.log10(low)); e <= Math.floor(Math.log10(high) + 1e-9); e += 1) all.push(e);
  return all;
}

function power(value: number): string {
  const exponent = Math.floor(Math.log10(value) + 1e-9);
  const digit = Math.round(value / 10 ** exponent);
  return `${digit === 1 ? "" : `${digit}·`}10${superscript(exponent)}`;
}

// "1 mm", "20 µm" where the unit takes prefixes, else "10⁻³".
export function errorLabel(value: number, unit: string): string {
  return hasPrefixes(unit) ? quantity(value, unit, 1) : power(value);
}

export function factorLabel(value: number): string {
  if (value < 0.01 || value >= 1e6) return `${power(value)}×`;
  return value >= 1e4 ? `${value / 1e3}k×` : `${value}×`;
}

// The box around a plot's area, on whole pixels.
export function frameOf(box: { left: number; right: number; top: number; bottom: number }): SVGRectElement {
  return svg("rect", { class: "frame", x: box.left + 0.5, y: box.top + 0.5, width: box.right - box.left, height: box.bottom - box.top });
}

// Grid lines at whole decades and, where there is room, at 2 and 5 in between.
export function grid(
  scale: LogScale,
  along: "x" | "y",
  from: number,
  to: number,
): SVGGElement {
  const group = svg("g", { class: "grid" });
  const [low = 1, high = 10] = scale.domain();
  const perDecade = Math.abs(scale(10) - scale(1));
  const add = (value: number, minor: boolean) => {
    if (value < low || value > high) return;
    const at = Math.round(scale(value)) + 0.5;
    const ends = along === "x" ? { x1: at, x2: at, y1: from, y2: to } : { y1: at, y2: at, x1: from, x2: to };
    group.append(svg("line", { ...ends, class: minor ? "minor" : "major" }));
  };
  for (const e of decades(scale)) {
    add(10 ** e, false);
    if (perDecade > 90) for (const digit of [2, 5]) add(digit * 10 ** e, true);
  }
  return group;
}
