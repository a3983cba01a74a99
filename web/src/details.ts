// What is known of one chosen cell: soundness, settings, figures, samples, the command that runs it again, its replay.
import { type Cell, type Report, valueInfo } from "./data";
import { simulateCommand } from "./command";
import { clear, el, type Child } from "./dom";
import { figure, interval, percent, realtime, seconds, timestep } from "./format";
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
      const range = interval(value.name, value.low, value.high, value.unit);
      body.append(
        el(
          "tr",
          { "data-value": value.name },
          el("th", { scope: "row", title: valueInfo(value.name).meaning }, valueInfo(value.name).label),
          el("td", { class: "figure" }, figure(value), range ? el("span", { class: "range" }, range) : null),
        ),
      );
    }
  }
  return el("table", { class: "detail-values", "aria-label": "Figures of the cell with their 95 % intervals" }, body);
}

// The button selects the text and copies it where the browser allows that.
export function copyable(text: string, className: string): HTMLElement {
  const code = el("code", { class: className }, text);
  const copy = el("button", { type: "button", class: "copy" }, "Copy");
  copy.addEventListener("click", () => {
    const range = document.createRange();
    range.selectNodeContents(code);
    const selection = window.getSelection();
    selection?.removeAllRanges();
    selection?.addRange(range);
    // Pages opened from a file may not be allowed to write to the clipboard: the text is selected all the same.
    navigator.clipboard?.writeText(text).then(
      () => (copy.textContent = "Copied"),
      () => (copy.textContent = "Selected"),
    );
  });
  return el("div", { class: "command-box" }, code, copy);
}

function commandBox(report: Report, choice: Choice, cells: Cell[]): Child[] {
  const command = simulateCommand(report, choice.system, choice.contender, choice.timestep);
  if (!command) return [el("p", { class: "quiet" }, "assay simulate cannot run this cell: it does not support this control.")];
  const pieces = cells.some((cell) => cell.measure === "consistency");
  return [
    el("h3", {}, "Run it again"),
    copyable(command.text, "command"),
    pieces ? el("p", { class: "quiet note" }, "This is the run from the system's start. The pieces of the self-consistency error start in states of the fine-step run.") : null,
  ];
}

// The drawer that shows the chosen cell beside the page, or below it where the window is narrow. It never moves the plot
// away; where the drawer covers what was chosen, the page scrolls by as little as shows it.
export class Drawer {
  readonly element = el("aside", { class: "drawer", "aria-label": "Details of the chosen cell", hidden: true });
  private opener: HTMLElement | null = null;

  constructor(
    private readonly report: Report,
    private readonly palette: Palette,
  ) {
    state.onChoice(() => this.draw());
    document.addEventListener("keydown", (event) => {
      if (event.key === "Escape" && !this.element.hidden && !event.defaultPrevented) this.close();
    });
    this.draw();
  }

  private close(): void {
    const opener = this.opener;
    state.choose(null);
    if (opener?.isConnected) opener.focus({ preventScroll: true });
  }

  private draw(): void {
    const choice = state.choice;
    clear(this.element);
    const cells = choice ? this.report.view(choice.system).cellsAt(choice.contender, choice.timestep) : [];
    const active = document.activeElement as HTMLElement | null;
    if (choice && active && !this.element.contains(active)) this.opener = active;
    this.element.hidden = cells.length === 0;
    document.body.classList.toggle("has-drawer", cells.length > 0);
    if (!choice || cells.length === 0) return;
    const { system, contender, timestep: step } = choice;
    const view = this.report.view(system);
    const known = this.report.contenderByName.get(contender);
    const point = view.point(contender, step);
    const margin = view.json.candidates.find((one) => view.json.points[one.point] === point)?.margin;
    const speed = point?.speed;
    const close = el("button", { type: "button", class: "close", "aria-label": "Close the details" }, "Close");
    close.addEventListener("click", () => this.close());
    const samples = cells.flatMap((cell) => cell.samples ?? []);
    const first = cells[0];
    const slot = el("div", { "data-replay": "", "data-system": system, "data-contender": contender, "data-timestep": step });
    this.element.append(
      el("div", { class: "drawer-head" }, el("h2", {}, swatch(this.palette, contender), ` ${contender}`), close),
      el("p", { class: "drawer-place" }, el("b", {}, `${timestep(step)} ms`), " on ", el("a", { href: `#${system}` }, system)),
      choice.why ? el("p", { class: "drawer-why" }, choice.why) : "",
      point ? el("p", { class: `soundness ${point.sound ? "sound" : "unsound"}` }, point.sound ? `Sound: every measure ended well at this and every smaller timestep${margin ? `; ${margin}` : ""}.` : `Not sound: ${point.why}.`) : "",
      speed ? el("p", {}, el("b", {}, `${realtime(speed.value)} real time`), speed.timed || !speed.between ? "" : `, not timed at this timestep: interpolated between ${speed.between.map(timestep).join(" and ")} ms`) : "",
      values(cells),
      el("ul", { class: "outcomes" }, ...cells.map(outcome)),
      el("h3", {}, "Settings"),
      facts([
        ["engine", [known?.engine, known?.version].filter(Boolean).join(" ")],
        ["integrator", String(known?.capabilities["integrator"] ?? "")],
        ["coordinates", String(known?.capabilities["coordinates"] ?? "")],
        ["precision", String(known?.capabilities["precision"] ?? "")],
        ["joint solver", String(known?.capabilities["joint_solver"] ?? "")],
        ["contact solver", String(known?.capabilities["contact_solver"] ?? "")],
        ...(known?.changes ?? []).map((text): [string, string] => ["setting", text]),
        ["settings", known?.changes ? (known.changes.length > 0 ? null : "the adapter's defaults") : known?.settings],
        ["wall time", first ? seconds(first.wall_s) : null],
        ["stolen by the host", first ? percent(first.steal) : null],
      ]),
      ...(samples.length > 0 ? [el("h3", {}, "Samples"), ...samples.map(histogram)] : []),
      ...commandBox(this.report, choice, cells).filter((child): child is Node => child instanceof Node),
      slot,
    );
    for (const hook of replayHooks) hook(slot, choice);
    this.element.scrollTop = 0;
    // From the keyboard the drawer is the next place to be.
    if (this.opener?.matches(":focus-visible")) close.focus({ preventScroll: true });
    this.uncover(choice);
  }

  private uncover(choice: Choice): void {
    const drawer = this.element.getBoundingClientRect();
    if (drawer.top < 10) return; // beside the page
    const mark = document.querySelector(`#${CSS.escape(choice.system)} .series[data-contender="${CSS.escape(choice.contender)}"] [data-timestep="${choice.timestep}"]`);
    const box = mark?.getBoundingClientRect();
    if (box && box.bottom > drawer.top - 24 && box.top < window.innerHeight) window.scrollBy({ top: box.bottom - drawer.top + 24 });
  }
}
