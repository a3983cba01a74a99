// How an engine does on a task, in one of six grades: its best contender within the reader's limits against the fastest of
// all within them. Which contenders are within is answer.ts's; here they are only compared.
import { exceeds } from "./answer";
import { valueInfo, type Batches, type Report, type SystemView, type ViewPoint } from "./data";
import { plain, quantity, timestep } from "./format";
import { engineOf } from "./palette";
import { wishes } from "./wishes";

export type Grade = "A" | "B" | "C" | "D" | "F" | "–";

export interface Mark {
  grade: Grade;
  text: string; // beside the grade, where there is room
  why: string;
  place: string; // the part of the page that has the evidence
  point: { system: string; contender: string; timestep: number } | null;
}

export interface Task {
  id: string;
  title: string;
  kind: string;
  place: string;
  marks: () => Map<string, Mark>; // by engine
  measure: "speed" | "timestep" | "mean speed" | "worlds"; // what is compared
}

const kNear = 2; // times slower than the fastest
const kFar = 10;

// `limited`: some task has limits.
export function meanings(limited: boolean): [grade: Grade, meaning: string][] {
  return [
    ["A", `${limited ? "within your limits, " : ""}at most ${kNear} times slower than the fastest`],
    ["B", `${limited ? "within them, " : ""}at most ${kFar} times slower`],
    ["C", `${limited ? "within them, " : ""}slower`],
    ...(limited ? ([["D", "sound, but beyond a limit"]] as [Grade, string][]) : []),
    ["F", "no sound run"],
    ["–", "not run, withdrawn, or not measured in full"],
  ];
}

function graded(slower: number): Grade {
  return slower <= kNear * (1 + 1e-9) ? "A" : slower <= kFar * (1 + 1e-9) ? "B" : "C";
}

// What an engine cannot do, and what was withdrawn until it is measured again, is no failure; the program's words for a
// point begin with the measure and its outcome.
const kNoRun = /: unsupported\b/;

const times = (factor: number) => `${plain(factor, factor < 1000 ? 2 : 1)}×`;

export function engineName(report: Report, contender: string): string {
  const known = report.contenderByName.get(contender);
  return known ? engineOf(known) : contender;
}

const at = (point: ViewPoint) => `${point.contender} at ${timestep(point.timestep_ms)} ms`;

// Engines of a system whose points say neither of two better things.
function rest(report: Report, view: SystemView, marks: Map<string, Mark>): Map<string, Mark> {
  const sound = new Map<string, boolean>();
  const first = new Map<string, ViewPoint>();
  for (const point of view.json.points) {
    const engine = engineName(report, point.contender);
    sound.set(engine, (sound.get(engine) ?? false) || point.sound);
    if (!point.sound && !first.has(engine)) first.set(engine, point);
  }
  for (const [engine, some] of sound) {
    if (marks.has(engine)) continue;
    const failed = first.get(engine);
    const none = failed !== undefined && view.json.points.every((point) => engineName(report, point.contender) !== engine || kNoRun.test(point.why));
    const why = some ? "sound, but a limited value or the speed was not measured" : `${failed ? `${at(failed)}: ` : ""}${failed?.why ?? "no sound run"}${!none && view.json.overlap ? `. ${view.json.overlap.replace(/\.$/, "")}` : ""}`;
    marks.set(engine, { grade: some || none ? "–" : "F", text: "", why, place: view.system, point: failed && !some ? { system: view.system, contender: failed.contender, timestep: failed.timestep_ms } : null });
  }
  return marks;
}

