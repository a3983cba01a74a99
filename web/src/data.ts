// The report's JSON as the C++ side writes it (src/report), and the page's index over it.
import type { Replay } from "./replay/decode";

export type Outcome = "ok" | "unstable" | "diverged" | "timeout" | "crashed" | "unsupported";

export interface Value {
  name: string;
  unit: string;
  value: number | null;
  low: number | null;
  high: number | null;
}

export interface Cell {
  system: string;
  contender: string;
  timestep_ms: number | null;
  measure: string;
  outcome: Outcome;
  reason: string;
  wall_s: number | null;
  cpu_s: number | null;
  engine_s: number | null;
  steal: number | null;
  values: Value[];
  samples?: Samples[];
}

// Samples of a cell: all of them where they are few, else a histogram. The name ends with the unit.
export interface Samples {
  name: string;
  count: number;
  values?: number[];
  from?: number;
  to?: number;
  bins?: number[]; // counts, of equal width from `from` to `to`
  above?: number;
}

export type Point3 = [number, number, number];

// A capsule between two points of the world frame, or a sphere where they are equal; m.
export interface PictureShape {
  a: Point3;
  b: Point3;
  r: number;
  c: string;
}

export interface Picture {
  system: string;
  start: PictureShape[];
  end: { contender: string; time_s: number; shapes: PictureShape[] } | null;
  ground: number | null;
}

// Who computes the same motion, and until when. The lists have an entry per pair (0, 1), (0, 2), ..., (1, 2), ...
export interface Agreement {
  system: string;
  timestep_ms: number;
  contenders: string[];
  time_s: number[];
  distance_m: ((number | null)[] | null)[];
  parting_s: (number | null)[];
}

export interface ClaimFigure {
  label: string;
  contender: string;
  system: string;
  timestep_ms: number | null;
  measure: string;
  value: number | null;
  unit: string;
  low: number | null;
  high: number | null;
}

export interface Claim {
  number: number;
  title: string;
  statement: string;
  paper: string;
  verdict: "holds" | "changed" | "not-measurable";
  summary: string;
  reason: string;
  today: string;
  key?: string;
  figures: ClaimFigure[];
}

export interface Deviation {
  test: string;
  bound: number;
  reason: string;
}

export interface Contender {
  name: string;
  engine: string;
  version: string;
  base: string;
  settings: string;
  capabilities: Record<string, unknown>;
  build: Record<string, unknown>;
}

export interface System {
  name: string;
  facts: Record<string, unknown>;
}

export type GateStatus = "pass" | "fail" | "deviation" | "not-applicable";

export interface GateResult {
  contender: string;
  test: string;
  status: GateStatus;
  figure: number | null;
  tolerance: number | null;
  unit: string;
  note: string;
}

export interface ReportJson {
  format: number;
  manifest: { key: string; value: string }[];
  systems: System[];
  contenders: Contender[];
  cells: Cell[];
  conformance: GateResult[];
  pictures?: Picture[];
  agreement?: Agreement[];
  claims?: Claim[];
}

// What is known of a value's name; other names are shown as they are.
export interface ValueInfo {
  label: string; // in running text and on axes
  better: "low" | "high" | "none";
  plot: boolean; // can be the error axis of the speed-accuracy plot
  meaning: string;
}

