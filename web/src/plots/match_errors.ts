// Errors of contenders against measured motion: one row a contender, and one row or dot a log.
import { downloads } from "../download";
import type { Match, MatchedContender } from "../data";
import { el, svg, textWidth } from "../dom";
import { plain } from "../format";
import type { Palette } from "../palette";
import { state } from "../state";
import { errorLabel, frameOf, grid, logScale, ticks, type LogScale } from "./axes";
import { drawContenders, explain, hitArea } from "./canvas";

const kRow = 30; // px
const kNamedLogs = 24; // from more logs on each is a dot
const kMostNamed = 5; // odd logs with a name in the plot
const kLeast = 1e-4; // of an error that is drawn

// Of a perfect model that starts from a measured state.
export const kNoise = "noise floor";

// What an error is called, and its unit.
export const kFigures: Record<string, [title: string, unit: string]> = {
  joints_deg: ["joints", "°"],
  position_percent: ["position", "% of the body's size"],
  rotation_deg: ["rotation", "°"],
};

// "joints (°)"; a free body is ranked by the mean of two numbers.
export function scoreTitle(match: Match): string {
  const figures = Object.keys(match.contenders.find((one) => one.held_out)?.held_out ?? {});
  const of = (name: string) => `${kFigures[name]?.[0] ?? name} (${kFigures[name]?.[1] ?? ""})`;
  const bodies = figures.filter((name) => name !== "joints_deg");
  return [figures.includes("joints_deg") ? of("joints_deg") : "", bodies.length > 0 ? `mean of ${bodies.map(of).join(" and ")}` : ""].filter(Boolean).join(" plus ");
}

function axis(drawing: SVGSVGElement, x: LogScale, frame: { left: number; right: number; top: number; bottom: number }, title: string): void {
  drawing.append(grid(x, "x", frame.top, frame.bottom), frameOf(frame));
  for (const value of ticks(x, 44)) drawing.append(svg("text", { class: "tick", x: x(value), y: frame.bottom + 16, "text-anchor": "middle" }, numberText(value)));
  // A title that is wider than the window is written small.
  const wide = textWidth(`${title} →`, 12.5);
  drawing.append(svg("text", { class: "axis-title", x: frame.right, y: frame.bottom + 34, "text-anchor": "end", ...(wide > frame.right ? { textLength: frame.right - 2, lengthAdjust: "spacingAndGlyphs" } : {}) }, `${title} →`));
}

function numberText(value: number): string {
  return value >= 1e-3 && value < 1e4 ? plain(value, 1) : errorLabel(value, "");
}

function fitted(match: Match): MatchedContender[] {
  return match.contenders.filter((one) => one.score);
}

