// Which contender holds the object at which timestep: every mark is a cell, so that a hole in the range shows.
import type { Cell, SystemView } from "../data";
import { el, svg, type Child } from "../dom";
import { percent, quantity, timestep } from "../format";
import type { Palette } from "../palette";
import { state } from "../state";
import { contenderColumn, scrollFrame, sortableTable, type Column } from "./sortable";

export type Grip = "held" | "dropped" | "failed" | "none";

export function gripOf(cell: Cell): Grip {
  if (cell.outcome === "unsupported") return "none";
  if (cell.outcome !== "ok") return "failed";
  const held = cell.values.find((value) => value.name === "grasp_held")?.value;
  return held === null || held === undefined ? "none" : held === 1 ? "held" : "dropped";
}

export function gripMark(grip: Grip): SVGSVGElement {
  const drawing = svg("svg", { class: `grip ${grip}`, width: 16, height: 16, viewBox: "-8 -8 16 16", "aria-hidden": "true" });
  if (grip === "held") drawing.append(svg("circle", { r: 5 }));
  if (grip === "dropped") drawing.append(svg("path", { d: "M-5,-4H5L0,5Z" }));
  if (grip === "failed") drawing.append(svg("path", { d: "M-4,-4L4,4M-4,4L4,-4" }));
  return drawing;
}

const kWords: Record<Grip, string> = { held: "held", dropped: "dropped", failed: "failed", none: "not tried" };

export function graspTable(view: SystemView, palette: Palette): HTMLElement | null {
  const cells = view.cells.filter((cell) => cell.measure === "grasp" && cell.timestep_ms !== null);
  if (cells.length === 0) return null;
  const steps = [...new Set(cells.map((cell) => cell.timestep_ms!))].sort((a, b) => a - b);
  const rows = view.contenders.filter((contender) => cells.some((cell) => cell.contender === contender));
  const at = (contender: string, step: number) => cells.find((cell) => cell.contender === contender && cell.timestep_ms === step);
  const single = (contender: string, name: string) => view.single(contender, name);
  const mark = (contender: string, step: number): Child => {
    const cell = at(contender, step);
    if (!cell) return "";
    const grip = gripOf(cell);
    const share = cell.values.find((value) => value.name === "grasp_held");
    const tried = share?.value !== null && share?.low !== null && share?.low !== undefined && share.high !== null;
    const states = tried ? `, held from ${percent(share!.value!)} of the initial states (95 % interval ${percent(share!.low!)} to ${percent(share!.high!)})` : "";
    const dropped = cell.values.find((value) => value.name === "drop_time")?.value;
    const text = `${contender} at ${timestep(step)} ms: ${grip === "failed" ? cell.outcome : kWords[grip]}${dropped ? ` after ${quantity(dropped, "s")}` : ""}${states}`;
    const button = el("button", { type: "button", class: "grip-cell", title: cell.reason || text, "aria-label": text, "data-grip": grip, "data-timestep": step, "data-contender-of": contender }, gripMark(grip));
    button.addEventListener("click", () => state.choose({ system: view.system, contender, timestep: step }));
    return button;
  };
  const largest = (name: string) => (contender: string) => {
    const value = single(contender, name);
    return value === null ? "–" : timestep(value);
  };
  const columns: Column<string>[] = [
    contenderColumn(palette),
    {
      title: "Largest (ms)",
      hint: "the largest timestep that holds the object",
      key: (contender) => single(contender, "largest_stable_timestep"),
      cell: (contender) => el("b", {}, largest("largest_stable_timestep")(contender)),
      className: "figure largest",
    },
    {
      title: "No smaller fails (ms)",
      hint: "the largest timestep up to which every smaller one holds it too",
      key: (contender) => single(contender, "stable_up_to_timestep"),
      cell: largest("stable_up_to_timestep"),
      className: "figure",
    },
    ...steps.map((step) => ({
      title: timestep(step),
      cell: (contender: string) => mark(contender, step),
      className: "grip-column",
    })),
  ];
  const drop = view.report.facts(view.system)["grasp"] as { object?: string; drop_m?: number } | undefined;
  const limit = drop?.drop_m ? ` The object is dropped when it has slipped farther than ${quantity(drop.drop_m, "m")}.` : "";
  const legend = el(
    "p",
    { class: "sub grip-legend" },
    ...(["held", "dropped", "failed"] as Grip[]).flatMap((grip) => [gripMark(grip), ` ${grip === "failed" ? "unstable or failed" : kWords[grip]}  `]),
  );
  return el(
    "div",
    { class: "panel grasp-panel" },
    el("h3", {}, "Grasp"),
    scrollFrame("Grasp by contender and timestep", `Timesteps in ms.${limit} A click opens the cell's details.`, sortableTable(columns, rows)),
    legend,
  );
}
