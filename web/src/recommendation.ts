// What `assay run ROBOT` answered, as it was printed: its parts with sentences and tables.
import type { AnswerPart, Report } from "./data";
import { el } from "./dom";
import { scrollFrame } from "./tables/sortable";

// What the command kept, or nothing where the results are not a robot's.
export function answerParts(report: Report): AnswerPart[] {
  const kept = report.manifest("answer");
  if (!kept) return [];
  try {
    return JSON.parse(kept) as AnswerPart[];
  } catch {
    return []; // of another version
  }
}

// "speed:  251 (249 to 252)": what stands before the colon is the label.
function line(text: string): HTMLElement {
  const label = /^([^:.]{1,40}):\s+/.exec(text);
  return label ? el("li", {}, el("b", {}, label[1]!), ` ${text.slice(label[0].length)}`) : el("li", {}, text);
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
  return el("div", { class: "answer-part" }, el("h3", {}, one.heading), one.lines.length > 0 ? el("ul", {}, ...one.lines.map(line)) : null, one.columns.length > 0 ? scrollFrame(one.heading, "", table) : null);
}

// The first three parts are the answer; the rest is its evidence.
export function recommendation(parts: AnswerPart[]): HTMLElement {
  const evidence = parts.findIndex((one) => /^(What|Engines) /.test(one.heading));
  const first = evidence < 0 ? parts : parts.slice(0, evidence);
  const rest = evidence < 0 ? [] : parts.slice(evidence);
  return el(
    "div",
    { class: "recommendation" },
    ...first.map(part),
    rest.length > 0 ? el("details", {}, el("summary", {}, "What it approximates, what did not qualify, and which engines refuse this robot"), ...rest.map(part)) : null,
  );
}
