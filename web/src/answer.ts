// The answer to a question within limits, as `assay recommend` gives it (src/results/recommend.h, answer.h): the
// program's figures are compared with the limits, and its sentences filled. tests/answers/cases.json holds both to the
// same words.
import { valueInfo, type AnswerLine, type AnswerPart, type Candidate, type LeftOut, type Speed, type SystemView, type ViewPoint, type Worst } from "./data";
import { realtime, timestep } from "./format";

export interface Asked {
  name: string;
  largest: number;
  text: string; // as the reader typed it
  usual?: boolean; // it is the one that questions have by default
}

export interface Limits {
  asked: Asked[];
  realtime: number | null;
}

export interface Pick {
  candidate: Candidate;
  point: ViewPoint;
  speed: Speed;
  worst: Record<string, Worst>;
}

export interface Picked {
  passing: Pick[]; // each contender's first candidate within the limits, in the list's order
  alike: Pick[]; // of those, what no measurement tells from the first
  certain: Pick | null; // the first whose intervals are within the limits as a whole
  relaxed: Relaxation[]; // where nothing is within the limits: by limit, as asked, the least that it has to give way alone
  beyond: Pick[]; // of each other contender the candidate that misses a limit by the least factor, the least first
}

// A limit that would let the question have an answer, all others as they are.
export interface Relaxation {
  name: string | null; // null: the least realtime factor
  to: number;
  text: string;
  one: Pick;
}

// A number of three digits in a unit.
interface Written {
  number: number;
  scale: number;
  text: string;
}

// In the largest unit in which it is at least 1. `up`: -1 rounds down, 1 up, 0 to the nearest.
function written(value: number, units: { text: string; scale: number }[], up: number): Written {
  const sorted = [...units].sort((a, b) => b.scale - a.scale);
  const { text, scale } = sorted.find((unit) => unit.text !== "cm" && unit.scale <= value * (1 + 1e-9)) ?? sorted[sorted.length - 1] ?? { text: "", scale: 1 };
  const [mantissa = "1.00", exponent = "+0"] = (value / scale).toExponential(2).split("e");
  let number = Number(`${mantissa}e${exponent}`);
  if ((up > 0 && exceeds(value, number * scale)) || (up < 0 && number * scale > value)) {
    const hundredths = Math.round(Number(mantissa) * 100) + up;
    number = hundredths < 100 ? Number(`9.99e${Number(exponent) - 1}`) : Number(`${(hundredths / 100).toFixed(2)}e${exponent}`);
  }
  return { number, scale, text: shortest(number) + (text ? ` ${text}` : "") };
}

// As C++ writes a number with as few digits as tell it from others.
function shortest(number: number): string {
  if (Math.abs(number) >= 1e-4 && Math.abs(number) < 1e16) return String(number);
  return number.toExponential().replace(/e([+-])(\d)$/, "e$10$2");
}

function unitsOf(view: SystemView, name: string): { text: string; scale: number }[] {
  const base = valueInfo(name).unit;
  return view.report.json.units?.[base] ?? [{ text: base === "1" ? "" : base, scale: 1 }];
}

// A limit as a reader would type it, with three digits.
export function limitText(view: SystemView, name: string, largest: number): string {
  return written(largest, unitsOf(view, name), 0).text;
}

export function isUsual(view: SystemView, name: string, largest: number): boolean {
  return view.json.usual.some((one) => one.value === name && Math.abs(one.largest - largest) <= 1e-9 * largest);
}

function picksOf(view: SystemView): Pick[] {
  return view.json.candidates.flatMap((candidate) => {
    const point = view.json.points[candidate.point];
    return point?.speed ? [{ candidate, point, speed: point.speed, worst: point.worst ?? {} }] : [];
  });
}

// Beyond what a limit in other units can lose by rounding.
export function exceeds(figure: number, limit: number): boolean {
  return figure > limit * (1 + 1e-12);
}

