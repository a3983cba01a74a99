// What changed from one results directory to another, as `assay compare` found it.
import type { ChangeRow, Changes, Report } from "../data";
import { el, type Child } from "../dom";
import { plain, quantity, timestep } from "../format";
import { scrollFrame, sortableTable, type Column } from "./sortable";

const kWords: Record<ChangeRow["change"], string> = { none: "none", within: "small", better: "better", worse: "worse", other: "changed", unsettled: "unsettled" };

function list(title: string, lines: string[]): HTMLElement | null {
  if (lines.length === 0) return null;
  return el("div", {}, el("p", { class: "sub table-text" }, title), el("ul", {}, ...lines.map((line) => el("li", {}, line))));
}

export function changes(report: Report, compared: Changes): Child[] {
  const rows = compared.rows.filter((row) => row.change !== "none" && row.change !== "within");
  const columns: Column<ChangeRow>[] = [
    { title: "Contender", key: (row) => row.contender, cell: (row) => report.title(row.contender), head: true, className: "sticky" },
    { title: "Change", key: (row) => row.change, cell: (row) => (row.change === "worse" ? el("b", { class: "bad" }, kWords.worse) : kWords[row.change]) },
    { title: "After against before", cell: (row) => row.text, className: "figure" },
    { title: "System", key: (row) => row.system, cell: (row) => row.system, className: "name" },
    { title: "Timestep", key: (row) => row.timestep_ms, cell: (row) => `${timestep(row.timestep_ms)} ms` },
    { title: "Value", key: (row) => row.value, cell: (row) => row.value.replace(/_/g, " ") },
    { title: "Before", key: (row) => row.a, cell: (row) => (row.a === null ? "" : quantity(row.a, row.unit)), className: "figure" },
    { title: "After", key: (row) => row.b, cell: (row) => (row.b === null ? "" : quantity(row.b, row.unit)), className: "figure" },
    { title: "p, corrected", key: (row) => row.p_corrected ?? 0, cell: (row) => (row.p_corrected === undefined ? "exact" : row.p_corrected < 1e-4 ? "< 0.0001" : plain(row.p_corrected, 2)), className: "figure" },
  ];
  const text = `From ${compared.a} to ${compared.b}. Times: ratio with its 95 % interval, corrected for the number of contenders (Holm) and of a contender's times (Benjamini and Hochberg) at ${plain(compared.level, 2)}; smaller changes than ${plain(100 * compared.threshold, 2)} % are left out${compared.control ? `; relative to ${compared.control}` : ""}.`;
  const common = compared.common_ratio;
  return [
    rows.length > 0 ? el("div", { class: "panel matrix-panel" }, scrollFrame("What changed", text, sortableTable(columns, rows))) : el("p", { class: "sub table-text" }, text),
    common !== null ? el("p", { class: "sub table-text" }, `The median of all times' ratios is ${plain(common, 4)}. A change that all contenders share is probably the machine's.`) : null,
    compared.gaps ? el("p", { class: "sub table-text" }, `Not judged: ${compared.gaps}.`) : null,
    list("Other builds of engines:", compared.builds),
    list("Accepted differences:", compared.accepted),
    list("Not in both:", compared.coverage),
  ];
}
