// One system of the campaign: facts, speed, accuracy, figures.
import { outcomeCounts } from "./analysis";
import { valueInfo, type System, type SystemView } from "./data";
import { el } from "./dom";
import { questionText, shortAnswer } from "./answers";
import { fold } from "./fold";
import { counted, timestep, unbroken } from "./format";
import { kTwin } from "./grades";
import { LimitSlider } from "./limit";
import { modelNotes } from "./notes";
import type { Palette } from "./palette";
import { agreementPanel } from "./plots/agreement";
import { bars } from "./plots/bars";
import { dampingPlot } from "./plots/damping";
import { frontList } from "./plots/front";
import { legend } from "./plots/legend";
import { picture } from "./plots/picture";
import { SpeedAccuracy } from "./plots/speed_accuracy";
import { replayPanel } from "./replay/panel";
import { state } from "./state";
import { dampingTable } from "./tables/damping";
import { graspTable } from "./tables/grasp";
import { Matrix } from "./tables/matrix";
import { wishes } from "./wishes";

// `all` are hinges and slides; results before version 0.2 do not say how many of them are slides.
function joints(all: number, slides: unknown): string {
  const count = (number: number, what: string) => (number > 0 ? counted(number, what) : "");
  if (typeof slides !== "number") return count(all, "joint");
  return [count(all - slides, "hinge"), count(slides, "slide")].filter(Boolean).join(", ") || "no joints";
}

const kFacts: [string, (value: unknown, facts: Record<string, unknown>) => string][] = [
  ["bodies", (v) => `${v} bodies`],
  ["dof", (v) => `${v} DOF`],
  ["hinges", (v, facts) => joints(Number(v), facts["slides"])],
  ["shapes", (v) => `${v} shapes`],
  ["contact_pairs", (v) => `${v} contact pairs`],
  ["mass_kg", (v) => `${Number(Number(v).toPrecision(4))} kg`],
  ["duration_s", (v) => `${Number(Number(v).toPrecision(4))} s simulated`],
  ["control", (v) => String(v)],
  ["gravity", (v) => (Array.isArray(v) && v.every((part) => part === 0) ? "no gravity" : "")],
  ["contacts", (v) => (v === false ? "contacts off" : "")],
];

function systemFacts(system: System): HTMLElement {
  const list = el("ul", { class: "chips" });
  for (const [key, write] of kFacts) {
    const value = system.facts[key];
    if (value === undefined || value === null) continue;
    const text = write(value, system.facts);
    if (text) list.append(el("li", {}, text));
  }
  return list;
}

// What the program says besides of the system: other questions and what to know of the answer.
function others(view: SystemView): HTMLElement {
  const rest = view.json.card.answers.filter((one) => Object.keys(one.limits ?? {}).length === 0 || one.realtime !== null);
  return el("ul", { class: "other-answers" }, ...rest.map((one) => el("li", { "data-answer": one.id }, `${one.question}: `, one.contender ? el("b", {}, one.text) : one.text)), view.json.card.caveat ? el("li", {}, view.json.card.caveat) : null);
}

// How to see what the results keep no states of: the answer's motion, else that of the first sound point.
function withoutReplay(view: SystemView): HTMLElement | null {
  const point = wishes.answer(view).found.passing[0]?.point ?? view.json.points.find((one) => one.sound);
  if (!point) return null;
  const file = `${view.system}.mp4`;
  return el("p", { class: "quiet note replay-none" }, "There is no replay here, because these results hold no states of its runs. A movie of one, run again: ", el("code", {}, `assay draw DIR ${view.system} --contenders ${point.contender} --timestep ${timestep(point.timestep_ms)} --out ${file}`));
}