const kValues: Record<string, ValueInfo> = {
  truth_error: {
    label: "Truth error",
    better: "low",
    plot: true,
    meaning: "mean distance of the bodies from a solution that no contender made, at the end of the run",
  },
  consistency: {
    label: "Consistency error",
    better: "low",
    plot: true,
    meaning: "mean distance of the bodies from the contender's own run at the smallest timestep, over short pieces of it",
  },
  energy_drift: {
    label: "Energy drift",
    better: "low",
    plot: true,
    meaning: "largest deviation of the total energy from its initial value over the run",
  },
  angular_momentum_drift: {
    label: "Angular momentum drift",
    better: "low",
    plot: true,
    meaning: "largest deviation of the conserved angular momentum from its initial value over the run",
  },
  linear_momentum_drift: {
    label: "Linear momentum drift",
    better: "low",
    plot: true,
    meaning: "largest deviation of the linear momentum from its initial value over the run",
  },
  joint_dislocation_max: {
    label: "Joint dislocation",
    better: "low",
    plot: true,
    meaning: "largest distance of a hinge's two anchors over the run",
  },
  joint_dislocation_rms: {
    label: "Joint dislocation, RMS",
    better: "low",
    plot: false,
    meaning: "largest distance of a hinge's two anchors in each sample, root mean square over the run",
  },
  joint_misalignment_max: {
    label: "Joint misalignment",
    better: "low",
    plot: true,
    meaning: "largest angle between a hinge's two axes over the run",
  },
  joint_misalignment_rms: {
    label: "Joint misalignment, RMS",
    better: "low",
    plot: false,
    meaning: "largest angle between a hinge's two axes in each sample, root mean square over the run",
  },
  limit_violation_max: {
    label: "Limit violation",
    better: "low",
    plot: true,
    meaning: "largest angle of a joint beyond its limit over the run",
  },
  limit_violation_rms: {
    label: "Limit violation, RMS",
    better: "low",
    plot: false,
    meaning: "largest angle of a joint beyond its limit in each sample, root mean square over the run",
  },
  penetration_max: {
    label: "Penetration",
    better: "low",
    plot: true,
    meaning: "largest depth of two colliding shapes in each other over the run",
  },
  penetration_rms: {
    label: "Penetration, RMS",
    better: "low",
    plot: false,
    meaning: "largest depth of two colliding shapes in each other in each sample, root mean square over the run",
  },
  grasp_slip: {
    label: "Grasp slip",
    better: "low",
    plot: true,
    meaning: "farthest that the object has moved in the hand over the run",
  },
  grasp_held: {
    label: "Grasp held",
    better: "high",
    plot: false,
    meaning: "1 when the object stayed in the hand for the whole run, else 0",
  },
  drop_time: { label: "Drop time", better: "high", plot: false, meaning: "when the object left the hand" },
  largest_stable_timestep: {
    label: "Largest stable timestep",
    better: "high",
    plot: false,
    meaning: "the largest timestep at which the object stays in the hand",
  },
  stable_up_to_timestep: {
    label: "Stable up to",
    better: "high",
    plot: false,
    meaning: "the largest timestep up to which the object stays in the hand at every smaller one measured too",
  },
  damping_rate: {
    label: "Hidden damping",
    better: "none",
    plot: false,
    meaning: "rate at which velocities decay although nothing damps them; negative when energy is gained",
  },
  agreement: {
    label: "Distance from the others",
    better: "none",
    plot: false,
    meaning: "median distance from the other contenders' runs at the smallest timestep, at the run's end",
  },
  parting_time: {
    label: "Parting time",
    better: "high",
    plot: false,
    meaning: "median time up to which the other contenders' runs at the smallest timestep stay within 1 mm",
  },
  run_time: { label: "Run time", better: "low", plot: false, meaning: "processor time of the whole run's steps" },
  steps_per_second: {
    label: "Steps per second",
    better: "high",
    plot: false,
    meaning: "steps of the whole run over their processor time",
  },
  scaling_exponent: {
    label: "Scaling exponent",
    better: "low",
    plot: false,
    meaning: "power of the number of bodies with which the run time grows",
  },
  energy_drift_relative: {
    label: "Energy drift, relative",
    better: "low",
    plot: false,
    meaning: "energy drift divided by the initial kinetic energy",
  },
  angular_momentum_drift_relative: {
    label: "Angular momentum drift, relative",
    better: "low",
    plot: false,
    meaning: "angular momentum drift divided by the momentum's scale",
  },
  linear_momentum_drift_relative: {
    label: "Linear momentum drift, relative",
    better: "low",
    plot: false,
    meaning: "linear momentum drift divided by the momentum's scale",
  },
  raw_speed: { label: "Raw speed", better: "high", plot: false, meaning: "the engine's own step calls per second" },
  step_time: { label: "Step time", better: "low", plot: false, meaning: "time of one call of the engine's step" },
  realtime_factor: {
    label: "Realtime factor",
    better: "high",
    plot: false,
    meaning: "simulated seconds per second of computing: timestep divided by step time",
  },
  restart_floor: {
    label: "Restart floor",
    better: "none",
    plot: false,
    meaning: "the consistency error at the reference's own timestep: hidden state and rounding, not integration",
  },
  truth_floor: {
    label: "Truth floor",
    better: "none",
    plot: false,
    meaning: "the truth error that stays however small the timestep, far above rounding: not an integration error",
  },
  consistency_floor: {
    label: "Near the restart floor",
    better: "none",
    plot: false,
    meaning: "the restart floor, where the consistency error is so close to it that it says little of the timestep",
  },
  aa_ratio: {
    label: "A/A ratio",
    better: "none",
    plot: false,
    meaning: "step time of one contender measured under two names: how far from 1 is what the timing is worth",
  },
  time_ratio: {
    label: "Step time ratio",
    better: "none",
    plot: false,
    meaning: "step time over that of the contender which the campaign names as its measure",
  },
  truth_order: {
    label: "Observed order",
    better: "none",
    plot: false,
    meaning: "slope of the truth error between this timestep and the next smaller one",
  },
};