// 0 for a candidate within all limits, else the largest factor by which it misses one; null when a limited value was not
// measured there. With `whole` the far ends of the intervals count.
function excess(one: Pick, limits: Limits, whole: boolean): number | null {
  let most = 0;
  for (const { name, largest } of limits.asked) {
    const worst = one.worst[name];
    if (!worst) return null;
    const error = whole ? (worst.high ?? worst.value) : worst.value;
    if (exceeds(error, largest)) most = Math.max(most, error / largest);
  }
  const speed = whole ? one.speed.low : one.speed.value;
  if (limits.realtime !== null && speed < limits.realtime) most = Math.max(most, limits.realtime / speed);
  return most;
}

// Each limit in turn: the least that some candidate within all others has of it.
function relaxations(view: SystemView, limits: Limits): Relaxation[] {
  const found: Relaxation[] = [];
  const picks = picksOf(view);
  for (const { name } of limits.asked) {
    const others = { ...limits, asked: limits.asked.filter((asked) => asked.name !== name) };
    const within = picks.filter((one) => one.worst[name] && excess(one, others, false) === 0);
    if (within.length === 0) continue;
    const least = written(Math.min(...within.map((one) => one.worst[name]!.value)), unitsOf(view, name), 1);
    const to = least.number * least.scale;
    const fastest = within.find((one) => !exceeds(one.worst[name]!.value, to));
    if (fastest) found.push({ name, to, text: least.text, one: fastest });
  }
  if (limits.realtime !== null) {
    const fastest = picks.find((one) => excess(one, { ...limits, realtime: null }, false) === 0);
    if (fastest) {
      const { number, text } = written(fastest.speed.value, [{ text: "", scale: 1 }], -1);
      found.push({ name: null, to: number, text, one: fastest });
    }
  }
  return found;
}

export function relaxedLimits(limits: Limits, by: Relaxation): Limits {
  if (by.name === null) return { ...limits, realtime: by.to };
  return { ...limits, asked: limits.asked.map((asked) => (asked.name === by.name ? { ...asked, largest: by.to, text: by.text } : asked)) };
}

// What bounds a pick's place among its contender's timesteps (src/results/recommend.h).
type End = "none" | "tried" | "timed" | "measured" | "between";
interface Edge {
  larger: End;
  smaller: End;
  between: number[]; // ms
}

// "none" where the point tells that nothing better lies there; else what it lacks for that.
function unknownAt(point: ViewPoint, limits: Limits): End {
  if (!point.sound) return "none";
  const worst = point.worst ?? {};
  if (limits.asked.some(({ name, largest }) => worst[name] && exceeds(worst[name].value, largest))) return "none";
  if (!point.speed) return "timed";
  return Object.keys(worst).length > 0 && limits.asked.every(({ name }) => worst[name]) ? "none" : "measured";
}

function edgeOf(view: SystemView, one: Pick, limits: Limits): Edge {
  const points = view.json.points.filter((point) => point.contender === one.point.contender);
  const own = points.indexOf(one.point);
  const edge: Edge = { larger: own + 1 === points.length ? "tried" : "none", smaller: own === 0 ? "tried" : "none", between: [] };
  for (const point of points.slice(own + 1)) {
    const unknown = unknownAt(point, limits);
    if (unknown === "none") {
      if (edge.larger !== "none") edge.larger = "between";
      break;
    }
    if (edge.larger === "none") edge.larger = unknown;
    edge.between.push(point.timestep_ms);
  }
  for (const point of points.slice(0, own).reverse()) {
    const unknown = unknownAt(point, limits);
    if (unknown === "none") {
      edge.smaller = "none";
      break;
    }
    if (edge.smaller === "none") edge.smaller = unknown;
  }
  return edge;
}

export function pick(view: SystemView, limits: Limits): Picked {
  const passing: Pick[] = [];
  let certain: Pick | null = null;
  const seen = new Set<string>();
  const missing = new Map<string, { by: number; one: Pick }>();
  for (const one of picksOf(view)) {
    const line = view.report.varied(one.point.contender);
    const by = excess(one, limits, false);
    if (by === null) continue;
    if (by > 0) {
      if (by < (missing.get(line)?.by ?? Infinity)) missing.set(line, { by, one });
      continue;
    }
    if (!certain && excess(one, limits, true) === 0) certain = one;
    if (seen.has(line)) continue;
    seen.add(line);
    passing.push(one);
  }
  const best = passing[0];
  const order = view.json.candidates;
  const beyond = [...missing].filter(([line]) => !seen.has(line)).map(([, miss]) => miss);
  beyond.sort((a, b) => a.by - b.by || order.indexOf(a.one.candidate) - order.indexOf(b.one.candidate));
  const relaxed = best ? [] : relaxations(view, limits);
  return { passing, relaxed, alike: best ? passing.slice(1).filter((one) => one.speed.high >= best.speed.low) : [], certain, beyond: beyond.map((miss) => miss.one) };
}

