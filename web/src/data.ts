// The report's JSON as the C++ side writes it (src/report), and the page's index over it.
import type { Replay } from "./replay/decode";

export type Outcome = "ok" | "unstable" | "diverged" | "timeout" | "crashed" | "unsupported";

export interface Value {
  name: string;
  unit: string;
  value: number | null;
  low: number | null;
  high: number | null;
  bound?: boolean; // the value is an upper bound: near a floor
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

// As the JSON has it: without what was not stored, and without units that the catalogue has.
export type StoredValue = Pick<Value, "name" | "value"> & Partial<Value>;
export type StoredCell = Omit<Cell, "values"> & { values: StoredValue[] };

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
  image?: string | null; // a data URL, of what is more than capsules and spheres; none in older reports
  azimuth: number; // of the view that shows it best: degrees, 0 looks along x
  start: PictureShape[];
  end: { contender: string; time_s: number; shapes: PictureShape[] } | null;
  ground: number | null;
}

// Which contenders compute the same motion, and until when. The lists have an entry per pair (0, 1), (0, 2), ..., (1, 2), ...
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
  verdict: "holds" | "changed" | "not-settled" | "not-measurable";
  now?: string;
  threshold?: string;
  summary: string;
  reason: string;
  today: string;
  key?: string;
  figures: ClaimFigure[];
}

// `assay compare`, from results A to B.
export interface Changes {
  a: string;
  b: string;
  summary: string;
  threshold: number;
  level: number;
  control: string | null;
  common_ratio: number | null;
  gaps: string; // what keeps it from saying that nothing is worse, "" for nothing
  builds: string[];
  accepted: string[];
  coverage: string[];
  correction: string; // of p values
  only_a: number; // cells
  only_b: number;
  values_only_in_a: number;
  other_windows: ChangedCell[]; // not compared
  without_control: ChangedCell[];
  rows: ChangeRow[];
}

export interface ChangedCell {
  system: string;
  contender: string;
  timestep_ms: number;
  measure: string;
}

export interface ChangeRow extends ChangedCell {
  value: string;
  unit: string;
  a: number | null;
  b: number | null;
  outcome_a: string;
  outcome_b: string;
  ratio: number | null;
  low?: number | null; // of the ratio
  high?: number | null;
  change: "none" | "within" | "better" | "worse" | "other" | "unsettled";
  text: string; // "+5.1 % (+4.0 to +6.2)"
  p_rank?: number; // of times
  p?: number;
  samples?: [number, number];
  sample?: string; // what they are: "round"
  p_corrected?: number; // of times, and of accuracy over several initial states
}

// `assay history`.
export interface Courses {
  runs: { dir: string; started: string; commit: string }[];
  threshold: number;
  control: string | null;
  other_windows: number;
  without_control: number;
  too_short: number;
  courses: Course[];
}

export interface Course {
  system: string;
  contender: string;
  timestep_ms: number;
  measure: string;
  value: string;
  time: boolean;
  unit: string;
  points: { run: number; value: number | null; low: number; high: number; outcome: string }[];
  changes: { run: number; ratio: number | null; change: "better" | "worse" | "other"; text: string }[];
}

// A certificate of `assay parity`.
export interface ParityPart {
  error: number;
  noise: number;
}

export interface ParityJoint {
  element: string;
  [kind: string]: ParityPart | string;
}

export interface ParityLimit {
  joint: string;
  upper: boolean;
  expected: number;
  found: boolean;
  place: number | null;
}

export interface ParityCertificate {
  contender: string;
  engine: string;
  verdict: "same" | "differs" | "unexplained" | "not settled" | "not examined";
  error: number;
  noise: number;
  tolerance: number;
  unexplained: number;
  raised: string;
  beside: string; // the contender with which it was compared
  declared: string[];
  failure: string;
  joints: ParityJoint[];
  limits: ParityLimit[];
  causes: { element: string; parameter: string; seen: string; change: number; effect: number; explains: number; alike?: string[] }[];
}

export interface Parity {
  model: string;
  notes?: string[]; // what the model leaves out of its file
  samples: number;
  seed: number;
  hash: string; // of the model
  certificates: ParityCertificate[];
}

// Two files that `assay parity A B` has compared.
export interface ParityPair {
  a: { file: string; format: string; hash: string; joints: number; bodies: number; mass: number };
  b: { file: string; format: string; hash: string; joints: number; bodies: number; mass: number };
  verdict: "same" | "differs";
  joints_matched: number;
  matches: { kind: string; a: string; b: string; how: string; reversed: boolean }[];
  total_effect: number;
  findings: { element: string; what: string }[];
  differences: { element: string; parameter: string; unit: string; a: number | null; b: number | null; words: string; effect: number; share: number; felt: string }[];
  not_in_a_format: { element: string; what: string }[];
  notes: string[];
  motion: { contender: string; failure: string; distance: number; body: string; travelled: number; note: string };
}

