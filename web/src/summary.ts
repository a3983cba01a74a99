// The page's first words: per system, who is unbeaten in speed and accuracy, computed from the figures.
import { kResolution, mainMeasure, paretoFront, points, type FrontMember } from "./analysis";
import { valueInfo, type SystemView } from "./data";
import { el, type Child } from "./dom";
import { quantity, realtime, sentenceList, timestepRange } from "./format";
import type { Palette } from "./palette";
import { swatch } from "./plots/legend";

function range(low: string, high: string): string {
  return low === high ? low : `${low} to ${high}`;
}

function sentence(member: FrontMember, place: string, unit: string, label: string): string {
  const speeds = member.points.map((point) => point.speed);
  const errors = member.points.map((point) => point.error);
  const speed = range(realtime(Math.min(...speeds)), realtime(Math.max(...speeds)));
  const written = (value: number) => (unit === "m" && value < kResolution ? `under ${quantity(kResolution, unit, 1)}` : quantity(value, unit));
  const error = range(written(Math.min(...errors)), written(Math.max(...errors)));
  const tie =
    member.equals.length > 0
      ? `, and so ${member.equals.length === 1 ? "does" : "do"} ${sentenceList(member.equals)} within the intervals`
      : "";
  return `${place}: at ${timestepRange(member.points.map((point) => point.timestep))} it runs at ${speed} real time with a ${label} ${error.startsWith("under") ? "" : "of "}${error}${tie}.`;
}

function whyNoFront(view: SystemView): Child[] {
  const cells = view.cells.filter((cell) => cell.outcome !== "unsupported");
  if (cells.length === 0) return ["No cell of this system has been run."];
  if (!cells.some((cell) => cell.measure === "raw_speed")) {
    return ["This system was not timed: its errors are plotted over the timestep, and nobody is the fastest."];
  }
  const failed = cells.some((cell) => cell.outcome !== "ok");
  return ["No contender has both a speed and an error here", ...(failed ? ["; ", el("a", { href: "#failures" }, "what failed, and why")] : []), "."];
}

export function systemSummary(view: SystemView, palette: Palette): HTMLElement {
  const box = el("section", { class: "summary-system" }, el("h3", {}, el("a", { href: `#${view.system}` }, view.system)));
  const name = mainMeasure(view);
  const label = name ? valueInfo(name).label.toLowerCase() : "";
  const front = name ? paretoFront(points(view, name), view.unit(name) === "m" ? kResolution : 0) : [];
  if (!name || front.length === 0) {
    box.append(el("p", { class: "quiet" }, ...whyNoFront(view)));
    return box;
  }
  const all = points(view, name);
  const contenders = new Set(all.map((point) => point.contender)).size;
  box.append(
    el("p", { class: "sub" }, `Of ${contenders} contenders, ${front.length === 1 ? "one is" : `${front.length} are`} unbeaten in speed and ${label} together:`),
  );
  const list = el("ul", { class: "front" });
  const speed = (member: FrontMember) => Math.max(...member.points.map((point) => point.speed));
  const error = (member: FrontMember) => Math.min(...member.points.map((point) => point.error));
  const fastest = Math.max(...front.map(speed));
  const least = Math.min(...front.map(error));
  // The fastest comes last, wherever its most accurate point lies.
  front.sort((a, b) => Number(speed(a) === fastest) - Number(speed(b) === fastest) || error(a) - error(b));
  front.forEach((member) => {
    const isFastest = speed(member) === fastest;
    const isBest = error(member) === least;
    const place = isFastest && isBest ? "is both the fastest and the most accurate" : isBest ? "is the most accurate" : isFastest ? "is the fastest" : "lies in between";
    list.append(
      el("li", {}, swatch(palette, member.contender), el("span", {}, el("strong", {}, member.contender), " ", sentence(member, place, view.unit(name), label))),
    );
  });
  box.append(list);
  return box;
}