// As C++ writes {:.3g}.
function general(value: number): string {
  const [mantissa = "", exponent = ""] = value.toExponential(2).split("e");
  const power = Number(exponent);
  if (power >= -4 && power < 3) return String(Number(value.toPrecision(3)));
  return `${Number(mantissa)}e${power < 0 ? "-" : "+"}${String(Math.abs(power)).padStart(2, "0")}`;
}

const kHere = "\u0000"; // stands for pieces of a sentence while it is filled
const brief = (name: string) => valueInfo(name).short;
const placeOf = (point: ViewPoint) => `${point.contender} at ${timestep(point.timestep_ms)} ms`;

// The words of one answer.
export class Words {
  readonly found: Picked;

  constructor(
    private readonly view: SystemView,
    private readonly limits: Limits,
  ) {
    this.found = pick(view, limits);
  }

  say(name: string, words: Record<string, string> = {}): string {
    return (this.view.report.json.phrases?.[name] ?? name).replace(/\{(\w+)\}/g, (_, key: string) => words[key] ?? "");
  }

  private limitsText(): string {
    const parts = this.limits.asked.map(({ name, text, usual }) => this.say(usual ? "within_usual" : "within", { value: brief(name), limit: text }));
    if (this.limits.realtime !== null) parts.push(this.say("at_least", { realtime: realtime(this.limits.realtime) }));
    return parts.join(", ");
  }

  private edge(one: Pick, limits = this.limits): string {
    const { larger, smaller, between } = edgeOf(this.view, one, limits);
    if (larger === "tried" && smaller === "tried") return this.say("only_tried");
    const most = larger === "none" ? "" : this.say(larger === "between" ? "between" : `largest_${larger}`, { steps: between.map(timestep).join(", ") });
    const least = smaller === "none" ? "" : this.say(`smallest_${smaller}`);
    return most && least ? this.say("edges", { larger: most, smaller: least }) : most + least;
  }

  // A pick that is named as an answer.
  private answering(one: Pick, limits = this.limits): string {
    const edge = this.edge(one, limits);
    return this.say(edge ? "answer_at_edge" : "answer", { place: placeOf(one.point), realtime: one.candidate.realtime, edge });
  }

  private mark(one: Pick): string {
    const { larger, smaller } = edgeOf(this.view, one, this.limits);
    if (larger !== "none") return smaller !== "none" ? " ±" : " +";
    return smaller !== "none" ? " -" : "";
  }

  private markLines(some: Pick[]): AnswerLine[] {
    const edges = some.map((one) => edgeOf(this.view, one, this.limits));
    const lines: AnswerLine[] = [];
    if (edges.some(({ larger }) => larger !== "none")) lines.push({ label: "", text: this.say("larger_mark") });
    if (edges.some(({ smaller }) => smaller !== "none")) lines.push({ label: "", text: this.say("smaller_mark") });
    return lines;
  }

  // What stands for limited values that the results lack.
  grounds(): string[] {
    return this.limits.asked.flatMap(({ name }) => this.view.json.stand_ins[name] ?? []);
  }

  // Where its contender first exceeds a limit at a larger timestep, before what the program says of it.
  margin(one: Pick): string {
    let first: { point: ViewPoint; name: string; worst: Worst } | null = null;
    for (const { point, worst } of picksOf(this.view)) {
      if (point.contender !== one.point.contender || point.timestep_ms <= one.point.timestep_ms) continue;
      if (first && point.timestep_ms >= first.point.timestep_ms) continue;
      const over = this.limits.asked.find(({ name, largest }) => worst[name] && exceeds(worst[name].value, largest));
      if (over) first = { point, name: over.name, worst: worst[over.name]! };
    }
    if (!first) return one.candidate.margin;
    const factor = Math.round((100 * first.point.timestep_ms) / one.point.timestep_ms) / 100;
    return this.say("exceeds", { value: brief(first.name), figure: first.worst.text, factor: String(factor), step: timestep(first.point.timestep_ms), margin: one.candidate.margin });
  }

