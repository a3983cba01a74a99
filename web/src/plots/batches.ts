// Many worlds at once: world-steps a second against the number of worlds, and the figures behind it.
import { line } from "d3-shape";

import type { BatchRow, Batches, Report } from "../data";
import { el, svg } from "../dom";
import { downloads } from "../download";
import { deviceName, interval, plain, quantity, timestep } from "../format";
import { batchPlace } from "../grades";
import type { Palette } from "../palette";
import { state } from "../state";
import { scrollFrame, sortableTable, type Column } from "../tables/sortable";
import { frameOf, grid, logScale, ticks } from "./axes";
import { drawContenders, explain, hitArea } from "./canvas";
import { endLabels } from "./labels";
import { swatch } from "./legend";

interface Curve {
  contender: string;
  name: string; // with the device, where that is no processor, and the timestep, where there are several
  rows: BatchRow[];
}

const kMega = 1e6;
const kAsked = 4096; // worlds that the reader is shown first, where they were run

// What a plot shows against the number of worlds.
interface Shown {
  value: "batch_rate" | "batch_latency";
  title: string;
  axis: string;
  better: string;
  missing: string; // what a cross stands for
  tick: (value: number) => string;
}

const kRate: Shown = { value: "batch_rate", title: "World-steps a second", axis: "↑ more world-steps a second", better: "Higher is faster.", missing: "no rate", tick: thousands };
const kLatency: Shown = { value: "batch_latency", title: "Latency", axis: "↑ longer wait for a step", better: "Lower is sooner.", missing: "no latency", tick: (us) => quantity(us, "us", 1) };

function positive(row: BatchRow, name: string): number | null {
  const value = row.values[name]?.value ?? null;
  return value !== null && value > 0 ? value : null;
}

function nameOf(batches: Batches, row: BatchRow): string {
  const steps = new Set(batches.rows.map((each) => each.timestep_ms)).size;
  return [row.contender, row.device === "cpu" ? "" : `on ${row.device}`, steps > 1 ? `at ${timestep(row.timestep_ms)} ms` : ""].filter(Boolean).join(" ");
}

function curvesOf(batches: Batches): Curve[] {
  const curves = new Map<string, Curve>();
  for (const row of batches.rows) {
    const name = nameOf(batches, row);
    const curve = curves.get(name) ?? { contender: row.contender, name, rows: [] };
    curve.rows.push(row);
    curves.set(name, curve);
  }
  return [...curves.values()];
}

// In processes of an engine of one world.
function isAlone(row: BatchRow): boolean {
  return Boolean(row.values["batch_processes"]?.value);
}

// Where the worlds were stepped.
function placeOf(batches: Batches, row: BatchRow): string {
  const processes = row.values["batch_processes"]?.value;
  if (processes) return processes === 1 ? "1 process" : `${processes} processes on ${processes} cores`;
  return row.device === "cpu" ? "together, processor" : `together, ${deviceName(batches.devices[row.device] ?? row.device)}`;
}

// Of a tick: 500 k.
function thousands(value: number): string {
  if (value >= kMega) return `${plain(value / kMega, 1)} M`;
  return value >= 1000 ? `${plain(value / 1000, 1)} k` : plain(value, 1);
}

// With three digits: 2.61 M.
function thousands3(value: number): string {
  if (value >= kMega) return `${plain(value / kMega, 3)} M`;
  return value >= 1e4 ? `${plain(value / 1000, 3)} k` : plain(value, 3);
}

function megabytes(bytes: number | null | undefined): string {
  return bytes === null || bytes === undefined ? "–" : `${plain(bytes / kMega, 3)} MB`;
}