export function valueInfo(name: string): ValueInfo {
  const known = kValues[name];
  if (known) return known;
  const words = name.replace(/_/g, " ");
  return { label: words.charAt(0).toUpperCase() + words.slice(1), better: "none", plot: false, meaning: words };
}

export const kPlotNames = Object.keys(kValues).filter((name) => kValues[name]!.plot);

// What is known at one system, contender, timestep of one value: the number, or why there is none.
export interface Entry {
  value: Value | null;
  cell: Cell;
}

// The measure whose cells hold values of this name: where a cell failed, it holds none.
function measureOf(name: string): string {
  if (["raw_speed", "step_time", "realtime_factor", "aa_ratio", "time_ratio"].includes(name)) return "raw_speed";
  if (name.startsWith("truth")) return "truth";
  if (name === "restart_floor" || name === "consistency_floor") return "consistency";
  if (/^(joint_|limit_|penetration)/.test(name)) return "violation";
  if (/^(grasp_|drop_time|largest_stable|stable_up)/.test(name)) return "grasp";
  if (["run_time", "steps_per_second", "scaling_exponent"].includes(name)) return "scaling";
  if (name === "parting_time") return "agreement";
  return name.includes("_drift") || name === "damping_rate" ? "drift" : name;
}

export class Report {
  readonly contenderByName = new Map<string, Contender>();
  // The engine that does nothing: it measures the harness and is no contender.
  readonly harness: string[] = [];

  constructor(readonly json: ReportJson) {
    for (const contender of json.contenders) {
      this.contenderByName.set(contender.name, contender);
      if (contender.engine === "null") this.harness.push(contender.name);
    }
    // Cells of contenders that the database does not describe are shown all the same.
    for (const cell of json.cells) {
      if (!this.contenderByName.has(cell.contender)) {
        const contender: Contender = {
          name: cell.contender,
          engine: cell.contender.replace(/-.*/, ""),
          version: "",
          base: cell.contender,
          settings: "",
          capabilities: {},
          build: {},
        };
        json.contenders.push(contender);
        this.contenderByName.set(cell.contender, contender);
        if (contender.engine === "null") this.harness.push(contender.name);
      }
    }
    for (const cell of json.cells) {
      if (!json.systems.some((system) => system.name === cell.system)) {
        json.systems.push({ name: cell.system, facts: {} });
      }
    }
  }