  // Values that the table of contenders shows.
  columns(): string[] {
    const { most, besides } = this.view.json.columns;
    const limited = this.limits.asked.slice(0, most).map(({ name }) => name);
    return limited.length > 0 ? [...limited, ...besides.filter((name) => !limited.includes(name))] : [];
  }

  // The best and its facts, then each contender's fastest.
  parts(): AnswerPart[] {
    const { passing, alike, certain } = this.found;
    const best = passing[0];
    if (!best) return [];
    const { point, candidate, worst } = best;
    const lines: AnswerLine[] = [];
    const line = (label: string, text: string) => lines.push({ label, text });
    line(this.say("asked"), this.limitsText());
    const changes = this.view.report.contenderByName.get(point.contender)?.changes ?? [];
    if (changes.length === 0) line(this.say("settings"), this.say("defaults"));
    for (const change of changes) line(this.say("setting"), change);
    line(this.say("speed"), candidate.speed);
    if (candidate.note) line("", candidate.note);
    for (const { name } of this.limits.asked) line(brief(name), worst[name]!.line ?? worst[name]!.text);
    if (candidate.held) line(this.say("grasp"), candidate.held);
    line(this.say("margin"), this.margin(best));
    if (alike.length > 0) line(this.say("alike"), alike.map((one) => placeOf(one.point)).join(", "));
    if (certain !== best) {
      const whole = certain ? this.say("whole", { answer: this.answering(certain) }) : this.say("no_whole");
      line("", this.say("reaches", { whole }));
    }
    const { limited, open } = this.view.json.accuracy;
    const names = this.limits.asked.map(({ name }) => name);
    const isOpen = names[0] !== undefined && limited.includes(names[0]) && !names.some((name) => valueInfo(name).measure === valueInfo(open).measure);
    if (isOpen && worst[open]) line(this.say("not_accuracy"), this.say("accuracy", { error: worst[open].text }));
    const heading = this.say("best", { system: this.view.system, answer: this.answering(best) });
    const columns = [this.say("contender"), this.say("timestep"), this.say("realtime"), ...this.columns().map(brief)];
    const rows = passing.map((one) => this.row(one));
    const estimates = passing.some((one) => !one.speed.timed) ? [{ label: "", text: this.say("estimates") }] : [];
    const right = columns.map((_, index) => index).slice(1);
    return [
      { heading, evidence: false, lines, columns: [], rows: [], right: [] },
      { heading: this.say("each"), evidence: false, lines: [...estimates, ...this.markLines(passing)], columns, rows, right },
    ];
  }

  row(one: Pick): string[] {
    const speed = one.speed.timed ? one.candidate.realtime : this.say("estimated", { realtime: one.candidate.realtime });
    return [one.point.contender, `${timestep(one.point.timestep_ms)} ms${this.mark(one)}`, speed, ...this.columns().map((name) => one.worst[name]?.text ?? "")];
  }

  private missed(worst: Record<string, Worst>, speed: { value: number; text: string } | null): string {
    const parts: string[] = [];
    for (const { name, largest } of this.limits.asked) {
      const own = worst[name];
      if (!own) continue;
      const factor = own.value / largest;
      const over = exceeds(own.value, largest) && Number.isFinite(factor) ? this.say("over", { factor: general(factor) }) : "";
      parts.push(this.say("figure", { value: brief(name), figure: own.text }) + over);
    }
    const least = this.limits.realtime;
    if (least !== null && speed) {
      const under = speed.value < least ? this.say("under", { factor: general(speed.value / least) }) : "";
      parts.push(this.say("times_realtime", { realtime: speed.text }) + under);
    }
    return parts.join("; ");
  }

