// Time of a whole run against the number of bodies, for every contender, with and without contacts.
import { line } from "d3-shape";

import type { Cell, Report, Value } from "../data";
import { el, svg } from "../dom";
import { interval, plain, quantity } from "../format";
import type { Palette } from "../palette";
import { downloads } from "../download";
import { state } from "../state";
import { scrollFrame, sortableTable, type Column } from "../tables/sortable";
import { frameOf, grid, logScale, ticks } from "./axes";
import { drawContenders, explain, hitArea } from "./canvas";
import { endLabels } from "./labels";
import { swatch } from "./legend";

interface Point {
  size: number;
  cell: Cell;
  time: Value | null;
  x: number;
  y: number;
}

interface Curve {
  contender: string;
  contacts: boolean;
  points: Point[];
  exponent: Value | null;
}

export function scalingCurves(report: Report): Curve[] {
  const curves = new Map<string, Curve>();
  for (const system of report.sizes) {
    const contacts = system.facts["contacts"] !== false;
    const size = Number(system.facts["bodies"]);
    for (const cell of report.view(system.name).cells) {
      if (cell.measure !== "scaling" || cell.outcome === "unsupported") continue;
      const key = `${String(system.facts["family"])} ${cell.contender}`;
      let curve = curves.get(key);
      if (!curve) curves.set(key, (curve = { contender: cell.contender, contacts, points: [], exponent: null }));
      const find = (name: string) => cell.values.find((value) => value.name === name && value.value !== null) ?? null;
      curve.points.push({ size, cell, time: find("run_time"), x: 0, y: 0 });
      curve.exponent = find("scaling_exponent") ?? curve.exponent;
    }
  }
  for (const curve of curves.values()) curve.points.sort((a, b) => a.size - b.size);
  return [...curves.values()];
}

// Systems of one size differ in their seed: each has its mark, and the line goes through the one in the middle.
function middleOfEachSize(points: Point[]): Point[] {
  const sizes = [...new Set(points.map((point) => point.size))];
  return sizes.map((size) => {
    const own = points.filter((point) => point.size === size).sort((a, b) => a.time!.value! - b.time!.value!);
    return own[Math.floor((own.length - 1) / 2)]!;
  });
}

function exponentText(value: Value | null): string {
  return value ? `${plain(value.value!)} (${interval("scaling_exponent", value.low, value.high, "1")})` : "–";
}

