// Damping that no model asks for: the rate at which velocities decay, fitted to the energy.
import type { SystemView, Value } from "../data";
import { el } from "../dom";
import { brief, interval, quantity, timestep } from "../format";
import type { Palette } from "../palette";
import { state } from "../state";
import { contenderColumn, scrollFrame, sortableTable, type Column } from "./sortable";

// The rate (1/s) that rounding can cause if it errs the same way in every step. `step` in ms.
export function roundingRate(view: SystemView, contender: string, step: number): number {
  const single = view.report.contenderByName.get(contender)?.capabilities["precision"] === "single";
  return (single ? 2 ** -23 : 2 ** -52) / (step / 1000);
}

function signOf(value: Value, rounding: number): "rounding" | "none" | "loses" | "gains" {
  const { value: rate, low, high } = value;
  if (Math.abs(rate!) <= rounding) return "rounding";
  if (low !== null && high !== null && low <= 0 && high >= 0) return "none";
  return rate! > 0 ? "loses" : "gains";
}

export function dampingTable(view: SystemView, palette: Palette): HTMLElement | null {
  const steps = view.timesteps("damping_rate").filter((step) => view.contenders.some((name) => view.entry(name, step, "damping_rate")?.value));
  if (steps.length === 0) return null;
  const rows = view.contenders.filter((contender) => steps.some((step) => view.entry(contender, step, "damping_rate")?.value));
  const columns: Column<string>[] = [
    contenderColumn(palette),
    ...steps.map((step) => ({
      title: timestep(step),
      key: (contender: string) => view.entry(contender, step, "damping_rate")?.value?.value ?? null,
      cell: (contender: string) => {
        const entry = view.entry(contender, step, "damping_rate");
        if (!entry?.value) return el("span", { class: "quiet" }, entry ? entry.cell.outcome : "–");
        const { value, low, high } = entry.value;
        const sign = signOf(entry.value, roundingRate(view, contender, step));
        const title = [quantity(value, "1/s", 2), `95 % interval ${interval("damping_rate", low, high, "1/s")}`].join(", ");
        const button = el(
          "button",
          { type: "button", class: `cell damping ${sign}`, title },
          el("span", { class: "number" }, sign === "rounding" ? "≈ 0" : brief(value, "1")),
        );
        button.addEventListener("click", () => state.choose({ system: view.system, contender, timestep: step }));
        return button;
      },
      className: "figure",
    })),
  ];
  const text =
    "Rate in 1/s at which velocities decay although nothing damps them, at timesteps in ms. ≈ 0: so small that rounding can cause it. Grey: the interval covers zero. Bold: the motion gains energy (a negative rate).";
  return el("div", { class: "panel matrix-panel damping-panel" }, el("h3", {}, "Hidden damping in figures"), scrollFrame("Hidden damping by contender and timestep", text, sortableTable(columns, rows)));
}
