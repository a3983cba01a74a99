// The answer to a question within limits, as `assay recommend` gives it (src/results/recommend.h, answer.h): the
// program's figures are compared with the limits, and its sentences filled. tests/answers/cases.json holds both to the
// same words.
import { valueInfo, type AnswerLine, type AnswerPart, type Candidate, type LeftOut, type Speed, type SystemView, type ViewPoint, type Worst } from "./data";
import { realtime, timestep } from "./format";

export interface Asked {
  name: string;
  largest: number;
  text: string; // as the reader typed it
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
  beyond: Pick[]; // of each other contender the candidate that misses a limit by the least factor, the least first
}

function picksOf(view: SystemView): Pick[] {
  return view.json.candidates.flatMap((candidate) => {
    const point = view.json.points[candidate.point];
    return point?.speed ? [{ candidate, point, speed: point.speed, worst: point.worst ?? {} }] : [];
  });
}

// 0 for a candidate within all limits, else the largest factor by which it misses one; null when a limited value was not
// measured there. With `whole` the far ends of the intervals count.
function excess(one: Pick, limits: Limits, whole: boolean): number | null {
  let most = 0;
  for (const { name, largest } of limits.asked) {
    const worst = one.worst[name];
    if (!worst) return null;
    const error = whole ? (worst.high ?? worst.value) : worst.value;
    if (error > largest) most = Math.max(most, error / largest);
  }
  const speed = whole ? one.speed.low : one.speed.value;
  if (limits.realtime !== null && speed < limits.realtime) most = Math.max(most, limits.realtime / speed);
  return most;
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
  return { passing, alike: best ? passing.slice(1).filter((one) => one.speed.high >= best.speed.low) : [], certain, beyond: beyond.map((miss) => miss.one) };
}

// As C++ writes {:.3g}.
function general(value: number): string {
  const [mantissa = "", exponent = ""] = value.toExponential(2).split("e");
  const power = Number(exponent);
  if (power >= -4 && power < 3) return String(Number(value.toPrecision(3)));
  return `${Number(mantissa)}e${power < 0 ? "-" : "+"}${String(Math.abs(power)).padStart(2, "0")}`;
}

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
    const parts = this.limits.asked.map(({ name, text }) => this.say("within", { value: brief(name), limit: text }));
    if (this.limits.realtime !== null) parts.push(this.say("at_least", { realtime: realtime(this.limits.realtime) }));
    return parts.join(", ");
  }

  // Where its contender first exceeds a limit at a larger timestep, before what the program says of it.
  margin(one: Pick): string {
    let first: { point: ViewPoint; name: string; worst: Worst } | null = null;
    for (const { point, worst } of picksOf(this.view)) {
      if (point.contender !== one.point.contender || point.timestep_ms <= one.point.timestep_ms) continue;
      if (first && point.timestep_ms >= first.point.timestep_ms) continue;
      const over = this.limits.asked.find(({ name, largest }) => worst[name] && worst[name].value > largest);
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
      const whole = certain ? this.say("whole", { place: placeOf(certain.point), realtime: certain.candidate.realtime }) : this.say("no_whole");
      line("", this.say("reaches", { whole }));
    }
    const { limited, open } = this.view.json.accuracy;
    const names = this.limits.asked.map(({ name }) => name);
    const isOpen = names[0] === limited && !names.some((name) => valueInfo(name).measure === valueInfo(open).measure);
    if (isOpen && worst[open]) line(this.say("not_accuracy"), this.say("accuracy", { error: worst[open].text }));
    const heading = this.say("best", { system: this.view.system, place: placeOf(point), realtime: candidate.realtime });
    const columns = [this.say("contender"), this.say("timestep"), this.say("realtime"), ...this.columns().map(brief)];
    const rows = passing.map((one) => this.row(one));
    const estimates = passing.some((one) => !one.speed.timed) ? [{ label: "", text: this.say("estimates") }] : [];
    const right = columns.map((_, index) => index).slice(1);
    return [
      { heading, evidence: false, lines, columns: [], rows: [], right: [] },
      { heading: this.say("each"), evidence: false, lines: estimates, columns, rows, right },
    ];
  }

  row(one: Pick): string[] {
    const speed = one.speed.timed ? one.candidate.realtime : this.say("estimated", { realtime: one.candidate.realtime });
    return [one.point.contender, `${timestep(one.point.timestep_ms)} ms`, speed, ...this.columns().map((name) => one.worst[name]?.text ?? "")];
  }

  private missed(worst: Record<string, Worst>, speed: { value: number; text: string } | null): string {
    const parts: string[] = [];
    for (const { name, largest } of this.limits.asked) {
      const own = worst[name];
      if (!own) continue;
      const factor = own.value / largest;
      const over = factor > 1 && Number.isFinite(factor) ? this.say("over", { factor: general(factor) }) : "";
      parts.push(this.say("figure", { value: brief(name), figure: own.text }) + over);
    }
    const least = this.limits.realtime;
    if (least !== null && speed) {
      const under = speed.value < least ? this.say("under", { factor: general(speed.value / least) }) : "";
      parts.push(this.say("times_realtime", { realtime: speed.text }) + under);
    }
    return parts.join("; ");
  }

  // Where nothing is within the limits: what misses them by the least, or was begun.
  none(): string {
    return this.say("none", { system: this.view.system, limits: this.limitsText(), nearest: this.nearest() });
  }

  private nearest(): string {
    const first = this.found.beyond[0];
    if (first) return this.say("nearest", { place: placeOf(first.point), values: this.missed(first.worst, { value: first.speed.value, text: first.candidate.realtime }) });
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
