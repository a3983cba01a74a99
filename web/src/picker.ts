// The reader's question: which engine, within limits of the reader's own?
import { isUsual, limitText, pick, relaxedLimits, Words, type Asked, type Limits, type Pick } from "./answer";
import { valueInfo, type LeftOut, type Report, type SystemView } from "./data";
import { clear, el } from "./dom";
import { onRestored } from "./address";
import { counted, plain, timestep, unbroken, unitText } from "./format";
import type { Palette } from "./palette";
import { swatch } from "./plots/legend";
import { answerLine } from "./recommendation";
import { state, type Question } from "./state";
import { scrollFrame, sortableTable, type Column } from "./tables/sortable";
import { firstQuestion, wishes } from "./wishes";

export function canPick(report: Report): boolean {
  return report.answered.some((view) => view.json.candidates.length > 0);
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

  // `redraw`: the form too, which a reader who types in it keeps as it is.
  let typing = false;
  const change = (next: Question, redraw: boolean, learn = true) => {
    question = state.question = next;
    typing = !redraw;
    if (learn) wishes.ask(viewOf(next.system), next);
    else show();
    typing = false;
    state.kept();
  };
  const show = () => {
    if (!typing) form();
    draw();
  };
  const limitable = (view: SystemView) => view.json.errors.filter((name) => valueInfo(name).limit);
  const setLimit = (index: number, name: string, largest: number, redraw: boolean) =>
    change({ ...question, limits: question.limits.map((one, at) => (at === index ? [name, largest] : one)) }, redraw);
  // A limit to begin with: the middle of what the candidates have.
  const middle = (view: SystemView, name: string) => {
    const all = view.json.candidates.map((one) => view.json.points[one.point]?.worst?.[name]?.value ?? 0).filter((value) => value > 0).sort((a, b) => a - b);
    return 10 ** Math.ceil(Math.log10(all[Math.floor(all.length / 2)] ?? 1e-3));
  };
  // What is asked before a reader says anything.
  const isFirst = (view: SystemView, name: string, largest: number) => firstQuestion(view).limits.some(([each, first]) => each === name && Math.abs(largest - first) <= 1e-9 * first);
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
      const mark = el("small", { class: "pick-default" });
      const tell = (value: number) => (mark.textContent = isFirst(view, name, value) ? "default" : "");
      const typed = () => {
        const value = Number(error.value) * Number(unit.value);
        tell(value);
        setLimit(index, name, value, false);
      };
      tell(largest);
      error.addEventListener("input", typed);
      unit.addEventListener("change", typed);
      remove.addEventListener("click", () => change({ ...question, limits: question.limits.filter((_, at) => at !== index) }, true));
      limits.append(el("div", { class: "pick-limit" }, measure, el("span", { "aria-hidden": "true" }, "≤"), el("span", { class: "limit" }, error, unit), mark, remove));
    });
    more.hidden = question.limits.length >= names.length;
  };
  more.addEventListener("click", () => {
    const view = viewOf(question.system);
    const name = limitable(view).find((each) => !question.limits.some(([used]) => used === each));
    if (name) change({ ...question, limits: [...question.limits, [name, middle(view, name)]] }, true);
  });
  system.addEventListener("change", () => change(wishes.of(viewOf(system.value)), true, false));
  rate.addEventListener("input", () => change({ ...question, realtime: Number(rate.value) > 0 ? Number(rate.value) : null }, false));
  const open = (one: Pick) => {
    state.setShown([one.point.contender], true);
    state.choose({ system: question.system, contender: one.point.contender, timestep: one.point.timestep_ms });
  };
  // As the reader typed it: "1mm".
  const typed = ([name, largest]: [string, number]): Asked => {
    const view = viewOf(question.system);
    if (isUsual(view, name, largest)) return { name, largest, text: limitText(view, name, largest), usual: true };
    const { number, scale, units } = inUnits(report, name, largest);
    return { name, largest, text: `${number}${units.find((unit) => unit.scale === scale)?.text ?? ""}` };
  };
  const draw = () => {
    clear(found);
    if (question.limits.length === 0 && question.realtime === null) {
      found.append(el("p", { class: "quiet" }, "Add a limit."));
      return;
    }
    if (question.limits.some(([, largest]) => !(largest > 0))) {
      found.append(el("p", { class: "quiet" }, "Each limit needs a positive number."));
      return;
    }
    const limits: Limits = { asked: question.limits.map(typed), realtime: question.realtime };
    const words = new Words(viewOf(question.system), limits);
    const { passing } = words.found;
    const [best] = passing;
    const [answer, each] = words.parts();
    if (best && answer && each) {
      const { contender, timestep_ms: step } = best.point;
      const details = el("button", { type: "button", class: "link", click: () => open(best) }, "Details");
      found.append(
        el("p", { class: "pick-best", "data-contender-of": contender, "data-timestep": step }, swatch(palette, contender), " ", el("strong", {}, answer.heading), " ", details),
        ...whatIf(best),
        full(el("ul", { class: "pick-facts" }, ...answer.lines.map(answerLine))),
        el("details", { class: "pick-each" }, el("summary", {}, `${each.heading} (${passing.length})`), ...each.lines.map(({ text }) => el("p", { class: "quiet" }, text)), scrollFrame(each.heading, "", contenders(words, each.columns, passing))),
      );
    } else {
      found.append(none(words, limits));
    }
    const { overlap } = viewOf(question.system).json;
    if (overlap) found.append(el("p", { class: "pick-overlap" }, unbroken(overlap)));
    const grounds = words.grounds();
    if (grounds.length > 0) found.append(el("details", { class: "pick-grounds" }, el("summary", {}, words.say("grounds")), ...grounds.map((text) => el("p", { class: "quiet" }, text))));
    const left = words.leftOut();
    if (left.length > 0) found.append(excluded(words.say("left_out"), left));
  };
  // The facts of the answer, which stay open from one answer to the next.
  let isFull = false;
  const full = (facts: HTMLElement) => {
    const box = el("details", { class: "pick-full", open: isFull }, el("summary", {}, "Settings, intervals and margin"), facts);
    box.addEventListener("toggle", () => (isFull = box.open));
    return box;
  };
  // What accepting ten times the first limit would bring.
  const whatIf = (best: Pick) => {
    const [first, ...others] = question.limits;
    if (!first) return [];
    const [name, largest] = first;
    const next: [string, number][] = [[name, Number((10 * largest).toPrecision(12))], ...others];
    const view = viewOf(question.system);
    const [other] = pick(view, { asked: next.map(([each, most]) => ({ name: each, largest: most, text: "" })), realtime: question.realtime }).passing;
    if (!other || (other.point.contender === best.point.contender && other.point.timestep_ms === best.point.timestep_ms)) return [];
    const faster = other.speed.value / best.speed.value;
    return [el("p", { class: "pick-what-if" }, asking(`Accept ${limitText(view, name, next[0]![1])}: ${plain(faster, 2)} times faster, ${other.point.contender} at ${timestep(other.point.timestep_ms)} ms`, { ...question, limits: next }))];
  };
  // A phrase that asks this question; a link, for a button's text does not wrap as that around it.
  const asking = (text: string, next: Question) => {
    const click = (event: Event) => {
      event.preventDefault();
      change(next, true);
    };
    return el("a", { href: "#pick", click }, unbroken(text));
  };
  // What to relax, each way on a line of its own.
  const none = (words: Words, limits: Limits) => {
    const text = el("div", { class: "pick-none" });
    const ways = el("ul");
    for (const piece of words.nonePieces()) {
      if (!piece.relax) {
        (ways.lastElementChild ?? text).append(unbroken(piece.text));
        continue;
      }
      const { asked, realtime } = relaxedLimits(limits, piece.relax);
      const { relax, place, rest } = /^(?<relax>.*?)(?<place>: .*? ms)(?<rest>.*)$/s.exec(piece.text)?.groups ?? { relax: piece.text, place: "", rest: "" };
      ways.append(el("li", {}, asking(relax!, { ...question, limits: asked.map(({ name, largest }) => [name, largest]), realtime }), el("b", {}, unbroken(place!)), el("span", { class: "quiet" }, unbroken(rest!))));
    }
    if (ways.childElementCount > 0) text.append(ways);
    return text;
  };
  const contenders = (words: Words, titles: string[], passing: Pick[]) => {
    const keys: ((one: Pick) => number | string | null)[] = [(one) => one.point.contender, (one) => one.point.timestep_ms, (one) => one.speed.value];
    for (const name of words.columns()) keys.push((one) => one.worst[name]?.value ?? null);
    const rows = new Map(passing.map((one) => [one, words.row(one)]));
    const columns = titles.map((title, index): Column<Pick> => ({ title, key: keys[index]!, cell: (one) => rows.get(one)![index]!, className: "figure" }));
    columns[0] = { ...columns[0]!, cell: (one) => el("span", { class: "contender" }, swatch(palette, one.point.contender), one.point.contender), className: "sticky", head: true };
    columns.push({ title: words.say("margin"), cell: (one) => words.margin(one), className: "wider" });
    return sortableTable(columns, passing);
  };
  const excluded = (title: string, left: LeftOut[]) => {
    const points = left.reduce((sum, one) => sum + one.steps.length, 0);
    const rows = left.map(({ contender, when, why }) => el("li", {}, el("b", {}, contender), " ", el("span", { class: "quiet" }, when), el("p", {}, why)));
    return el("details", { class: "pick-excluded" }, el("summary", {}, `${title} (${counted(points, "point")})`), el("ul", {}, ...rows));
  };
  onRestored(() => {
    if (!state.question || !views.some((view) => view.system === state.question?.system)) return;
    question = state.question;
    wishes.ask(viewOf(question.system), question);
  });
  // Another part of the page asks: of the system that it is about.
  wishes.subscribe(() => {
    if (!typing && state.question && views.some((view) => view.system === state.question?.system)) question = state.question;
    show();
  });
  if (state.question?.system === question.system) wishes.ask(viewOf(question.system), question);
  else show();
  return el(
    "div",
    { class: "panel picker", id: "pick" },
    el("h2", {}, "Which engine?"),
    el("form", { class: "question", submit: (event: Event) => event.preventDefault() }, el("label", {}, "System ", system), limits, more, el("label", {}, "Speed ≥ ", el("span", { class: "limit" }, rate), " × real time")),
    found,
  );
}
