// Measured and simulated motion over time, what is between them below, on one axis of time.
import { bisector } from "d3-array";

import { downloads } from "../download";
import type { MotionLog, MotionRun } from "../data";
import { el, svg } from "../dom";
import { plain } from "../format";
import type { Palette } from "../palette";
import { state } from "../state";
import { facts, tooltip } from "../tooltip";
import { frameOf } from "./axes";
import { drawContenders } from "./canvas";
import { endLabels, type Box } from "./labels";
import { leftAxis, linearScale, timeAxis } from "./linear";

export const kMeasured = "measured";
const kImpact = 0.05; // s that count as at an impact
const kDots = 5; // px between samples from which on each is a dot
const kDegrees = 180 / Math.PI;

// What a run is called on the page, and among what the reader shows and hides.
export function runName(run: MotionRun): string {
  return run.fitted ? run.contender : `${run.contender} untuned`;
}

// One number over time that can be plotted, with the difference of a run to what was measured.
export interface Coordinate {
  name: string;
  unit: string;
  least: number; // the least range of its axis
  values: (run: MotionRun) => (number | null)[];
  residuals: (run: MotionRun, measured: MotionRun) => (number | null)[];
}

type Turn = [number, number, number, number];

// The angle between two orientations, degrees.
function angle(a: Turn, b: Turn): number {
  const dot = Math.abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]);
  return 2 * kDegrees * Math.acos(Math.min(1, dot));
}

function turnAt(run: MotionRun, column: number, sample: number): Turn | null {
  const turn = [3, 4, 5, 6].map((k) => run.values[column + k]?.[sample]);
  return turn.every((one) => typeof one === "number") ? (turn as Turn) : null;
}

export function coordinates(log: MotionLog): Coordinate[] {
  const all: Coordinate[] = [];
  let column = 0;
  const scaled = (name: string, unit: string, at: number, scale: number, least: number): Coordinate => ({
    name,
    unit,
    least,
    values: (run) => (run.values[at] ?? []).map((value) => (value === null ? null : scale * value)),
    residuals: (run, measured) =>
      (run.values[at] ?? []).map((value, sample) => {
        const truth = measured.values[at]?.[sample];
        return value === null || truth === null || truth === undefined ? null : scale * (value - truth);
      }),
  });
  const several = log.quantities.filter(({ kind }) => kind === "body").length > 1;
  for (const { name, kind } of log.quantities) {
    if (kind !== "body") {
      all.push(kind === "hinge" ? scaled(name, "°", column, kDegrees, 0.5) : scaled(name, "mm", column, 1000, 1));
      column += 1;
      continue;
    }
    const at = column;
    const title = (what: string) => (several ? `${name}: ${what}` : what);
    ["x", "y", "z"].forEach((axis, k) => all.push(scaled(title(axis), "mm", at + k, 1000, 2)));
    all.push({
      name: title("rotation from the start"),
      unit: "°",
      least: 1,
      values: (run) => {
        // of all runs from where the measured one began
        const start = turnAt(log.runs[0]!, at, 0);
        return log.time_s.map((_, sample) => {
          const turn = turnAt(run, at, sample);
          return turn && start ? angle(turn, start) : null;
        });
      },
      residuals: (run, measured) =>
        log.time_s.map((_, sample) => {
          const [turn, truth] = [turnAt(run, at, sample), turnAt(measured, at, sample)];
          return turn && truth ? angle(turn, truth) : null;
        }),
    });
    column += 7;
  }
  return all;
}

// The window of each sample.
function windowOf(log: MotionLog, sample: number): number {
  let found = 0;
  log.windows.forEach(({ first }, index) => {
    if (first <= sample) found = index;
  });
  return found;
}

export class MotionPlot {
  readonly canvas = el("div", { class: "canvas motion-canvas" });
  readonly saves: HTMLElement;
  private readonly redraw: () => void;

  constructor(
    private readonly palette: Palette,
    private log: MotionLog,
    private coordinate: Coordinate,
  ) {
    this.redraw = drawContenders(this.canvas, (width) => this.draw(width));
    this.saves = downloads(() => `${this.log.log}-${this.coordinate.name}`.replace(/[^\w.-]+/g, "-"), this.canvas, () => this.rows());
  }

  show(log: MotionLog, coordinate: Coordinate): void {
    [this.log, this.coordinate] = [log, coordinate];
    this.redraw();
  }