// By speed within the limits.
function timed(report: Report, view: SystemView): Map<string, Mark> {
  const { question, found } = wishes.answer(view);
  const marks = new Map<string, Mark>();
  const place = view.system;
  const fastest = found.passing[0];
  for (const one of found.passing) {
    const engine = engineName(report, one.point.contender);
    if (marks.has(engine) || !fastest) continue;
    const slower = Math.max(1, fastest.speed.value / one.speed.value);
    const alike = found.alike.includes(one);
    const why = `${at(one.point)}: ${one.candidate.realtime} real time, ${one === fastest ? "the fastest" : alike ? "not told apart from the fastest" : `${times(slower)} slower than the fastest`}`;
    marks.set(engine, { grade: alike ? "A" : graded(slower), text: times(slower), why, place, point: { system: place, contender: one.point.contender, timestep: one.point.timestep_ms } });
  }
  for (const one of found.beyond) {
    const engine = engineName(report, one.point.contender);
    if (marks.has(engine)) continue;
    const missed = question.limits.filter(([name, largest]) => one.worst[name] && exceeds(one.worst[name].value, largest)).map(([name]) => `${valueInfo(name).short} ${one.worst[name]!.text}`);
    if (question.realtime !== null && one.speed.value < question.realtime) missed.push(`${one.candidate.realtime} real time`);
    marks.set(engine, { grade: "D", text: "", why: `${at(one.point)}, the nearest: ${missed.join(", ")}`, place, point: { system: place, contender: one.point.contender, timestep: one.point.timestep_ms } });
  }
  return rest(report, view, marks);
}

// Where no step was timed: by the largest timestep within those limits that were measured.
function untimed(report: Report, view: SystemView): Map<string, Mark> {
  const { limits } = wishes.of(view);
  const best = new Map<string, ViewPoint>();
  const beyond = new Map<string, ViewPoint>();
  for (const point of view.json.points) {
    const worst = point.worst ?? {};
    const known = limits.filter(([name]) => worst[name]);
    if (!point.sound || known.length === 0) continue;
    const engine = engineName(report, point.contender);
    const into = known.every(([name, largest]) => !exceeds(worst[name]!.value, largest)) ? best : beyond;
    const old = into.get(engine);
    if (!old || (into === best ? point.timestep_ms > old.timestep_ms : point.timestep_ms < old.timestep_ms)) into.set(engine, point);
  }
  const largest = Math.max(...[...best.values()].map((point) => point.timestep_ms));
  const marks = new Map<string, Mark>();
  const add = (engine: string, point: ViewPoint, grade: Grade, text: string, why: string) =>
    marks.set(engine, { grade, text, why, place: view.system, point: { system: view.system, contender: point.contender, timestep: point.timestep_ms } });
  for (const [engine, point] of best) add(engine, point, graded(largest / point.timestep_ms), `${timestep(point.timestep_ms)} ms`, `within the limits up to ${timestep(point.timestep_ms)} ms (${point.contender}); not timed`);
  for (const [engine, point] of beyond) {
    if (marks.has(engine)) continue;
    const missed = limits.filter(([name, most]) => point.worst?.[name] && exceeds(point.worst[name].value, most)).map(([name]) => `${valueInfo(name).short} ${point.worst![name]!.text}`);
    add(engine, point, "D", "", `${at(point)}: ${missed.join(", ")}`);
  }
  return rest(report, view, marks);
}

// Steps a second at 1 ms, whatever the errors: the mean factor over the systems that both were timed on.
function speedAt1ms(report: Report, views: SystemView[]): Map<string, Mark> {
  const logs = new Map<string, number[]>();
  for (const view of views) {
    const best = new Map<string, number>();
    for (const point of view.json.points) {
      if (point.timestep_ms !== 1 || !point.speed?.timed) continue;
      const engine = engineName(report, point.contender);
      best.set(engine, Math.max(best.get(engine) ?? 0, point.speed.value));
    }
    const fastest = Math.max(...best.values());
    for (const [engine, speed] of best) logs.set(engine, [...(logs.get(engine) ?? []), Math.log(fastest / speed)]);
  }
  const marks = new Map<string, Mark>();
  const mean = new Map([...logs].map(([engine, list]) => [engine, Math.exp(list.reduce((sum, one) => sum + one, 0) / list.length)]));
  for (const [engine, slower] of mean) {
    const count = logs.get(engine)!.length;
    marks.set(engine, { grade: graded(slower), text: times(slower), why: `a step takes ${times(slower)} the time of the fastest contender's, in the mean over ${count} of ${views.length} systems`, place: views[0]!.system, point: null });
  }
  return marks;
}

