// Which contenders compute the same motion: distances between all pairs of contenders as a heat map with a slider for the time, and
// one contender's distances from all others over the time.
import { scaleLinear } from "d3-scale";
import { line } from "d3-shape";

import type { Agreement } from "../data";
import { clear, el, onWidth, svg, textWidth, uniqueId } from "../dom";
import { downloads, type CsvRow } from "../download";
import { plain, quantity, timestep } from "../format";
import type { Palette } from "../palette";
import { state } from "../state";
import { facts, tooltip } from "../tooltip";
import { errorLabel, frameOf, grid, logScale, ticks } from "./axes";
import { drawContenders } from "./canvas";

// Dark is near, light is far; can be distinguished without colour, and is the same in both themes.
const kStops = ["#00204d", "#213d6b", "#545b6c", "#7b7b78", "#a59c74", "#d3c164", "#ffea46"];
const kNearest = 1e-9; // m and less
const kFarthest = 1; // m and more
const kParted = 1e-3; // m; two runs have separated when they are farther apart

function channels(hex: string): number[] {
  return [1, 3, 5].map((at) => Number.parseInt(hex.slice(at, at + 2), 16));
}

export function heat(distance: number): string {
  const span = Math.log10(kFarthest / kNearest);
  const share = Math.min(1, Math.max(0, Math.log10(Math.max(distance, 1e-300) / kNearest) / span));
  const place = share * (kStops.length - 1);
  const at = Math.min(kStops.length - 2, Math.floor(place));
  const [from, to] = [channels(kStops[at]!), channels(kStops[at + 1]!)];
  return `rgb(${from.map((value, index) => Math.round(value + (place - at) * (to[index]! - value))).join(" ")})`;
}

// The pair's place in the lists.
export function pairIndex(count: number, i: number, j: number): number {
  const [a, b] = i < j ? [i, j] : [j, i];
  return a * count - (a * (a + 1)) / 2 + (b - a - 1);
}

// The first time at which half of the pairs have separated; the end where most stay together. Before it all are alike,
// long after it chance decides.
export function tellingTime(of: Agreement): { index: number; parted: boolean } {
  const last = of.time_s.length - 1;
  const times = of.parting_s.filter((time): time is number => time !== null).sort((a, b) => a - b);
  const middle = times[Math.floor(times.length / 2)];
  const index = middle === undefined ? -1 : of.time_s.findIndex((time) => time >= middle);
  return index < 0 ? { index: last, parted: false } : { index: Math.max(1, index), parted: true };
}

