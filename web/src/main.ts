// Assembles the page from the JSON inside it.
import { citation, glossary } from "./about";
import { Address } from "./address";
import { cards } from "./answers";
import { claimCounts, claimsList } from "./claims";
import { readReport, type Report } from "./data";
import { Drawer } from "./details";
import { drawWaiting, el } from "./dom";
import { folded, Frame, mastheadOf, part } from "./frame";
import { counted } from "./format";
import { engineGrid } from "./grid";
import { buildMatch } from "./match";
import { Palette } from "./palette";
import { canPick, picker } from "./picker";
import { addPlace } from "./places";
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
  const body = `${counted(lines, "contender")} of ${counted(engineNames.size, "engine")}${swept} on ${counted(systems, "system")}`;
  const result = ok === 0 ? `${body}: none of the ${counted(cells, "cell")} has a sound result.` : `${body}; ${ok} of ${counted(cells, "cell")} have a sound result.`;
  return report.manifest("started") && !report.manifest("finished") ? `${result} The run has not ended: more may follow.` : result;
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

const kOnePage = 12; // systems; of more each has a page of its own

function build(report: Report, masthead: HTMLElement, nav: HTMLElement, page: HTMLElement): void {
  state.lineOf = (contender) => report.varied(contender);
  const palette = new Palette(report);
  const address = new Address(report, palette.first);
  const measured = report.json.measured.cells > 0;
  const claims = report.json.claims ?? [];
  const answered = report.json.answer ?? [];
  mastheadOf(report, masthead, report.manifest("campaign_title") || "Physics engines, side by side", lead(report));
  const frame = new Frame(nav, page, address);
  const { pieces, links } = frame;
  const add = frame.add.bind(frame);
  const views = report.mainSystems.map((system) => ({ system, view: report.view(system.name) }));
  const paged = views.length > kOnePage;
  const transferred = report.json.transfer ?? [];
  const addTransfer = () => {
    const runs = "Every engine runs the same policy from the same perturbed starts.";
    add(part("transfer", "Where does the policy work?", runs), "Where it works", () => transferred.flatMap((matrix) => transfers(report, matrix, palette)));
  };
  // Policies are asked other questions than systems.
  const policies = transferred.length > 0 && !canPick(report);
  if (policies) addTransfer();
  const asks = canPick(report);
  const picture = policies ? null : engineGrid(report);
  if (picture || asks) {
    const first = el("section", { id: "overview", class: "part overview" }, el("div", { class: "overview-grid" }, picture, asks ? picker(report, palette) : null));
    links.push(["overview", "Overview"]);
    addPlace(first);
    page.append(first);
  }
  if (answered.length > 0) {
    const text = "The answer for all systems together, as the command gave it.";
    add(part("recommendation", "Recommendation", text), "Recommendation", () => [recommendation(answered)], true);
  }
  if (!policies && transferred.length > 0) addTransfer();
  if (report.answered.length > 0 && !policies) {
    const plotted = report.answered.some((view) => view.json.candidates.length > 0);
    const what = paged ? "Each opens a page of its own." : !plotted ? "" : "The ring is the answer within your limits, the dashed line the limit, the broad line the front.";
    add(part("answers", "All systems", what), "Systems", () => [cards(report, palette)]);
  }
  if (!measured) {
    page.append(el("p", { class: "alert" }, "Nothing has been measured yet. Start the campaign, or repeat the same command if it was stopped; then make the report again."));
  }
  for (const [index, { system, view }] of views.entries()) {
    const section = el("section", { class: "system", id: view.system, "aria-busy": paged ? null : "true", "data-alone": paged ? "" : null }, el("h2", {}, view.system));
    if (!paged) links.push([view.system, policies && views.length === 1 ? "Runs" : view.system]);
    page.append(section);
    const fill = () => fillSystem(section, view, system, palette);
    if (paged) {
      let drawn = false;
      const open = () => {
        if (drawn) return;
        drawn = true;
        for (const draw of fill()) draw();
        section.prepend(el("p", { class: "back" }, el("a", { href: "#answers" }, "← All systems")));
        drawWaiting();
      };
      addPlace(section, open, true);
      continue;
    }
    addPlace(section);
    const later = () => pieces.add(section, ...fill(), () => section.removeAttribute("aria-busy"));
    // The first plots are drawn before anything else below the answers.
    if (index === 0) later();
    else pieces.add(section, later);
  }
  if (report.sizes.length > 0) {
    add(folded("scaling", "Scaling", "time of a run by the number of bodies", "Processor time of a whole run of systems that differ only in size."), "Scaling", () => [scalingPanel(report, palette)]);
  }
  if ((report.json.batches ?? []).length > 0) {
    const text = "World-steps per second of many worlds at once; the tables say how they were stepped.";
    add(part("worlds", "Many worlds", text), "Many worlds", () => batchPanels(report, palette));
  }
  if (claims.length > 0) {
    const text = "Each claim of Erez, Tassa and Todorov (ICRA 2015), judged by today's versions of the paper's engines. A claim is settled when the whole 95 % interval lies on one side of its threshold.";
    add(folded("claims", "What the paper claims, tested again", claimCounts(claims), text), "Claims", () => [claimsList(claims)]);
  }
  const compared = report.json.changes;
  if (compared) add(part("changes", "What changed", `${compared.summary.charAt(0).toUpperCase()}${compared.summary.slice(1)}.`), "Changes", () => changes(report, compared));
  const followed = report.json.history;
  if (followed) {
    const text = `The course of each contender over ${followed.runs.length} runs, where it changed.`;
    add(part("history", "History", text), "History", () => courses(report, followed));
  }
  if ((report.json.parity ?? []).length > 0) {
    const text = "Whether the model's file means the same robot in every engine: the forces that explain each contender's accelerations, against Newton and Euler's equations of the file.";
    add(part("parity", "The same robot?", text), "Parity", () => [parity(report)]);
  }
  const tests = report.json.conformance;
  const passed = tests.filter((one) => one.status === "pass" || one.status === "not-applicable").length;
  const deviations = tests.filter((one) => one.status === "deviation").length;
  const gated = "A contender is scored only when its adapter passes these tests against closed forms and independent solutions. A deviation caused by the engine itself is proven, declared and bounded.";
  add(folded("gate", "Conformance suite", tests.length > 0 ? `${passed} of ${tests.length} tests pass or do not apply, ${deviations} declared deviations` : "not run", gated), "Conformance", () => [gate(report)]);
  const { cells, ok } = report.json.measured;
  const failed = "A cell that fails is a result: its outcome and reason are kept. Cells that differ only in the timestep share a row.";
  add(folded("failures", "Failures", measured ? `${cells - ok} of ${cells} cells have no sound result` : "nothing was run", failed), "Failures", () => [failureTable(report, palette), leftOut(report)]);
  add(folded("fairness", "Fairness", "settings and builds of every contender", ""), "Fairness", () => [fairness(report, palette)]);
  if (measured) add(folded("values", "All values", `of ${cells} cells, as a table to filter and save`, ""), "Values", () => [valuesTable(report)]);
  const terms = report.json.glossary ?? [];
  if (terms.length > 0) add(folded("glossary", "Glossary", `${terms.length} terms`, ""), "Glossary", () => [glossary(report)]);
  add(folded("manifest", "Manifest", "the machine, the program and the campaign behind these figures", ""), "Manifest", () => [plate(report), engines(report), manifestTable(report)]);
  if (measured) add(folded("cite", "Cite these results", "", ""), "Cite", () => [citation(report)]);
  frame.finish(() => document.body.append(new Drawer(report, palette).element)); // of any system's cell
}

const place = (id: string) => document.getElementById(id)!;
const read = readReport();
(read.json.match ? buildMatch : build)(read, place("masthead"), place("sections"), place("page"));
