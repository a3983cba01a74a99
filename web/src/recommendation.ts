// What `assay run ROBOT` answered, as it was printed: its parts with sentences and tables.
import type { AnswerLine, AnswerPart } from "./data";
import { el } from "./dom";
import { scrollFrame } from "./tables/sortable";

export function answerLine(line: AnswerLine): HTMLElement {
  return line.label ? el("li", { "data-label": line.label }, el("b", {}, line.label), ` ${line.text}`) : el("li", {}, line.text);
}

function part(one: AnswerPart): HTMLElement {
  const right = new Set(one.right);
  const cells = (names: string[], make: (text: string, kind: string) => HTMLElement) => el("tr", {}, ...names.map((text, i) => make(text, right.has(i) ? "figure" : "")));
  const table = el(
    "table",
    {},
    el("thead", {}, cells(one.columns, (text, kind) => el("th", { scope: "col", class: kind }, text))),
    el("tbody", {}, ...one.rows.map((row) => cells(row, (text, kind) => el("td", { class: kind }, text)))),
  );
  return el("div", { class: "answer-part" }, el("h3", {}, one.heading), one.lines.length > 0 ? el("ul", {}, ...one.lines.map(answerLine)) : null, one.columns.length > 0 ? scrollFrame(one.heading, "", table) : null);
}

// The answer, and what it rests on.
export function recommendation(parts: AnswerPart[]): HTMLElement {
  const first = parts.filter((one) => !one.evidence);
  const rest = parts.filter((one) => one.evidence);
  return el(
    "div",
    { class: "recommendation" },
    ...first.map(part),
    rest.length > 0 ? el("details", {}, el("summary", {}, "What it approximates, what did not qualify, and which engines refuse this robot"), ...rest.map(part)) : null,
  );
}