// One contender's distance from each other over the time.
function distancePlot(of: Agreement, palette: Palette, start: number): { element: HTMLElement; setTime: (index: number) => void; setOrigin: (index: number) => void } {
  const count = of.contenders.length;
  let origin = 0;
  let at = start;
  const choice = el("select", { "aria-label": "Contender that the others are compared with" }, ...of.contenders.map((name, index) => el("option", { value: index }, name)));
  const canvas = el("div", { class: "canvas" });
  let clock: SVGLineElement | null = null;
  let clockText: SVGTextElement | null = null;
  let x: (time: number) => number = () => 0;
  const moveClock = () => {
    const place = x(of.time_s[at] ?? 0);
    clock?.setAttribute("x1", String(place));
    clock?.setAttribute("x2", String(place));
    clockText?.setAttribute("x", String(place));
    if (clockText) clockText.textContent = `${plain(of.time_s[at] ?? 0)} s`;
  };
  const draw = (width: number) => {
    clock = clockText = null;
    const series = of.contenders
      .map((name, j) => ({ name, values: j === origin ? [] : (of.distance_m[pairIndex(count, origin, j)] ?? []) }))
      .filter(({ name, values }) => values.length > 0 && !state.isHidden(name));
    const positive = series.flatMap(({ values }) => values).filter((value): value is number => value !== null && value > 0);
    if (positive.length === 0) {
      canvas.append(el("p", { class: "quiet empty" }, "No other contender that is shown was compared with it."));
      return;
    }
    const height = Math.round(Math.min(460, Math.max(300, width * 0.75)));
    const frame = { left: 60, right: width - 22, top: 20, bottom: height - 46 };
    const y = logScale([...positive.map((value) => Math.max(value, 1e-12)), kParted], [frame.bottom, frame.top], 1);
    const [begin = 0, end = 1] = [of.time_s[0], of.time_s[of.time_s.length - 1]];
    const time = scaleLinear().domain([begin, end]).range([frame.left, frame.right]);
    x = time;
    const drawing = svg("svg", {
      class: "distances", width, height, viewBox: `0 0 ${width} ${height}`, role: "img",
      "aria-label": `Distance of ${series.map(({ name }) => name).join(", ")} from ${of.contenders[origin]} over the time`,
    }); // prettier-ignore
    drawing.append(grid(y, "y", frame.left, frame.right));
    drawing.append(frameOf(frame));
    for (const value of time.ticks(Math.max(2, Math.floor(width / 90)))) {
      drawing.append(svg("text", { class: "tick", x: time(value), y: frame.bottom + 18, "text-anchor": "middle" }, `${value} s`));
    }
    for (const value of ticks(y, 20)) {
      drawing.append(svg("text", { class: "tick", x: frame.left - 8, y: y(value) + 4, "text-anchor": "end" }, errorLabel(value, "m")));
    }
    const parted = Math.round(y(kParted)) + 0.5;
    drawing.append(svg("line", { class: "realtime-line", x1: frame.left, x2: frame.right, y1: parted, y2: parted }));
    const [least = 0] = y.domain();
    for (const { name, values } of series) {
      const look = palette.look(name);
      const points = values
        .map((value, index): [number, number] => [time(of.time_s[index] ?? 0), y(Math.max(value ?? 0, least))])
        .filter((_, index) => (values[index] ?? 0) > 0);
      const group = svg("g", { class: "series", "data-contender": name, style: `--line:${look.color}` });
      group.append(svg("path", { class: "line", d: line()(points) ?? "", "stroke-dasharray": look.dash }));
      const last = points[points.length - 1];
      if (last) group.append(svg("path", { class: "mark", d: look.path(40), transform: `translate(${last[0]},${last[1]}) rotate(${look.turn})` }));
      drawing.append(group);
    }
    clock = svg("line", { class: "clock", y1: frame.top, y2: frame.bottom });
    clockText = svg("text", { class: "tick", y: frame.top - 6, "text-anchor": "middle" });
    drawing.append(clock, clockText, svg("text", { class: "axis-title", x: frame.left, y: height - 8 }, "dotted: separated, 1 mm"));
    moveClock();
    canvas.append(drawing);
  };
  const redraw = drawContenders(canvas, draw);
  const setOrigin = (index: number) => {
    origin = index;
    choice.value = String(index);
    redraw();
  };
  choice.addEventListener("change", () => setOrigin(Number(choice.value)));
  const rows = (): CsvRow[] => {
    const others = of.contenders.flatMap((name, j) => (j === origin || state.isHidden(name) ? [] : [{ name, values: of.distance_m[pairIndex(count, origin, j)] }]));
    return [["time_s", ...others.map(({ name }) => `${of.contenders[origin]} to ${name} (m)`)], ...of.time_s.map((time, index) => [time, ...others.map(({ values }) => values?.[index] ?? null)])];
  };
  return {
    element: el("div", { class: "distance-plot" }, downloads(() => `${of.system}-distances`, canvas, rows), el("p", { class: "sub" }, "Distance from ", choice, " over the time"), canvas),
    setTime: (index: number) => {
      at = index;
      moveClock();
    },
    setOrigin,
  };
}

