// Everything that was recorded of the machine and the run.
import type { Report } from "../data";
import { el } from "../dom";
import { percent, quantity, timestep } from "../format";

// The cost of the harness itself: the same timing of an engine that does nothing.
export function harnessCost(report: Report): { text: string; short: string } | null {
  let best: { us: number; system: string; step: number } | null = null;
  for (const cell of report.cells) {
    if (!report.isHarness(cell.contender)) continue;
    const value = cell.values.find((candidate) => candidate.name === "step_time");
    if (value?.value === null || value?.value === undefined) continue;
    // The dearest of all systems and timesteps: nothing was measured with more overhead than this.
    if (!best || value.value > best.us) best = { us: value.value, system: cell.system, step: cell.timestep_ms ?? 0 };
  }
  if (!best) return null;
  return {
    text: `${quantity(best.us, "us")} a step at most (${best.system}, ${timestep(best.step)} ms), measured with an engine that does nothing`,
    short: quantity(best.us, "us"),
  };
}

export function stealSummary(report: Report): string | null {
  const shares = report.cells
    .filter((cell) => cell.measure === "raw_speed" && cell.steal !== null)
    .map((cell) => cell.steal!)
    .sort((a, b) => a - b);
  if (shares.length === 0) return null;
  const median = shares[Math.floor(shares.length / 2)]!;
  return `median ${percent(median)}, largest ${percent(shares[shares.length - 1]!)} of the machine's time, over ${shares.length} timing cells`;
}

// What the runs record, in the order and the words in which it is shown. What is not listed here is shown under its key.
const kGroups: [string, [string, string, ((value: string) => string)?][]][] = [
  [
    "Machine",
    [
      ["cpu", "CPU"],
      ["cpu_model", "Model"],
      ["cpu_mhz", "MHz at the start"],
      ["cpu_cache", "Last cache"],
      ["cpu_vectors", "Widest vectors"],
      ["turbo", "Turbo"],
      ["cores", "Cores"],
      ["governor", "Governor"],
      ["virtual_machine", "Virtual machine"],
      ["memory", "Memory", asMemory],
      ["kernel", "Kernel"],
      ["sandbox", "Workers confined"],
    ],
  ],
  [
    "Program",
    [
      ["assay_version", "assay"],
      ["commit", "Commit"],
      ["compiler", "Compiler"],
      ["flags", "Flags"],
      ["build_type", "Build type"],
    ],
  ],
  [
    "Campaign",
    [
      ["campaign_title", "Title"],
      ["campaign", "Name"],
      ["campaign_hash", "Content address"],
      ["command", "Command"],
      ["seed", "Seed"],
      ["started", "Started"],
      ["finished", "Finished"],
      ["wall_s", "Wall time", asSeconds],
      ["cpu_s", "CPU time", asSeconds],
    ],
  ],
  [
    "Quality of the timing",
    [
      ["timing", "Scheme"],
      ["timing_estimate", "Estimate"],
      ["twins", "One contender under two names"],
      ["timing_core", "Core"],
      ["clock_cost_ns", "Reading the clock", (value) => quantity(Number(value), "ns")],
      ["harness", "Harness overhead"],
      ["steal", "Stolen by the host"],
      ["engine_share_timing", "Timing cells' time inside engine steps", asShare],
      ["engine_share_accuracy", "Accuracy cells' time inside engine steps", asShare],
    ],
  ],
];

function asSeconds(value: string): string {
  const seconds = Number(value);
  if (!Number.isFinite(seconds)) return value;
  if (seconds < 120) return quantity(seconds, "s");
  const minutes = Math.floor(seconds / 60);
  return minutes < 120 ? `${minutes} min ${Math.round(seconds % 60)} s` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

function asMemory(value: string): string {
  const [, kilobytes] = /^(\d+) kB$/.exec(value) ?? [];
  return kilobytes ? `${(Number(kilobytes) / 1024 ** 2).toFixed(1)} GiB` : value;
}

function asShare(value: string): string {
  return Number.isFinite(Number(value)) ? percent(Number(value)) : value;
}

export function manifestTable(report: Report): HTMLElement {
  const recorded = new Map(report.json.manifest.map((entry) => [entry.key, entry.value]));
  const harness = harnessCost(report);
  if (harness) recorded.set("harness", harness.text);
  const steal = stealSummary(report);
  if (steal) recorded.set("steal", steal);
  if (recorded.size === 0) return el("p", { class: "quiet" }, "Nothing was recorded of the machine.");

  const listed = new Set(kGroups.flatMap(([, entries]) => entries.map(([key]) => key)));
  const others = [...recorded.keys()].filter((key) => !listed.has(key));
  const groups: typeof kGroups = [...kGroups, ["Other", others.map((key) => [key, key.replace(/_/g, " ")])]];
  const table = el("table", { class: "manifest", "aria-label": "Machine, program and campaign" });
  for (const [title, entries] of groups) {
    const body = el("tbody", {}, el("tr", {}, el("th", { scope: "rowgroup", colspan: "2", class: "group" }, title)));
    for (const [key, label, write] of entries) {
      const value = recorded.get(key);
      if (value === undefined) continue;
      body.append(el("tr", {}, el("th", { scope: "row" }, label), el("td", {}, (write ? write(value) : value) || "–")));
    }
    if (body.rows.length > 1) table.append(body);
  }
  return table;
}
