// Which failures are one and the same.
import type { Cell, Outcome, Report } from "./data";

export interface Failure {
  system: string;
  contender: string;
  measure: string;
  timesteps: number[];
  outcome: Outcome;
  reason: string; // of the smallest timestep
  alike: boolean; // the other timesteps' reasons differ in their numbers
}

// Cells without a sound result. Cells that differ only in the timestep and in the numbers of their reasons are one entry.
export function failures(report: Report): Failure[] {
  const list = new Map<string, Failure>();
  for (const cell of report.cells) {
    if (cell.outcome === "ok") continue;
    const key = [cell.system, cell.contender, cell.measure, cell.outcome, cell.reason.replace(/[\d.]+(e[+-]?\d+)?/g, "#")].join("\u0000");
    const known = list.get(key);
    if (known) {
      known.alike ||= cell.reason !== known.reason;
      if ((cell.timestep_ms ?? 0) < Math.min(...known.timesteps)) known.reason = cell.reason;
      known.timesteps.push(cell.timestep_ms ?? 0);
    } else {
      list.set(key, {
        system: cell.system,
        contender: cell.contender,
        measure: cell.measure,
        timesteps: [cell.timestep_ms ?? 0],
        outcome: cell.outcome,
        reason: cell.reason,
        alike: false,
      });
    }
  }
  return [...list.values()];
}

export function outcomeCounts(cells: Cell[]): Map<Outcome, number> {
  const counts = new Map<Outcome, number>();
  for (const cell of cells) counts.set(cell.outcome, (counts.get(cell.outcome) ?? 0) + 1);
  return counts;
}
