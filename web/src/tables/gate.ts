// The conformance gate: test x contender, with the figure that decided.
import type { GateResult, GateStatus, Report } from "../data";
import { el } from "../dom";
import { brief, quantity } from "../format";
import { facts } from "../tooltip";
import { scrollFrame } from "./sortable";

const kMarks: Record<GateStatus, { sign: string; word: string }> = {
  pass: { sign: "✓", word: "pass" },
  fail: { sign: "✕", word: "fail" },
  deviation: { sign: "≈", word: "declared deviation" },
  "not-applicable": { sign: "–", word: "not applicable" },
};

function statusOf(result: GateResult): { sign: string; word: string } {
  return kMarks[result.status] ?? { sign: "?", word: String(result.status) };
}

export function gate(report: Report): HTMLElement {
  const results = report.json.conformance;
  if (results.length === 0) return el("p", { class: "quiet" }, "The gate was not run for these results.");
  const tests = [...new Set(results.map((result) => result.test))];
  const gated = new Set(results.map((result) => result.contender));
  const contenders = [
    ...report.json.contenders.map((contender) => contender.name).filter((name) => gated.has(name)),
    ...[...gated].filter((name) => !report.contenderByName.has(name)),
  ];
  const byKey = new Map(results.map((result) => [`${result.contender}\u0000${result.test}`, result]));

  const head = el("tr", {}, el("th", { scope: "col", class: "sticky" }, "Test"));
  for (const name of contenders) {
    head.append(el("th", { scope: "col", class: "turned" }, el("span", {}, report.title(name))));
  }
  const body = el("tbody");
  for (const test of tests) {
    const row = el("tr", {}, el("th", { scope: "row", class: "sticky" }, test));
    for (const name of contenders) {
      const result = byKey.get(`${name}\u0000${test}`);
      if (!result) {
        row.append(el("td", { class: "gate" }, el("span", { class: "quiet" }, " ")));
        continue;
      }
      const { sign, word } = statusOf(result);
      const silent = result.status === "not-applicable";
      const figure = silent ? "" : brief(result.figure, result.unit);
      const button = el(
        "button",
        {
          type: "button",
          class: `gate-cell ${result.status}`,
          "aria-expanded": "false",
          "aria-label": `${name}, ${test}: ${word}`,
          title: result.note || null,
        },
        el("span", { class: "sign" }, sign),
        figure ? el("span", { class: "gate-figure" }, figure) : null,
      );
      button.addEventListener("click", () => {
        const next = row.nextElementSibling;
        const open = button.getAttribute("aria-expanded") === "true";
        for (const other of row.querySelectorAll("[aria-expanded=true]")) other.setAttribute("aria-expanded", "false");
        if (next?.classList.contains("detail")) next.remove();
        if (open) return;
        button.setAttribute("aria-expanded", "true");
        row.after(
          el(
            "tr",
            { class: "detail" },
            el(
              "td",
              { colspan: String(contenders.length + 1) },
              el(
                "div",
                { class: "detail-box" },
                el("p", {}, el("strong", {}, name), `, ${test}: `, el("b", { class: result.status === "fail" ? "bad" : "" }, word), result.note ? `. ${result.note}` : ""),
                facts([
                  ["Figure", silent ? null : quantity(result.figure, result.unit)],
                  ["Tolerance", silent ? null : quantity(result.tolerance, result.unit)],
                ]),
              ),
            ),
          ),
        );
      });
      row.append(el("td", { class: "gate" }, button));
    }
    body.append(row);
  }
  const counts = new Map<string, number>();
  for (const result of results) counts.set(result.status, (counts.get(result.status) ?? 0) + 1);
  const caption = [...counts].map(([status, count]) => `${count} × ${kMarks[status as GateStatus]?.word ?? status}`).join(", ");
  return scrollFrame(
    "Conformance gate",
    `${caption}. A click shows figure, tolerance and note.`,
    el("table", { class: "gate-table" }, el("thead", {}, head), body),
  );
}
