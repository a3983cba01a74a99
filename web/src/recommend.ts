// For an error that is good enough: who is the fastest, at which timestep. The same rule as `assay recommend`.
import type { Report } from "./data";

export interface Interval {
  value: number;
  low: number;
  high: number;
}

export interface Candidate {
  contender: string;
  timestep: number; // ms
  speed: Interval; // realtime factor
  error: Interval;
}

export interface Recommendation {
  unit: string;
  fastest: Candidate[]; // each contender at its fastest within the limit, the fastest first
  alike: Candidate[]; // whose speed the measurement cannot tell from the first one's
  best: Candidate | null; // the smallest error of all, within the limit or not
}

// What there is to choose an error of.
export function recommendable(report: Report, system: string): string[] {
  const names = new Set<string>();
  for (const cell of report.view(system).cells) {
    if (cell.measure === "raw_speed" || cell.measure === "scaling") continue;
    for (const value of cell.values) names.add(value.name);
  }
  return [...names];
}

// Between timesteps that were timed the step's time is interpolated, logarithmically in both; beyond them it is the
// nearest one's.
function speedAt(speeds: [number, Interval][], timestep: number): Interval | null {
  const last = speeds[speeds.length - 1];
  if (!last) return null;
  let to = speeds.findIndex(([step]) => step >= timestep * (1 - 1e-9));
  let from = to;
  if (to < 0) to = from = speeds.length - 1;
  else if (speeds[to]![0] > timestep * (1 + 1e-9) && to > 0) from = to - 1;
  const [below, above] = [speeds[from]!, speeds[to]!];
  const span = Math.log(above[0] / below[0]);
  const weight = span > 0 ? Math.log(timestep / below[0]) / span : 0;
  const blend = (bound: keyof Interval) => timestep * (below[1][bound] / below[0]) ** (1 - weight) * (above[1][bound] / above[0]) ** weight;
  return { value: blend("value"), low: blend("low"), high: blend("high") };
}

export function candidates(report: Report, system: string, name: string): { list: Candidate[]; unit: string } {
  const cells = report.view(system).cells; // without the engine that does nothing
  const speeds = new Map<string, [number, Interval][]>();
  const intervalOf = (value: { value: number | null; low: number | null; high: number | null }): Interval => ({
    value: value.value!,
    low: value.low ?? value.value!,
    high: value.high ?? value.value!,
  });
  for (const cell of cells) {
    const factor = cell.values.find((value) => value.name === "realtime_factor");
    if (!factor || factor.value === null || cell.outcome !== "ok" || cell.timestep_ms === null) continue;
    const list = speeds.get(cell.contender) ?? [];
    list.push([cell.timestep_ms, intervalOf(factor)]);
    speeds.set(cell.contender, list);
  }
  for (const list of speeds.values()) list.sort(([a], [b]) => a - b);
  const list: Candidate[] = [];
  let unit = "";
  for (const cell of cells) {
    const error = cell.values.find((value) => value.name === name);
    // At the reference's own timestep the error says nothing of integration.
    const reference = cell.values.some((value) => value.name === "restart_floor" && value.value !== null);
    if (!error || error.value === null || reference || cell.outcome !== "ok" || cell.timestep_ms === null) continue;
    unit = error.unit;
    const speed = speedAt(speeds.get(cell.contender) ?? [], cell.timestep_ms);
    if (speed) list.push({ contender: cell.contender, timestep: cell.timestep_ms, speed, error: intervalOf(error) });
  }
  return { list, unit };
}

export function recommend(report: Report, system: string, name: string, limit: number): Recommendation {
  const { list, unit } = candidates(report, system, name);
  const fastest = new Map<string, Candidate>();
  for (const one of list) {
    if (!Number.isFinite(one.speed.value) || !(one.error.value <= limit)) continue;
    const known = fastest.get(one.contender);
    const better = !known || one.speed.value > known.speed.value || (one.speed.value === known.speed.value && one.error.value < known.error.value);
    if (better) fastest.set(one.contender, one);
  }
  // By name first, as the program lists those of equal speed.
  const ordered = [...fastest.values()]
    .sort((a, b) => (a.contender < b.contender ? -1 : 1))
    .sort((a, b) => b.speed.value - a.speed.value);
  const first = ordered[0];
  return {
    unit,
    fastest: ordered,
    alike: first ? ordered.slice(1).filter((one) => one.speed.high >= first.speed.low) : [],
    best: list.reduce<Candidate | null>((least, one) => (!least || one.error.value < least.error.value ? one : least), null),
  };
}