// Many worlds of one contender (src/report/batches.h).
export interface BatchRow {
  contender: string;
  timestep_ms: number;
  worlds: number;
  device: string; // "cpu", "cuda:0"
  outcome: Outcome;
  reason: string;
  values: Record<string, { value: number | null; low: number | null; high: number | null }>;
}

// Many worlds at once; these cells are nowhere else in the JSON.
export interface Batches {
  system: string;
  devices: Record<string, string>; // names of devices
  rows: BatchRow[];
}

// Who transfers: contenders and timesteps under one policy (src/results/transfer_matrix.h).
export interface TransferMatrix {
  system: string;
  policy: string;
  trained_in: string | null;
  trained_ms: number | null;
  duration_s: number;
  pushes: string | null;
  many_times: number; // from which on a value is an excess
  told_apart: number; // the p-value up to which shares of falls differ
  answer: string[];
  rows: TransferRow[];
}

export interface TransferRow {
  contender: string;
  timestep_ms: number;
  outcome: Outcome;
  reason: string | null;
  runs: number;
  trained: boolean;
  verdict: "stays up" | "stays up, but worse" | "falls" | "not settled" | "no run";
  against_training: "falls more often" | "falls less often" | "not told apart" | null; // null: not compared
  falls_p: number | null;
  excesses: { value: string; times: number }[]; // values that are many times those of training
  excess: string | null; // the same in words
  values: Record<string, { value: number | null; unit: string; low: number | null; high: number | null }>;
  parting: {
    starts: number;
    parted: number;
    body: string | null;
    same_body: number;
    joint: string | null; // null: the free base itself
    same_joint: number;
    contact: number; // runs
    first_s: number | null;
    median_s: number | null;
    shown_s: number | null; // of the run that is kept
  };
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
  varies?: string; // the contender of which a sweep made this one by other settings; else its own name
  changes?: string[]; // in words: its settings that differ from the adapter's defaults
  capabilities: Record<string, unknown>;
  not_given?: string[]; // values that it cannot have, because its engine does not give what they are made of
  build: Record<string, unknown>;
}

