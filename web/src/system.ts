// One system of the campaign: facts, speed, accuracy, figures.
import { outcomeCounts } from "./analysis";
import { valueInfo, type System, type SystemView } from "./data";
import { el } from "./dom";
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

// `all` are hinges and slides; results before version 0.2 do not say how many of them are slides.
function joints(all: number, slides: unknown): string {
  const count = (number: number, what: string) => (number > 0 ? `${number} ${what}${number === 1 ? "" : "s"}` : "");
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

// Fills `section` with its head and plots; what comes below them is drawn by the functions returned, in their order.
export function fillSystem(section: HTMLElement, view: SystemView, system: System, palette: Palette): (() => void)[] {
  const drawn = view.report.json.pictures?.find((candidate) => candidate.system === view.system);
  const head = el("div", { class: "system-head" }, el("div", {}, el("h2", {}, view.system), systemFacts(system), modelNotes(system.facts["notes"])), drawn ? picture(drawn, 110, 74) : "");
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
  let chosen = measures.includes(wanted) ? wanted : (view.json.main ?? measures[0] ?? "");
  let matrix: Matrix | null = null;
  const plots = el("div", { class: "plots" });
  let front = frontList(view, palette, chosen);
  if (measures.length > 0) {
    const plot = new SpeedAccuracy(view, palette, chosen, measures, (name) => {
      chosen = name;
      matrix?.select(name);
      const next = frontList(view, palette, name);
      front.replaceWith(next);
      front = next;
    });
    plots.append(plot.element);
  }
  plots.append(el("div", { class: "beside" }, bars(view, palette), measures.length > 0 ? front : null));
  const body = el("div", { class: "system-main" }, plots);
  section.append(el("div", { class: "system-body" }, legend(view, palette), body));
  const agreement = view.report.json.agreement?.find((candidate) => candidate.system === view.system);
  const append = (make: () => HTMLElement | null) => () => {
    const made = make();
    if (made) body.append(made);
  };
  return [
    append(() => replayPanel(view, palette)),
    append(() => graspTable(view, palette)),
    append(() => (agreement && agreement.contenders.length > 1 ? agreementPanel(agreement, palette) : null)),
    append(() => dampingPlot(view, palette)),
    append(() => dampingTable(view, palette)),
    append(() => (matrix = new Matrix(view, palette, chosen)).element),
  ];
}
