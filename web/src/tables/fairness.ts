// What each contender is and does differently: printed lightly where most contenders agree.
import type { Contender, Deviation, Report } from "../data";
import { el } from "../dom";
import type { Palette } from "../palette";
import { swatch } from "../plots/legend";
import { scrollFrame, sortableTable, type Column } from "./sortable";

function text(contender: Contender, key: string): string {
  const value = contender.capabilities[key];
  if (value === null || value === undefined) return "";
  if (typeof value === "boolean") return value ? "yes" : "no";
  return String(value);
}

function withOrder(contender: Contender): string {
  const order = text(contender, "order");
  return text(contender, "integrator") + (order ? `, order ${order}` : "");
}

function contact(key: string): (contender: Contender) => string {
  return (contender) => (contender.capabilities["contact"] === false ? "no contact" : text(contender, key));
}

function springs(contender: Contender): string {
  const kind = text(contender, "springs");
  const note = text(contender, "spring_note");
  return note ? `${kind}: ${note}` : kind;
}

export function deviations(contender: Contender): Deviation[] {
  const list = contender.capabilities["deviations"];
  return Array.isArray(list) ? (list as Deviation[]) : [];
}

const kColumns: { title: string; hint: string; text: (contender: Contender) => string; wide?: "wide" | "wider" }[] = [
  { title: "Precision", hint: "of the state and the arithmetic", text: (c) => text(c, "precision") },
  { title: "Coordinates", hint: "joint: hinges hold exactly; maximal: six coordinates a body", text: (c) => text(c, "coordinates") },
  { title: "Integrator", hint: "and its order on smooth systems", text: withOrder, wide: "wide" },
  { title: "Joints", hint: "how hinges are held", text: (c) => text(c, "joint_solver"), wide: "wide" },
  { title: "Contact", hint: "how contacts act", text: contact("contact_model"), wide: "wide" },
  { title: "Contact solver", hint: "", text: contact("contact_solver"), wide: "wide" },
  { title: "Iterations", hint: "of the solver, where it iterates", text: (c) => text(c, "iterations") || "direct" },
  { title: "Friction cone", hint: "", text: contact("friction_cone"), wide: "wide" },
  { title: "Friction", hint: "how the pair's coefficient is reached", text: contact("friction_combine"), wide: "wide" },
  { title: "Springs, dampers (PD)", hint: "how joint springs and dampers act", text: springs, wide: "wide" },
  { title: "Limits", hint: "joint limits", text: (c) => text(c, "joint_limits") },
  { title: "Armature", hint: "exact joint armature", text: (c) => text(c, "armature") },
  { title: "Gyroscopic", hint: "torque w x (I w) is included", text: (c) => text(c, "gyroscopic") },
  { title: "Hidden damping", hint: "what the engine takes away without being asked", text: (c) => text(c, "hidden_damping") || "none" },
  { title: "Sleeping", hint: "bodies at rest are no longer computed", text: (c) => text(c, "sleep") },
  { title: "Speed limits", hint: "above which the engine cuts velocities", text: (c) => text(c, "speed_limits") },
  { title: "Finest timestep", hint: "below which the engine loses slow motions, so its fine-step run is no finer", text: (c) => (c.capabilities["finest_timestep_ms"] ? `${text(c, "finest_timestep_ms")} ms` : "any") },
  { title: "Contact forces", hint: "which of them the engine gives; without them the residuals of contact are not given either", text: (c) => text(c, "contact_forces") || "not given", wide: "wide" },
  { title: "Threads", hint: "", text: (c) => text(c, "threads") },
  { title: "Other", hint: "velocity quantisation, clamps", text: (c) => text(c, "other") || "–", wide: "wider" },
  { title: "Settings", hint: "that differ from the adapter's defaults", text: (c) => c.settings || "defaults", wide: "wide" },
];

