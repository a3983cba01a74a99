// Who transfers: whether the robot stays up under a policy, by contender and timestep, and where its motion parts from that
// of training. Signs and words stand beside the colours.
import { momentLink } from "../address";
import { replayOf, type Report, type TransferMatrix, type TransferRow } from "../data";
import { el, type Child } from "../dom";
import { percent, quantity, timestep } from "../format";
import { engineOf, type Palette } from "../palette";
import { swatch } from "../plots/legend";
import { state } from "../state";
import { scrollFrame } from "./sortable";

const kVerdicts: Record<TransferRow["verdict"], { sign: string; word: string; style: string }> = {
  "stays up": { sign: "✓", word: "stays up", style: "good" },
  "stays up, but worse": { sign: "!", word: "stays up, but", style: "open" },
  falls: { sign: "✗", word: "falls", style: "bad" },
  "not settled": { sign: "?", word: "not settled", style: "open" },
  "no run": { sign: "–", word: "no run", style: "none" },
};
const kBefore = 0.2; // s before the runs part, where the replay is opened

function capital(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

function cell(matrix: TransferMatrix, row: TransferRow | undefined): HTMLElement {
  if (!row) return el("td", { class: "transfer-cell none" }, "");
  const { sign, word, style } = kVerdicts[row.verdict];
  const rate = row.values["fall_rate"];
  const fallen = rate?.value === null || rate?.value === undefined ? null : Math.round(rate.value * row.runs);
  const range = rate && rate.low !== null && rate.high !== null ? `, 95 % interval of the share ${percent(rate.low)} to ${percent(rate.high)}` : "";
  const count = fallen === null ? "" : `${fallen} of ${row.runs} fall`;
  const { against_training: against, excess } = row;
  const notes = [count ? `${count}${range}` : "", against && matrix.trained_in ? (against === "not told apart" ? `${against} from training` : `${against} than in training`) : "", excess ?? ""];
  const text = `${row.contender} at ${timestep(row.timestep_ms)} ms: ${[row.verdict, ...notes].filter(Boolean).join(", ")}${row.reason ? `; ${row.reason}` : ""}`;
  const button = el(
    "button",
    { type: "button", class: "transfer-button", title: text, "data-timestep": row.timestep_ms, "data-contender-of": row.contender },
    el("span", { class: "sign" }, sign),
    ` ${word}`,
    count ? " " : null,
    count ? el("small", {}, count) : null,
    against && against !== "not told apart" ? el("small", {}, `${against} than in training`) : null,
    excess ? el("small", { class: "excess" }, excess) : null,
  );
  button.addEventListener("click", () => state.choose({ system: matrix.system, contender: row.contender, timestep: row.timestep_ms }));
  return el("td", { class: `transfer-cell ${style}`, "data-verdict": row.verdict }, button);
}

// The row at the timestep of training, else the first that parts.
function told(matrix: TransferMatrix, rows: TransferRow[]): TransferRow | undefined {
  return rows.find((row) => row.timestep_ms === matrix.trained_ms && row.parting.starts > 0) ?? rows.find((row) => row.parting.parted > 0);
}

function parts(row: TransferRow | undefined): Child[] {
  if (!row || row.parting.starts === 0) return [el("span", { class: "quiet" }, "not compared")];
  const { parted, starts, body, joint, same_body, median_s, contact } = row.parting;
  if (parted === 0) return [el("span", { class: "quiet" }, "never parts")];
  const notes = [`after ${quantity(median_s, "s")}`, `${same_body} of ${starts} runs`, contact > 0 ? `at a contact in ${contact}` : ""];
  return [el("b", {}, body ?? "a body"), ` by ${joint ?? "the base itself"}`, el("small", {}, notes.filter(Boolean).join(", "))];
}

// Both runs side by side, a moment before they part.
function link(matrix: TransferMatrix, row: TransferRow | undefined): Child {
  const replay = replayOf(matrix.system);
  const trained = matrix.trained_in;
  const shown = row?.parting.shown_s;
  if (!row || !replay || !trained || shown === null || shown === undefined) return "";
  const kept = (contender: string) => replay.runs.some((run) => run.contender === contender && run.timestep_ms === row.timestep_ms);
  if (row.contender === trained || !kept(trained) || !kept(row.contender)) return "";
  const moment = { system: matrix.system, timestep: row.timestep_ms, time: Math.max(0, shown - kBefore) };
  const text = `${trained} and ${row.contender} side by side at ${quantity(moment.time, "s")}, before they part`;
  return el("a", { href: momentLink(moment, [trained, row.contender]), "aria-label": text, title: text, "data-action": "side-by-side" }, "Side by side");
}

function table(report: Report, matrix: TransferMatrix, palette: Palette): HTMLTableElement {
  const steps = [...new Set(matrix.rows.map((row) => row.timestep_ms))].sort((a, b) => a - b);
  const engines = new Map<string, Map<string, TransferRow[]>>();
  // as the program orders rows: the lowest fall rate first
  for (const row of matrix.rows) {
    const contender = report.contenderByName.get(row.contender);
    const engine = contender ? engineOf(contender) : row.contender;
    const of = engines.get(engine) ?? new Map<string, TransferRow[]>();
    engines.set(engine, of);
    of.set(row.contender, [...(of.get(row.contender) ?? []), row]);
  }
  const head = ["Contender", ...steps.map((step) => `${timestep(step)} ms${step === matrix.trained_ms ? " (training)" : ""}`), "First body to separate", "Replay"];
  const bodies = [...engines].map(([engine, contenders]) =>
    el(
      "tbody",
      {},
      el("tr", { class: "transfer-engine" }, el("th", { scope: "rowgroup", class: "sticky" }, engine), el("td", { colspan: head.length - 1 })),
      ...[...contenders].map(([contender, rows]) => {
        const row = told(matrix, rows);
        return el(
          "tr",
          {},
          el("th", { scope: "row", class: "sticky" }, el("span", { class: "contender" }, swatch(palette, contender), contender, contender === matrix.trained_in ? " (training)" : null)),
          ...steps.map((step) => cell(matrix, rows.find((each) => each.timestep_ms === step))),
          el("td", { class: "transfer-parts" }, ...(contender === matrix.trained_in && row?.parting.parted === 0 ? ["–"] : parts(row))),
          el("td", {}, link(matrix, row)),
        );
      }),
    ),
  );
  return el("table", { class: "transfer-table" }, el("thead", {}, el("tr", {}, ...head.map((title, i) => el("th", { scope: "col", class: i === 0 ? "sticky" : null }, title)))), ...bodies);
}

export function transfers(report: Report, matrix: TransferMatrix, palette: Palette): Child[] {
  const [first = "", ...others] = matrix.answer;
  const runs = Math.max(0, ...matrix.rows.map((row) => row.runs));
  const at = matrix.trained_ms === null ? "" : ` at ${timestep(matrix.trained_ms)} ms`;
  const training = matrix.trained_in ? ` First body to separate: the body that is first more than 1 mm from that in ${matrix.trained_in}, where the policy was trained${at}, and the joint that moves it the most.` : "";
  const compared = matrix.rows.some((row) => row.against_training)
    ? ` Falls more or less often: the share differs from that of training by the rank test, p at most ${matrix.told_apart} after a correction for the number of rows. !: stays up, but an error, the slip or the power is at least ${matrix.many_times} times that of training, even by the near ends of the 95 % intervals.`
    : "";
  const text = `${matrix.policy}, ${runs} ${runs === 1 ? "run" : "runs"} of ${quantity(matrix.duration_s, "s")} for each figure${matrix.pushes ? `, with ${matrix.pushes}` : ""}. ✓ stays up: the 95 % interval of the share that falls ends at or below 20 %; ✗ falls: it begins at or above 50 %; ? neither.${compared}${training} A click on a figure opens its details.`;
  return [
    el(
      "div",
      { class: "panel transfer-panel", "data-system": matrix.system },
      el("h3", {}, matrix.system),
      el("p", { class: "transfer-answer" }, `${capital(first)}.`),
      others.length > 0 ? el("ul", { class: "transfer-others" }, ...others.map((line) => el("li", {}, `${capital(line)}.`))) : null,
      scrollFrame(`Who transfers on ${matrix.system}, by contender and timestep`, text, table(report, matrix, palette)),
    ),
  ];
}
