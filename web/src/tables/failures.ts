// Cells without a sound result: counts by contender and system, then each with its reason, to be narrowed down.
import { failures, type Failure } from "../analysis";
import type { Report } from "../data";
import { clear, el } from "../dom";
import { sentenceList, timestep, timestepRange } from "../format";
import type { Palette } from "../palette";
import { swatch } from "../plots/legend";
import { state } from "../state";
import { scrollFrame, sortableTable, type Column } from "./sortable";

// More rows than this are shown only when they are asked for.
const kAtOnce = 30;

type Key = "contender" | "system" | "measure" | "outcome";

const kKeys: [Key, string][] = [["contender", "Contender"], ["system", "System"], ["measure", "Measure"], ["outcome", "Outcome"]]; // prettier-ignore

function measureText(measure: string): string {
  return measure.replace(/_/g, " ");
}

// Opens the details of the failed cell with the smallest timestep, where the command stands that runs it again.
function again(report: Report, failure: Failure): HTMLElement | string {
  if (report.isHarness(failure.contender)) return "";
  const button = el("button", { type: "button", class: "link", "aria-label": `Details of ${failure.contender} on ${failure.system}` }, "Details");
  button.addEventListener("click", () => {
    state.choose({ system: failure.system, contender: failure.contender, timestep: Math.min(...failure.timesteps) });
  });
  return button;
}

function countCells(list: Failure[]): number {
  return list.reduce((sum, failure) => sum + failure.timesteps.length, 0);
}

function list(report: Report, rows: Failure[], limit: number): HTMLTableElement {
  const cells = new Map<string, number>();
  const keyOf = (one: { system: string; contender: string; measure: string }) => `${one.system}\u0000${one.contender}\u0000${one.measure}`;
  for (const cell of report.cells) cells.set(keyOf(cell), (cells.get(keyOf(cell)) ?? 0) + 1);
  const timesteps = (failure: Failure) =>
    failure.timesteps.length > 2 && failure.timesteps.length === cells.get(keyOf(failure))
      ? `all, ${timestepRange(failure.timesteps)}`
      : `${[...failure.timesteps].sort((a, b) => a - b).map(timestep).join(", ")} ms`;
  const columns: Column<Failure>[] = [
    { title: "Contender", key: (f) => f.contender, cell: (f) => report.title(f.contender), head: true, className: "sticky" },
    { title: "System", key: (f) => f.system, cell: (f) => f.system, className: "name" },
    { title: "Measure", key: (f) => f.measure, cell: (f) => measureText(f.measure) },
    { title: "Timesteps", key: (f) => Math.min(...f.timesteps), cell: timesteps },
    { title: "Outcome", key: (f) => f.outcome, cell: (f) => el("b", { class: "bad" }, f.outcome) },
    { title: "Reason", key: (f) => f.reason, cell: (f) => (f.reason || "no reason was stored") + (f.alike ? "; the others alike" : ""), className: "wider" },
    { title: "Details", cell: (f) => again(report, f) },
  ];
  return sortableTable(columns, rows, limit);
}

// How many cells of each contender failed on each system; `choose` gets the contender and the system of a clicked count.
function counts(report: Report, palette: Palette, all: Failure[], choose: (chosen: Partial<Record<Key, string>>) => void): HTMLElement {
  const systems = report.json.systems.map((system) => system.name).filter((name) => all.some((failure) => failure.system === name));
  const contenders = report.json.contenders.map((contender) => contender.name).filter((name) => all.some((failure) => failure.contender === name));
  const of = (contender: string | null, system: string | null) =>
    all.filter((failure) => (contender === null || failure.contender === contender) && (system === null || failure.system === system));
  const button = (contender: string | null, system: string | null) => {
    const found = of(contender, system);
    const count = countCells(found);
    if (count === 0) return el("span", { class: "quiet" }, "·");
    const kinds = [...new Set(found.map((failure) => failure.outcome))].join(", ");
    const where = [contender ?? "all contenders", system ?? "all systems"].join(" on ");
    const node = el("button", { type: "button", class: "cell", title: kinds, "aria-label": `${count} cells of ${where}: ${kinds}; shows them below` }, el("span", { class: "number" }, String(count)));
    node.addEventListener("click", () => choose({ contender: contender ?? "", system: system ?? "" }));
    return node;
  };
  const columns: Column<string>[] = [
    {
      title: "Contender",
      key: (name) => name,
      cell: (name) => el("span", { class: "contender" }, report.isHarness(name) ? null : swatch(palette, name), report.title(name)),
      className: "sticky",
      head: true,
    },
    { title: "All", key: (name) => -countCells(of(name, null)), cell: (name) => button(name, null), className: "figure" },
    ...systems.map((system) => ({
      title: system,
      key: (name: string) => -countCells(of(name, system)),
      cell: (name: string) => button(name, system),
      className: "figure",
    })),
  ];
  const table = sortableTable(columns, [...contenders].sort((a, b) => countCells(of(b, null)) - countCells(of(a, null))));
  table.append(el("tfoot", {}, el("tr", {}, el("th", { scope: "row", class: "sticky" }, "All"), ...[null, ...systems].map((system) => el("td", { class: "figure" }, button(null, system))))));
  const frame = scrollFrame("Failed cells by contender and system", "Cells without a sound result; a click on a number lists them below.", table);
  frame.classList.add("failure-counts");
  return frame;
}