export function fairness(report: Report, palette: Palette): HTMLElement {
  // Of settings that were swept the contender whose they are stands for all, if it took part.
  const swept = (contender: Contender) => report.varied(contender.name) !== contender.name && report.contenderByName.has(report.varied(contender.name));
  const rows = report.contenders.filter((contender) => Object.keys(contender.capabilities).length > 0 && !swept(contender));
  if (rows.length === 0) return el("p", { class: "quiet" }, "The results do not describe their contenders.");
  const columns: Column<Contender>[] = [
    {
      title: "Contender",
      key: (contender) => contender.name,
      cell: (contender) => el("span", { class: "contender" }, swatch(palette, contender.name), contender.name),
      className: "sticky",
      head: true,
    },
  ];
  for (const column of kColumns) {
    const counts = new Map<string, number>();
    for (const row of rows) counts.set(column.text(row), (counts.get(column.text(row)) ?? 0) + 1);
    const [common, many] = [...counts].sort((a, b) => b[1] - a[1])[0] ?? ["", 0];
    columns.push({
      title: column.title,
      hint: column.hint,
      key: column.text,
      className: column.wide ?? "",
      cell: (row) => {
        const value = column.text(row) || "–";
        return el("span", { class: many > rows.length / 2 && value === common ? "common" : "" }, value);
      },
    });
  }
  columns.push({
    title: "Declared deviations",
    hint: "proven to be caused by the engine",
    className: "wider",
    cell: (row) => {
      const list = deviations(row);
      if (list.length === 0) return el("span", { class: "common" }, "none");
      return el("ul", {}, ...list.map((deviation) => el("li", {}, el("code", {}, deviation.test), `: ${deviation.reason}`)));
    },
  });
  return scrollFrame("Fairness table", "What each contender does, as its adapter declares it. What most contenders share is printed lightly.", sortableTable(columns, rows));
}

// Where each engine comes from and how it was compiled: one row an engine.
export function engines(report: Report): HTMLElement {
  const seen = new Map<string, Contender>();
  for (const contender of report.json.contenders) {
    if (contender.engine && !seen.has(contender.engine)) seen.set(contender.engine, contender);
  }
  if (seen.size === 0) return el("p", { class: "quiet" }, "No engine was part of these results.");
  const fact = (key: string) => (contender: Contender) => {
    const value = contender.build[key];
    return value === undefined || value === null || value === "" ? "–" : String(value);
  };
  // Read from the machine code; results of before version 0.2 do not have it.
  const binary = (key: string) => (contender: Contender) => {
    const facts = contender.build["binary"] as Record<string, unknown> | undefined;
    return facts === undefined || facts === null ? "–" : String(facts[key] ?? "–");
  };
  const uses = (contender: Contender) => {
    const counts = (contender.build["binary"] as { counts?: Record<string, number> } | undefined)?.counts;
    if (counts === undefined) return "–";
    return `SSE ${(counts["scalar"] ?? 0) + (counts["vector"] ?? 0)}, AVX ${counts["avx"] ?? 0}, 256 bit ${counts["avx256"] ?? 0}, FMA ${counts["fma"] ?? 0}`;
  };
  const columns: Column<Contender>[] = [
    { title: "Engine", key: (c) => c.engine, cell: (c) => report.title(c.engine), head: true, className: "sticky" },
    { title: "Version", key: (c) => c.version, cell: (c) => c.version || "–" },
    { title: "Build", hint: "baseline: for every x86-64 processor", key: fact("build"), cell: fact("build") },
    { title: "Instruction set", hint: "the widest in the binary", key: binary("instruction_set"), cell: binary("instruction_set") },
    { title: "Instructions", hint: "in the binary, not how often they run", key: uses, cell: uses, className: "wide" },
    { title: "Arithmetic", hint: "precision of the binary's arithmetic instructions", key: binary("arithmetic"), cell: binary("arithmetic") },
    { title: "Assertions", hint: "left in the binary", key: binary("checks"), cell: binary("checks") },
    { title: "Source", key: fact("source"), cell: fact("source"), className: "wide" },
    { title: "Compiler", key: fact("compiler"), cell: fact("compiler"), className: "wide" },
    { title: "Flags", key: fact("flags"), cell: (c) => el("code", {}, fact("flags")(c)), className: "wider" },
  ];
  return scrollFrame("Engines and their builds", "Engines, and how they were built", sortableTable(columns, [...seen.values()]));
}
