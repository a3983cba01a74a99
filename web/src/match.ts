// The page of measured motion (`assay match`): which contender moves as the robot did, with which parameters.
import { Address } from "./address";
import type { Match, MotionLog, Report } from "./data";
import { el, type Child } from "./dom";
import { counted, sentenceList, timestep } from "./format";
import { folded, Frame, mastheadOf, part } from "./frame";
import { Palette } from "./palette";
import { swatch } from "./plots/legend";
import { contenderErrors, logErrors } from "./plots/match_errors";
import { coordinates, kMeasured, MotionPlot, runName, type Coordinate } from "./plots/motion";
import { measuredReplay } from "./replay/panel";
import { roving } from "./roving";
import { markContenders, state } from "./state";
import { manifestTable } from "./tables/manifest";
import { byTimestep, checks, fittedParameters, matchWarnings, phases, ranking } from "./tables/matched";

// " deg" of the program's sentences as a reader writes it.
function degrees(text: string): string {
  return text.replace(/ deg\b/g, "°");
}

function lead(match: Match): string {
  const all = match.contenders.length + match.to_do.length;
  const windows = match.windows === "whole motions" ? "whole motions" : `stretches of ${match.windows.report_s} s`;
  const judged = match.held_out_by === "leaving one out" ? `each of ${counted(match.held_out.length, "log")} judged by a fit to the others` : `${counted(match.training.length, "log")} to fit, ${match.held_out.length} to judge`;
  return `${counted(all, "contender")}; ${judged}, by ${windows}; timestep ${timestep(match.timestep_ms)} ms`;
}

const kRoles: Record<MotionLog["roles"][number], string> = { worst: "the worst log", median: "the median log", separating: "the log that separates contenders most" };

function roleText(log: MotionLog, match: Match): string {
  return match.held_out.length === 1 ? "the only held-out log" : sentenceList(log.roles.map((role) => kRoles[role]));
}

// Runs of the kept logs, each with a button that shows or hides it everywhere on the page.
function runButtons(names: string[], palette: Palette): HTMLElement {
  const items = names.map((name) => {
    const button = el("button", { type: "button", class: "legend-item", role: "checkbox", "data-contender": name, "aria-checked": "true" }, swatch(palette, name), el("span", {}, name));
    button.addEventListener("click", () => state.toggle(name));
    button.addEventListener("pointerenter", (event) => event.pointerType === "mouse" && state.setHighlight(name));
    button.addEventListener("pointerleave", () => state.setHighlight(null));
    return button;
  });
  const box = el("div", { class: "legend match-legend", role: "group", "aria-label": "Runs shown" }, ...items);
  roving(box);
  const update = () => {
    for (const button of items) button.setAttribute("aria-checked", String(!state.isHidden(button.dataset.contender ?? "")));
    markContenders(box);
  };
  state.subscribe(update);
  update();
  return box;
}

// Names of the runs that are kept, the best contender's first.
function keptRuns(logs: MotionLog[]): string[] {
  return [...new Set(logs.flatMap((log) => log.runs.filter((run) => run.contender !== kMeasured).map(runName)))];
}

// Where the best contender is farthest from what was measured, by the range of the motion.
function farthestCoordinate(log: MotionLog, all: Coordinate[]): Coordinate {
  const [measured, run] = log.runs;
  const far = (each: Coordinate) => {
    const numbers = (values: (number | null)[]) => values.filter((value): value is number => value !== null);
    const truth = numbers(each.values(measured!));
    const off = numbers(each.residuals(run ?? measured!, measured!)).map(Math.abs);
    return Math.max(0, ...off) / Math.max(each.least, Math.max(...truth) - Math.min(...truth));
  };
  return all.reduce((best, each) => (far(each) > far(best) ? each : best), all[0]!);
}

function motionPanel(match: Match, logs: MotionLog[], palette: Palette): HTMLElement {
  let log = logs[0]!;
  let all = coordinates(log);
  let coordinate = farthestCoordinate(log, all);
  const plot = new MotionPlot(palette, log, coordinate);
  const note = el("p", { class: "quiet note" });
  const name = (each: MotionLog) => `${each.log}: ${roleText(each, match)}`;
  const logs_ = el("select", { "aria-label": "Log" }, ...logs.map((each, index) => el("option", { value: index }, name(each))));
  const which = el("select", { "aria-label": "Coordinate" });
  const options = () => which.replaceChildren(...all.map((each, index) => el("option", { value: index, selected: each.name === coordinate.name }, each.name)));
  const tell = () => {
    const ended = log.runs.filter((run) => run.ended).map((run) => `${runName(run)} ends early: ${run.ended}`);
    const again = log.windows.length > 1 ? "At each dotted line the simulations start again from the measured state." : "The simulations start from the measured state.";
    note.textContent = [again, ...ended].join(" ");
  };
  const show = () => {
    plot.show(log, coordinate);
    tell();
  };
  logs_.addEventListener("change", () => {
    log = logs[Number(logs_.value)]!;
    all = coordinates(log);
    coordinate = all.find((each) => each.name === coordinate.name) ?? all[0]!;
    options();
    show();
  });
  which.addEventListener("change", () => {
    coordinate = all[Number(which.value)]!;
    show();
  });
  options();
  tell();
  return el(
    "figure",
    { class: "panel motion-panel" },
    el("figcaption", {}, plot.saves, el("h3", {}, "Over time"), el("div", { class: "replay-bar" }, el("label", {}, "Log ", logs_), el("label", {}, "of ", which))),
    runButtons(keptRuns(logs), palette),
    plot.canvas,
    note,
  );
}

