// Assembles the page from the JSON inside it.
import { readReport, type Report } from "./data";
import { drawWaiting, el, type Child } from "./dom";
import { sentenceList } from "./format";
import { outcomeCounts } from "./analysis";
import { claimsList } from "./claims";
import { Palette, shownAtFirst } from "./palette";
import { canPick, picker } from "./picker";
import { Pieces } from "./pieces";
import { scalingPanel } from "./plots/scaling";
import { state } from "./state";
import { systemSummary } from "./summary";
import { fillSystem } from "./system";
import { engines, fairness } from "./tables/fairness";
import { failureTable } from "./tables/failures";
import { gate } from "./tables/gate";
import { harnessCost, manifestTable, stealSummary } from "./tables/manifest";
import { valuesTable } from "./tables/values";
import { tooltip } from "./tooltip";

function header(report: Report): HTMLElement {
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
  return el(
    "header",
    { class: "masthead" },
    el("p", { class: "wordmark" }, "assay"),
    el("h1", {}, "Physics engines, side by side"),
    el("p", { class: "lead" }, lead(report)),
    facts,
  );
}

function lead(report: Report): string {
  const cells = report.json.cells.filter((cell) => !report.isHarness(cell.contender));
  const counts = outcomeCounts(cells);
  const good = counts.get("ok") ?? 0;
  const contenders = new Set(cells.map((cell) => cell.contender));
  const engineNames = new Set(report.contenders.filter((c) => contenders.has(c.name) && c.engine).map((c) => c.engine.replace(/-(f32|f64)$/, "")));
  if (cells.length === 0) return "These results are empty: no cell of the campaign has been measured yet.";
  const body = `${contenders.size} contenders of ${engineNames.size} engines on ${report.json.systems.length} ${report.json.systems.length === 1 ? "system" : "systems"}: ${cells.length} cells`;
  if (good === 0) return `${body}, and none of them has a sound result.`;
  if (good === cells.length) return `${body}, all with a sound result.`;
  const failed = [...counts].filter(([outcome]) => outcome !== "ok").map(([outcome, count]) => `${count} ${outcome}`);
  return `${body}, ${good} with a sound result; ${sentenceList(failed)}.`;
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

function build(report: Report, page: HTMLElement): void {
  const palette = new Palette(report);
  const everyone = report.contenders.map((contender) => contender.name);
  state.show(shownAtFirst(everyone), everyone);
  const measured = report.json.cells.some((cell) => !report.isHarness(cell.contender));
  const claims = report.json.claims ?? [];
  const pieces = new Pieces();
  const links: [string, string][] = [];
  const nav = el("nav", { "aria-label": "Parts of the report" });
  page.append(header(report), nav);

  const add = (section: HTMLElement, name: string, fill: () => Child[]) => {
    links.push([section.id, name]);
    page.append(section);
    pieces.add(section, () => {
      for (const child of fill()) if (child) section.append(child);
      section.removeAttribute("aria-busy");
    });
  };
  if (claims.length > 0) {
    const text = "Each finding of Erez, Tassa and Todorov (ICRA 2015), judged by today's versions of the paper's engines; then what all of today's engines say.";
    add(part("claims", "What the paper found, tested again", text), "Claims", () => [claimsList(claims)]);
  }
  if (measured && canPick(report)) {
    const text = "The fastest contender whose error is small enough, at the timestep at which it is.";
    add(part("pick", "Which engine?", text), "Which engine?", () => [picker(report, palette)]);
  }
  const gated = "A contender is scored only when its adapter passes these tests against closed forms and independent solutions. A deviation that is the engine's own is proven, declared and bounded.";
  add(part("gate", "Conformance gate", gated), "Gate", () => [gate(report)]);
  const views = report.mainSystems.map((system) => ({ system, view: report.view(system.name) }));
  if (measured) {
    add(part("summary", "Summary", ""), "Summary", () => [el("div", { class: "summary" }, ...views.map(({ view }) => systemSummary(view, palette)))]);
  } else {
    page.append(
      el("p", { class: "alert" }, "Nothing has been measured yet. Start the campaign, or the same command again if it was stopped; then make the report anew."),
    );
  }
  for (const [index, { system, view }] of views.entries()) {
    const section = el("section", { class: "system", id: view.system, "aria-busy": "true" }, el("h2", {}, view.system));
    links.push([view.system, view.system]);
    page.append(section);
    const fill = () => {
      pieces.add(section, ...fillSystem(section, view, system, palette), () => section.removeAttribute("aria-busy"));
    };
    // The first plots are drawn before anything else of the page.
    if (index === 0) fill();
    else pieces.add(section, fill);
  }
  if (report.sizes.length > 0) {
    add(part("scaling", "Scaling", "Processor time of a whole run of systems that differ in size alone."), "Scaling", () => [scalingPanel(report, palette)]);
  }
  if (measured) add(part("values", "All values", ""), "Values", () => [valuesTable(report)]);
  const failed = "A cell that fails is a result: its outcome and reason are kept. Cells that differ in the timestep alone share a row.";
  add(part("failures", "What failed", failed), "Failures", () => [failureTable(report, palette), leftOut(report)]);
  add(part("fairness", "Fairness", ""), "Fairness", () => [fairness(report, palette)]);
  add(part("manifest", "Manifest", ""), "Manifest", () => [engines(report), manifestTable(report)]);
  nav.append(...links.map(([id, name]) => el("a", { href: `#${id}` }, name)));
  tooltip.attach();
  drawWaiting();
  performance.mark("assay:first-plots");

  let moved = false; // by the reader
  const move = () => (moved = true);
  for (const type of ["wheel", "touchstart", "pointerdown", "keydown"]) window.addEventListener(type, move, { once: true, passive: true });
  const rest = () =>
    pieces.start(() => {
      // What an address names may have been pushed away by what was drawn above it.
      if (!moved && location.hash.length > 1) document.getElementById(decodeURIComponent(location.hash.slice(1)))?.scrollIntoView();
      document.body.dataset.ready = "";
    });
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", rest, { once: true });
  else rest();
}

const page = document.getElementById("page");
if (page) build(readReport(), page);