export interface System {
  name: string;
  facts: Record<string, unknown>;
  section: boolean; // it has one of its own on the page
  size: boolean; // it is one of several that differ only in size, of which the time of a whole run was measured
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

// A sentence, with what it is about in front; "" for nothing.
export interface AnswerLine {
  label: string;
  text: string;
}

// A part of an answer (src/results/answer.h); columns in `right` hold numbers.
export interface AnswerPart {
  heading: string;
  evidence: boolean; // what the answer rests on; else it is part of the answer itself
  lines: AnswerLine[];
  columns: string[];
  rows: string[][];
  right: number[];
}

export interface ReportJson {
  format: number;
  manifest: { key: string; value: string }[];
  systems: System[]; // in the page's order
  contenders: Contender[];
  measured: { cells: number; ok: number; contenders: string[] }; // without the harness
  conformance: GateResult[];
  pictures?: Picture[];
  agreement?: Agreement[];
  claims?: Claim[];
  parity?: (Parity | ParityPair)[];
  transfer?: TransferMatrix[];
  batches?: Batches[];
  changes?: Changes;
  history?: Courses;
  catalogue?: ValueInfo[];
  units?: Record<string, Unit[]>;
  looks?: Record<string, LookJson>;
  glossary?: { term: string; meaning: string }[];
  answer?: AnswerPart[]; // of `assay run ROBOT`
  phrases?: Record<string, string>; // an answer's sentences, with places in braces for what depends on its limits
  views?: ViewJson[];
  match?: Match; // then the page is of measured motion, and shows nothing else
}

// `assay match` (src/report/match_page.cc): figures of an error by what was measured, "joints_deg", "position_percent",
// "rotation_deg".
export type ErrorFigures = Record<string, number>;

export interface Interval {
  value: number;
  low: number;
  high: number;
}

export interface MatchedParameter {
  name: string;
  unit: string;
  status: "fitted" | "at its bound" | "not identified";
  value: number;
  low: number | null;
  high: number | null;
  model: number;
  with: string; // the combination of which it is
}

export interface MatchedContender {
  contender: string;
  failure: string | null;
  warnings: string[];
  // of one without a failure
  score?: Interval;
  untuned_score?: Interval;
  worse_than_untuned?: boolean;
  floor_score?: number;
  as_good_as_best?: boolean;
  behind_best?: Interval | null;
  held_out?: ErrorFigures;
  untuned?: ErrorFigures;
  floor?: ErrorFigures;
  parameters?: MatchedParameter[];
  not_identified?: { members: string[]; relative_interval: number; frozen: string; as_found?: boolean }[];
  phases?: (Record<string, number | string> & { phase: string })[];
  timesteps?: { timestep_ms: number; held_out: ErrorFigures; windows: number; failed: number }[];
}

// Errors of all held-out logs, in the order of Match.held_out; null where a log has none.
export interface LogErrors {
  contender: string;
  fitted?: Record<string, (number | null)[]>;
  untuned?: Record<string, (number | null)[]>;
}

export interface MotionRun {
  contender: string; // "measured" for what was measured
  fitted: boolean;
  ended: string; // why it ended early
  values: (number | null)[][]; // of each quantity, a body's x, y, z, qw, qx, qy, qz, by sample; rad, m
}

export interface MotionLog {
  log: string;
  roles: ("worst" | "median" | "separating")[];
  time_s: number[];
  windows: { first: number; start_s: number; scored: boolean }[];
  first_impact_s: number | null;
  quantities: { name: string; kind: "hinge" | "slide" | "body" }[];
  runs: MotionRun[]; // the measured one first
}

export interface LogFinding {
  severity: "wrong" | "warning" | "remark";
  kind: string;
  log: string | null;
  quantity: string | null;
  message: string;
  fix: string | null;
}

export interface Match {
  model: string;
  like?: string; // the contender that moved in place of a robot
  timestep_ms: number;
  windows: "whole motions" | { fit_s: number; report_s: number };
  held_out_by: string;
  training: string[];
  held_out: string[];
  answer: string;
  to_do: string[];
  contenders: MatchedContender[]; // best first, those without a fit last
  unpredictable: string[];
  odd_names?: string[];
  warnings: string[];
  logs: LogErrors[];
  findings: LogFinding[];
  motion?: MotionLog[];
}

// What a value is called and means. The catalogue's order is the order of display.
export interface ValueInfo {
  name: string;
  unit: string;
  label: string; // in headings and on axes
  short: string; // in running text
  better: "low" | "high" | "none";
  measure: string; // its cells hold the value
  plot: boolean; // can be the error axis of the plot
  limit: boolean; // can be limited in the picker
  meaning: string;
}

export interface Unit {
  text: string;
  scale: number;
}

// How a contender is drawn.
export interface LookJson {
  family: string;
  light: string;
  dark: string;
  dash: string;
  mark: string;
  first: boolean; // shown when the report opens
}

export interface Speed {
  value: number;
  low: number;
  high: number;
  timed: boolean;
  between: [number, number] | null; // ms; the timed steps around one that was not timed
}

// A limit of contacts that a question has unless it says otherwise.
export interface UsualLimit {
  option: string;
  value: string;
  largest: number;
}

export interface ViewPoint {
  contender: string;
  timestep_ms: number;
  speed: Speed | null; // null: outside what was timed
  sound: boolean;
  why: string; // what failed at this or a smaller timestep
  worst?: Record<string, Worst>; // of a sound point, by value: the largest at this or any smaller timestep
}

export interface Worst {
  value: number;
  high?: number; // upper end of its interval, if it is another number
  text: string; // "4.34 mm"
  line?: string; // with its interval and where it is from, if that is more
}

// A sound point with a speed; `point` is its place among the view's points. Texts are the program's.
export interface Candidate {
  point: number;
  realtime: string;
  speed: string;
  note?: string; // what to know about the speed
  held?: string; // from how many initial states an object was held
  margin: string;
}

// Timesteps of a contender that are no candidates for one reason.
export interface LeftOut {
  contender: string;
  steps: number[];
  when: string;
  why: string;
}

export interface Answer {
  id: string;
  question: string;
  text: string;
  figures: string; // of the contender; the whole text where no contender answers
  contender: string | null;
  timestep_ms: number | null;
  limits?: Record<string, number>;
  realtime?: number | null;
}

// What follows from the cells of one system, as the program computed it.
export interface ViewJson {
  system: string;
  main: string | null; // the value that plot and card begin with
  values: string[];
  errors: string[];
  points: ViewPoint[];
  fronts: Record<string, { point: number; equals: string[] }[]>;
  swept?: Record<string, Record<string, number[]>>; // by value, then contender whose settings were varied: its front's points, the fastest first
  candidates: Candidate[];
  left_out: LeftOut[]; // whatever the limits
  columns: { most: number; besides: string[] }; // how many limited values a table shows, and which others besides
  accuracy: { limited: string[]; open: string }; // a limit of one of the first leaves the last one open
  usual: UsualLimit[]; // what every question limits that does not do without
  overlap?: string; // that the model overlaps itself where it starts; "" where it does not, none in older reports
  stand_ins: Record<string, string>; // of values that stand for others, which these results lack: what they are
  card: { answers: Answer[]; caveat: string };
}

// What is known at one system, contender, timestep of one value: the number, or why there is none.
export interface Entry {
  value: Value | null;
  cell: Cell;
}

const kNoView: Omit<ViewJson, "system"> = { main: null, values: [], errors: [], points: [], fronts: {}, candidates: [], left_out: [], columns: { most: 0, besides: [] }, accuracy: { limited: [], open: "" }, usual: [], stand_ins: {}, card: { answers: [], caveat: "" } }; // prettier-ignore

const catalogue = new Map<string, ValueInfo>();

// Of the page's report; a name that it does not know stands for itself.
export function valueInfo(name: string): ValueInfo {
  const known = catalogue.get(name);
  if (known) return known;
  const words = name.replace(/_/g, " ");
  const label = words.charAt(0).toUpperCase() + words.slice(1);
  return { name, unit: "", label, short: words, better: "none", measure: "", plot: false, limit: false, meaning: words };
}

export class Report {
  readonly contenderByName = new Map<string, Contender>();
  // The engine that does nothing: it measures the harness and is no contender.
  readonly harness: string[] = [];