export function buildMatch(report: Report, masthead: HTMLElement, nav: HTMLElement, page: HTMLElement): void {
  const match = report.json.match!;
  const palette = new Palette(report);
  const best = match.contenders.find((one) => one.score);
  const second = match.contenders.filter((one) => one.score)[1];
  const first = [kMeasured, best?.contender, best && `${best.contender} untuned`, second?.contender].filter((name): name is string => name !== undefined);
  const address = new Address(report, first);
  const frame = new Frame(nav, page, address);
  const logs = match.motion ?? [];
  document.title = match.like ? `${match.model}: like ${match.like}` : `${match.model}: measured motion`;
  mastheadOf(report, masthead, `${match.model}: which engine moves as ${match.like ? `${match.like} does` : "measured"}`, lead(match));

  const answer = part("answer", `Which contender moves as ${match.like ?? "the robot"} does?`, match.like ? `The measured motion of this page is that of ${match.like}, in place of logs.` : "");
  frame.add(answer, "Answer", (): Child[] => [
    match.to_do.length > 0 ? el("p", { class: "alert" }, `Not complete: ${sentenceList(match.to_do)} ${match.to_do.length === 1 ? "has" : "have"} not been fitted yet. The same command goes on where it stopped; motion and replays are added at its end.`) : null,
    el("p", { class: "match-answer" }, degrees(match.answer)),
    el("div", { class: "match-overview" }, best ? contenderErrors(match, palette) : null, match.contenders.length + match.to_do.length > 0 ? el("div", { class: "panel" }, ranking(match, palette)) : null),
  ], true);
  if (logs.length > 0) {
    const text = "Held-out logs by the best contender's error. Grey: what was measured. Colours: what contenders make of it from the same first state, fitted (full lines) and untuned (dashed).";
    frame.add(part("motion", "Measured and simulated motion", text), "Motion", () => [motionPanel(match, logs, palette)]);
  }
  if (best) {
    const odd = match.odd_names ?? [];
    const text = odd.length > 0 ? `Odd logs, which no contender explains as it does the others: ${sentenceList(odd.slice(0, 5))}${odd.length > 5 ? ` and ${odd.length - 5} more` : ""}.` : "";
    const names = match.contenders.filter((one) => one.score).flatMap(({ contender }) => [contender, `${contender} untuned`]);
    frame.add(part("logs", "Error by log", text), "Logs", () => [logs.length > 0 ? null : runButtons(names, palette), logErrors(match, palette), phases(match, palette), byTimestep(match, palette)]);
  }
  if (logs.length > 0) {
    frame.add(part("replays", "Replays", ""), "Replays", () => {
      const panels = logs
        .filter((log) => log.roles.some((role) => role !== "separating"))
        .map((log) => measuredReplay(report.view(log.log), palette, { title: `${log.log}: ${roleText(log, match)}`, text: "What was measured is translucent, what contenders make of it is drawn in their colours. The buttons above choose the runs. Drag to turn the view; hold Shift and turn the wheel to zoom." }));
      return [runButtons(keptRuns(logs), palette), ...(panels.some(Boolean) ? panels : [el("p", { class: "quiet" }, "There is nothing to play: the logs do not say where all bodies of the model are.")])];
    });
  }
  if (match.contenders.some((one) => (one.parameters ?? []).length > 0)) {
    frame.add(part("parameters", "Fitted parameters", ""), "Parameters", () => fittedParameters(match, palette));
  }
  const warnings = matchWarnings(match).length;
  frame.add(folded("checks", "Checks and warnings", [warnings > 0 ? counted(warnings, "warning") : "", match.findings.length > 0 ? counted(match.findings.length, "finding") + " in the logs" : ""].filter(Boolean).join(", ") || "none", ""), "Checks", () => checks(match));
  frame.add(folded("manifest", "Manifest", "the machine and the program behind these figures", ""), "Manifest", () => [manifestTable(report)]);
  frame.finish();
}
