// The reader's question: which engine, within limits of the reader's own? The program has listed the candidates, the
// fastest first; here they are only compared with the limits.
import { valueInfo, type Candidate, type Report, type Speed, type SystemView, type ViewPoint, type Worst } from "./data";
import { clear, el } from "./dom";
import { onRestored } from "./address";
import { quantity, realtime, timestep, timestepRange, unitText } from "./format";
import type { Palette } from "./palette";
import { swatch } from "./plots/legend";
import { state, type Question } from "./state";
import { scrollFrame, sortableTable, type Column } from "./tables/sortable";

export interface Pick {
  candidate: Candidate;
  point: ViewPoint;
  speed: Speed;
}

export interface Picked {
  passing: Pick[]; // each contender's first candidate within the limits, in the list's order
  alike: Pick[]; // of those, what no measurement tells from the first
  beyond: Pick[]; // of each other contender the candidate that misses a limit by the least factor
}

// 0 for a candidate within all limits, else the largest factor by which it misses one; null when a limited value was not
// measured there.
function excess(candidate: Candidate, speed: Speed, question: Question): number | null {
  let most = 0;
  for (const [name, largest] of question.limits) {
    const worst = candidate.worst[name];
    if (!worst) return null;
    if (worst.value > largest) most = Math.max(most, worst.value / largest);
  }
  if (question.realtime !== null && speed.value < question.realtime) most = Math.max(most, question.realtime / speed.value);
  return most;
}

export function pick(view: SystemView, question: Question): Picked {
  const passing: Pick[] = [];
  const seen = new Set<string>();
  const missing = new Map<string, { by: number; one: Pick }>();
  for (const candidate of view.json.candidates) {
    const point = view.json.points[candidate.point];
    const line = point ? view.report.varied(point.contender) : "";
    if (!point?.speed || seen.has(line)) continue;
    const one = { candidate, point, speed: point.speed };
    const by = excess(candidate, point.speed, question);
    if (by === null) continue;
    if (by > 0) {
      if (by < (missing.get(line)?.by ?? Infinity)) missing.set(line, { by, one });
      continue;
    }
    seen.add(line);
    passing.push(one);
  }
  const best = passing[0];
  const beyond = [...missing].filter(([line]) => !seen.has(line)).map(([, miss]) => miss).sort((a, b) => a.by - b.by);
  return { passing, alike: best ? passing.slice(1).filter((one) => one.speed.high >= best.speed.low) : [], beyond: beyond.map((miss) => miss.one) };
}

// Where the contender first exceeds a limit at a larger timestep.
export function firstExceeded(view: SystemView, best: Pick, question: Question): { timestep: number; name: string; worst: Worst } | null {
  let first: { timestep: number; name: string; worst: Worst } | null = null;
  for (const candidate of view.json.candidates) {
    const point = view.json.points[candidate.point];
    if (point?.contender !== best.point.contender || point.timestep_ms <= best.point.timestep_ms) continue;
    if (first && point.timestep_ms >= first.timestep) continue;
    for (const [name, largest] of question.limits) {
      const worst = candidate.worst[name];
      if (!worst || worst.value <= largest) continue;
      first = { timestep: point.timestep_ms, name, worst };
      break;
    }
  }
  return first;
}

export function canPick(report: Report): boolean {
  return report.answered.some((view) => view.json.candidates.length > 0);
}

// The one that the system's card answers first.
export function firstQuestion(view: SystemView): Question {
  const limits = view.json.card.answers.map((one) => Object.entries(one.limits ?? {})).find((each) => each.length > 0);
  return { system: view.system, limits: limits ?? [], realtime: limits ? null : 1 };
}

let asked: (question: Question) => void = () => undefined;

// Puts a question to the picker and shows it.
export function ask(question: Question): void {
  asked(question);
  document.getElementById("pick")?.scrollIntoView();
}

