// The conformance suite: which contenders pass, which do not and why; and contender x test, with the figure that decided.
import type { GateResult, GateStatus, Report } from "../data";
import { el, type Child } from "../dom";
import { brief, quantity, sentenceList } from "../format";
import { facts } from "../tooltip";
import { unfold } from "./detail";
import { deviations } from "./fairness";
import { roving } from "../roving";
import { scrollFrame } from "./sortable";

const kMarks: Record<GateStatus, { sign: string; word: string }> = {
  pass: { sign: "✓", word: "pass" },
  fail: { sign: "✕", word: "fail" },
  deviation: { sign: "≈", word: "declared deviation" },
  "not-applicable": { sign: "–", word: "not applicable" },
};

function mark(status: GateStatus): { sign: string; word: string } {
  return kMarks[status] ?? { sign: "?", word: String(status) };
}

function capital(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

function detail(result: GateResult): Child[] {
  const silent = result.status === "not-applicable";
  const note = result.note.replace(/^declared: /, "");
  const word = el("b", { class: result.status === "fail" ? "bad" : "" }, mark(result.status).word);
  return [
    el("p", {}, el("strong", {}, result.contender), `, ${result.test}: `, word, note ? `. ${capital(note)}` : ""),
    facts([
      ["Figure", silent ? null : quantity(result.figure, result.unit)],
      ["Tolerance", silent ? null : quantity(result.tolerance, result.unit)],
    ]),
  ];
}

function cell(result: GateResult): HTMLElement {
  const { sign, word } = mark(result.status);
  const figure = result.status === "not-applicable" ? "" : brief(result.figure, result.unit);
  const button = el(
    "button",
    {
      type: "button",
      class: `gate-cell ${result.status}`,
      "aria-expanded": "false",
      "aria-label": `${result.contender}, ${result.test}: ${word} ${figure}`.trim(),
      title: result.note || null,
    },
    el("span", { class: "sign", "aria-hidden": "true" }, sign),
    figure ? el("span", { class: "gate-figure" }, figure) : null,
  );
  button.addEventListener("click", () => unfold(button, () => detail(result)));
  return button;
}

function contendersWith(results: GateResult[], status: GateStatus): string[] {
  return [...new Set(results.filter((result) => result.status === status).map((result) => result.contender))];
}

// One sentence for all, then a line for each test that a contender fails or passes only within a declared bound.
function verdict(report: Report, results: GateResult[], contenders: string[]): HTMLElement {
  const failed = contendersWith(results, "fail");
  const deviating = contendersWith(results, "deviation").filter((name) => !failed.includes(name));
  const clean = contenders.length - failed.length - deviating.length;
  const words = [`${clean} pass every test that applies to them`];
  if (deviating.length > 0) words.push(`${deviating.length} pass with deviations that are proven, declared and bounded`);
  if (failed.length > 0) words.push(`${failed.length} fail and are not scored`);
  const list = el("ul", { class: "gate-verdict" });
  // What the adapter declares, without the figures of this run, which the table has.
  const declared = (result: GateResult): string => {
    const contender = report.contenderByName.get(result.contender);
    const found = contender && deviations(contender).find((deviation) => deviation.test === result.test);
    return found ? found.reason : result.note;
  };
  for (const status of ["fail", "deviation"] as const) {
    const groups = new Map<string, GateResult[]>();
    for (const result of results) {
      if (result.status !== status) continue;
      const key = status === "fail" ? result.contender : declared(result);
      groups.set(key, [...(groups.get(key) ?? []), result]);
    }
    for (const [why, group] of groups) {
      const names = [...new Set(group.map((result) => report.title(result.contender)))];
      const which = [...new Set(group.map((result) => result.test))];
      list.append(
        el(
          "li",
          { class: status },
          el("span", { class: `sign ${status}` }, mark(status).sign),
          el("span", {}, el("strong", {}, sentenceList(names)), `: ${status === "fail" ? "fails " : ""}`, sentenceList(which), status === "fail" ? "" : `. ${capital(why)}`),
        ),
      );
    }
  }
  return el("div", {}, el("p", {}, `Of ${contenders.length} contenders ${sentenceList(words)}.`), list);
}

export function gate(report: Report): HTMLElement {
  const results = report.json.conformance;
  if (results.length === 0) return el("p", { class: "quiet" }, "The conformance suite was not run for these results.");
  const tests = [...new Set(results.map((result) => result.test))];
  const gated = new Set(results.map((result) => result.contender));
  const contenders = [
    ...report.json.contenders.map((contender) => contender.name).filter((name) => gated.has(name)),
    ...[...gated].filter((name) => !report.contenderByName.has(name)),
  ];
  const byKey = new Map(results.map((result) => [`${result.contender}\u0000${result.test}`, result]));

  const head = el("tr", {}, el("th", { scope: "col", class: "sticky" }, "Contender"));
  for (const test of tests) head.append(el("th", { scope: "col", class: "turned" }, el("span", {}, test)));
  const body = el("tbody");
  for (const name of contenders) {
    const row = el("tr", {}, el("th", { scope: "row", class: "sticky" }, report.title(name)));
    for (const test of tests) {
      const result = byKey.get(`${name}\u0000${test}`);
      row.append(el("td", { class: "gate" }, result ? cell(result) : el("span", { class: "quiet" }, " ")));
    }
    body.append(row);
  }
  const counts = new Map<GateStatus, number>();
  for (const result of results) counts.set(result.status, (counts.get(result.status) ?? 0) + 1);
  const table = el("table", { class: "gate-table" }, el("thead", {}, head), body);
  roving(table);
  const caption = [...counts].map(([status, count]) => `${count} × ${mark(status).word}`).join(", ");
  return el(
    "div",
    {},
    verdict(report, results, contenders),
    el(
      "details",
      { class: "gate-all" },
      el("summary", {}, `All ${contenders.length} contenders and ${tests.length} tests`),
      scrollFrame(
        "Conformance suite",
        `${caption}. A click shows figure, tolerance and note.`,
        table,
      ),
    ),
  );
}
