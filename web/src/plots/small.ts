// A system's speed and accuracy in little: the lines of what the legend shows, the front, the limit and the answer.
import { line } from "d3-shape";

import { valueInfo, type SystemView, type ViewPoint } from "../data";
import { svg } from "../dom";
import { belowFloor, timestep } from "../format";
import type { Palette } from "../palette";
import { state } from "../state";
import { wishes } from "../wishes";
import { errorLabel, factorLabel, frameOf, grid, logScale, ticks } from "./axes";

interface Placed {
  point: ViewPoint;
  speed: number;
  error: number;
}

// The value that a small plot shows: the one that the system is judged by.
export function smallValue(view: SystemView): string | null {
  return view.json.main;
}

function placedOf(view: SystemView, name: string): Placed[] {
  const { unit } = valueInfo(name);
  return view.json.points.flatMap((point) => {
    const error = point.worst?.[name]?.value;
    return point.sound && point.speed && error !== undefined && error > 0 && !belowFloor(error, unit) ? [{ point, speed: point.speed.value, error }] : [];
  });
}

// Null where there is nothing to draw: less than two timesteps with a speed and an error.
export function smallPlot(view: SystemView, palette: Palette, width: number, height: number): SVGSVGElement | null {
  const name = smallValue(view);
  if (!name) return null;
  const all = placedOf(view, name);
  if (new Set(all.map(({ point }) => point.timestep_ms)).size < 2) return null;
  const { question, found } = wishes.answer(view);
  const best = found.passing[0]?.point ?? null;
  const front = (view.json.fronts[name] ?? []).map(({ point }) => view.json.points[point]!);
  const lines = new Map<string, Placed[]>();
  for (const one of all) {
    const own = view.report.varied(one.point.contender);
    lines.set(own, [...(lines.get(own) ?? []), one]);
  }
  const isShown = (own: string) => !state.isHidden(own) || (best !== null && view.report.varied(best.contender) === own);
  const shown = all.filter(({ point }) => isShown(view.report.varied(point.contender)) || front.includes(point));
  if (shown.length === 0) return null;
  const frame = { left: 50, right: width - 14, top: 6, bottom: height - 20 };
  const x = logScale(shown.map(({ speed }) => speed), [frame.left, frame.right], 1);
  const y = logScale(shown.map(({ error }) => error), [frame.bottom, frame.top], 1);
  const drawing = svg("svg", { class: "small accuracy", width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${valueInfo(name).label} against speed on ${view.system}${best ? `; the answer is ${best.contender} at ${timestep(best.timestep_ms)} ms` : ""}` });
  drawing.append(grid(x, "x", frame.top, frame.bottom), grid(y, "y", frame.left, frame.right), frameOf(frame));
  for (const value of ticks(x, 42)) drawing.append(svg("text", { class: "tick", x: x(value), y: frame.bottom + 14, "text-anchor": "middle" }, factorLabel(value)));
  for (const value of ticks(y, 30)) drawing.append(svg("text", { class: "tick", x: frame.left - 4, y: y(value) + 4, "text-anchor": "end" }, errorLabel(value, valueInfo(name).unit)));
  const path = line<Placed>(({ speed }) => x(speed), ({ error }) => y(error)); // prettier-ignore
  const steps = front.flatMap((point) => all.find((one) => one.point === point) ?? []);
  drawing.append(svg("path", { class: "front-line", d: steps.map(({ speed, error }, index) => (index === 0 ? `M${x(speed)},${y(error)}` : `H${x(speed)}V${y(error)}`)).join("") }));
  const largest = question.limits.find(([each]) => each === name)?.[1];
  const [low = 0, high = 0] = y.domain();
  if (largest !== undefined && largest > low && largest < high) drawing.append(svg("line", { class: "limit-line", x1: frame.left, x2: frame.right, y1: y(largest), y2: y(largest) }));
  for (const [own, points] of lines) {
    if (!isShown(own)) continue;
    const group = svg("g", { class: "series", style: `--line:${palette.look(own).color}` });
    const settings = new Set(points.map(({ point }) => point.contender));
    if (settings.size === 1) group.append(svg("path", { class: "line", d: path(points) ?? "", "stroke-dasharray": palette.look(own).dash }));
    for (const { speed, error } of points) group.append(svg("circle", { class: "dot", cx: x(speed), cy: y(error), r: 1.8 }));
    drawing.append(group);
  }
  const answer = best && all.find(({ point }) => point === best);
  if (answer) drawing.append(svg("circle", { class: "answer-ring", cx: x(answer.speed), cy: y(answer.error), r: 6.5 }));
  return drawing;
}