  isHarness(contender: string): boolean {
    return this.harness.includes(contender);
  }

  // A contender's or an engine's name where the one that does nothing may appear among the others.
  title(name: string): string {
    return name === "null" || this.isHarness(name) ? `${name} (does nothing)` : name;
  }

  manifest(key: string): string | null {
    return this.json.manifest.find((entry) => entry.key === key)?.value ?? null;
  }

  // Contenders that are compared, in the campaign's order.
  get contenders(): Contender[] {
    return this.json.contenders.filter((contender) => !this.isHarness(contender.name));
  }

  private readonly views = new Map<string, SystemView>();

  view(system: string): SystemView {
    let view = this.views.get(system);
    if (!view) this.views.set(system, (view = new SystemView(this, system)));
    return view;
  }

  facts(system: string): Record<string, unknown> {
    return this.json.systems.find((candidate) => candidate.name === system)?.facts ?? {};
  }

  // Systems with a section of their own: those that are not merely a size of a family.
  get mainSystems(): System[] {
    const alone = new Set(this.json.cells.filter((cell) => cell.measure !== "scaling").map((cell) => cell.system));
    return this.json.systems.filter((system) => !system.facts["family"] || alone.has(system.name));
  }

  // Systems that differ in size, of which the time of a whole run was measured.
  get sizes(): System[] {
    const timed = new Set(this.json.cells.filter((cell) => cell.measure === "scaling").map((cell) => cell.system));
    return this.json.systems.filter((system) => system.facts["family"] && timed.has(system.name));
  }
}

export class SystemView {
  readonly cells: Cell[];
  readonly contenders: string[];
  private readonly at = new Map<string, Cell[]>(); // by contender and timestep

  constructor(
    readonly report: Report,
    readonly system: string,
  ) {
    this.cells = report.json.cells.filter((cell) => cell.system === system && !report.isHarness(cell.contender));
    for (const cell of this.cells) {
      const key = `${cell.contender} ${cell.timestep_ms}`;
      const list = this.at.get(key);
      if (list) list.push(cell);
      else this.at.set(key, [cell]);
    }
    const present = new Set(this.cells.map((cell) => cell.contender));
    this.contenders = report.contenders.map((contender) => contender.name).filter((name) => present.has(name));
  }

  // All cells of a contender at a timestep.
  cellsAt(contender: string, timestep: number): Cell[] {
    return this.at.get(`${contender} ${timestep}`) ?? [];
  }

  // Names of all values of the system's cells, known ones first and in the order of the list above.
  valueNames(): string[] {
    const present = new Set<string>();
    for (const cell of this.cells) for (const value of cell.values) present.add(value.name);
    const known = Object.keys(kValues).filter((name) => present.has(name));
    return [...known, ...[...present].filter((name) => !(name in kValues)).sort()];
  }

  // Names that can be the error axis: something measured, or something tried that failed everywhere.
  plotNames(): string[] {
    const present = new Set(this.valueNames());
    const measured = new Set([...present].map(measureOf));
    return kPlotNames.filter(
      (name) =>
        present.has(name) ||
        // What a measure would have told is not known where every run failed: its first value stands for all.
        (!measured.has(measureOf(name)) &&
          !/momentum|misalignment|^limit_|^penetration/.test(name) &&
          this.cells.some((cell) => cell.outcome !== "ok" && cell.measure === measureOf(name))),
    );
  }

  entry(contender: string, timestep: number, name: string): Entry | null {
    let failed: Cell | null = null;
    const measure = measureOf(name);
    for (const cell of this.at.get(`${contender} ${timestep}`) ?? []) {
      const value = cell.values.find((candidate) => candidate.name === name);
      if (value && value.value !== null) return { value, cell };
      if (cell.outcome !== "ok" && cell.measure === measure) failed = cell;
    }
    return failed ? { value: null, cell: failed } : null;
  }