  constructor(readonly json: ReportJson) {
    for (const info of json.catalogue ?? []) catalogue.set(info.name, info);
    // errors of pieces come last, with the pieces' lengths in the order of text
    const pieces = (name: string) => Number(/_(\d+)ms$/.exec(name)?.[1] ?? 0);
    for (const view of json.views ?? []) view.errors.sort((a, b) => pieces(a) - pieces(b));
    for (const contender of json.contenders) {
      this.contenderByName.set(contender.name, contender);
      if (contender.engine === "null") this.harness.push(contender.name);
    }
  }

  private readonly known = new Map<string, Cell[]>();

  // Of one system. They stand in elements of their own, so that the page can draw its first section before it has read all
  // others.
  cellsOf(system: string): Cell[] {
    let cells = this.known.get(system);
    if (cells) return cells;
    const index = this.json.systems.findIndex((candidate) => candidate.name === system);
    const element = document.querySelector(`script[data-cells="${index}"]`);
    if (!element && document.readyState === "loading") return [];
    const stored = JSON.parse(element?.textContent || "[]") as StoredCell[];
    cells = stored.map((cell) => ({
      ...cell,
      values: cell.values.map((value) => ({ low: null, high: null, ...value, unit: value.unit ?? valueInfo(value.name).unit })),
    }));
    this.known.set(system, cells);
    return cells;
  }

  // Whether the cells of a system have been read; those below the first section stand behind the page's script.
  isRead(system: string): boolean {
    return this.known.has(system);
  }

  // Of all systems.
  get cells(): Cell[] {
    return this.json.systems.flatMap((system) => this.cellsOf(system.name));
  }

  // The contender that this one is a setting of: its own name, unless a sweep made it. These share a line and a look.
  varied(contender: string): string {
    return this.contenderByName.get(contender)?.varies || contender;
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
    return this.json.systems.filter((system) => system.section);
  }

  get answered(): SystemView[] {
    return this.mainSystems.map((system) => this.view(system.name)).filter((view) => view.json.card.answers.length > 0);
  }

  // Systems that differ in size, of which the time of a whole run was measured.
  get sizes(): System[] {
    return this.json.systems.filter((system) => system.size);
  }
}

export class SystemView {
  readonly json: ViewJson;
  private readonly pointAt = new Map<string, ViewPoint>();
  private indexed: { cells: Cell[]; at: Map<string, Cell[]>; contenders: string[] } | null = null;

  constructor(
    readonly report: Report,
    readonly system: string,
  ) {
    this.json = report.json.views?.find((view) => view.system === system) ?? { ...kNoView, system };
    for (const point of this.json.points) this.pointAt.set(`${point.contender} ${point.timestep_ms}`, point);
  }

