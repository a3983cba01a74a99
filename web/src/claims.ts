// What the paper states, and what today's engines say about it.
import { onRestored } from "./address";
import { valueInfo, type Claim, type ClaimFigure } from "./data";
import { el } from "./dom";
import { interval, quantity, superscript, timestep } from "./format";
import { state } from "./state";

const kVerdicts: Record<Claim["verdict"], [sign: string, word: string]> = {
  holds: ["✓", "holds"],
  changed: ["≠", "changed"],
  "not-settled": ["≈", "not settled"],
  "not-measurable": ["?", "not measurable"],
};

// "1.67e+06x" as a reader writes it.
function readable(text: string): string {
  return text
    .replace(/(\d(?:\.\d+)?)e([+-]?\d+)/g, (_, digits: string, exponent: string) => `${digits}×10${superscript(Number(exponent))}`)
    .replace(/([\d⁰¹²³⁴-⁹])x(?![\w])/g, "$1×");
}

function sentence(text: string): string {
  return /[.!?]$/.test(text) ? text : `${text}.`;
}

function figures(list: ClaimFigure[]): HTMLElement {
  const body = el("tbody");
  for (const figure of list) {
    const unit = figure.unit;
    body.append(
      el(
        "tr",
        {},
        el("th", { scope: "row" }, figure.label || figure.contender),
        el("td", {}, figure.system),
        el("td", { class: "figure" }, figure.timestep_ms === null ? "" : `${timestep(figure.timestep_ms)} ms`),
        el("td", {}, valueInfo(figure.measure).label),
        el("td", { class: "figure number" }, quantity(figure.value, unit)),
        el("td", { class: "figure" }, interval(figure.measure, figure.low, figure.high, unit)),
      ),
    );
  }
  const head = ["Figure", "System", "Timestep", "Of", "Value", "95 % interval"].map((title, index) =>
    el("th", { scope: "col", class: [2, 4, 5].includes(index) ? "figure" : null }, title),
  );
  return el("div", { class: "scroll", tabindex: "0" }, el("table", { class: "claim-figures" }, el("thead", {}, el("tr", {}, ...head)), body));
}

function claim(one: Claim): HTMLElement {
  const [sign, word] = kVerdicts[one.verdict] ?? ["?", one.verdict];
  const now = one.now || one.key || "";
  const more = el(
    "details",
    { open: state.claim === one.number },
    el("summary", {}, one.figures.length > 0 ? `What the paper measured, and ${one.figures.length} of today's figures` : "What the paper measured"),
    one.paper ? el("p", {}, el("b", {}, "The paper: "), sentence(one.paper)) : null,
    one.summary ? el("p", { class: "claim-summary" }, el("b", {}, "Today: "), readable(one.summary)) : null,
    one.today ? el("p", { class: "claim-today" }, el("b", {}, "All contenders: "), readable(one.today)) : null,
    one.figures.length > 0 ? figures(one.figures) : null,
  );
  more.addEventListener("toggle", () => {
    if (more.open) state.claim = one.number;
    else if (state.claim === one.number) state.claim = null;
    state.kept();
  });
  onRestored(() => {
    if (state.claim === one.number) more.open = true;
  });
  return el(
    "li",
    { class: `claim ${one.verdict}`, "data-claim": one.number, id: `claim-${one.number}` },
    el("span", { class: "claim-number" }, String(one.number)),
    el(
      "div",
      { class: "claim-body" },
      now ? el("p", { class: "claim-now" }, sentence(readable(now))) : null,
      one.verdict === "not-measurable" && one.reason ? el("p", { class: "quiet" }, `Not measurable: ${sentence(one.reason)}`) : null,
      el(
        "p",
        { class: "claim-paper" },
        el("span", { class: `verdict ${one.verdict}` }, el("span", { "aria-hidden": "true" }, `${sign} `), word),
        el("span", {}, el("b", {}, `${one.title}. `), sentence(one.statement), one.threshold ? ` Threshold: ${one.threshold}.` : ""),
      ),
      more,
    ),
  );
}

// "Of 17: 9 hold, 5 changed"
export function claimCounts(claims: Claim[]): string {
  const count = (verdict: Claim["verdict"]) => claims.filter((one) => one.verdict === verdict).length;
  const words = (Object.keys(kVerdicts) as Claim["verdict"][])
    .filter((verdict) => count(verdict) > 0)
    .map((verdict) => `${count(verdict)} ${verdict === "holds" && count(verdict) !== 1 ? "hold" : kVerdicts[verdict][1]}`);
  return `of ${claims.length} claims ${words.join(", ")}`;
}

export function claimsList(claims: Claim[]): HTMLElement {
  return el("ol", { class: "claims" }, ...claims.map(claim));
}