  unit(name: string): string {
    for (const cell of this.cells) {
      const value = cell.values.find((candidate) => candidate.name === name);
      if (value) return value.unit;
    }
    return "";
  }

  private readonly steps = new Map<string, number[]>();

  // Timesteps that have an entry of this value, ascending.
  timesteps(name: string): number[] {
    let found = this.steps.get(name);
    if (!found) this.steps.set(name, (found = this.findTimesteps(name)));
    return found;
  }

  private findTimesteps(name: string): number[] {
    const measure = measureOf(name);
    const found = new Set<number>();
    for (const cell of this.cells) {
      if (cell.timestep_ms === null) continue;
      if (cell.values.some((value) => value.name === name) || (cell.outcome !== "ok" && cell.measure === measure)) {
        found.add(cell.timestep_ms);
      }
    }
    return [...found].sort((a, b) => a - b);
  }

  // Realtime factor at a timestep. Where it was not timed there, the step time is interpolated between the neighbours
  // that were (logarithmically in both), or is the nearest one's.
  realtimeFactor(contender: string, timestep: number): RealtimeFactor | null {
    let below: Value | null = null;
    let above: Value | null = null;
    let from = 0;
    let to = 0;
    for (const step of this.timesteps("realtime_factor")) {
      const value = this.entry(contender, step, "realtime_factor")?.value;
      if (!value || value.value === null || value.value <= 0) continue;
      if (step <= timestep) [below, from] = [value, step];
      if (step >= timestep && !above) [above, to] = [value, step];
    }
    const first = below ?? above;
    const second = above ?? below;
    if (!first || !second) return null;
    if (!below) from = to;
    if (!above) to = from;
    const weight = to === from ? 0 : Math.log(timestep / from) / Math.log(to / from);
    // The factor per timestep is the inverse of the step time.
    const blend = (a: number | null, b: number | null) =>
      a === null || b === null || a <= 0 || b <= 0 ? null : timestep * (a / from) ** (1 - weight) * (b / to) ** weight;
    const value = blend(first.value, second.value);
    if (value === null) return null;
    return {
      value,
      low: blend(first.low, second.low),
      high: blend(first.high, second.high),
      timedAt: from === to ? [from] : [from, to],
      estimated: from !== timestep || to !== timestep,
    };
  }

  // A value that a contender has once, not for every timestep: a floor.
  single(contender: string, name: string): number | null {
    for (const cell of this.cells) {
      if (cell.contender !== contender) continue;
      const value = cell.values.find((candidate) => candidate.name === name);
      if (value && value.value !== null) return value.value;
    }
    return null;
  }

  // Timesteps at which a value says something of integration. Against its own run the reference's timestep shows the
  // restart floor and nothing else.
  errorTimesteps(name: string): number[] {
    const steps = this.timesteps(name);
    if (name !== "consistency") return steps;
    const fact = this.report.json.systems.find((system) => system.name === this.system)?.facts["reference_ms"];
    const holder = this.cells.find((cell) => cell.values.some((value) => value.name === "restart_floor"));
    const reference = typeof fact === "number" ? fact : holder?.timestep_ms;
    return steps.filter((step) => step !== reference);
  }
}

export interface RealtimeFactor {
  value: number;
  low: number | null;
  high: number | null;
  timedAt: number[]; // ms
  estimated: boolean; // not timed at the timestep asked for
}

export function readReport(): Report {
  const text = document.getElementById("assay-data")?.textContent ?? "";
  return new Report(JSON.parse(text) as ReportJson);
}

let replays: Replay[] | null = null;

// They stand behind the page's script: only when the document has been read whole are they there.
export function replayOf(system: string): Replay | undefined {
  replays ??= JSON.parse(document.getElementById("assay-replays")?.textContent || "[]") as Replay[];
  return replays.find((candidate) => candidate.system === system);
}