export function contenderErrors(match: Match, palette: Palette): HTMLElement {
  const canvas = el("div", { class: "canvas" });
  const all = fitted(match);
  const title = scoreTitle(match);
  const draw = (width: number) => {
    const names = Math.min(0.45 * width, 14 + Math.max(...all.map(({ contender }) => textWidth(contender, 12.5))));
    const frame = { left: Math.round(names), right: width - 12, top: 6, bottom: 6 + kRow * all.length };
    const drawing = svg("svg", {
      class: "accuracy match-contenders", width, height: frame.bottom + 42, viewBox: `0 0 ${width} ${frame.bottom + 42}`, role: "img",
      "aria-label": `Errors on held-out logs, ${title}: ${all.map((one) => `${one.contender} ${plain(one.score!.value)}, untuned ${plain(one.untuned_score!.value)}`).join("; ")}`,
    }); // prettier-ignore
    const positive = (value: number) => Math.max(value, kLeast);
    const x = logScale(all.flatMap((one) => [one.score!.low, one.score!.high, one.untuned_score!.value, one.floor_score ?? one.score!.value].map(positive)), [frame.left, frame.right], 0.5);
    axis(drawing, x, frame, title);
    all.forEach((one, index) => {
      const look = palette.look(one.contender);
      const y = frame.top + kRow * (index + 0.5);
      const [score, untuned] = [one.score!, one.untuned_score!];
      const group = svg("g", { class: "series contender-row", style: `--line:${look.color}`, "data-contender": one.contender });
      const mark = (value: number, hollow: boolean) => svg("path", { class: `mark${hollow ? " hollow" : ""}`, d: look.path(80), transform: `translate(${x(positive(value))},${y}) rotate(${look.turn})` });
      const [from, to] = [x(positive(untuned.value)), x(positive(score.value))];
      group.append(
        svg("rect", { class: "hit", x: 0, y: y - kRow / 2, width, height: kRow }),
        svg("text", { class: "match-name", x: frame.left - 8, y: y + 4, "text-anchor": "end" }, one.contender),
        svg("line", { class: "match-way", x1: from, x2: to, y1: y, y2: y }),
        svg("path", { class: "whisker match-interval", d: `M${x(positive(score.low))},${y - 5}v10M${x(positive(score.low))},${y}H${x(positive(score.high))}M${x(positive(score.high))},${y - 5}v10` }),
      );
      if (one.floor_score && one.floor_score > 0) group.append(svg("line", { class: "match-floor", x1: x(positive(one.floor_score)), x2: x(positive(one.floor_score)), y1: y - 11, y2: y + 11 }));
      group.append(mark(untuned.value, true), mark(score.value, false));
      explain(group, one.contender, one.contender, () => [
        ["fitted", `${plain(score.value)} (${plain(score.low)} to ${plain(score.high)})`],
        ["untuned", plain(untuned.value)],
        [kNoise, one.floor_score === undefined ? null : plain(one.floor_score, 2)],
      ]);
      drawing.append(group);
    });
    canvas.append(drawing);
  };
  drawContenders(canvas, draw);
  const sign = (content: SVGElement) => svg("svg", { width: 22, height: 14, viewBox: "0 0 22 14", "aria-hidden": "true" }, content);
  const circle = (hollow: boolean) => sign(svg("g", { class: "series", style: "--line:var(--soft)" }, svg("circle", { class: `mark${hollow ? " hollow" : ""}`, cx: 11, cy: 7, r: 5 })));
  const key = el(
    "ul",
    { class: "plot-key" },
    el("li", {}, circle(true), "untuned: as the model's file says"),
    el("li", {}, circle(false), "fitted to other logs"),
    el("li", {}, sign(svg("path", { class: "whisker match-interval", style: "--line:var(--soft)", d: "M3,2v10M3,7H19M19,2v10" })), "95 % interval over logs"),
    el("li", {}, sign(svg("line", { class: "match-floor", x1: 11, x2: 11, y1: 1, y2: 13 })), `${kNoise}: the error that noise of the first state alone makes; no lower bound, for a fit to noisy logs can do better on them`),
  );
  const rows = () => [["contender", "fitted", "low", "high", "untuned", "floor"], ...all.map((one) => [one.contender, one.score!.value, one.score!.low, one.score!.high, one.untuned_score!.value, one.floor_score ?? null])];
  return el("figure", { class: "panel" }, el("figcaption", {}, downloads(() => `${match.model}-errors`, canvas, rows), el("h3", {}, "Errors on logs that the fits did not see")), canvas, key);
}

