// What follows from the figures: who is unbeaten in speed and accuracy, and which failures are one and the same.
import type { Cell, Outcome, Report, SystemView } from "./data";

export interface FrontPoint {
  contender: string;
  timestep: number;
  speed: number;
  speedLow: number;
  speedHigh: number;
  error: number;
}

export interface FrontMember {
  contender: string;
  points: FrontPoint[]; // on the front, by timestep
  equals: string[]; // contenders that no figure tells apart from this one on these points
}

// The measure that the summary and the plot start with: the error against an independent solution where there is one.
export function mainMeasure(view: SystemView): string | null {
  const names = view.plotNames();
  const wide = names.find(
    (name) =>
      (name === "truth_error" || name === "consistency") &&
      view.contenders.filter((contender) => view.timesteps(name).some((step) => view.entry(contender, step, name)?.value)).length >= 2,
  );
  return wide ?? names[0] ?? null;
}

export function points(view: SystemView, name: string): FrontPoint[] {
  const list: FrontPoint[] = [];
  for (const contender of view.contenders) {
    for (const timestep of view.errorTimesteps(name)) {
      const entry = view.entry(contender, timestep, name);
      const speed = view.realtimeFactor(contender, timestep);
      if (!entry?.value || entry.cell.outcome !== "ok" || !speed) continue;
      if (name === "consistency" && entry.cell.values.some((value) => value.name === "consistency_floor")) continue;
      list.push({
        contender,
        timestep,
        speed: speed.value,
        speedLow: speed.low ?? speed.value,
        speedHigh: speed.high ?? speed.value,
        error: Math.abs(entry.value.value!),
      });
    }
  }
  return list;
}

// Errors that differ by less than this share count as equal.
const kSameError = 0.01;

// The independent solution is good to this, and rounding decides below it: smaller errors count as equal.
export const kResolution = 1e-12; // m

// Contenders with a point that no other point beats in speed without being less accurate, the most accurate first. Of
// contenders that no figure tells apart, the one that the list names first stands for all.
export function paretoFront(list: FrontPoint[], resolution = 0): FrontMember[] {
  const error = (point: FrontPoint) => Math.max(point.error, resolution);
  const bySpeed = [...list].sort((a, b) => b.speed - a.speed || error(a) - error(b) || a.contender.localeCompare(b.contender));
  const front: FrontPoint[] = [];
  let least = Infinity;
  for (const point of bySpeed) {
    if (error(point) < least * (1 - kSameError)) {
      least = error(point);
      front.push(list.find((other) => isEqual(point, other, resolution)) ?? point);
    }
  }
  const members = new Map<string, FrontPoint[]>();
  for (const point of [...front].reverse()) members.set(point.contender, [...(members.get(point.contender) ?? []), point]);
  return [...members].map(([contender, own]) => ({
    contender,
    points: [...own].sort((a, b) => a.timestep - b.timestep),
    equals: [...new Set(list.map((point) => point.contender))].filter(
      (other) =>
        other !== contender &&
        own.every((point) => list.some((twin) => twin.contender === other && isEqual(point, twin, resolution))),
    ),
  }));
}

// Same timestep, same error, overlapping intervals of the speed.
function isEqual(a: FrontPoint, b: FrontPoint, resolution: number): boolean {
  const larger = Math.max(a.error, b.error, resolution);
  const smaller = Math.max(Math.min(a.error, b.error), resolution);
  return a.timestep === b.timestep && larger - smaller <= kSameError * larger && b.speedHigh >= a.speedLow && b.speedLow <= a.speedHigh;
}

export interface Failure {
  system: string;
  contender: string;
  measure: string;
  timesteps: number[];
  outcome: Outcome;
  reason: string; // of the smallest timestep
  alike: boolean; // the other timesteps' reasons differ in their numbers
}

// Cells that have no sound result; those that differ in the timestep and in the numbers of their reasons alone are one
// entry.
export function failures(report: Report): Failure[] {
  const list = new Map<string, Failure>();
  for (const cell of report.json.cells) {
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