export function failureTable(report: Report, palette: Palette): HTMLElement {
  // What the engine that does nothing cannot do is no failure.
  const all = failures(report).filter((failure) => !report.isHarness(failure.contender) || failure.outcome !== "unsupported");
  if (report.cells.length === 0) return el("p", { class: "quiet" }, "No cell has been run.");
  if (all.length === 0) return el("p", {}, "Nothing failed: every cell of the campaign has a sound result.");
  const outcomes = [...new Set(all.map((failure) => failure.outcome))]
    .map((outcome): [string, number] => [outcome, countCells(all.filter((failure) => failure.outcome === outcome))])
    .sort((a, b) => b[1] - a[1]);
  const measured = report.cells.filter((cell) => !report.isHarness(cell.contender)).length;
  const sum = el(
    "p",
    { class: "failure-sum" },
    `${countCells(all)} of ${measured} cells have no sound result: ${sentenceList(outcomes.map(([outcome, count]) => `${count} ${outcome}`))}.`,
  );

  const option = (key: Key) => {
    const names = [...new Set(all.map((failure) => failure[key]))];
    const text = (name: string) => (key === "contender" ? report.title(name) : key === "measure" ? measureText(name) : name);
    return names.map((name) => el("option", { value: name }, `${text(name)} (${countCells(all.filter((failure) => failure[key] === name))})`));
  };
  const filters = kKeys.map(([key, label]): [Key, HTMLSelectElement] => [
    key,
    el("select", { "aria-label": label, "data-filter": key }, el("option", { value: "" }, `Any ${label.toLowerCase()}`), ...option(key)),
  ]);
  const search = el("input", { type: "search", placeholder: "Words of the reason", "aria-label": "Words to look for" });
  const count = el("p", { class: "sub", "aria-live": "polite" });
  const frame = el("div", { class: "failure-list" });
  const more = el("button", { type: "button", class: "more" });
  let limit = kAtOnce;
  const draw = () => {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    const found = all.filter((failure) => {
      const text = `${failure.system} ${failure.contender} ${failure.measure} ${failure.outcome} ${failure.reason}`.toLowerCase();
      return filters.every(([key, select]) => !select.value || failure[key] === select.value) && words.every((word) => text.includes(word));
    });
    const cells = countCells(found);
    const first = limit < found.length ? `, the first ${limit} shown` : "";
    count.textContent = `${cells} ${cells === 1 ? "cell" : "cells"} in ${found.length} ${found.length === 1 ? "row" : "rows"}${first}`;
    clear(frame);
    if (found.length > 0) frame.append(scrollFrame("Failures", "", list(report, found, limit)));
    more.textContent = `Show all ${found.length}`;
    more.hidden = limit >= found.length;
  };
  const change = () => {
    limit = kAtOnce;
    draw();
  };
  for (const [, select] of filters) select.addEventListener("change", change);
  search.addEventListener("input", change);
  more.addEventListener("click", () => {
    limit = Infinity;
    draw();
    frame.querySelector<HTMLElement>("[tabindex='0']")?.focus({ preventScroll: true });
  });
  const bar = el("div", { class: "filters" }, search, ...filters.map(([, select]) => select));
  const clearing = el("button", { type: "button", class: "more" }, "All failures");
  const choose = (chosen: Partial<Record<Key, string>>) => {
    search.value = "";
    for (const [key, select] of filters) select.value = chosen[key] ?? "";
    change();
    bar.scrollIntoView({ block: "nearest" });
    frame.querySelector<HTMLElement>("[tabindex='0']")?.focus({ preventScroll: true });
  };
  clearing.addEventListener("click", () => choose({}));
  bar.append(clearing);
  draw();
  const table = all.length > 5 ? counts(report, palette, all, choose) : null;
  return el("div", {}, sum, table, bar, count, frame, more);
}