  // Made when it is asked for: most sections are drawn long after the page is there.
  private get index() {
    if (this.indexed) return this.indexed;
    const cells = this.report.cellsOf(this.system).filter((cell) => !this.report.isHarness(cell.contender));
    const at = new Map<string, Cell[]>(); // by contender and timestep
    for (const cell of cells) {
      const key = `${cell.contender} ${cell.timestep_ms}`;
      const list = at.get(key);
      if (list) list.push(cell);
      else at.set(key, [cell]);
    }
    const present = new Set(cells.map((cell) => cell.contender));
    const contenders = this.report.contenders.map((contender) => contender.name).filter((name) => present.has(name));
    const index = { cells, at, contenders };
    if (this.report.isRead(this.system)) this.indexed = index;
    return index;
  }

  get cells(): Cell[] {
    return this.index.cells;
  }

  get contenders(): string[] {
    return this.index.contenders;
  }

  // What has a line of its own: a contender, or all settings of one that were swept.
  get lines(): string[] {
    return [...new Set(this.contenders.map((name) => this.report.varied(name)))];
  }

  // The contenders of a line; several where its settings were swept.
  settingsOf(line: string): string[] {
    return this.contenders.filter((name) => this.report.varied(name) === line);
  }

  // The one that stands for a line where there is room for one: with the settings that were not varied, if it took part.
  standIn(line: string): string {
    return this.contenders.includes(line) ? line : (this.settingsOf(line)[0] ?? line);
  }

  // All cells of a contender at a timestep.
  cellsAt(contender: string, timestep: number): Cell[] {
    return this.index.at.get(`${contender} ${timestep}`) ?? [];
  }

  point(contender: string, timestep: number): ViewPoint | undefined {
    return this.pointAt.get(`${contender} ${timestep}`);
  }

  speed(contender: string, timestep: number): Speed | null {
    return this.point(contender, timestep)?.speed ?? null;
  }

  get isTimed(): boolean {
    return this.json.points.some((point) => point.speed !== null);
  }

  // The smallest timestep of a contender that is not sound, and why.
  firstFailure(contender: string): ViewPoint | null {
    const failed = this.json.points.filter((point) => point.contender === contender && !point.sound);
    return failed.reduce<ViewPoint | null>((least, point) => (!least || point.timestep_ms < least.timestep_ms ? point : least), null);
  }

  entry(contender: string, timestep: number, name: string): Entry | null {
    let failed: Cell | null = null;
    const { measure } = valueInfo(name);
    for (const cell of this.index.at.get(`${contender} ${timestep}`) ?? []) {
      const value = cell.values.find((candidate) => candidate.name === name);
      if (value && value.value !== null) return { value, cell };
      if (cell.outcome !== "ok" && cell.measure === measure) failed = cell;
    }
    return failed ? { value: null, cell: failed } : null;
  }

  unit(name: string): string {
    return valueInfo(name).unit;
  }

  private readonly steps = new Map<string, number[]>();

  // Timesteps that have an entry of this value, ascending.
  timesteps(name: string): number[] {
    let found = this.steps.get(name);
    if (!found) this.steps.set(name, (found = this.findTimesteps(name)));
    return found;
  }

  private findTimesteps(name: string): number[] {
    const { measure } = valueInfo(name);
    const found = new Set<number>();
    for (const cell of this.cells) {
      if (cell.timestep_ms === null) continue;
      if (cell.values.some((value) => value.name === name) || (cell.outcome !== "ok" && cell.measure === measure)) {
        found.add(cell.timestep_ms);
      }
    }
    return [...found].sort((a, b) => a - b);
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

  // Timesteps at which a value is an error of integration for some contender; at a reference's own timestep it is a restart
  // floor.
  errorTimesteps(name: string): number[] {
    const steps = this.timesteps(name);
    if (!name.startsWith("consistency")) return steps;
    const own = this.cells.filter((cell) => cell.values.some((value) => value.name === name));
    return steps.filter((step) => own.some((cell) => cell.timestep_ms === step && !isReference(cell)));
  }
}

// A cell in which a fine-step run was compared with itself.
export function isReference(cell: Cell): boolean {
  return cell.values.some((value) => value.name === "restart_floor");
}

export function readReport(): Report {
  const text = document.getElementById("assay-data")?.textContent ?? "";
  return new Report(JSON.parse(text) as ReportJson);
}

let replays: Replay[] | null = null;

export function replayAt(index: number): Replay | undefined {
  return replays?.[index];
}

// They stand behind the page's script: only when the document has been read whole are they there.
export function replayOf(system: string): Replay | undefined {
  if (!replays && document.readyState === "loading") return undefined;
  replays ??= JSON.parse(document.getElementById("assay-replays")?.textContent || "[]") as Replay[];
  return replays.find((candidate) => candidate.system === system);
}