export function agreementPanel(of: Agreement, palette: Palette): HTMLElement {
  const telling = tellingTime(of);
  let at = telling.index;
  const plot = distancePlot(of, palette, at);
  const count = of.contenders.length;
  const end = of.time_s[of.time_s.length - 1] ?? 0;
  let cursor: [number, number] | null = null;
  const id = uniqueId("time");
  const slider = el("input", { type: "range", id, min: 0, max: of.time_s.length - 1, step: 1, value: at });
  const shown = el("output", { for: id });
  const canvas = el("div", { class: "canvas scroll" });
  const distance = (i: number, j: number) => (i === j ? 0 : (of.distance_m[pairIndex(count, i, j)]?.[at] ?? null));
  let cells: { node: SVGRectElement; i: number; j: number }[] = [];
  let ring: SVGRectElement | null = null;
  let place = { left: 0, top: 0, size: 0 };

  const paint = () => {
    for (const { node, i, j } of cells) {
      const value = distance(i, j);
      node.style.fill = value === null ? "var(--faint)" : heat(value);
      node.dataset.distance = value === null ? "" : String(value);
    }
    shown.textContent = `${plain(of.time_s[at] ?? 0)} of ${plain(end)} s`;
    slider.setAttribute("aria-valuetext", shown.textContent);
  };
  const hide = () => {
    cursor = null;
    ring?.setAttribute("visibility", "hidden");
    tooltip.hide();
  };
  const point = (i: number, j: number, drawing: SVGSVGElement) => {
    cursor = [i, j];
    const [x, y] = [place.left + j * place.size, place.top + i * place.size];
    ring?.setAttribute("visibility", "visible");
    ring?.setAttribute("x", String(x));
    ring?.setAttribute("y", String(y));
    const box = drawing.getBoundingClientRect();
    const value = distance(i, j);
    const parting = i === j ? null : (of.parting_s[pairIndex(count, i, j)] ?? null);
    const duration = end - (of.time_s[0] ?? 0);
    tooltip.show(
      box.left + x + place.size,
      box.top + y + place.size,
      el("strong", {}, i === j ? of.contenders[i]! : `${of.contenders[i]} and ${of.contenders[j]}`),
      facts([
        ["time", `${plain(of.time_s[at] ?? 0)} s`],
        ["distance", i === j ? "its own run" : quantity(value, "m")],
        [`farther than ${quantity(kParted, "m", 1)}`, parting === null ? null : parting >= duration ? "never" : `from ${plain(parting)} s on`],
      ]),
    );
  };

  const draw = (width: number) => {
    clear(canvas);
    const small = (width - 150) / count < 14;
    const font = small ? 9 : 11;
    const turn = small ? 90 : 50; // degrees
    const [across, up] = [Math.cos((turn * Math.PI) / 180), Math.sin((turn * Math.PI) / 180)];
    const lengths = of.contenders.map((name) => textWidth(name, font));
    const names = Math.ceil(Math.max(...lengths)) + 8;
    // How far the names above the last columns lean out on the right.
    const lean = (size: number) => Math.max(...lengths.map((length, i) => across * length + 8 - (count - 1 - i) * size), 4);
    let size = 24;
    while (size > 9 && names + size * count + lean(size) > width) size -= 1;
    const side = size * count;
    const head = Math.ceil(up * (names + 8)) + 4;
    const whole = Math.ceil(names + side + lean(size));
    place = { left: names, top: head, size };
    const drawing = svg("svg", {
      class: "agreement", width: whole, height: head + side + 4, viewBox: `0 0 ${whole} ${head + side + 4}`,
      tabindex: 0, role: "application", "aria-label": "Distance of each pair of contenders; arrow keys move between pairs",
    }); // prettier-ignore
    cells = [];
    of.contenders.forEach((name, i) => {
      const middle = head + i * size + size / 2;
      const style = `font-size:${font}px`;
      drawing.append(svg("text", { class: "name", x: names - 5, y: middle + 0.36 * font, "text-anchor": "end", style }, name));
      const foot = names + i * size + size / 2 + 3;
      drawing.append(svg("text", { class: "name", transform: `translate(${foot},${head - 6}) rotate(${-turn})`, style }, name));
      of.contenders.forEach((_, j) => {
        const node = svg("rect", { x: names + j * size, y: head + i * size, width: size - 1, height: size - 1, "data-pair": `${i} ${j}` });
        cells.push({ node, i, j });
        drawing.append(node);
      });
    });
    ring = svg("rect", { class: "ring", width: size - 1, height: size - 1, visibility: "hidden" });
    drawing.append(ring);
    const track = (event: MouseEvent) => {
      const box = drawing.getBoundingClientRect();
      const j = Math.floor((event.clientX - box.left - place.left) / place.size);
      const i = Math.floor((event.clientY - box.top - place.top) / place.size);
      if (i >= 0 && j >= 0 && i < count && j < count) point(i, j, drawing);
      else hide();
    };
    drawing.addEventListener("pointermove", track);
    drawing.addEventListener("click", (event) => {
      track(event);
      if (cursor) plot.setOrigin(cursor[0]);
    });
    drawing.addEventListener("pointerleave", hide);
    drawing.addEventListener("blur", hide);
    drawing.addEventListener("keydown", (event) => {
      const moves: Record<string, [number, number]> = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
      if (event.key === "Escape") return hide();
      if ((event.key === "Enter" || event.key === " ") && cursor) {
        event.preventDefault();
        return plot.setOrigin(cursor[0]);
      }
      const move = moves[event.key];
      if (!move) return;
      event.preventDefault();
      const [i, j] = cursor ?? [0, 0];
      point((i + move[0] + count) % count, (j + move[1] + count) % count, drawing);
    });
    canvas.append(drawing);
    paint();
  };
  onWidth(canvas, draw);
  slider.addEventListener("input", () => {
    at = Number(slider.value);
    paint();
    plot.setTime(at);
  });

  const begin = telling.parted
    ? `The slider begins at ${plain(of.time_s[at] ?? 0)} s, when half of the pairs are farther apart than ${quantity(kParted, "m", 1)}.`
    : `The slider begins at the end: most pairs are never farther apart than ${quantity(kParted, "m", 1)}.`;
  const scale = el("div", { class: "heat-scale" }, el("span", {}, `≤ ${quantity(kNearest, "m", 1)}`), el("span", { class: "ramp", style: `background:linear-gradient(90deg, ${kStops.join(", ")})` }), el("span", {}, `≥ ${quantity(kFarthest, "m", 1)}`));
  return el(
    "figure",
    { class: "panel agreement-panel" },
    el(
      "figcaption",
      {},
      el("h3", {}, "Agreement"),
      el("p", { class: "sub" }, `Mean distance of the bodies between two contenders' own runs at ${timestep(of.timestep_ms)} ms. Dark: the same motion. ${begin}`),
      el("div", { class: "time-row" }, el("label", { for: id }, "Time"), slider, shown),
      scale,
    ),
    el("div", { class: "agreement-parts" }, canvas, plot.element),
  );
}