function worlds(report: Report, batches: Batches): Map<string, Mark> {
  const place = batchPlace(batches);
  const best = new Map<string, { rate: number; worlds: number; contender: string }>();
  const failed = new Map<string, string>();
  // at the number of worlds that most engines have, the largest of these
  const counts = new Map<number, Set<string>>();
  for (const row of batches.rows) if (row.values["batch_rate"]?.value) counts.set(row.worlds, (counts.get(row.worlds) ?? new Set()).add(engineName(report, row.contender)));
  const most = Math.max(0, ...[...counts.values()].map((set) => set.size));
  // where none has a rate, the largest number of worlds that was tried
  const size = counts.size === 0 ? Math.max(0, ...batches.rows.map((row) => row.worlds)) : Math.max(0, ...[...counts].filter(([, set]) => set.size === most).map(([count]) => count));
  for (const row of batches.rows) {
    if (row.worlds !== size) continue;
    const engine = engineName(report, row.contender);
    const rate = row.values["batch_rate"]?.value ?? 0;
    if (!rate) failed.set(engine, row.reason);
    else if (rate > (best.get(engine)?.rate ?? 0)) best.set(engine, { rate, worlds: row.worlds, contender: row.contender });
  }
  const fastest = Math.max(...[...best.values()].map(({ rate }) => rate));
  const marks = new Map<string, Mark>();
  for (const [engine, { rate, contender }] of best) {
    marks.set(engine, { grade: graded(fastest / rate), text: times(fastest / rate), why: `${contender}, ${size} worlds: ${quantity(rate, "1/s")} world-steps`, place, point: null });
  }
  for (const [engine, why] of failed) if (!marks.has(engine)) marks.set(engine, { grade: "F", text: "", why, place, point: null });
  return marks;
}

// The element that holds these plots.
export function batchPlace(batches: Batches): string {
  return `worlds-${batches.system}`;
}

// What kind of task a system is, in one or two words.
export function kindOf(view: SystemView): string {
  const facts = view.report.facts(view.system);
  if (facts["grasp"]) return "grasp";
  if (facts["contacts"] === false || facts["contact_pairs"] === 0) return "smooth motion";
  if (Number(facts["hinges"]) === 0) return "pile";
  return "contacts";
}

// A smooth twin of a robot, without gravity or contacts, is part of the robot's own page.
export const kTwin = /-swing$/;

export function tasks(report: Report): Task[] {
  const names = new Set(report.mainSystems.map((system) => system.name));
  const views = report.mainSystems.map((system) => report.view(system.name)).filter((view) => view.json.points.length > 0 && !(kTwin.test(view.system) && names.has(view.system.replace(kTwin, ""))));
  const list: Task[] = views.map((view) => ({
    id: view.system,
    title: view.system,
    kind: kindOf(view),
    place: view.system,
    measure: view.json.candidates.length > 0 ? "speed" : "timestep",
    marks: () => (view.json.candidates.length > 0 ? timed(report, view) : untimed(report, view)),
  }));
  const measured = views.filter((view) => view.json.points.some((point) => point.timestep_ms === 1 && point.speed?.timed));
  if (measured.length > 0) list.push({ id: "speed", title: "speed", kind: "a step of 1 ms, mean over systems", place: measured[0]!.system, measure: "mean speed", marks: () => speedAt1ms(report, measured) });
  for (const batches of report.json.batches ?? []) list.push({ id: batchPlace(batches), title: batches.system, kind: "many worlds", place: batchPlace(batches), measure: "worlds", marks: () => worlds(report, batches) });
  return list;
}