function plot(batches: Batches, palette: Palette, what: Shown): { canvas: HTMLElement; note: HTMLElement } {
  const curves = curvesOf(batches);
  const shownOf = (row: BatchRow) => positive(row, what.value);
  const canvas = el("div", { class: "canvas" });
  const note = el("p", { class: "quiet note" });
  drawContenders(canvas, (width) => {
    const shown = curves.filter((curve) => !state.isHidden(curve.contender));
    const all = shown.flatMap((curve) => curve.rows);
    const measured = all.filter((row) => shownOf(row) !== null);
    const off = new Set(curves.filter((curve) => state.isHidden(curve.contender)).map((curve) => curve.contender)).size;
    const notes = [
      what.better,
      all.some(isAlone) ? "Thin lines: engines of one world, in a process a core." : "",
      all.some((row) => shownOf(row) === null) ? `A cross at the bottom: ${what.missing} there, the table says why.` : "",
      off > 0 ? `${off} more ${off === 1 ? "contender is" : "contenders are"} switched off.` : "",
    ];
    note.textContent = notes.filter(Boolean).join(" ");
    if (measured.length === 0) {
      canvas.append(el("p", { class: "quiet empty" }, `No contender that is shown has a value here: ${what.title.toLowerCase()}.`));
      return;
    }
    const height = Math.round(Math.min(520, Math.max(360, width * 0.62)));
    const frame = { left: 62, right: width - (width > 560 ? 132 : 14), top: 22, bottom: height - 48 };
    const x = logScale(all.map((row) => row.worlds), [frame.left, frame.right], 0.5);
    const y = logScale(measured.map((row) => shownOf(row)!), [frame.bottom - 18, frame.top], 1);
    const drawing = svg("svg", {
      class: "scaling", width, height, viewBox: `0 0 ${width} ${height}`, role: "img",
      "aria-label": `${what.title} on ${batches.system} against the number of worlds; the table below holds the figures`,
    }); // prettier-ignore
    drawing.append(grid(x, "x", frame.top, frame.bottom), grid(y, "y", frame.left, frame.right));
    drawing.append(frameOf(frame));
    for (const value of ticks(x, 40)) {
      drawing.append(svg("text", { class: "tick", x: x(value), y: frame.bottom + 18, "text-anchor": "middle" }, plain(value, String(value).length)));
    }
    for (const value of ticks(y, 20)) {
      drawing.append(svg("text", { class: "tick", x: frame.left - 8, y: y(value) + 4, "text-anchor": "end" }, what.tick(value)));
    }
    drawing.append(
      svg("text", { class: "axis-title", x: frame.right, y: height - 8, "text-anchor": "end" }, "worlds"),
      svg("text", { class: "axis-title", x: frame.left, y: height - 8 }, what.axis),
    );
    const at = (row: BatchRow): [number, number] => [x(row.worlds), shownOf(row) === null ? frame.bottom - 9 : y(shownOf(row)!)];
    const path = line<BatchRow>((row) => at(row)[0], (row) => at(row)[1]); // prettier-ignore
    for (const curve of shown) {
      const look = palette.look(curve.contender);
      const alone = curve.rows.some(isAlone);
      const group = svg("g", { class: `series${alone ? " free" : ""}`, "data-contender": curve.contender, style: `--line:${look.color}` });
      group.append(svg("path", { class: "line", d: path(curve.rows.filter((row) => shownOf(row) !== null)) ?? "", "stroke-dasharray": look.dash }));
      for (const row of curve.rows) {
        const [left, top] = at(row);
        const place = `translate(${left},${top})`;
        const rate = row.values["batch_rate"];
        group.append(
          shownOf(row) !== null
            ? svg("path", { class: `mark${alone ? " hollow" : ""}`, d: look.path(alone ? 52 : 42), transform: `${place} rotate(${look.turn})`, "data-worlds": row.worlds, "data-value": shownOf(row)! })
            : svg("path", { class: "failed", d: "M-4,-4L4,4M-4,4L4,-4", transform: place, "data-worlds": row.worlds }),
        );
        const hit = hitArea(left, top);
        explain(hit, curve.contender, curve.name, () => [
          ["worlds", String(row.worlds)],
          ["world-steps a second", rate ? quantity(rate.value, "1/s") : row.outcome],
          ["interval", rate ? interval("batch_rate", rate.low, rate.high, "1/s") : ""],
          ["a step of all, alone", quantity(row.values["batch_latency"]?.value, "us")],
          ["stepped", placeOf(batches, row)],
          ["reason", row.reason],
        ]);
        group.append(hit);
      }
      drawing.append(group);
    }
    const ends = shown.flatMap((curve) => {
      const last = curve.rows.filter((row) => shownOf(row) !== null).pop();
      return last ? [{ name: curve.name, color: palette.look(curve.contender).color, ends: [at(last)] }] : [];
    });
    drawing.append(endLabels(ends, measured.map(at), { ...frame, right: width }));
    canvas.append(drawing);
  });
  return { canvas, note };
}

function table(batches: Batches, palette: Palette): HTMLTableElement {
  const value = (row: BatchRow, name: string) => row.values[name]?.value ?? null;
  const number = (title: string, name: string, text: (row: BatchRow) => string, hint: string): Column<BatchRow> => ({
    title,
    hint,
    key: (row) => value(row, name),
    cell: (row) => (value(row, name) === null ? el("span", { class: "quiet" }, "–") : el("span", { class: "number" }, text(row))),
    className: "figure",
  });
  const columns: Column<BatchRow>[] = [
    {
      title: "Contender",
      key: (row) => nameOf(batches, row),
      cell: (row) => {
        const button = el("button", { type: "button", class: "legend-item", "data-contender": row.contender, role: "checkbox", "aria-checked": String(!state.isHidden(row.contender)) }, swatch(palette, row.contender), nameOf(batches, row));
        button.addEventListener("click", () => state.toggle(row.contender));
        state.subscribe(() => button.setAttribute("aria-checked", String(!state.isHidden(row.contender))));
        return button;
      },
      className: "sticky",
      head: true,
    },
    number("Worlds", "batch_worlds", (row) => String(row.worlds), "stepped together"),
    {
      title: "World-steps/s",
      hint: "steps a second times worlds, with the 95 % interval of the median over rounds",
      key: (row) => value(row, "batch_rate"),
      cell: (row) => {
        const rate = row.values["batch_rate"];
        if (!rate) return el("span", { class: "quiet batch-failed" }, el("b", {}, row.outcome), `: ${row.reason}`);
        return el("span", { class: "growth" }, el("span", { class: "number" }, quantity(rate.value, "1/s")), el("span", { class: "range" }, interval("batch_rate", rate.low, rate.high, "1/s")));
      },
      className: "figure",
    },
    number("Latency", "batch_latency", (row) => quantity(value(row, "batch_latency"), "us"), "a single step of all worlds, until all are done"),
    number("Memory", "batch_memory", (row) => megabytes(value(row, "batch_memory")), "that all worlds take"),
    number("Compile", "batch_compile_time", (row) => (value(row, "batch_compile_time") ? quantity(value(row, "batch_compile_time"), "s") : "–"), "until the first step can be asked for"),
    number("From one world", "batch_equivalence", (row) => `${quantity(value(row, "batch_equivalence"), "m")}, ${value(row, "batch_compared") ?? 0} compared`, "largest distance of a body from the run of one world, and how many worlds were compared"),
    { title: "Stepped", cell: (row) => placeOf(batches, row) },
  ];
  // what failed before a value was found still has its number of worlds
  const rows = batches.rows.map((row) => ({ ...row, values: { ...row.values, batch_worlds: { value: row.worlds, low: null, high: null } } }));
  return sortableTable(columns, rows);
}

