// A card for each system: the answers that most readers come for.
import type { Answer, Report, SystemView } from "./data";
import { el, type Child } from "./dom";
import { timestep } from "./format";
import type { Palette } from "./palette";
import { swatch } from "./plots/legend";
import { picture } from "./plots/picture";
import { ask, firstQuestion } from "./picker";
import { roving } from "./roving";
import { state } from "./state";

function answer(view: SystemView, palette: Palette, one: Answer): HTMLElement {
  const { contender, timestep_ms: step } = one;
  const question = el("dt", {}, one.question);
  if (contender === null || step === null) return el("div", { class: "answer", "data-answer": one.id }, question, el("dd", { class: "none" }, one.figures));
  const name = `${contender} at ${timestep(step)} ms`;
  // A number and its unit stay together.
  const figures = one.figures.replace(/(\d) (?=[µnpm]?m\b|m?rad\b)/g, "$1\u00a0");
  const button = el("button", { type: "button", class: "answer-link", "data-contender-of": contender, "data-timestep": step }, swatch(palette, contender), el("b", {}, name));
  button.addEventListener("click", () => {
    state.setShown([contender], true);
    state.choose({ system: view.system, contender, timestep: step });
  });
  return el("div", { class: "answer", "data-answer": one.id }, question, el("dd", {}, button, figures ? el("span", { class: "figures" }, figures) : null));
}

function card(view: SystemView, palette: Palette): HTMLElement {
  const { system, json } = view;
  const drawn = view.report.json.pictures?.find((candidate) => candidate.system === system);
  const change = el("button", { type: "button", class: "link" }, "Set other limits");
  change.addEventListener("click", () => ask(firstQuestion(view)));
  const more = el("button", { type: "button", class: "card-more", "aria-expanded": "false" }, "More");
  const rest = el(
    "div",
    { class: "card-rest" },
    el("dl", {}, ...json.card.answers.slice(1).map((one) => answer(view, palette, one))),
    json.card.caveat ? el("p", { class: "caveat" }, json.card.caveat) : null,
    el("p", { class: "card-links" }, el("a", { href: `#${system}` }, "Plots and figures"), json.candidates.length > 0 ? change : null),
  );
  const head: Child[] = [el("h3", {}, el("a", { href: `#${system}` }, system)), drawn ? picture(drawn, 56, 40) : null];
  const first = json.card.answers[0]!;
  const box = el("section", { class: "card", "data-system": system, "aria-label": system }, el("div", { class: "card-head" }, ...head), el("dl", { class: "card-first" }, answer(view, palette, first)), more, rest);
  more.addEventListener("click", () => {
    const open = box.classList.toggle("open");
    more.setAttribute("aria-expanded", String(open));
    more.textContent = open ? "Less" : "More";
  });
  roving(box, "button, a");
  return box;
}

export function cards(report: Report, palette: Palette): HTMLElement {
  // Where a card is a row, its first question stands once above all; cards with another one say so.
  const shared = report.answered[0]?.json.card.answers[0]?.question ?? "";
  const list = report.answered.map((view) => {
    const made = card(view, palette);
    made.classList.toggle("own-question", view.json.card.answers[0]?.question !== shared);
    return made;
  });
  return el("div", {}, el("p", { class: "cards-question" }, shared), el("div", { class: "cards" }, ...list));
}