function speedText(speed: Speed): string {
  const range = speed.low === speed.high ? "" : `${realtime(speed.low)} to ${realtime(speed.high)}`;
  const between = speed.between && !speed.timed ? `not timed at this timestep, interpolated between ${timestep(speed.between[0])} and ${timestep(speed.between[1])} ms` : "";
  const notes = [range, between].filter(Boolean).join("; ");
  return `${realtime(speed.value)} real time${notes ? ` (${notes})` : ""}`;
}

function worstText(name: string, worst: Worst | undefined, step: number): string {
  if (!worst) return "–";
  return quantity(worst.value, valueInfo(name).unit) + (worst.at_ms === step ? "" : ` (at ${timestep(worst.at_ms)} ms)`);
}

// A limit as the reader types it: the largest unit in which it is at least 1.
function inUnits(report: Report, name: string, largest: number): { number: number; scale: number; units: { text: string; scale: number }[] } {
  const base = valueInfo(name).unit;
  const all = report.json.units?.[base] ?? [{ text: base === "1" ? "" : base, scale: 1 }];
  const units = all.filter((unit, index) => all.findIndex((other) => other.scale === unit.scale) === index); // "um" is "µm"
  const fitting = [...units].sort((a, b) => b.scale - a.scale).find((unit) => unit.scale <= largest * (1 + 1e-9) && unit.text !== "cm");
  const scale = fitting?.scale ?? Math.min(...units.map((unit) => unit.scale));
  return { number: Number((largest / scale).toPrecision(12)), scale, units };
}

