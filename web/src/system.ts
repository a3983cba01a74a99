// One system of the campaign: facts, speed, accuracy, figures.
import { mainMeasure, outcomeCounts } from "./analysis";
import { kPlotNames, type System, type SystemView } from "./data";
import { el } from "./dom";
import type { Palette } from "./palette";
import { bars } from "./plots/bars";
import { legend } from "./plots/legend";
import { SpeedAccuracy } from "./plots/speed_accuracy";
import { Matrix } from "./tables/matrix";

const kFacts: [string, (value: unknown) => string][] = [
  ["bodies", (v) => `${v} bodies`],
  ["dof", (v) => `${v} DOF`],
  ["hinges", (v) => `${v} hinges`],
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
    const text = write(value);
    if (text) list.append(el("li", {}, text));
  }
  return list;
}

export function systemSection(view: SystemView, system: System, palette: Palette): HTMLElement {
  const section = el("section", { class: "system", id: view.system }, el("h2", {}, view.system), systemFacts(system));
  if (view.cells.length === 0) {
    section.append(el("p", { class: "quiet" }, "No cell of this system has been run yet."));
    return section;
  }
  const counts = outcomeCounts(view.cells);
  const good = counts.get("ok") ?? 0;
  if (good === 0) {
    section.append(
      el("p", { class: "alert" }, `None of the ${view.cells.length} cells of this system has a sound result. `, el("a", { href: "#failures" }, "What failed, and why")),
    );
  }
  const measures = view.plotNames();
  if (measures.length === 0 && view.valueNames().length === 0 && view.timesteps("raw_speed").length === 0) {
    const text = good > 0 ? "Nothing has been measured here yet: there are reference runs alone." : "There is no figure to show.";
    section.append(el("p", { class: "quiet" }, text));
    return section;
  }
  const chosen = mainMeasure(view) ?? measures[0] ?? kPlotNames[0]!;
  const matrix = new Matrix(view, palette, chosen);
  const row = el("div", { class: "plots" }, bars(view, palette), legend(view, palette));
  if (measures.length > 0) {
    const plot = new SpeedAccuracy(view, palette, chosen, measures, (name) => matrix.select(name));
    row.append(plot.element);
  }
  section.append(row, matrix.element);
  return section;
}
