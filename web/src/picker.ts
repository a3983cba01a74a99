// The reader's question: which engine, for an error that is good enough?
import { valueInfo, type Report } from "./data";
import { clear, el } from "./dom";
import { quantity, realtime, timestep, unitText } from "./format";
import type { Palette } from "./palette";
import { swatch } from "./plots/legend";
import { candidates, recommend, recommendable, type Candidate } from "./recommend";
import { state } from "./state";
import { scrollFrame, sortableTable, type Column } from "./tables/sortable";

// Units that an error may be given in, with their scale.
const kUnits: Record<string, [string, number][]> = {
  m: [["mm", 1e-3], ["µm", 1e-6], ["nm", 1e-9], ["cm", 1e-2], ["m", 1]],
  rad: [["mrad", 1e-3], ["deg", Math.PI / 180], ["rad", 1]],
  J: [["mJ", 1e-3], ["µJ", 1e-6], ["J", 1]],
  "1": [["%", 1e-2], ["", 1]],
}; // prettier-ignore

function unitsOf(unit: string): [string, number][] {
  return kUnits[unit] ?? [[unitText(unit), 1]];
}

function within(bounds: { value: number; low: number; high: number }, write: (value: number) => string): string {
  return bounds.low === bounds.high ? write(bounds.value) : `${write(bounds.value)} (${write(bounds.low)} to ${write(bounds.high)})`;
}

function canChoose(report: Report, system: string, name: string): boolean {
  return valueInfo(name).plot && candidates(report, system, name).list.length > 0;
}

// Whether there is anything to choose from.
export function canPick(report: Report): boolean {
  return report.mainSystems.some(({ name: system }) => recommendable(report, system).some((name) => canChoose(report, system, name)));
}

export function picker(report: Report, palette: Palette): HTMLElement {
  const systems = report.mainSystems
    .map(({ name: system }) => ({ system, names: recommendable(report, system).filter((name) => canChoose(report, system, name)) }))
    .filter(({ names }) => names.length > 0);
  const system = el("select", { "aria-label": "System", id: "pick-system" }, ...systems.map((one) => el("option", { value: one.system }, one.system)));
  const measure = el("select", { "aria-label": "Measure", id: "pick-measure" });
  const error = el("input", { type: "number", min: 0, step: "any", value: 1, "aria-label": "Largest error that will do", id: "pick-error" });
  const unit = el("select", { "aria-label": "Unit of the error", id: "pick-unit" });
  const answer = el("div", { class: "answer", "aria-live": "polite" });

  const fillUnits = () => {
    clear(unit);
    const { unit: base } = candidates(report, system.value, measure.value);
    for (const [name, scale] of unitsOf(base)) unit.append(el("option", { value: scale }, name || "(a plain number)"));
    // A limit that says something to begin with: the middle of what was measured, as a power of ten.
    const errors = candidates(report, system.value, measure.value).list.map((one) => Math.abs(one.error.value)).filter((value) => value > 0).sort((a, b) => a - b);
    const middle = errors[Math.floor(errors.length / 2)] ?? 1e-3;
    const scales = unitsOf(base).map(([, scale]) => scale);
    const fitting = scales.filter((scale) => scale <= middle).sort((a, b) => b - a)[0] ?? Math.min(...scales);
    unit.value = String(fitting);
    error.value = String(Number((10 ** Math.round(Math.log10(middle / fitting))).toPrecision(1)));
  };
  const fillMeasures = () => {
    clear(measure);
    const names = systems.find((one) => one.system === system.value)?.names ?? [];
    for (const name of names) measure.append(el("option", { value: name }, valueInfo(name).label));
    measure.value = names.includes("consistency") ? "consistency" : names[0]!;
    fillUnits();
  };
  const open = (one: Candidate) => {
    state.setShown([one.contender], true);
    state.choose({ system: system.value, contender: one.contender, timestep: one.timestep });
  };
  const draw = () => {
    clear(answer);
    const limit = Number(error.value) * Number(unit.value);
    if (!(limit > 0)) {
      answer.append(el("p", { class: "quiet" }, "Give a positive number for the error."));
      return;
    }
    const found = recommend(report, system.value, measure.value, limit);
    const label = valueInfo(measure.value).label.toLowerCase();
    const best = found.fastest[0];
    if (!best) {
      const least = found.best;
      answer.append(
        el("p", { class: "pick-none" }, `No contender's ${label} on ${system.value} is that small: the smallest is ${quantity(least?.error.value, found.unit)}, of ${least?.contender} at ${timestep(least?.timestep ?? 0)} ms.`),
      );
      return;
    }
    const line = el("p", { class: "pick-best", "data-contender-of": best.contender, "data-timestep": best.timestep }, swatch(palette, best.contender), " ", el("strong", {}, `${best.contender} at ${timestep(best.timestep)} ms`), `: ${within(best.speed, realtime)} real time, ${label} ${within(best.error, (value) => quantity(value, found.unit))}. `);
    const more = el("button", { type: "button", class: "link" }, "Its details");
    more.addEventListener("click", () => open(best));
    line.append(more);
    answer.append(line);
    if (best.error.high > limit) answer.append(el("p", { class: "quiet" }, "Its error's interval goes beyond the limit."));
    if (found.alike.length > 0) {
      answer.append(el("p", { class: "pick-alike" }, "As fast, as far as was measured: ", found.alike.map((one) => `${one.contender} at ${timestep(one.timestep)} ms`).join(", "), "."));
    }
    const columns: Column<Candidate>[] = [
      { title: "Contender", key: (one) => one.contender, cell: (one) => el("span", { class: "contender" }, swatch(palette, one.contender), one.contender), className: "sticky", head: true },
      { title: "Timestep", key: (one) => one.timestep, cell: (one) => `${timestep(one.timestep)} ms`, className: "figure" },
      { title: "Times real time", key: (one) => one.speed.value, cell: (one) => within(one.speed, realtime), className: "figure" },
      { title: "Error", key: (one) => one.error.value, cell: (one) => within(one.error, (value) => quantity(value, found.unit)), className: "figure" },
    ];
    answer.append(
      el("details", {}, el("summary", {}, `Each of ${found.fastest.length} contenders at its fastest within the limit`), scrollFrame("Contenders within the limit", "", sortableTable(columns, found.fastest))),
    );
  };
  system.addEventListener("change", () => {
    fillMeasures();
    draw();
  });
  measure.addEventListener("change", () => {
    fillUnits();
    draw();
  });
  error.addEventListener("input", draw);
  unit.addEventListener("change", draw);
  fillMeasures();
  draw();
  return el(
    "div",
    { class: "panel picker" },
    el("p", { class: "question" }, "On ", system, " with a ", measure, " of at most ", el("span", { class: "limit" }, error, " ", unit), ":"),
    answer,
  );
}
