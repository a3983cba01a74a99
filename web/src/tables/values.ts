// Every stored value: to filter, to sort, to take away.
import { valueInfo, type Report } from "../data";
import { clear, el } from "../dom";
import { csvText, save } from "../download";
import { bounded, interval, timestep } from "../format";
import { roving } from "../roving";

interface Row {
  system: string;
  contender: string;
  timestep_ms: number | null;
  measure: string;
  outcome: string;
  value: string;
  unit: string;
  figure: number | null;
  low: number | null;
  high: number | null;
  bound?: boolean;
  reason: string;
}

const kAtOnce = 30;

export function valueRows(report: Report): Row[] {
  const rows: Row[] = [];
  for (const cell of report.cells) {
    const common = { system: cell.system, contender: cell.contender, timestep_ms: cell.timestep_ms, measure: cell.measure, outcome: cell.outcome, reason: cell.reason };
    for (const value of cell.values) {
      rows.push({ ...common, value: value.name, unit: value.unit, figure: value.value, low: value.low, high: value.high, bound: value.bound });
    }
    if (cell.values.length === 0 && cell.outcome !== "ok") rows.push({ ...common, value: "", unit: "", figure: null, low: null, high: null });
  }
  return rows;
}

// The layout of `assay export`, whose CSV has no reasons: a value's name stands for its measure.
const kFields = ["system", "contender", "timestep_ms", "measure", "value", "unit", "outcome", "low", "high"] as const;

function exported(row: Row): Record<(typeof kFields)[number] | "reason", string | number | null> {
  const { system, contender, timestep_ms, unit, outcome, reason, low, high } = row;
  const common = { system, contender, timestep_ms, measure: row.value || row.measure, unit: unit || null, outcome, reason };
  if (row.bound) return { ...common, value: null, low: 0, high: row.figure };
  return { ...common, value: row.figure, low, high };
}

export function asCsv(rows: Row[]): string {
  return csvText([[...kFields], ...rows.map(exported).map((row) => kFields.map((key) => row[key]))]);
}

export function valuesTable(report: Report): HTMLElement {
  const all = valueRows(report);
  const unique = (key: "system" | "contender" | "value" | "outcome") => [...new Set(all.map((row) => row[key]))].filter((name) => name !== "" && !(key === "contender" && report.isHarness(name)));
  const choice = (key: "system" | "contender" | "value" | "outcome", label: string) =>
    el(
      "select",
      { "aria-label": label, "data-filter": key },
      el("option", { value: "" }, `Any ${label.toLowerCase()}`),
      ...unique(key).map((name) => el("option", { value: name }, key === "value" ? valueInfo(name).label : report.title(name))),
    );
  const filters = { system: choice("system", "System"), contender: choice("contender", "Contender"), value: choice("value", "Value"), outcome: choice("outcome", "Outcome") };
  const search = el("input", { type: "search", placeholder: "Words, as in “bullet grasp”", "aria-label": "Words to look for" });
  const count = el("p", { class: "sub", "aria-live": "polite" });
  const body = el("tbody");
  const more = el("button", { type: "button", class: "more" }, "Show more");
  let order: Exclude<keyof Row, "bound"> | null = null;
  let descending = false;
  let limit = kAtOnce;
  let found: Row[] = all;

  const compare = (a: string | number | null, b: string | number | null) => {
    if (a === null || b === null) return a === b ? 0 : a === null ? 1 : -1;
    const difference = typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b));
    return descending ? -difference : difference;
  };
  const draw = () => {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    found = all.filter((row) => {
      for (const [key, select] of Object.entries(filters)) if (select.value && row[key as keyof typeof filters] !== select.value) return false;
      if (words.length === 0) return true;
      const text = `${row.system} ${row.contender} ${row.measure} ${row.value} ${row.outcome} ${row.reason}`.toLowerCase();
      return words.every((word) => text.includes(word));
    });
    const key = order;
    if (key) found = [...found].sort((a, b) => compare(a[key], b[key]));
    const part = found.slice(0, limit);
    count.textContent = `${found.length} of ${all.length} values${part.length < found.length ? `, the first ${part.length} shown` : ""}`;
    body.replaceChildren(
      ...part.map((row) =>
        el(
          "tr",
          { class: row.outcome === "ok" ? null : "bad-row" },
          el("td", {}, row.system),
          el("th", { scope: "row" }, report.title(row.contender)),
          el("td", { class: "figure" }, row.timestep_ms === null ? "" : `${timestep(row.timestep_ms)} ms`),
          el("td", {}, row.value ? valueInfo(row.value).label : row.measure.replace(/_/g, " ")),
          el("td", { class: "figure number" }, row.value ? bounded(row.value, row.figure, row.unit, row.bound) : "–"),
          el("td", { class: "figure" }, interval(row.value, row.low, row.high, row.unit)),
          el("td", { title: row.reason || null }, row.outcome === "ok" ? "ok" : el("b", { class: "bad" }, row.outcome)),
        ),
      ),
    );
    more.hidden = part.length === found.length;
  };
  const heads: [string, Exclude<keyof Row, "bound">, string][] = [
    ["System", "system", ""], ["Contender", "contender", ""], ["Timestep", "timestep_ms", "figure"], ["Value", "value", ""],
    ["Figure", "figure", "figure"], ["95 % interval", "low", "figure"], ["Outcome", "outcome", ""],
  ]; // prettier-ignore
  const cells = heads.map(([title, key, className]) => {
    const button = el("button", { type: "button", class: "sort" }, title);
    const head = el("th", { scope: "col", class: className || null }, button);
    button.addEventListener("click", () => {
      descending = order === key ? !descending : false;
      order = key;
      for (const other of cells) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", descending ? "descending" : "ascending");
      draw();
    });
    return head;
  });
  const change = () => {
    limit = kAtOnce;
    draw();
  };
  for (const select of Object.values(filters)) select.addEventListener("change", change);
  search.addEventListener("input", change);
  more.addEventListener("click", () => {
    limit += 10 * kAtOnce;
    draw();
  });
  const name = (report.manifest("campaign") ?? "results").replace(/[^\w.-]+/g, "-");
  const csv = el("button", { type: "button", class: "download", "data-format": "csv" }, "Download CSV");
  csv.addEventListener("click", () => save(`${name}.csv`, "text/csv", asCsv(found)));
  const json = el("button", { type: "button", class: "download", "data-format": "json" }, "Download JSON");
  json.addEventListener("click", () => save(`${name}.json`, "application/json", JSON.stringify(found.map(exported), null, 1)));
  draw();
  const table = el("table", { class: "values", "aria-label": "All values" }, el("thead", {}, el("tr", {}, ...cells)), body);
  roving(table);
  const box = el("div", { class: "values-panel" });
  clear(box);
  box.append(
    el("div", { class: "filters" }, search, ...Object.values(filters), el("span", { class: "downloads" }, csv, json)),
    count,
    el("div", { class: "scroll" }, table),
    more,
  );
  return box;
}