  private get runs(): MotionRun[] {
    return this.log.runs.filter((run) => run.contender !== kMeasured && !state.isHidden(runName(run)));
  }

  private rows(): (string | number | null)[][] {
    const shown = [this.log.runs[0]!, ...this.runs];
    const columns = shown.map((run) => this.coordinate.values(run));
    return [["time_s", ...shown.map((run) => `${run.contender === kMeasured ? kMeasured : runName(run)} (${this.coordinate.unit})`)], ...this.log.time_s.map((time, sample) => [time, ...columns.map((values) => values[sample] ?? null)])];
  }

  private draw(width: number): void {
    const { log, coordinate } = this;
    const measured = log.runs[0]!;
    const time = log.time_s;
    const start = log.windows[0]!.start_s;
    const truth = coordinate.values(measured);
    const runs = this.runs.map((run) => ({ run, name: runName(run), values: coordinate.values(run), residuals: coordinate.residuals(run, measured) }));
    const there = (values: (number | null)[]) => values.filter((value): value is number => value !== null);
    const height = Math.round(Math.min(520, Math.max(400, 0.42 * width)));
    const split = Math.round(0.64 * height);
    const upper: Box = { left: 58, right: width - 12, top: 24, bottom: split - 12 };
    const lower: Box = { left: 58, right: width - 12, top: split + 22, bottom: height - 26 };
    const x = linearScale([start, time[time.length - 1]!], [upper.left, upper.right], 1e-3, 0);
    const y = linearScale(there([...truth, ...runs.flatMap(({ values }) => values)]), [upper.bottom, upper.top], coordinate.least);
    const r = linearScale([0, ...there(runs.flatMap(({ residuals }) => residuals))], [lower.bottom, lower.top], coordinate.least / 2);
    const drawing = svg("svg", {
      class: "accuracy motion-plot", width, height, viewBox: `0 0 ${width} ${height}`, role: "img",
      "aria-label": `${coordinate.name} of ${log.log} over time, measured and simulated, and their differences below`,
    }); // prettier-ignore
    for (const box of [upper, lower]) drawing.append(...this.marks(x, box, box === upper, start), timeAxis(x, box, box === lower), frameOf(box));
    drawing.append(leftAxis(y, upper, 44), leftAxis(r, lower, 32));
    drawing.append(
      svg("text", { class: "axis-title", x: 4, y: 14 }, `${coordinate.name} (${coordinate.unit})`),
      svg("text", { class: "axis-title", x: 4, y: split + 12 }, coordinate.name.endsWith("from the start") ? `rotation between simulated and measured (${coordinate.unit})` : `simulated − measured (${coordinate.unit})`),
    );
    // what was measured: a broad line below all others, and its samples where they do not touch
    const path = (values: (number | null)[], scale: (value: number) => number) => {
      let text = "";
      let pen = "M";
      let window = 0;
      values.forEach((value, sample) => {
        const own = windowOf(log, sample);
        if (value === null || own !== window) pen = "M";
        window = own;
        if (value === null) return;
        text += `${pen}${x(time[sample]!).toFixed(1)},${scale(value).toFixed(1)}`;
        pen = "L";
      });
      return text;
    };
    const real = svg("g", { class: "motion-measured" }, svg("path", { class: "broad", d: path(truth, y) }));
    if ((upper.right - upper.left) / time.length >= kDots) {
      truth.forEach((value, sample) => value !== null && real.append(svg("circle", { cx: x(time[sample]!).toFixed(1), cy: y(value).toFixed(1), r: 1.7 })));
    }
    drawing.append(real);
    for (const { name, run, values, residuals } of runs) {
      const look = this.palette.look(name);
      drawing.append(
        svg(
          "g",
          { class: "series", style: `--line:${look.color}`, "data-contender": name, "data-fitted": String(run.fitted) },
          svg("path", { class: "line", d: path(values, y), "stroke-dasharray": look.dash }),
          svg("path", { class: "line residual", d: path(residuals, r), "stroke-dasharray": look.dash }),
        ),
      );
    }
    // names where lines are far from what was measured
    const lines = runs.map(({ name, values, residuals }) => {
      const order = residuals.map((value, sample) => ({ size: Math.abs(value ?? 0), sample })).sort((a, b) => b.size - a.size);
      const ends = order.slice(0, 40).filter((_, place) => place % 8 === 0).flatMap(({ sample }): [number, number][] => (values[sample] === null || values[sample] === undefined ? [] : [[x(time[sample]!), y(values[sample]!)]])); // prettier-ignore
      return { name, color: this.palette.look(name).color, ends };
    });
    // below, where each differs most
    const apart = runs.map(({ name, residuals }) => {
      const order = residuals.map((value, sample) => ({ value, sample })).filter(({ value }) => value !== null).sort((a, b) => Math.abs(b.value!) - Math.abs(a.value!)); // prettier-ignore
      return { name, color: this.palette.look(name).color, ends: order.slice(0, 3).map(({ value, sample }): [number, number] => [x(time[sample]!), r(value!)]) };
    });
    const extreme = truth.map((value, sample) => ({ value, sample })).filter(({ value }) => value !== null).sort((a, b) => b.value! - a.value!); // prettier-ignore
    lines.unshift({ name: kMeasured, color: this.palette.look(kMeasured).color, ends: [0, 0.5, 1].map((share): [number, number] => {
      const one = extreme[Math.round(share * (extreme.length - 1))]!;
      return [x(time[one.sample]!), y(one.value!)];
    }) }); // prettier-ignore
    const placed = (all: (number | null)[][], scale: (value: number) => number) =>
      all.flatMap((values) => values.flatMap((value, sample): [number, number][] => (value === null ? [] : [[x(time[sample]!), scale(value)]])));
    const points = placed([truth, ...runs.map(({ values }) => values)], y);
    drawing.append(endLabels(lines, points, upper), endLabels(apart, placed(runs.map(({ residuals }) => residuals), r), lower));
    const cursor = svg("line", { class: "motion-cursor", y1: upper.top, y2: lower.bottom, visibility: "hidden" });
    drawing.append(cursor);
    const nearest = bisector((one: number) => one).center;
    drawing.addEventListener("pointermove", (event) => {
      const at = x.invert(event.clientX - drawing.getBoundingClientRect().left);
      const sample = Math.min(time.length - 1, Math.max(0, nearest(time, at)));
      cursor.setAttribute("x1", String(x(time[sample]!)));
      cursor.setAttribute("x2", String(x(time[sample]!)));
      cursor.setAttribute("visibility", "visible");
      const text = (value: number | null | undefined) => (value === null || value === undefined ? "no state" : `${plain(value, 3)} ${coordinate.unit}`);
      tooltip.show(event.clientX, event.clientY, el("strong", {}, `${plain(time[sample]!, 4)} s`), facts([[kMeasured, text(truth[sample])], ...runs.map(({ name, values }): [string, string] => [name, text(values[sample])])]));
    });
    drawing.addEventListener("pointerleave", () => {
      cursor.setAttribute("visibility", "hidden");
      tooltip.hide();
    });
    this.canvas.append(drawing);
  }