export function picker(report: Report, palette: Palette): HTMLElement {
  const views = report.answered.filter((view) => view.json.candidates.length > 0);
  const viewOf = (system: string) => views.find((view) => view.system === system) ?? views[0]!;
  let question = state.question && views.some((view) => view.system === state.question?.system) ? state.question : firstQuestion(views[0]!);

  const system = el("select", { id: "pick-system" }, ...views.map((view) => el("option", { value: view.system }, view.system)));
  const limits = el("div", { class: "pick-limits" });
  const more = el("button", { type: "button", class: "more pick-more" }, "Add a limit");
  const rate = el("input", { type: "number", min: 0, step: "any", id: "pick-realtime", placeholder: "any", inputmode: "decimal" });
  const found = el("div", { class: "pick-answer", "aria-live": "polite" });

  const change = (next: Question, redraw: boolean) => {
    question = state.question = next;
    state.kept();
    if (redraw) form();
    draw();
  };
  const limitable = (view: SystemView) => view.json.errors.filter((name) => valueInfo(name).limit);
  const setLimit = (index: number, name: string, largest: number, redraw: boolean) =>
    change({ ...question, limits: question.limits.map((one, at) => (at === index ? [name, largest] : one)) }, redraw);
  // A limit to begin with: the middle of what the candidates have.
  const middle = (view: SystemView, name: string) => {
    const all = view.json.candidates.map((one) => one.worst[name]?.value ?? 0).filter((value) => value > 0).sort((a, b) => a - b);
    return 10 ** Math.ceil(Math.log10(all[Math.floor(all.length / 2)] ?? 1e-3));
  };
  const form = () => {
    const view = viewOf(question.system);
    system.value = view.system;
    rate.value = question.realtime === null ? "" : String(question.realtime);
    const names = limitable(view);
    clear(limits);
    question.limits.forEach(([name, largest], index) => {
      const { number, scale, units } = inUnits(report, name, largest);
      const label = valueInfo(name).label;
      const measure = el("select", { class: "pick-measure", "aria-label": `Limited value ${index + 1}` }, ...names.map((each) => el("option", { value: each, selected: each === name }, valueInfo(each).label)));
      const error = el("input", { type: "number", min: 0, step: "any", class: "pick-error", "aria-label": `Largest ${label.toLowerCase()}`, value: number, inputmode: "decimal" });
      const unit = el("select", { class: "pick-unit", "aria-label": `Unit of the largest ${label.toLowerCase()}` }, ...units.map((each) => el("option", { value: each.scale, selected: each.scale === scale }, unitText(each.text) || "(number)")));
      const remove = el("button", { type: "button", class: "pick-remove", "aria-label": `Remove the limit of ${label.toLowerCase()}` }, "×");
      measure.addEventListener("change", () => setLimit(index, measure.value, middle(view, measure.value), true));
      const typed = () => setLimit(index, name, Number(error.value) * Number(unit.value), false);
      error.addEventListener("input", typed);
      unit.addEventListener("change", typed);
      remove.addEventListener("click", () => change({ ...question, limits: question.limits.filter((_, at) => at !== index) }, true));
      limits.append(el("div", { class: "pick-limit" }, measure, el("span", {}, "at most"), el("span", { class: "limit" }, error, unit), remove));
    });
    more.hidden = question.limits.length >= names.length;
  };
  more.addEventListener("click", () => {
    const view = viewOf(question.system);
    const name = limitable(view).find((each) => !question.limits.some(([used]) => used === each));
    if (name) change({ ...question, limits: [...question.limits, [name, middle(view, name)]] }, true);
  });
  system.addEventListener("change", () => change(firstQuestion(viewOf(system.value)), true));
  rate.addEventListener("input", () => change({ ...question, realtime: Number(rate.value) > 0 ? Number(rate.value) : null }, false));
  const open = (one: Pick) => {
    state.setShown([one.point.contender], true);
    state.choose({ system: question.system, contender: one.point.contender, timestep: one.point.timestep_ms });
  };
  const settings = (one: Pick) => {
    const changes = report.contenderByName.get(one.point.contender)?.changes;
    return changes ? el("li", { class: "pick-settings" }, changes.length > 0 ? `Settings: ${changes.join("; ")}` : "Settings: the adapter's defaults") : null;
  };
  const draw = () => {
    clear(found);
    const view = viewOf(question.system);
    if (question.limits.some(([, largest]) => !(largest > 0))) {
      found.append(el("p", { class: "quiet" }, "Each limit needs a positive number."));
      return;
    }
    const { passing, alike, beyond } = pick(view, question);
    const best = passing[0];
    const marginText = (one: Pick) => {
      const beyond = firstExceeded(view, one, question);
      if (!beyond) return one.candidate.margin;
      const factor = Math.round((100 * beyond.timestep) / one.point.timestep_ms) / 100;
      return `${valueInfo(beyond.name).label.toLowerCase()} ${worstText(beyond.name, beyond.worst, beyond.timestep)} at ${factor} times this step (${timestep(beyond.timestep)} ms), above the limit; ${one.candidate.margin}`;
    };
    if (!best) {
      const closest = question.limits.map(([name]) => {
        const least = view.json.candidates.reduce<Candidate | null>((least, one) => (one.worst[name] && (!least || one.worst[name]!.value < least.worst[name]!.value) ? one : least), null);
        const point = least ? view.json.points[least.point] : undefined;
        return least && point ? `The smallest ${valueInfo(name).label.toLowerCase()} is ${quantity(least.worst[name]!.value, valueInfo(name).unit)}, of ${point.contender} at ${timestep(point.timestep_ms)} ms.` : `No sound point has a ${valueInfo(name).label.toLowerCase()}.`;
      });
      found.append(el("p", { class: "pick-none" }, el("b", {}, `No contender is within ${question.limits.length + (question.realtime === null ? 0 : 1) > 1 ? "all these limits" : "this limit"} on ${view.system}. `), closest.join(" ")));
    } else {
      const details = el("button", { type: "button", class: "link", click: () => open(best) }, "Details");
      found.append(
        el("p", { class: "pick-best", "data-contender-of": best.point.contender, "data-timestep": best.point.timestep_ms }, swatch(palette, best.point.contender), " ", el("strong", {}, `${best.point.contender} at ${timestep(best.point.timestep_ms)} ms`), ` runs at ${speedText(best.speed)}. `, details),
        el("ul", { class: "pick-facts" }, settings(best), ...question.limits.map(([name]) => el("li", {}, `${valueInfo(name).label}: ${worstText(name, best.candidate.worst[name], best.point.timestep_ms)}, the largest at this or any smaller timestep`)), el("li", { class: "pick-margin" }, `Margin: ${marginText(best)}`)),
      );
      if (alike.length > 0) {
        found.append(el("p", { class: "pick-alike" }, "Not told apart in speed: ", alike.map((one) => `${one.point.contender} at ${timestep(one.point.timestep_ms)} ms`).join(", "), "."));
      }
      const columns: Column<Pick>[] = [
        { title: "Contender", key: (one) => one.point.contender, cell: (one) => el("span", { class: "contender" }, swatch(palette, one.point.contender), one.point.contender), className: "sticky", head: true },
        { title: "Timestep", key: (one) => one.point.timestep_ms, cell: (one) => `${timestep(one.point.timestep_ms)} ms`, className: "figure" },
        { title: "Times real time", key: (one) => one.speed.value, cell: (one) => realtime(one.speed.value), className: "figure" },
        ...question.limits.map(([name]): Column<Pick> => ({ title: valueInfo(name).label, key: (one) => one.candidate.worst[name]?.value ?? null, cell: (one) => worstText(name, one.candidate.worst[name], one.point.timestep_ms), className: "figure" })),
        { title: "Margin", cell: marginText, className: "wider" },
      ];
      found.append(el("details", {}, el("summary", {}, passing.length === 1 ? "The one contender within the limits" : `All ${passing.length} contenders within the limits, each at its fastest`), scrollFrame("Contenders within the limits", "", sortableTable(columns, passing))));
    }
    found.append(excluded(view, beyond));
  };
  // A contender's timesteps that are no candidates for one reason share a line.
  const excluded = (view: SystemView, beyond: Pick[]) => {
    const groups = new Map<string, { contender: string; steps: number[]; why: string }>();
    for (const one of beyond) {
      const values = question.limits.map(([name]) => `${valueInfo(name).label.toLowerCase()} ${worstText(name, one.candidate.worst[name], one.point.timestep_ms)}`);
      if (question.realtime !== null) values.push(`${realtime(one.speed.value)} real time`);
      groups.set(`${one.point.contender}\u0000beyond`, { contender: one.point.contender, steps: [one.point.timestep_ms], why: `beyond the limits, and nearest to them here: ${values.join(", ")}` });
    }
    for (const one of view.json.excluded) {
      const key = `${one.contender}\u0000${one.why}`;
      const group = groups.get(key) ?? { contender: one.contender, steps: [], why: one.why };
      group.steps.push(one.timestep_ms);
      groups.set(key, group);
    }
    if (groups.size === 0) return el("p", { class: "quiet note" }, "Every timestep measured is a candidate.");
    const rows = [...groups.values()];
    const columns: Column<(typeof rows)[number]>[] = [
      { title: "Contender", key: (one) => one.contender, cell: (one) => one.contender, className: "sticky", head: true },
      { title: "Timesteps", key: (one) => Math.min(...one.steps), cell: (one) => timestepRange(one.steps), className: "name" },
      { title: "Why", key: (one) => one.why, cell: (one) => one.why, className: "wider" },
    ];
    return el("details", { class: "pick-excluded" }, el("summary", {}, `What was excluded, and why (${view.json.excluded.length + beyond.length} points)`), scrollFrame("Excluded points", "", sortableTable(columns, rows)));
  };
  asked = (next) => change(next, true);
  onRestored(() => {
    if (!state.question || !views.some((view) => view.system === state.question?.system)) return;
    question = state.question;
    form();
    draw();
  });
  form();
  draw();
  return el(
    "div",
    { class: "panel picker" },
    el("form", { class: "question", submit: (event: Event) => event.preventDefault() }, el("label", {}, "System ", system), limits, more, el("label", {}, "Real time at least ", el("span", { class: "limit" }, rate, "×"))),
    found,
  );
}