// Fills `section` with its head, answer and plot; what comes below them is drawn by the functions returned, in their order.
export function fillSystem(section: HTMLElement, view: SystemView, system: System, palette: Palette): (() => void)[] {
  const drawn = view.report.json.pictures?.find((candidate) => candidate.system === view.system);
  const twin = view.report.mainSystems.find((other) => kTwin.test(other.name) && other.name.replace(kTwin, "") === view.system);
  const head = el("div", { class: "system-head" }, el("div", {}, el("h2", {}, view.system), systemFacts(system), modelNotes(system.facts["notes"]), view.json.overlap ? el("p", { class: "overlap" }, unbroken(view.json.overlap)) : null, twin ? el("p", { class: "twin" }, el("a", { href: `#${twin.name}` }, `${twin.name}: the same robot without gravity and contacts, against a reference solution`)) : null), drawn ? picture(drawn, 110, 74) : "");
  section.replaceChildren(head);
  if (view.cells.length === 0) {
    section.append(el("p", { class: "quiet" }, "No cell of this system has been run yet."));
    return [];
  }
  const counts = outcomeCounts(view.cells);
  const good = counts.get("ok") ?? 0;
  if (good === 0) {
    section.append(
      el("p", { class: "alert" }, `None of the ${view.cells.length} cells of this system has a sound result. `, el("a", { href: "#failures" }, "What failed, and why")),
    );
  }
  const measures = view.json.errors.filter((name) => valueInfo(name).plot);
  if (measures.length === 0 && view.json.values.length === 0 && view.timesteps("raw_speed").length === 0) {
    const text = good > 0 ? "Nothing has been measured here yet: there are only reference runs." : "There is no figure to show.";
    section.append(el("p", { class: "quiet" }, text));
    return [];
  }
  const wanted = state.measures.get(view.system) ?? "";
  let chosen = measures.includes(wanted) ? wanted : (plotted(view, measures) ?? "");
  let matrix: Matrix | null = null;
  let front = frontList(view, palette, chosen);
  const main = el("div", { class: "system-main" });
  const asked = el("div", { class: "system-answer", "aria-live": "polite" });
  const answer = () => asked.replaceChildren(el("span", { class: "asked" }, questionText(view)), ...shortAnswer(view, palette).filter((child): child is Node => child instanceof Node));
  answer();
  wishes.subscribe(answer);
  if (measures.length > 0) {
    const slider = new LimitSlider(view, chosen);
    const plot = new SpeedAccuracy(view, palette, chosen, measures, (name) => {
      chosen = name;
      slider.select(name);
      matrix?.select(name);
      const next = frontList(view, palette, name);
      front.replaceWith(next);
      front = next;
    });
    plot.element.querySelector("figcaption")?.after(el("div", { class: "ask-row" }, slider.element, asked));
    main.append(plot.element);
  }
  // A legend stands beside what it is of.
  const body = el("div", { class: "system-body" }, legend(view, palette), main);
  if (measures.length > 0) section.append(body);
  const folds = el("div", { class: "folds" });
  section.append(folds);
  const agreement = view.report.json.agreement?.find((candidate) => candidate.system === view.system);
  const add = (title: string, note: () => string, make: () => HTMLElement | null) => () => {
    const made = make();
    if (made) folds.append(fold(title, note(), made));
  };
  const speedSteps = view.timesteps("raw_speed").length;
  const beside = () => speedSteps === 0 && measures.length === 0 ? null : el("div", { class: "beside" }, bars(view, palette), measures.length > 0 ? front : null);
  const settings = view.contenders.length;
  return [
    () => {
      const replay = replayPanel(view, palette) ?? withoutReplay(view);
      if (!replay) return;
      main.append(replay);
      if (!body.isConnected) folds.before(body);
    },
    add("Raw speed and the front", () => (speedSteps > 0 ? `steps a second at ${counted(speedSteps, "timestep")}; unbeaten: ${counted((view.json.fronts[chosen] ?? []).length, "point")}` : "not timed"), beside),
    add("Grasps", () => "from how many starts the object was held", () => graspTable(view, palette)),
    add("Agreement", () => "which engines compute the same motion, and until when", () => (agreement && agreement.contenders.length > 1 ? agreementPanel(agreement, palette) : null)),
    add("Hidden damping", () => "energy that no model takes away", () => {
      const both = [dampingPlot(view, palette), dampingTable(view, palette)].filter((one): one is HTMLElement => one !== null);
      return both.length > 0 ? el("div", {}, ...both) : null;
    }),
    add("All figures", () => `${view.json.values.length} values of ${settings} contenders, by timestep`, () => (matrix = new Matrix(view, palette, chosen)).element),
    () => folds.append(fold("Other answers", "most accurate in real time, largest sound timestep", others(view))),
  ];
}

// The value that the plot begins with: the one that the system is judged by, unless it asks for no choice.
function plotted(view: SystemView, measures: string[]): string | undefined {
  const { main } = view.json;
  if (!main) return measures[0];
  // Of a front of one point the fastest is the most accurate, too: contacts tell more then.
  return (view.json.fronts[main] ?? []).length > 1 ? main : (view.json.usual.map((one) => one.value).find((name) => measures.includes(name)) ?? main);
}