  // Where nothing is within the limits: what to relax, else what misses them by the least, or was begun. In pieces, of
  // which those with a relaxation are what a reader may choose.
  nonePieces(): { text: string; relax?: Relaxation }[] {
    const pieces = this.relaxedPieces() ?? [{ text: this.nearest() }];
    const [before = "", after = ""] = this.say("none", { system: this.view.system, limits: this.limitsText(), nearest: kHere }).split(kHere);
    return [{ text: before }, ...pieces, { text: after }];
  }

  private relaxedPieces(): { text: string; relax?: Relaxation }[] | null {
    const { relaxed } = this.found;
    if (relaxed.length === 0) return null;
    const pieces: { text: string; relax?: Relaxation }[] = [];
    const unmoved: string[] = [];
    const add = (name: string | null, named: string) => {
      const own = relaxed.find((one) => one.name === name);
      if (!own) return unmoved.push(named);
      if (pieces.length > 0) pieces.push({ text: this.say("or") });
      const relax = name === null ? this.say("relax_speed", { realtime: realtime(own.to) }) : this.say("relax", { value: named, limit: own.text });
      return pieces.push({ text: this.say("relaxed", { relax, answer: this.answering(own.one, relaxedLimits(this.limits, own)) }), relax: own });
    };
    for (const { name } of this.limits.asked) add(name, brief(name));
    if (this.limits.realtime !== null) add(null, this.say("the_speed"));
    if (unmoved.length > 0) pieces.push({ text: this.say("not_alone", { values: unmoved.join(this.say("or_value")) }) });
    return pieces;
  }

  private nearest(): string {
    const first = this.found.beyond[0];
    if (first) {
      const edge = this.edge(first);
      const place = edge ? this.say("place_at_edge", { place: placeOf(first.point), edge }) : placeOf(first.point);
      const nearest = this.say("nearest", { place, values: this.missed(first.worst, { value: first.speed.value, text: first.candidate.realtime }) });
      return this.say("none_alone", { nearest });
    }
    const names = this.limits.asked.map(({ name }) => name);
    let nearest: { point: ViewPoint; missing: string[]; by: number } | null = null;
    for (const point of this.view.json.points) {
      const worst = point.worst ?? {};
      const missing = names.filter((name) => !worst[name]);
      const by = this.limits.asked.reduce((most, { name, largest }) => Math.max(most, (worst[name]?.value ?? 0) / largest), 0);
      if (!point.sound || missing.length === names.length) continue;
      if (nearest && (missing.length - nearest.missing.length || by - nearest.by) >= 0) continue;
      nearest = { point, missing, by };
    }
    if (!nearest) return this.say("nothing");
    const { point } = nearest;
    const unknown = nearest.missing.map(brief);
    if (!point.speed) unknown.push(this.say("unmeasured_speed"));
    const speed = point.speed && { value: point.speed.value, text: realtime(point.speed.value) };
    const text = this.say("nearest", { place: placeOf(point), values: this.missed(point.worst ?? {}, speed) });
    return unknown.length > 0 ? text + this.say("begun", { values: unknown.join(", ") }) : text;
  }

  // What is no candidate, lacks a limited value, or is beyond the limits; by contender.
  leftOut(): LeftOut[] {
    const groups = this.view.json.left_out.map((group) => ({ ...group }));
    const add = ({ contender, timestep_ms }: ViewPoint, why: string) => {
      const same = groups.find((group) => group.contender === contender && group.why === why);
      const steps = [...(same?.steps ?? []), timestep_ms].sort((a, b) => a - b);
      const made = { contender, steps, when: this.say("at", { steps: steps.map(timestep).join(", ") }), why };
      if (same) Object.assign(same, made);
      else groups.push(made);
    };
    for (const one of picksOf(this.view)) {
      for (const { name } of this.limits.asked) if (!one.worst[name]) add(one.point, this.say("unmeasured", { value: brief(name) }));
    }
    for (const one of this.found.beyond) {
      const values = this.limits.asked.map(({ name }) => this.say("figure", { value: brief(name), figure: one.worst[name]!.text }));
      if (this.limits.realtime !== null) values.push(this.say("times_realtime", { realtime: one.candidate.realtime }));
      add(one.point, this.say("near", { values: values.join(", ") }));
    }
    return groups.sort((a, b) => (a.contender < b.contender ? -1 : a.contender > b.contender ? 1 : 0));
  }
}
