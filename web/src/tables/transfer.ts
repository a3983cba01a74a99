// Where a policy works: whether the robot stays up under a policy, by contender and timestep, and where its motion parts from that
// of training. Signs and words stand beside the colours.
import { momentLink } from "../address";
import { replayOf, valueInfo, type Report, type TransferMatrix, type TransferRow } from "../data";
import { el, svg, type Child } from "../dom";
import { counted, percent, plain, quantity, sentenceList, timestep } from "../format";
import { engineOf, type Palette } from "../palette";
import { swatch } from "../plots/legend";
import { picture } from "../plots/picture";
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

// The share of runs that fall, with its interval, as a bar.
function share(value: number, low: number | null, high: number | null): SVGSVGElement {
  const width = 40;
  const bar = svg("svg", { class: "share", width, height: 8, viewBox: `0 0 ${width} 8`, "aria-hidden": "true" }, svg("rect", { class: "all", x: 0, y: 2, width, height: 4 }), svg("rect", { class: "fell", x: 0, y: 2, width: width * value, height: 4 }));
  if (low !== null && high !== null) bar.append(svg("path", { class: "whisker", d: `M${width * low},1V7M${width * low},4H${width * high}M${width * high},1V7` }));
  return bar;
}

function cell(matrix: TransferMatrix, row: TransferRow | undefined): HTMLElement {
  if (!row) return el("td", { class: "transfer-cell none" }, "");
  const { sign, word, style } = kVerdicts[row.verdict];
  const failed = row.verdict === "no run" && row.outcome !== "ok";
  const rate = row.values["fall_rate"];
  const fallen = rate?.value === null || rate?.value === undefined ? null : Math.round(rate.value * row.runs);
  const range = rate && rate.low !== null && rate.high !== null ? `, 95 % interval of the share ${percent(rate.low)} to ${percent(rate.high)}` : "";
  const count = fallen === null ? "" : `${fallen} of ${row.runs} fall`;
  const span = rate && rate.low !== null && rate.high !== null ? ` (${plain(100 * rate.low, 2)} to ${percent(rate.high)})` : "";
  const { against_training: against, excess } = row;
  const notes = [count ? `${count}${range}` : "", against && matrix.trained_in ? (against === "not told apart" ? `${against} from training` : `${against} than in training`) : "", excess ?? ""];
  const text = `${row.contender} at ${timestep(row.timestep_ms)} ms: ${[row.verdict, ...notes].filter(Boolean).join(", ")}${row.reason ? `; ${row.reason}` : ""}`;
  const button = el(
    "button",
    { type: "button", class: "transfer-button", title: text, "data-timestep": row.timestep_ms, "data-contender-of": row.contender },
    el("span", { class: "sign" }, sign),
    ` ${failed ? row.outcome : word}`,
    failed && row.reason ? el("small", {}, row.reason) : null,
    count ? " " : null,
    count ? el("small", {}, count + span) : null,
    rate && fallen !== null ? share(rate.value ?? 0, rate.low, rate.high) : null,
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
  const at = contact > 0 ? `in ${contact} of these a contact with the ground begins or ends in one run only` : null;
  return [el("b", {}, body ?? "a body"), ` by ${joint ?? "the base itself"}`, el("small", { title: at }, `after ${quantity(median_s, "s")}, ${same_body} of ${starts} runs`)];
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

// Values that are compared with those of training, as far as a matrix has them, with what a flag says.
const kCompared: [name: string, title: string, word: string][] = [
  ["velocity_error", "Velocity error", "off the command"],
  ["foot_slip", "Slip", "slips"],
  ["joint_power", "Power", "takes power"],
];

function compared(matrix: TransferMatrix, row: TransferRow | undefined, name: string, word: string): HTMLElement {
  const value = row?.values[name];
  if (!row || !value || value.value === null) return el("td", { class: "transfer-cell none" }, "–");
  const trained = matrix.rows.find((each) => each.trained)?.values[name]?.value ?? null;
  const excess = row.excesses.find((one) => one.value === name);
  const times = trained && !row.trained ? value.value / trained : null;
  const range = value.low !== null && value.high !== null ? ` (${quantity(value.low, value.unit)} to ${quantity(value.high, value.unit)})` : "";
  return el(
    "td",
    { class: `transfer-value${excess ? " outlier" : ""}`, "data-value": name, title: `${valueInfo(name).label}: ${quantity(value.value, value.unit)}${range}` },
    quantity(value.value, value.unit, 2),
    times === null ? null : el("small", {}, excess ? `▲ ${plain(excess.times, 2)}× training, ${word}` : `${plain(times, 2)}×`),
  );
}

function table(report: Report, matrix: TransferMatrix, palette: Palette): HTMLTableElement {
  const steps = [...new Set(matrix.rows.map((row) => row.timestep_ms))].sort((a, b) => a - b);
  // as the program orders rows, the lowest fall rate first, behind the contender of training
  const contenders = [...new Set(matrix.rows.map((row) => row.contender))].sort((a, b) => Number(b === matrix.trained_in) - Number(a === matrix.trained_in));
  const values = kCompared.filter(([name]) => matrix.rows.some((row) => (row.values[name]?.value ?? null) !== null));
  const links = new Map(contenders.map((contender) => [contender, link(matrix, told(matrix, matrix.rows.filter((row) => row.contender === contender)))]));
  const replays = [...links.values()].some(Boolean);
  const head = ["Contender", ...steps.map((step) => `${timestep(step)} ms${step === matrix.trained_ms ? " (training)" : ""}`), ...values.map(([, title]) => (matrix.rows.some((row) => row.trained) ? `${title}, × training` : title)), "First body to separate", ...(replays ? ["Replay"] : [])];
  const bodies = contenders.map((contender) => {
    const rows = matrix.rows.filter((row) => row.contender === contender);
    const row = told(matrix, rows);
    const shown = rows.find((each) => each.timestep_ms === matrix.trained_ms) ?? rows[0];
    return el(
      "tr",
      { "data-engine": report.contenderByName.has(contender) ? engineOf(report.contenderByName.get(contender)!) : contender },
      el("th", { scope: "row", class: "sticky" }, el("span", { class: "contender" }, swatch(palette, contender), contender, contender === matrix.trained_in ? " (training)" : null)),
      ...steps.map((step) => cell(matrix, rows.find((each) => each.timestep_ms === step))),
      ...values.map(([name, , word]) => compared(matrix, shown, name, word)),
      el("td", { class: "transfer-parts" }, ...(contender === matrix.trained_in && row?.parting.parted === 0 ? ["–"] : parts(row))),
      replays ? el("td", { class: "transfer-replay" }, links.get(contender)) : null,
    );
  });
  return el("table", { class: "transfer-table" }, el("thead", {}, el("tr", {}, ...head.map((title, i) => el("th", { scope: "col", class: i === 0 ? "sticky" : null }, title)))), el("tbody", {}, ...bodies));
}

export function transfers(report: Report, matrix: TransferMatrix, palette: Palette): Child[] {
  const [first = "", ...others] = matrix.answer;
  // of those that stay up and yet are not among the first
  const worse = matrix.rows.filter((row) => row.verdict === "stays up, but worse").map((row) => `${row.contender} at ${timestep(row.timestep_ms)} ms`);
  const runs = Math.max(0, ...matrix.rows.map((row) => row.runs));
  const at = matrix.trained_ms === null ? "" : ` at ${timestep(matrix.trained_ms)} ms`;
  const training = matrix.trained_in ? `First body to separate: the body that is first more than 1 mm from that in ${matrix.trained_in}, where the policy was trained${at}, and the joint that moves it the most.` : "";
  const against = matrix.rows.some((row) => row.against_training)
    ? `Falls more or less often: the share differs from that of training by the rank test, p at most ${matrix.told_apart} after a correction for the number of rows. ! and ▲: an error, the slip or the power is at least ${matrix.many_times} times that of training, even by the near ends of the 95 % intervals.`
    : "";
  const facts = [runs === 0 ? "No run has a sound result" : `${counted(runs, "run")} of ${quantity(matrix.duration_s, "s")} each`, matrix.policy, matrix.pushes ?? "", matrix.trained_in ? `trained in ${matrix.trained_in}${at}` : ""].filter(Boolean);
  const drawn = report.json.pictures?.find((candidate) => candidate.system === matrix.system);
  const look = drawn ? picture(drawn, 150, 90) : null;
  return [
    el(
      "div",
      { class: "panel transfer-panel", "data-system": matrix.system },
      el(
        "div",
        { class: "transfer-head" },
        el("div", {}, report.json.transfer?.length === 1 ? null : el("h3", {}, matrix.system), el("p", { class: "transfer-answer" }, `${capital(first)}.`), worse.length > 0 ? el("p", { class: "sub" }, `Stays up, but worse: ${sentenceList(worse)}.`) : null, el("p", { class: "sub" }, facts.join(" · "))),
        look,
      ),
      scrollFrame(`Where the policy works on ${matrix.system}, by contender and timestep`, "", table(report, matrix, palette)),
      others.length > 0 ? el("details", { class: "note transfer-words" }, el("summary", {}, "The same in words"), el("ul", { class: "transfer-others" }, ...others.map((line) => el("li", {}, `${capital(line)}.`)))) : null,
      el("p", { class: "quiet note" }, "✓ stays up: the 95 % interval of the share that falls ends at or below 20 %; ✗ falls: it begins at or above 50 %; ? neither. A click on a count opens its details."),
      training || against ? el("details", { class: "note" }, el("summary", {}, "How training is compared"), el("p", {}, against), el("p", {}, training)) : null,
    ),
  ];
}
