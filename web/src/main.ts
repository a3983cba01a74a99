// Assembles the page from the JSON inside it.
import { citation, glossary } from "./about";
import { Address } from "./address";
import { cards } from "./answers";
import { claimsList } from "./claims";
import { readReport, type Report } from "./data";
import { Drawer } from "./details";
import { drawWaiting, el, type Child } from "./dom";
import { sectionBar } from "./nav";
import { Palette } from "./palette";
import { canPick, picker } from "./picker";
import { Pieces } from "./pieces";
import { recommendation } from "./recommendation";
import { batchPanels } from "./plots/batches";
import { scalingPanel } from "./plots/scaling";
import { state } from "./state";
import { fillSystem } from "./system";
import { changes } from "./tables/changes";
import { courses } from "./tables/courses";
import { engines, fairness } from "./tables/fairness";
import { failureTable } from "./tables/failures";
import { gate } from "./tables/gate";
import { harnessCost, manifestTable, stealSummary } from "./tables/manifest";
import { parity } from "./tables/parity";
import { transfers } from "./tables/transfer";
import { valuesTable } from "./tables/values";
import { themeSwitch } from "./theme";
import { tooltip } from "./tooltip";

function plate(report: Report): HTMLElement {
  const facts = el("dl", { class: "plate" });
  const add = (name: string, value: string | null) => {
    if (value) facts.append(el("div", {}, el("dt", {}, name), el("dd", {}, value)));
  };
  add("Campaign", report.manifest("campaign_title") || report.manifest("campaign"));
  add("CPU", report.manifest("cpu"));
  add("Governor", report.manifest("governor"));
  add("Measured", report.manifest("finished") ?? report.manifest("started"));
  add("assay", [report.manifest("assay_version"), report.manifest("commit")?.slice(0, 12)].filter(Boolean).join(", "));
  const harness = harnessCost(report);
  add("Harness", harness ? `${harness.short} a step at most` : null);
  const steal = stealSummary(report);
  add("Steal", steal ? steal.replace(/ of the machine.*$/, "") : null);
  return facts;
}

function lead(report: Report): string {
  const { cells, ok } = report.json.measured;
  const contenders = new Set(report.json.measured.contenders);
  const engineNames = new Set(report.contenders.filter((c) => contenders.has(c.name) && c.engine).map((c) => c.engine.replace(/-(f32|f64)$/, "")));
  if (cells === 0) return "These results are empty: no cell of the campaign has been measured yet.";
  const systems = report.json.systems.length;
  const lines = new Set([...contenders].map((name) => report.varied(name))).size;
  const swept = lines < contenders.size ? ` in ${contenders.size} settings` : "";
  const body = `${lines} contenders of ${engineNames.size} engines${swept} on ${systems} ${systems === 1 ? "system" : "systems"}`;
  return ok === 0 ? `${body}: none of the ${cells} cells has a sound result.` : `${body}; ${ok} of ${cells} cells have a sound result.`;
}

// Contenders of the campaign whose engine is not there.
function leftOut(report: Report): HTMLElement | null {
  const absent = report.json.contenders.filter((contender) => typeof contender.build["absent"] === "string");
  if (absent.length === 0) return null;
  return el(
    "div",
    {},
    el("p", { class: "sub table-text" }, "Left out of the campaign:"),
    el("ul", {}, ...absent.map((contender) => el("li", {}, el("strong", {}, contender.name), `: ${contender.build["absent"]}`))),
  );
}

// A part of the page that is filled later; until then it holds its place.
function part(id: string, title: string, text: string): HTMLElement {
  return el("section", { id, class: "part", "aria-busy": "true" }, el("h2", {}, title), text ? el("p", { class: "sub" }, text) : null);
}