export function scalingPanel(report: Report, palette: Palette): HTMLElement {
  const curves = scalingCurves(report);
  const contenders = report.contenders.map((contender) => contender.name).filter((name) => curves.some((curve) => curve.contender === name));
  const canvas = el("div", { class: "canvas" });
  const note = el("p", { class: "quiet note" });
  const draw = (width: number) => {
    const shown = curves.filter((curve) => !state.isHidden(curve.contender));
    const timed = shown.flatMap((curve) => curve.points).filter((point) => (point.time?.value ?? 0) > 0);
    const off = new Set(curves.filter((curve) => state.isHidden(curve.contender)).map((curve) => curve.contender)).size;
    note.textContent = `Filled marks: with contacts; hollow marks and thin lines: without. A cross at the top: the run failed at that size.${off > 0 ? ` ${off} more ${off === 1 ? "contender is" : "contenders are"} switched off.` : ""}`;
    if (timed.length === 0) {
      canvas.append(el("p", { class: "quiet empty" }, "No contender that is shown has a time here."));
      return;
    }
    const height = Math.round(Math.min(520, Math.max(360, width * 0.62)));
    const frame = { left: 62, right: width - (width > 560 ? 104 : 14), top: 22, bottom: height - 48 };
    const x = logScale(shown.flatMap((curve) => curve.points.map((point) => point.size)), [frame.left, frame.right], 0.5);
    const y = logScale(timed.map((point) => point.time!.value!), [frame.bottom, frame.top], 1);
    const drawing = svg("svg", {
      class: "scaling", width, height, viewBox: `0 0 ${width} ${height}`, role: "img",
      "aria-label": "Time of a whole run against the number of bodies; the table beside holds the figures",
    }); // prettier-ignore
    drawing.append(grid(x, "x", frame.top, frame.bottom), grid(y, "y", frame.left, frame.right));
    drawing.append(frameOf(frame));
    for (const value of ticks(x, 40)) {
      drawing.append(svg("text", { class: "tick", x: x(value), y: frame.bottom + 18, "text-anchor": "middle" }, plain(value, 2)));
    }
    for (const value of ticks(y, 20)) {
      drawing.append(svg("text", { class: "tick", x: frame.left - 8, y: y(value) + 4, "text-anchor": "end" }, quantity(value, "s", 1)));
    }
    drawing.append(
      svg("text", { class: "axis-title", x: frame.right, y: height - 8, "text-anchor": "end" }, "number of bodies"),
      svg("text", { class: "axis-title", x: frame.left, y: height - 8 }, "↓ less time"),
    );
    const path = line<Point>((point) => point.x, (point) => point.y); // prettier-ignore
    for (const curve of shown) {
      const look = palette.look(curve.contender);
      const group = svg("g", { class: `series${curve.contacts ? "" : " free"}`, "data-contender": curve.contender, style: `--line:${look.color}` });
      for (const point of curve.points) {
        point.x = x(point.size);
        point.y = (point.time?.value ?? 0) > 0 ? y(point.time!.value!) : frame.top - 9;
      }
      const good = curve.points.filter((point) => (point.time?.value ?? 0) > 0);
      group.append(svg("path", { class: "line", d: path(middleOfEachSize(good)) ?? "", "stroke-dasharray": look.dash }));
      for (const point of curve.points) {
        const at = `translate(${point.x},${point.y})`;
        const node =
          (point.time?.value ?? 0) > 0
            ? svg("path", { class: `mark${curve.contacts ? "" : " hollow"}`, d: look.path(curve.contacts ? 42 : 52), transform: `${at} rotate(${look.turn})`, "data-size": point.size, "data-seconds": point.time!.value! })
            : svg("path", { class: "failed", d: "M-4,-4L4,4M-4,4L4,-4", transform: at, "data-size": point.size });
        const hit = hitArea(point.x, point.y);
        explain(hit, curve.contender, curve.contender, () => [
          ["bodies", String(point.size)],
          ["contacts", curve.contacts ? "on" : "off"],
          ["time of the run", point.time ? quantity(point.time.value, "s") : point.cell.outcome],
          ["interval", point.time ? interval("run_time", point.time.low, point.time.high, "s") : ""],
          ["grows with the power", curve.exponent ? exponentText(curve.exponent) : null],
          ["reason", point.cell.reason],
        ]);
        hit.addEventListener("click", () => state.choose({ system: point.cell.system, contender: curve.contender, timestep: point.cell.timestep_ms ?? 0 }));
        group.append(node, hit);
      }
      drawing.append(group);
    }
    const placed = (curve: Curve) => curve.points.filter((point) => (point.time?.value ?? 0) > 0);
    const lines = shown.filter((curve) => curve.contacts && placed(curve).length > 0).map((curve) => {
      const last = placed(curve).pop()!;
      return { name: curve.contender, color: palette.look(curve.contender).color, ends: [[last.x, last.y]] as [number, number][] };
    });
    drawing.append(endLabels(lines, shown.flatMap(placed).map((point) => [point.x, point.y]), { ...frame, right: width }));
    canvas.append(drawing);
  };
  drawContenders(canvas, draw);

  const curveOf = (contender: string, contacts: boolean) => curves.find((curve) => curve.contender === contender && curve.contacts === contacts);
  const last = (contender: string, contacts: boolean) => [...(curveOf(contender, contacts)?.points ?? [])].reverse().find((point) => point.time);
  const growth = (contacts: boolean, title: string): Column<string> => ({
    title,
    key: (contender) => curveOf(contender, contacts)?.exponent?.value ?? null,
    cell: (contender) => {
      const point = last(contender, contacts);
      if (!point) return el("span", { class: "quiet" }, "–");
      return el(
        "span",
        { class: "growth" },
        el("span", { class: "number" }, exponentText(curveOf(contender, contacts)?.exponent ?? null)),
        el("span", { class: "range" }, `${quantity(point.time!.value, "s")} at ${point.size}`),
      );
    },
    className: "figure",
  });
  const columns: Column<string>[] = [
    {
      title: "Contender",
      key: (contender) => contender,
      cell: (contender) => {
        const button = el("button", { type: "button", class: "legend-item", "data-contender": contender, role: "checkbox", "aria-checked": String(!state.isHidden(contender)) }, swatch(palette, contender), contender);
        button.addEventListener("click", () => state.toggle(contender));
        state.subscribe(() => button.setAttribute("aria-checked", String(!state.isHidden(contender))));
        return button;
      },
      className: "sticky",
      head: true,
    },
    growth(true, "With contacts"),
    growth(false, "Without"),
  ];
  const text = "The power of the number of bodies with which the time grows, fitted to all sizes, with its 95 % interval, and the time at the largest size. A click on a name shows or hides its lines.";
  const rows = () => [
    ["contender", "contacts", "bodies", "run_time_s", "low", "high", "outcome"],
    ...curves.filter((curve) => !state.isHidden(curve.contender)).flatMap((curve) => curve.points.map((point) => [curve.contender, curve.contacts ? "on" : "off", point.size, point.time?.value ?? null, point.time?.low ?? null, point.time?.high ?? null, point.cell.outcome])),
  ];
  return el(
    "div",
    { class: "scaling-parts" },
    el("figure", { class: "panel scaling-panel" }, el("figcaption", {}, downloads(() => "scaling", canvas, rows), el("h3", {}, "Time of a run"), el("p", { class: "sub" }, "Both axes are logarithmic: a power of the number of bodies is a straight line.")), canvas, note),
    el("div", { class: "panel matrix-panel" }, el("h3", {}, "How the time grows"), scrollFrame("Scaling exponents", text, sortableTable(columns, contenders))),
  );
}
