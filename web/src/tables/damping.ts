// Damping that nobody asked for: the rate at which velocities decay, fitted to the energy.
import type { SystemView } from "../data";
import { el } from "../dom";
import { interval, quantity, timestep } from "../format";
import type { Palette } from "../palette";
import { swatch } from "../plots/legend";
import { state } from "../state";
import { scrollFrame, sortableTable, type Column } from "./sortable";

export function dampingTable(view: SystemView, palette: Palette): HTMLElement | null {
  const steps = view.timesteps("damping_rate").filter((step) => view.contenders.some((name) => view.entry(name, step, "damping_rate")?.value));
  if (steps.length === 0) return null;
  const rows = view.contenders.filter((contender) => steps.some((step) => view.entry(contender, step, "damping_rate")?.value));
  const columns: Column<string>[] = [
    {
      title: "Contender",
      key: (contender) => contender,
      cell: (contender) => el("span", { class: "contender" }, swatch(palette, contender), contender),
      className: "sticky",
      head: true,
    },
    ...steps.map((step) => ({
      title: `${timestep(step)} ms`,
      key: (contender: string) => view.entry(contender, step, "damping_rate")?.value?.value ?? null,
      cell: (contender: string) => {
        const entry = view.entry(contender, step, "damping_rate");
        if (!entry?.value) return el("span", { class: "quiet" }, entry ? entry.cell.outcome : "–");
        const { value, low, high } = entry.value;
        const sign = low !== null && high !== null && low <= 0 && high >= 0 ? "none" : value! > 0 ? "loses" : "gains";
        const button = el(
          "button",
          { type: "button", class: `cell damping ${sign}`, title: `95 % interval ${interval("damping_rate", low, high, "1/s")}` },
          el("span", { class: "number" }, quantity(value, "1", 2)),
        );
        button.addEventListener("click", () => state.choose({ system: view.system, contender, timestep: step }));
        return button;
      },
      className: "figure",
    })),
  ];
  const text =
    "Rate in 1/s at which velocities decay although nothing damps them. Grey: the interval covers zero. Bold: the motion gains energy (a negative rate).";
  return el("div", { class: "panel matrix-panel damping-panel" }, el("h3", {}, "Hidden damping"), scrollFrame("Hidden damping by contender and timestep", text, sortableTable(columns, rows)));
}