function build(report: Report, masthead: HTMLElement, nav: HTMLElement, page: HTMLElement): void {
  state.lineOf = (contender) => report.varied(contender);
  const palette = new Palette(report);
  const address = new Address(report, palette.first);
  const measured = report.json.measured.cells > 0;
  const claims = report.json.claims ?? [];
  const pieces = new Pieces();
  const links: [string, string][] = [];
  const answered = report.json.answer ?? [];
  const title = (answered.length > 0 && report.manifest("campaign_title")) || "Physics engines, side by side";
  masthead.append(
    el("div", { class: "title" }, el("p", { class: "wordmark" }, "assay"), el("h1", {}, title)),
    el("p", { class: "lead" }, lead(report)),
    themeSwitch(),
  );

  const add = (section: HTMLElement, name: string, fill: () => Child[], now = false) => {
    links.push([section.id, name]);
    page.append(section);
    const draw = () => {
      for (const child of fill()) if (child) section.append(child);
      section.removeAttribute("aria-busy");
    };
    if (now) draw();
    else pieces.add(section, draw);
  };
  if (answered.length > 0) {
    const text = "The answer for all systems together, as the command gave it. Below: each system with its plots and replays.";
    add(part("recommendation", "Recommendation", text), "Recommendation", () => [recommendation(answered)], true);
  }
  if (report.answered.length > 0) {
    const text = "A contender is an engine with its settings. A timestep is sound when every measure ended well there and at every smaller one.";
    add(part("answers", "Which engine?", text), "Answers", () => [cards(report, palette)], true);
  }
  if (canPick(report)) {
    const text = "The fastest contender within all of your limits. Each error is the largest at that or any smaller timestep, and a speed is never extrapolated.";
    add(part("pick", "Within your limits", text), "Your limits", () => [picker(report, palette)]);
  }
  const transferred = report.json.transfer ?? [];
  if (transferred.length > 0) {
    const text = "Runs under one policy, from perturbed starts, in every engine: where the robot stays up, and where its motion first parts from that of training.";
    add(part("transfer", "Who transfers?", text), "Transfer", () => transferred.flatMap((matrix) => transfers(report, matrix, palette)));
  }
  if (claims.length > 0) {
    const text = "Each claim of Erez, Tassa and Todorov (ICRA 2015), judged by today's versions of the paper's engines. A claim is settled when the whole 95 % interval lies on one side of its threshold.";
    add(part("claims", "What the paper claims, tested again", text), "Claims", () => [claimsList(claims)]);
  }
  const compared = report.json.changes;
  if (compared) add(part("changes", "What changed", `${compared.summary.charAt(0).toUpperCase()}${compared.summary.slice(1)}.`), "Changes", () => changes(report, compared));
  const followed = report.json.history;
  if (followed) {
    const text = `The course of each contender over ${followed.runs.length} runs, where it changed.`;
    add(part("history", "History", text), "History", () => courses(report, followed));
  }
  const views = report.mainSystems.map((system) => ({ system, view: report.view(system.name) }));
  if (!measured) {
    page.append(el("p", { class: "alert" }, "Nothing has been measured yet. Start the campaign, or repeat the same command if it was stopped; then make the report again."));
  }
  for (const [index, { system, view }] of views.entries()) {
    const section = el("section", { class: "system", id: view.system, "aria-busy": "true" }, el("h2", {}, view.system));
    links.push([view.system, view.system]);
    page.append(section);
    const fill = () => {
      pieces.add(section, ...fillSystem(section, view, system, palette), () => section.removeAttribute("aria-busy"));
    };
    // The first plots are drawn before anything else below the answers.
    if (index === 0) fill();
    else pieces.add(section, fill);
  }
  if (report.sizes.length > 0) {
    add(part("scaling", "Scaling", "Processor time of a whole run of systems that differ only in size."), "Scaling", () => [scalingPanel(report, palette)]);
  }
  if ((report.json.batches ?? []).length > 0) {
    const text = "World-steps per second of many worlds at once: engines that step them together, and engines of one world with one process per core.";
    add(part("worlds", "Many worlds", text), "Many worlds", () => batchPanels(report, palette));
  }
  if ((report.json.parity ?? []).length > 0) {
    const text = "Whether the model's file means the same robot in every engine: the forces that explain each contender's accelerations, against Newton and Euler's equations of the file.";
    add(part("parity", "The same robot?", text), "Parity", () => [parity(report)]);
  }
  const gated = "A contender is scored only when its adapter passes these tests against closed forms and independent solutions. A deviation caused by the engine itself is proven, declared and bounded.";
  add(part("gate", "Conformance suite", gated), "Conformance", () => [gate(report)]);
  const failed = "A cell that fails is a result: its outcome and reason are kept. Cells that differ only in the timestep share a row.";
  add(part("failures", "Failures", failed), "Failures", () => [failureTable(report, palette), leftOut(report)]);
  add(part("fairness", "Fairness", ""), "Fairness", () => [fairness(report, palette)]);
  if (measured) add(part("values", "All values", ""), "Values", () => [valuesTable(report)]);
  if ((report.json.glossary ?? []).length > 0) add(part("glossary", "Glossary", ""), "Glossary", () => [glossary(report)]);
  add(part("manifest", "Manifest", "The machine, the program and the campaign behind these figures."), "Manifest", () => [plate(report), engines(report), manifestTable(report)]);
  if (measured) add(part("cite", "Cite these results", ""), "Cite", () => [citation(report)]);
  sectionBar(nav, links, (section) => address.at(section));
  tooltip.attach();
  drawWaiting();
  performance.mark("assay:first-plots");

  let moved = false; // by the reader
  const move = () => (moved = true);
  for (const type of ["wheel", "touchstart", "pointerdown", "keydown"]) window.addEventListener(type, move, { once: true, passive: true });
  const rest = () => {
    document.body.append(new Drawer(report, palette).element); // of any system's cell
    pieces.start(() => {
      // What an address names may have been pushed away by what was drawn above it.
      if (!moved) address.show();
      document.body.dataset.ready = "";
    });
  };
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", rest, { once: true });
  else rest();
}

const place = (id: string) => document.getElementById(id)!;
build(readReport(), place("masthead"), place("sections"), place("page"));
