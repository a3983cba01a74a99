// Everything that was recorded of the machine and the run.
import type { Report } from "../data";
import { el } from "../dom";
import { percent, plain, quantity, timestep } from "../format";

// The cost of the harness itself: the same timing of an engine that does nothing.
export function harnessCost(report: Report): { text: string; short: string } | null {
  let best: { us: number; system: string; step: number } | null = null;
  for (const cell of report.json.cells) {
    if (!report.isHarness(cell.contender)) continue;
    const value = cell.values.find((candidate) => candidate.name === "step_time");
    if (value?.value === null || value?.value === undefined) continue;
    // The dearest of all systems and timesteps: nothing was measured with more overhead than this.
    if (!best || value.value > best.us) best = { us: value.value, system: cell.system, step: cell.timestep_ms ?? 0 };
  }
  if (!best) return null;
  return {
    text: `${quantity(best.us, "us")} a step at most (${best.system}, ${timestep(best.step)} ms), measured with an engine that does nothing`,
    short: quantity(best.us, "us"),
  };
}

export function stealSummary(report: Report): string | null {
  const shares = report.json.cells
    .filter((cell) => cell.measure === "raw_speed" && cell.steal !== null)
    .map((cell) => cell.steal!)
    .sort((a, b) => a - b);
  if (shares.length === 0) return null;
  const median = shares[Math.floor(shares.length / 2)]!;
  return `median ${percent(median)}, largest ${percent(shares[shares.length - 1]!)} of the machine's time, over ${plain(shares.length, 6)} timing cells`;
}

export function manifestTable(report: Report): HTMLElement {
  const rows: [string, string][] = report.json.manifest.map((entry) => [entry.key, entry.value]);
  const harness = harnessCost(report);
  if (harness) rows.push(["harness overhead", harness.text]);
  const steal = stealSummary(report);
  if (steal) rows.push(["time stolen while timing", steal]);
  if (rows.length === 0) return el("p", { class: "quiet" }, "Nothing was recorded of the machine.");
  const body = el("tbody");
  for (const [key, value] of rows) {
    body.append(el("tr", {}, el("th", { scope: "row" }, key.replace(/_/g, " ")), el("td", {}, value || "–")));
  }
  return el("table", { class: "manifest" }, el("caption", {}, "Recorded when the campaign ran"), body);
}
