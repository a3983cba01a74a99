// Every cell without a sound result, with its reason.
import { failures, type Failure } from "../analysis";
import type { Report } from "../data";
import { el } from "../dom";
import { timestep, timestepRange } from "../format";
import { state } from "../state";
import { scrollFrame, sortableTable, type Column } from "./sortable";

// More rows than this scroll in a frame of their own.
const kMany = 40;

// Opens the details of the failed cell with the smallest timestep, where the command stands that runs it again.
function again(report: Report, failure: Failure): HTMLElement | string {
  if (report.isHarness(failure.contender)) return "";
  const button = el("button", { type: "button", class: "link", "aria-label": `Details of ${failure.contender} on ${failure.system}` }, "Details");
  button.addEventListener("click", () => {
    state.choose({ system: failure.system, contender: failure.contender, timestep: Math.min(...failure.timesteps) });
  });
  return button;
}

export function failureTable(report: Report): HTMLElement {
  const rows = failures(report);
  if (report.json.cells.length === 0) return el("p", { class: "quiet" }, "No cell has been run.");
  if (rows.length === 0) return el("p", {}, "Nothing failed: every cell of the campaign has a sound result.");
  const all = (failure: Failure) =>
    report.json.cells.filter(
      (cell) => cell.system === failure.system && cell.contender === failure.contender && cell.measure === failure.measure,
    ).length;
  const timesteps = (failure: Failure) =>
    failure.timesteps.length > 2 && failure.timesteps.length === all(failure)
      ? `all, ${timestepRange(failure.timesteps)}`
      : `${[...failure.timesteps].sort((a, b) => a - b).map(timestep).join(", ")} ms`;
  const columns: Column<Failure>[] = [
    { title: "Contender", key: (f) => f.contender, cell: (f) => report.title(f.contender), head: true, className: "sticky" },
    { title: "System", key: (f) => f.system, cell: (f) => f.system },
    { title: "Measure", key: (f) => f.measure, cell: (f) => f.measure.replace(/_/g, " ") },
    { title: "Timesteps", key: (f) => Math.min(...f.timesteps), cell: timesteps },
    { title: "Outcome", key: (f) => f.outcome, cell: (f) => el("b", { class: "bad" }, f.outcome) },
    { title: "Reason", key: (f) => f.reason, cell: (f) => (f.reason || "no reason was stored") + (f.alike ? "; the others alike" : ""), className: "wider" },
    { title: "", cell: (f) => again(report, f) },
  ];
  const frame = scrollFrame("Failures", "", sortableTable(columns, rows));
  if (rows.length > kMany) frame.querySelector(".scroll")?.classList.add("tall");
  return frame;
}
