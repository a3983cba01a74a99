// Assembles the page from the JSON inside it.
import { readReport, type Report } from "./data";
import { drawWaiting, el, type Child } from "./dom";
import { sentenceList } from "./format";
import { outcomeCounts } from "./analysis";
import { claimsList } from "./claims";
import { Palette, shownAtFirst } from "./palette";
import { picker } from "./picker";
import { scalingPanel } from "./plots/scaling";
import { state } from "./state";
import { systemSummary } from "./summary";
import { systemSection } from "./system";
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

function part(id: string, title: string, text: string, ...content: Child[]): HTMLElement {
  return el("section", { id, class: "part" }, el("h2", {}, title), text ? el("p", { class: "sub" }, text) : null, ...content);
}

function build(report: Report, page: HTMLElement): void {
  const palette = new Palette(report);
  const everyone = report.contenders.map((contender) => contender.name);
  state.show(shownAtFirst(everyone), everyone);
  const systems = report.mainSystems;
  const views = systems.map((system) => report.view(system.name));
  const measured = report.json.cells.some((cell) => !report.isHarness(cell.contender));
  const claims = report.json.claims ?? [];
  const choice = measured ? picker(report, palette) : null;
  const sizes = report.sizes.length > 0;
  const links: [string, string][] = [
    ...(claims.length > 0 ? [["claims", "Claims"] as [string, string]] : []),
    ...(choice ? [["pick", "Which engine?"] as [string, string]] : []),
    ["gate", "Gate"],
    ...(measured ? [["summary", "Summary"] as [string, string]] : []),
    ...systems.map((system): [string, string] => [system.name, system.name]),
    ...(sizes ? [["scaling", "Scaling"] as [string, string]] : []),
    ...(measured ? [["values", "Values"] as [string, string]] : []),
    ["failures", "Failures"],
    ["fairness", "Fairness"],
    ["manifest", "Manifest"],
  ];
  page.append(header(report));
  page.append(el("nav", { "aria-label": "Parts of the report" }, ...links.map(([id, name]) => el("a", { href: `#${id}` }, name))));
  if (claims.length > 0) {
    page.append(
      part("claims", "What the paper found, tested again", "Each finding of Erez, Tassa and Todorov (ICRA 2015), judged by today's versions of the paper's engines; then what all of today's engines say.", claimsList(claims)),
    );
  }
  if (choice) page.append(part("pick", "Which engine?", "The fastest contender whose error is small enough, at the timestep at which it is.", choice));
  page.append(
    part("gate", "Conformance gate", "A contender is scored only when its adapter passes these tests against closed forms and independent solutions. A deviation that is the engine's own is proven, declared and bounded.", gate(report)),
  );
  if (measured) {
    page.append(
      part("summary", "Summary", "", el("div", { class: "summary" }, ...views.map((view) => systemSummary(view, palette)))),
    );
  } else {
    page.append(
      el("p", { class: "alert" }, "Nothing has been measured yet. Start the campaign, or the same command again if it was stopped; then make the report anew."),
    );
  }
  // The rest comes piece by piece, each in a task of its own, so that the first plots are there at once.
  const pieces = [
    ...systems.map((system, index) => () => systemSection(views[index]!, system, palette)),
    ...(sizes ? [() => part("scaling", "Scaling", "Processor time of a whole run of systems that differ in size alone.", scalingPanel(report, palette))] : []),
    ...(measured ? [() => part("values", "All values", "", valuesTable(report))] : []),
    () => part("failures", "What failed", "A cell that fails is a result: its outcome and reason are kept. Cells that differ in the timestep alone share a row.", failureTable(report), leftOut(report)),
    () => part("fairness", "Fairness", "", fairness(report, palette)),
    () => part("manifest", "Manifest", "", engines(report), manifestTable(report)),
  ];
  tooltip.attach();
  const next = () => {
    const piece = pieces.shift();
    if (!piece) {
      // What an address names may have come only now.
      if (location.hash.length > 1) document.getElementById(decodeURIComponent(location.hash.slice(1)))?.scrollIntoView();
      document.body.dataset.ready = "";
      return;
    }
    page.append(piece());
    drawWaiting();
    setTimeout(next, 0);
  };
  next();
}

const page = document.getElementById("page");
if (page) build(readReport(), page);
