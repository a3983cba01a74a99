// The command that runs a cell of the report again.
import type { Report } from "./data";
import { timestep as written } from "./format";

export interface Command {
  text: string;
  note: string; // how its run differs from the cell's, "" where it is the same
}

// A shell word.
function word(text: string): string {
  return /^[\w./=:+,-]+$/.test(text) ? text : `'${text.replace(/'/g, "'\\''")}'`;
}

// Null where `assay simulate` cannot give the run its control.
export function simulateCommand(report: Report, system: string, contender: string, timestep: number): Command | null {
  const facts = report.facts(system);
  const model = facts["model"];
  const duration = facts["duration_s"];
  if (typeof model !== "string" || typeof duration !== "number") return null;
  // Results from before it was stored do not have it.
  const option = facts["control_option"];
  const control = String(facts["control"] ?? "passive");
  if (typeof option !== "string" && control !== "passive" && !/^\d+ actuators/.test(control)) return null;
  const known = report.contenderByName.get(contender);
  const parts = ["assay simulate", word(model.replace(/\.xml$/, "")), "--engine", word(known?.base || contender)];
  if (known && known.base !== known.name) {
    for (const setting of known.settings.split(" ").filter(Boolean)) parts.push("--set", word(setting));
  }
  parts.push("--timestep", written(timestep), "--duration", String(duration));
  const sample = facts["sample_ms"];
  if (typeof sample === "number") parts.push("--sample", written(sample));
  if (facts["contacts"] === false) parts.push("--contacts off");
  const gravity = facts["gravity"];
  if (Array.isArray(gravity) && gravity.every((part) => part === 0)) parts.push("--gravity off");
  if (typeof option === "string") parts.push("--control", word(option));
  parts.push("--out", word(`${system}_${contender}_${written(timestep).replace("/", "-")}ms.csv`));
  return { text: parts.join(" "), note: "" };
}