// The fastest at a number of worlds, which the reader chooses.
function fastestOf(batches: Batches, palette: Palette): HTMLElement {
  const rated = batches.rows.filter((row) => positive(row, "batch_rate") !== null);
  const counts = [...new Set(batches.rows.map((row) => row.worlds))].sort((a, b) => a - b);
  const begin = counts.includes(kAsked) ? kAsked : counts[counts.length - 1];
  const select = el("select", { "aria-label": `Worlds of ${batches.system}` }, ...counts.map((count) => el("option", { value: count, selected: count === begin }, String(count))));
  const answer = el("span", { "aria-live": "polite" });
  const update = () => {
    const there = rated.filter((row) => row.worlds === Number(select.value)).sort((a, b) => positive(b, "batch_rate")! - positive(a, "batch_rate")!);
    const [best, next] = there;
    if (!best) return answer.replaceChildren("No contender has a rate there.");
    const rate = best.values["batch_rate"]!;
    const range = rate.low !== null && rate.high !== null ? ` (${thousands3(rate.low)} to ${thousands3(rate.high)})` : "";
    const ahead = next ? `, ${plain(rate.value! / positive(next, "batch_rate")!, 2)} times ${nameOf(batches, next)}` : ", the only one";
    return answer.replaceChildren(swatch(palette, best.contender), " ", el("b", {}, nameOf(batches, best)), ` ${thousands3(rate.value!)} world-steps a second${range}${ahead}`);
  };
  select.addEventListener("change", update);
  update();
  return el("p", { class: "batch-answer", "data-system": batches.system }, el("b", {}, batches.system), ": fastest for ", select, " worlds: ", answer);
}

export function batchPanels(report: Report, palette: Palette): HTMLElement[] {
  const timed = (report.json.views ?? []).some((view) => view.points.some((point) => point.speed !== null));
  const apart = timed ? "Not comparable with the speed of one world in the sections above: those time single steps of one world on one core." : "";
  return (report.json.batches ?? []).map((batches) => {
    const csv = () => [
      ["contender", "timestep_ms", "device", "worlds", "rate", "low", "high", "latency_us", "memory_bytes", "compile_s", "equivalence_m", "outcome"],
      ...batches.rows.map((row) => {
        const of = (name: string) => row.values[name]?.value ?? null;
        const rate = row.values["batch_rate"];
        return [row.contender, row.timestep_ms, row.device, row.worlds, rate?.value ?? null, rate?.low ?? null, rate?.high ?? null, of("batch_latency"), of("batch_memory"), of("batch_compile_time"), of("batch_equivalence"), row.outcome];
      }),
    ];
    const steps = [...new Set(batches.rows.map((row) => row.timestep_ms))];
    const text = `Timestep ${steps.map((step) => `${timestep(step)} ms`).join(", ")}. Every contender takes the same steps in a round; worlds start at moments spread over its own run, each with rates of its own.`;
    const panel = (what: Shown) => {
      const { canvas, note } = plot(batches, palette, what);
      const file = `worlds-${batches.system}-${what.value.replace("batch_", "")}`;
      const head = el("figcaption", {}, downloads(() => file, canvas, csv), el("h3", {}, `${batches.system}: ${what.title.toLowerCase()}`), el("p", { class: "sub" }, what === kRate ? text : "Time of a single step of all worlds, from the call to its end: the time that a controller of all worlds waits."));
      return el("figure", { class: "panel scaling-panel", "data-shows": what.value }, head, canvas, note);
    };
    return el(
      "div",
      { class: "batch-parts", id: batchPlace(batches), "data-system": batches.system },
      fastestOf(batches, palette),
      panel(kRate),
      panel(kLatency),
      el("div", { class: "panel matrix-panel" }, scrollFrame(`Many worlds on ${batches.system}, by contender and number of worlds`, apart, table(batches, palette))),
    );
  });
}