  // Where the runs start again, the first impact, and what is not scored.
  private marks(x: (time: number) => number, box: Box, named: boolean, start: number): SVGElement[] {
    const { log } = this;
    const found: SVGElement[] = [];
    const label = (at: number, text: string) => found.push(svg("text", { class: "motion-mark-label", x: Math.min(at + 4, box.right - 90), y: box.top + 12 }, text));
    log.windows.forEach(({ start_s, scored }, index) => {
      const end = log.windows[index + 1]?.start_s ?? log.time_s[log.time_s.length - 1]!;
      if (!scored) {
        found.push(svg("rect", { class: "motion-unscored", x: x(start_s), width: Math.max(0, x(end) - x(start_s)), y: box.top, height: box.bottom - box.top }));
        if (named) label(x(start_s), "not scored");
      }
      if (start_s > start) found.push(svg("line", { class: "motion-restart", x1: x(start_s), x2: x(start_s), y1: box.top, y2: box.bottom }));
    });
    if (log.first_impact_s !== null) {
      const [from, to] = [x(log.first_impact_s), x(log.first_impact_s + kImpact)];
      found.push(svg("rect", { class: "motion-impact", x: from, width: Math.max(1, Math.min(to, box.right) - from), y: box.top, height: box.bottom - box.top }));
      if (named) label(Math.min(to, box.right), "first impact");
    }
    return found;
  }
}
