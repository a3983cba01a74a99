// Contender x timestep of one value. A click on a figure opens everything that is known of it below the row.
import { valueInfo, type Entry, type SystemView } from "../data";
import { clear, el, type Child } from "../dom";
import { figure, interval, named, percent, seconds, timestep, timestepRange } from "../format";
import type { Palette } from "../palette";
import { swatch } from "../plots/legend";
import { state } from "../state";
import { facts } from "../tooltip";
import { unfold } from "./detail";
import { scrollFrame, sortableTable, type Column } from "./sortable";

export class Matrix {
  readonly element: HTMLElement;
  private readonly frame = el("div");
  private readonly choice = el("select", { "aria-label": "Value of the table" });

  constructor(
    private readonly view: SystemView,
    private readonly palette: Palette,
    name: string,
  ) {
    for (const candidate of this.names()) {
      this.choice.append(el("option", { value: candidate }, valueInfo(candidate).label));
    }
    this.choice.addEventListener("change", () => this.draw());
    this.element = el(
      "div",
      { class: "panel matrix-panel" },
      el("div", { class: "table-head" }, el("h3", {}, "All figures"), el("label", {}, "Value ", this.choice)),
      this.frame,
    );
    this.select(name);
  }

  select(name: string): void {
    if (this.names().includes(name)) this.choice.value = name;
    this.draw();
  }

  private names(): string[] {
    return [...new Set([...this.view.json.errors, ...this.view.json.values])];
  }

  private draw(): void {
    const name = this.choice.value;
    const steps = this.view.timesteps(name);
    const info = valueInfo(name);
    const rows = this.view.contenders.filter((contender) => this.isMissing(contender, name) || steps.some((step) => this.view.entry(contender, step, name)));
    clear(this.frame);
    if (rows.length === 0) {
      this.frame.append(el("p", { class: "quiet" }, "No cell of this value."));
      return;
    }
    const best = new Map<number, string>();
    const telling = this.view.errorTimesteps(name);
    for (const step of telling) {
      const figures = rows
        .map((contender) => this.view.entry(contender, step, name))
        .filter((entry): entry is Entry => entry !== null && entry.value !== null && entry.cell.outcome === "ok")
        .map((entry) => entry.value!.value!);
      if (figures.length < 2 || info.better === "none") continue;
      best.set(step, named(name, info.better === "high" ? Math.max(...figures) : Math.min(...figures), this.view.unit(name)));
    }
    const columns: Column<string>[] = [
      {
        title: "Contender",
        key: (contender) => contender,
        cell: (contender) => el("span", { class: "contender" }, swatch(this.palette, contender), contender),
        className: "sticky",
        head: true,
      },
      ...steps.map((step) => ({
        title: `${timestep(step)} ms`,
        ...(telling.includes(step) ? {} : { hint: "the reference's own timestep: restart floors" }),
        key: (contender: string) => this.view.entry(contender, step, name)?.value?.value ?? null,
        cell: (contender: string) => this.figure(name, contender, step, best.get(step) ?? ""),
        className: telling.includes(step) ? "figure" : "figure floor",
      })),
    ];
    const floors = steps.filter((step) => !telling.includes(step));
    const text = [
      `${info.label}: ${info.meaning}.`,
      info.better === "none" ? "" : "The best of a column is bold.",
      floors.length > 0 ? `At ${timestepRange(floors)} the table shows restart floors; none of them counts as the best.` : "",
      "A click on a figure shows all that is known of it.",
    ].filter(Boolean).join(" "); // prettier-ignore
    this.frame.append(scrollFrame(`${info.label} on ${this.view.system}, by contender and timestep`, text, sortableTable(columns, rows)));
  }

  // Whether the engine does not give what the value is made of.
  private isMissing(contender: string, name: string): boolean {
    return this.view.report.contenderByName.get(contender)?.not_given?.includes(name) ?? false;
  }

  private figure(name: string, contender: string, step: number, best: string): Child | HTMLTableCellElement {
    const entry = this.view.entry(contender, step, name);
    if (!entry) return el("span", { class: "quiet" }, this.isMissing(contender, name) ? "not given" : "–");
    const { cell, value } = entry;
    const text = value ? figure(value) : cell.outcome === "unsupported" ? "not scored" : cell.outcome;
    const range = value ? interval(name, value.low, value.high, value.unit) : "";
    const sound = cell.outcome === "ok";
    const button = el(
      "button",
      {
        type: "button",
        class: `cell ${sound ? "ok" : "bad"}${sound && value && text === best ? " best" : ""}`,
        "aria-expanded": "false",
        title: [range && `95 % interval ${range}`, cell.reason].filter(Boolean).join("; ") || null,
      },
      el("span", { class: "number" }, text),
      value && range ? el("span", { class: "range" }, this.spread(value.value!, value.low!, value.high!)) : null,
      sound || !value ? null : el("span", { class: "flag" }, cell.outcome),
    );
    button.addEventListener("click", () => unfold(button, () => this.detail(entry, name)));
    return button;
  }

  // The interval's half width as a share of the value.
  private spread(value: number, low: number, high: number): string {
    if (value === 0) return "";
    const half = Math.abs((high - low) / 2 / value);
    return half < 0.0005 ? "± 0 %" : `± ${percent(half)}`;
  }

  private open(contender: string, step: number | null): Child {
    if (step === null) return null;
    const button = el("button", { type: "button", class: "link" }, "All of this cell, and the command that runs it again");
    button.addEventListener("click", () => {
      state.choose({ system: this.view.system, contender, timestep: step });
    });
    return button;
  }

  private detail(entry: Entry, name: string): Child[] {
    const { cell } = entry;
    const values = cell.values.map((value): [string, string] => {
      const range = interval(value.name, value.low, value.high, value.unit);
      return [valueInfo(value.name).label, figure(value) + (range ? `  (${range})` : "")];
    });
    const speed = this.view.speed(cell.contender, cell.timestep_ms ?? 0);
    return [
      el("p", {}, el("strong", {}, cell.contender), ` at ${timestep(cell.timestep_ms ?? 0)} ms, ${cell.measure.replace(/_/g, " ")}: `, el("b", { class: cell.outcome === "ok" ? "" : "bad" }, cell.outcome), cell.reason ? `. ${cell.reason}` : ""),
      facts([
        ...values,
        ...(speed && !cell.values.some((value) => value.name === "realtime_factor")
          ? [["Realtime factor", named("realtime_factor", speed.value, "1")] as [string, string]]
          : []),
        ["Wall time", seconds(cell.wall_s)],
        ["CPU time", seconds(cell.cpu_s)],
        ["Inside the engine", seconds(cell.engine_s)],
        ["Stolen by the host", percent(cell.steal)],
      ]),
      this.open(cell.contender, cell.timestep_ms),
      name === "restart_floor" ? el("p", { class: "quiet" }, valueInfo(name).meaning) : null,
    ];
  }
}
