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

// Exponents of the decades inside the scale, thinned to at least `spacing` pixels between labels.
export function decades(scale: LogScale, spacing: number): { all: number[]; labelled: number[] } {
  const [low = 1, high = 10] = scale.domain();
  const all: number[] = [];
  for (let e = Math.ceil(Math.log10(low) - 1e-9); e <= Math.floor(Math.log10(high) + 1e-9); e += 1) all.push(e);
  const perDecade = Math.abs(scale(10) - scale(1));
  const stride = [1, 2, 3, 6, 9, 12].find((step) => step * perDecade >= spacing) ?? 15;
  return { all, labelled: all.filter((e) => e % stride === 0) };
}

// "1 mm", "10 µm" where the unit takes prefixes, else "10⁻³".
export function decadeLabel(exponent: number, unit: string): string {
  if (hasPrefixes(unit)) return quantity(10 ** exponent, unit, 1);
  return `10${superscript(exponent)}`;
}

export function factorLabel(exponent: number): string {
  const value = 10 ** exponent;
  if (exponent < -2) return `10${superscript(exponent)}×`;
  if (exponent < 0) return `${value.toFixed(-exponent)}×`;
  if (exponent < 4) return `${value}×`;
  if (exponent < 6) return `${value / 1e3}k×`;
  return `10${superscript(exponent)}×`;
}

// Grid lines at whole decades and, where there is room, at 2 and 5 in between.
export function grid(
  scale: LogScale,
  along: "x" | "y",
  from: number,
  to: number,
): SVGGElement {
  const group = svg("g", { class: "grid" });
  const { all } = decades(scale, 0);
  const [low = 1, high = 10] = scale.domain();
  const perDecade = Math.abs(scale(10) - scale(1));
  const add = (value: number, minor: boolean) => {
    if (value < low || value > high) return;
    const at = Math.round(scale(value)) + 0.5;
    const ends = along === "x" ? { x1: at, x2: at, y1: from, y2: to } : { y1: at, y2: at, x1: from, x2: to };
    group.append(svg("line", { ...ends, class: minor ? "minor" : "major" }));
  };
  const first = all.length > 0 ? all[0]! - 1 : Math.floor(Math.log10(low));
  const last = all.length > 0 ? all[all.length - 1]! : first;
  for (let e = first; e <= last; e += 1) {
    add(10 ** e, false);
    if (perDecade > 90) for (const digit of [2, 5]) add(digit * 10 ** e, true);
  }
  return group;
}