// One row a log where there are few, else a dot each in the order of the best contender's errors.
export function logErrors(match: Match, palette: Palette): HTMLElement {
  const figures = [...new Set(match.logs.flatMap((one) => Object.keys(one.fitted ?? {})))];
  let figure = figures[0] ?? "joints_deg";
  const canvas = el("div", { class: "canvas" });
  const odd = match.odd_names ?? [];
  const best = match.contenders[0]?.contender ?? "";
  const series = () =>
    match.logs.flatMap((one) => [
      { contender: one.contender, name: one.contender, hollow: false, values: one.fitted?.[figure] ?? [] },
      { contender: one.contender, name: `${one.contender} untuned`, hollow: true, values: one.untuned?.[figure] ?? [] },
    ]);
  const order = () => {
    const values = match.logs.find((one) => one.contender === best)?.fitted?.[figure] ?? [];
    return match.held_out.map((_, log) => log).filter((log) => match.logs.some((one) => (one.fitted?.[figure]?.[log] ?? null) !== null)).sort((a, b) => (values[b] ?? -1) - (values[a] ?? -1)); // prettier-ignore
  };
  const draw = (width: number) => {
    const shown = series().filter(({ name }) => !state.isHidden(name));
    const logs = order();
    const all = shown.flatMap(({ values }) => values.filter((value): value is number => value !== null && value > 0));
    if (all.length === 0) {
      canvas.append(el("p", { class: "quiet empty" }, "No contender that is shown has an error of a held-out log."));
      return;
    }
    const [title, unit] = kFigures[figure] ?? [figure, ""];
    const few = logs.length <= kNamedLogs;
    const text = `error of ${title} (${unit})`;
    const point = (group: SVGElement, one: (typeof shown)[number], log: number, x: number, y: number) => {
      group.append(few ? svg("path", { class: `mark${one.hollow ? " hollow" : ""}`, d: palette.look(one.contender).path(46), transform: `translate(${x.toFixed(1)},${y.toFixed(1)}) rotate(${palette.look(one.contender).turn})` }) : svg("circle", { class: `mark${one.hollow ? " hollow" : ""}`, cx: x.toFixed(1), cy: y.toFixed(1), r: 2.6 }));
      const hit = few ? hitArea(x, y) : svg("circle", { class: "hit", cx: x.toFixed(1), cy: y.toFixed(1), r: 4 });
      explain(hit, one.name, one.name, () => [
        ["log", match.held_out[log] ?? ""],
        [title, `${plain(one.values[log]!)} ${unit}`],
        ["", odd.includes(match.held_out[log] ?? "") ? "odd: no contender explains it as the others" : null],
      ]);
      group.append(hit);
    };
    const label = `${text} of ${logs.length} held-out logs, by contender`;
    const groupOf = (one: (typeof shown)[number]) => svg("g", { class: "series", style: `--line:${palette.look(one.name).color}`, "data-contender": one.name });
    if (few) {
      const left = Math.min(0.4 * width, 16 + Math.max(...logs.map((log) => textWidth(match.held_out[log] ?? "", 12.5))));
      const frame = { left: Math.round(left), right: width - 12, top: 6, bottom: 6 + kRow * logs.length };
      const drawing = svg("svg", { class: "accuracy match-logs", width, height: frame.bottom + 42, viewBox: `0 0 ${width} ${frame.bottom + 42}`, role: "img", "aria-label": label });
      const x = logScale(all, [frame.left, frame.right], 0.5);
      axis(drawing, x, frame, text);
      logs.forEach((log, row) => {
        const name = match.held_out[log] ?? "";
        drawing.append(svg("text", { class: odd.includes(name) ? "match-name odd" : "match-name", x: frame.left - 8, y: frame.top + kRow * (row + 0.5) + 4, "text-anchor": "end" }, name));
        if (row > 0) drawing.append(svg("line", { class: "match-row", x1: frame.left, x2: frame.right, y1: frame.top + kRow * row + 0.5, y2: frame.top + kRow * row + 0.5 }));
      });
      for (const one of shown) {
        const group = groupOf(one);
        logs.forEach((log, row) => {
          const value = one.values[log] ?? null;
          if (value !== null && value > 0) point(group, one, log, x(value), frame.top + kRow * (row + 0.5));
        });
        drawing.append(group);
      }
      canvas.append(drawing);
      return;
    }
    const height = 360;
    const frame = { left: 58, right: width - 12, top: 10, bottom: height - 30 };
    const drawing = svg("svg", { class: "accuracy match-logs", width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label });
    const names = Math.min(kMostNamed, odd.length);
    const y = logScale(all, [frame.bottom, frame.top + 13 * names], 0.5);
    const x = (place: number) => frame.left + ((place + 0.5) / logs.length) * (frame.right - frame.left);
    drawing.append(grid(y, "y", frame.left, frame.right), frameOf(frame));
    for (const value of ticks(y, 30)) drawing.append(svg("text", { class: "tick", x: frame.left - 6, y: y(value) + 4, "text-anchor": "end" }, numberText(value)));
    drawing.append(svg("text", { class: "axis-title", x: frame.left, y: height - 8 }, `${logs.length} logs, those that ${best} explains worst first; ↑ ${text}`));
    for (const one of shown) {
      const group = groupOf(one);
      logs.forEach((log, place) => {
        const value = one.values[log] ?? null;
        if (value !== null && value > 0) point(group, one, log, x(place), y(value));
      });
      drawing.append(group);
    }
    // the oddest logs by their names, each on a line of its own above its dots
    odd.slice(0, kMostNamed).forEach((name, line) => {
      const place = logs.findIndex((log) => match.held_out[log] === name);
      const values = shown.flatMap(({ values }) => values[logs[place] ?? -1] ?? []);
      if (place < 0 || values.length === 0) return;
      const top = frame.top + 14 + 13 * line;
      const right = x(place) + 6 + textWidth(name, 11) > frame.right;
      drawing.append(
        svg("line", { class: "match-odd", x1: x(place), x2: x(place), y1: top - 8, y2: y(Math.min(...values)) }),
        svg("text", { class: "motion-mark-label", x: x(place) + (right ? -4 : 4), y: top, "text-anchor": right ? "end" : "start" }, name),
      );
    });
    canvas.append(drawing);
  };
  const redraw = drawContenders(canvas, draw);
  const choice = el("select", { "aria-label": "Error that is shown" }, ...figures.map((name) => el("option", { value: name }, kFigures[name]?.[0] ?? name)));
  choice.addEventListener("change", () => {
    figure = choice.value;
    redraw();
  });
  const rows = () => {
    const shown = series();
    return [["log", ...shown.map(({ name }) => name)], ...order().map((log) => [match.held_out[log] ?? "", ...shown.map(({ values }) => values[log] ?? null)])];
  };
  return el("figure", { class: "panel" }, el("figcaption", {}, downloads(() => `${match.model}-logs`, canvas, rows), el("h3", {}, "Each held-out log"), figures.length > 1 ? el("p", { class: "sub" }, "Of ", choice) : null), canvas);
}
