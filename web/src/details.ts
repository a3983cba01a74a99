// What is known of one chosen cell of a system: settings, figures, samples, the command that runs it again, its replay.
import { type Cell, type Report, valueInfo } from "./data";
import { simulateCommand } from "./command";
import { clear, el, type Child } from "./dom";
import { interval, named, percent, realtime, seconds, timestep } from "./format";
import type { Palette } from "./palette";
import { histogram } from "./plots/histogram";
import { swatch } from "./plots/legend";
import { state, type Choice } from "./state";
import { facts } from "./tooltip";

// Fills the panel's place for a replay, an element with the attribute data-replay, for the chosen cell. Others add
// themselves here.
export const replayHooks: ((slot: HTMLElement, choice: Choice) => void)[] = [];

function outcome(cell: Cell): HTMLElement {
  const sound = cell.outcome === "ok";
  return el(
    "li",
    {},
    `${cell.measure.replace(/_/g, " ")}: `,
    el("b", { class: sound ? "" : "bad" }, cell.outcome),
    cell.reason ? `, ${cell.reason}` : "",
  );
}

function values(cells: Cell[]): HTMLElement {
  const body = el("tbody");
  for (const cell of cells) {
    for (const value of cell.values) {
      body.append(
        el(
          "tr",
          { "data-value": value.name },
          el("th", { scope: "row", title: valueInfo(value.name).meaning }, valueInfo(value.name).label),
          el("td", { class: "figure" }, named(value.name, value.value, value.unit)),
          el("td", { class: "figure" }, interval(value.name, value.low, value.high, value.unit)),
        ),
      );
    }
  }
  const head = el("tr", {}, el("th", { scope: "col" }, "Value"), el("th", { scope: "col", class: "figure" }, "Figure"), el("th", { scope: "col", class: "figure" }, "95 % interval"));
  return el("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Figures of the cell" }, el("table", { class: "detail-values" }, el("thead", {}, head), body));
}

function commandBox(report: Report, choice: Choice, cells: Cell[]): Child[] {
  const command = simulateCommand(report, choice.system, choice.contender, choice.timestep);
  if (!command) return [el("p", { class: "quiet" }, "assay simulate cannot run this cell: it has no way to give this control.")];
  const code = el("code", { class: "command" }, command.text);
  const copy = el("button", { type: "button", class: "copy" }, "Copy");
  copy.addEventListener("click", () => {
    const range = document.createRange();
    range.selectNodeContents(code);
    const selection = window.getSelection();
    selection?.removeAllRanges();
    selection?.addRange(range);
    // Pages opened from a file may not be allowed to write to the clipboard: the text is selected all the same.
    navigator.clipboard?.writeText(command.text).then(
      () => (copy.textContent = "Copied"),
      () => (copy.textContent = "Selected"),
    );
  });
  const pieces = cells.some((cell) => cell.measure === "consistency");
  return [
    el("h4", {}, "Run it again"),
    el("div", { class: "command-box" }, code, copy),
    pieces
      ? el("p", { class: "quiet note" }, "The run from the system's start. Consistency's pieces start in states of the reference run.")
      : null,
  ];
}

export class Details {
  readonly element = el("section", { class: "panel details-panel", "aria-live": "polite", hidden: true });

  // For choices of any of `systems`.
  constructor(
    private readonly report: Report,
    private readonly systems: string[],
    private readonly palette: Palette,
  ) {
    state.onChoice(() => this.draw());
  }

  private draw(): void {
    const choice = state.choice;
    const mine = choice !== null && this.systems.includes(choice.system);
    this.element.hidden = !mine;
    clear(this.element);
    if (!mine) return;
    const { contender, timestep: step } = choice;
    const view = this.report.view(choice.system);
    const cells = view.cellsAt(contender, step);
    const known = this.report.contenderByName.get(contender);
    const speed = view.realtimeFactor(contender, step);
    const close = el("button", { type: "button", class: "close", "aria-label": "Close the details" }, "Close");
    close.addEventListener("click", () => state.choose(null));
    this.element.setAttribute("aria-label", `${contender} at ${timestep(step)} ms`);
    const samples = cells.flatMap((cell) => cell.samples ?? []);
    const first = cells[0];
    this.element.append(
      el("div", { class: "table-head" }, el("h3", {}, swatch(this.palette, contender), ` ${contender} at ${timestep(step)} ms${this.systems.length > 1 ? `, ${choice.system}` : ""}`), close),
      el(
        "div",
        { class: "details-grid" },
        el(
          "div",
          {},
          el("ul", { class: "outcomes" }, ...cells.map(outcome)),
          values(cells),
          speed?.estimated
            ? el("p", { class: "quiet note" }, `Not timed at this timestep: ${realtime(speed.value)} real time follows from ${speed.timedAt.map(timestep).join(" and ")} ms.`)
            : null,
        ),
        el(
          "div",
          {},
          el("h4", {}, "Settings"),
          facts([
            ["engine", [known?.engine, known?.version].filter(Boolean).join(" ")],
            ["integrator", String(known?.capabilities["integrator"] ?? "")],
            ["coordinates", String(known?.capabilities["coordinates"] ?? "")],
            ["precision", String(known?.capabilities["precision"] ?? "")],
            ["joint solver", String(known?.capabilities["joint_solver"] ?? "")],
            ["contact solver", String(known?.capabilities["contact_solver"] ?? "")],
            ["settings", known?.settings],
            ["wall time", first ? seconds(first.wall_s) : null],
            ["stolen by the host", first ? percent(first.steal) : null],
          ]),
          samples.length > 0 ? el("h4", {}, "Samples") : null,
          ...samples.map(histogram),
        ),
      ),
      ...commandBox(this.report, choice, cells).filter((child): child is Node => child instanceof Node),
    );
    const slot = el("div", { "data-replay": "", "data-system": choice.system, "data-contender": contender, "data-timestep": step });
    this.element.append(slot);
    for (const hook of replayHooks) hook(slot, choice);
    this.reveal();
  }

  // Brings the panel's upper part into view, and no more, so that the plot stays where it was if it can.
  private reveal(): void {
    const box = this.element.getBoundingClientRect();
    const wanted = Math.min(box.height, 0.55 * window.innerHeight);
    if (box.top + wanted > window.innerHeight) window.scrollBy({ top: box.top + wanted - window.innerHeight });
    else if (box.top < 0) window.scrollBy({ top: box.top - 60 });
  }
}
