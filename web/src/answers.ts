// A tile for each system: what it looks like, its speed and accuracy in little, and which contender answers the reader's
// question.
import { limitText } from "./answer";
import { valueInfo, type Report, type SystemView, type Worst } from "./data";
import { clear, el, type Child } from "./dom";
import { belowFloor, counted, floorText, realtime, timestep, unbroken } from "./format";
import { kTwin } from "./grades";
import type { Palette } from "./palette";
import { reach } from "./places";
import { swatch } from "./plots/legend";
import { picture } from "./plots/picture";
import { smallPlot } from "./plots/small";
import { state } from "./state";
import { wishes } from "./wishes";

const kPlot = { width: 286, height: 150 };

// As the program says it, but of what is below the resolution of its value only that it is.
export function worstText(name: string, { value, text }: Worst): string {
  const { unit } = valueInfo(name);
  return belowFloor(value, unit) ? floorText(unit) : text;
}

// What nearly answers, where nothing does.
function nearest(view: SystemView): string {
  const { found } = wishes.answer(view);
  const [relaxed] = found.relaxed;
  if (relaxed) {
    const what = relaxed.name === null ? `${realtime(relaxed.to)} real time` : `${valueInfo(relaxed.name).short} ${relaxed.text}`;
    return `nearest: ${relaxed.one.point.contender} at ${timestep(relaxed.one.point.timestep_ms)} ms with ${what}`;
  }
  return view.isTimed ? "no contender was measured in full" : "not timed";
}

// The answer in two lines, also above the system's plot.
export function shortAnswer(view: SystemView, palette: Palette): Child[] {
  const { found } = wishes.answer(view);
  const [best] = found.passing;
  if (!best) {
    const untimed = !view.isTimed && view.json.card.answers.find((one) => one.contender !== null);
    if (untimed) return [el("b", { class: "quiet" }, "Not timed"), el("span", { class: "figures" }, `${untimed.question.toLowerCase()}: ${untimed.text}`)];
    return [el("b", { class: "none" }, "No contender within the limits"), el("span", { class: "figures" }, unbroken(nearest(view)))];
  }
  const { contender, timestep_ms: step } = best.point;
  const button = el("button", { type: "button", class: "answer-link", "data-contender-of": contender, "data-timestep": step }, swatch(palette, contender), el("b", {}, unbroken(`${contender} at ${timestep(step)} ms`)));
  button.addEventListener("click", () => {
    state.setShown([contender], true);
    state.choose({ system: view.system, contender, timestep: step });
  });
  const errors = Object.keys(best.worst).filter((name) => name === view.json.main).map((name) => `${valueInfo(name).short} ${worstText(name, best.worst[name]!)}`);
  const alike = found.alike.length > 0 ? [`${found.alike.length} more not told apart`] : [];
  return [button, el("span", { class: "figures" }, [`${best.speed.timed ? "" : "about "}${best.candidate.realtime} real time`, ...errors, ...alike].map(unbroken).join(", "))];
}

// "Fastest within 1 mm of error, 5 mm of penetration"
export function questionText(view: SystemView): string {
  const { limits, realtime: rate } = wishes.of(view);
  const parts = limits.map(([name, largest]) => `${valueInfo(name).short} within ${limitText(view, name, largest)}`);
  if (rate !== null) parts.push(`at least ${realtime(rate)} real time`);
  return parts.length > 0 ? `Fastest with ${parts.join(", ")}` : "Fastest, whatever the errors";
}

// The deepest penetration and the like: what the program says about the answer to its first question.
function caveatOf(view: SystemView): string {
  return view.json.card.caveat.split(/(?<=\.) /)[0] ?? "";
}

function tile(view: SystemView, palette: Palette, robots: boolean): HTMLElement {
  const { system } = view;
  const drawn = view.report.json.pictures?.find((candidate) => candidate.system === system);
  const plot = el("div", { class: "card-plot" });
  const answer = el("div", { class: "card-answer", "data-answer": view.json.card.answers[0]?.id ?? "" });
  const link = el("a", { href: `#${system}` }, system);
  const look = drawn ? picture(drawn, robots ? 150 : 56, robots ? 110 : 40) : null;
  const caveat = robots ? caveatOf(view) : "";
  const box = el("section", { class: robots ? "card robot" : "card", "data-system": system, "aria-label": system }, robots ? look : null, el("div", { class: "card-head" }, el("h3", {}, link), robots ? null : look), robots ? null : plot, answer, caveat ? el("p", { class: "caveat" }, unbroken(caveat)) : null);
  plot.addEventListener("click", () => reach(system));
  const update = () => {
    if (!robots) {
      const small = smallPlot(view, palette, kPlot.width, kPlot.height);
      plot.replaceChildren(...(small ? [small] : [el("p", { class: "quiet" }, view.cells.length > 0 && view.cells.every((cell) => cell.outcome !== "ok") ? `None of ${counted(view.cells.length, "cell")} has a sound result.` : view.isTimed ? "One timestep was timed." : "No step was timed.")]));
    }
    clear(answer);
    for (const child of shortAnswer(view, palette)) if (child) answer.append(child);
  };
  update();
  wishes.subscribe(update);
  let shown = state.shownKey;
  state.subscribe(() => {
    if (shown === state.shownKey) return;
    shown = state.shownKey;
    update();
  });
  return box;
}

export function cards(report: Report, palette: Palette): HTMLElement {
  const names = new Set(report.answered.map((view) => view.system));
  const views = report.answered.filter((view) => !(kTwin.test(view.system) && names.has(view.system.replace(kTwin, ""))));
  const robots = views.length > 12;
  return el("div", { class: robots ? "cards gallery" : "cards" }, ...views.map((view) => tile(view, palette, robots)));
}
