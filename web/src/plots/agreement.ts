// Who computes the same motion: distances between all pairs of contenders as a heat map, with a slider for the time.
import type { Agreement } from "../data";
import { clear, el, onWidth, svg, uniqueId } from "../dom";
import { plain, quantity, timestep } from "../format";
import { facts, tooltip } from "../tooltip";

// Dark is near, light is far; also told apart without colour, and the same in both themes.
const kStops = ["#00204d", "#213d6b", "#545b6c", "#7b7b78", "#a59c74", "#d3c164", "#ffea46"];
const kNearest = 1e-9; // m and less
const kFarthest = 1; // m and more
const kParted = 1e-3; // m, as "parting time" has it

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

export function agreementPanel(of: Agreement): HTMLElement {
  const count = of.contenders.length;
  let at = of.time_s.length - 1;
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
    shown.textContent = `${plain(of.time_s[at] ?? 0)} s`;
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
    const duration = (of.time_s[of.time_s.length - 1] ?? 0) - (of.time_s[0] ?? 0);
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
    const names = Math.min(150, 8 + 6.4 * Math.max(...of.contenders.map((name) => name.length)));
    const size = Math.max(9, Math.min(24, Math.floor((width - names - 4) / count)));
    const side = size * count;
    const head = names * 0.82;
    place = { left: names, top: head, size };
    const drawing = svg("svg", {
      class: "agreement", width: names + side + 60, height: head + side + 4, viewBox: `0 0 ${names + side + 60} ${head + side + 4}`,
      tabindex: 0, role: "application", "aria-label": "Distance of each pair of contenders; arrow keys move between pairs",
    }); // prettier-ignore
    cells = [];
    of.contenders.forEach((name, i) => {
      const middle = head + i * size + size / 2;
      const font = size < 12 ? "font-size:9px" : "";
      drawing.append(svg("text", { class: "name", x: names - 5, y: middle + 4, "text-anchor": "end", style: font }, name));
      const across = names + i * size + size / 2 + 3;
      drawing.append(svg("text", { class: "name", transform: `translate(${across},${head - 6}) rotate(-50)`, style: font }, name));
      of.contenders.forEach((_, j) => {
        const node = svg("rect", { x: names + j * size, y: head + i * size, width: size - 1, height: size - 1, "data-pair": `${i} ${j}` });
        cells.push({ node, i, j });
        drawing.append(node);
      });
    });
    ring = svg("rect", { class: "ring", width: size - 1, height: size - 1, visibility: "hidden" });
    drawing.append(ring);
    drawing.addEventListener("pointermove", (event) => {
      const box = drawing.getBoundingClientRect();
      const j = Math.floor((event.clientX - box.left - place.left) / place.size);
      const i = Math.floor((event.clientY - box.top - place.top) / place.size);
      if (i >= 0 && j >= 0 && i < count && j < count) point(i, j, drawing);
      else hide();
    });
    drawing.addEventListener("pointerleave", hide);
    drawing.addEventListener("blur", hide);
    drawing.addEventListener("keydown", (event) => {
      const moves: Record<string, [number, number]> = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
      if (event.key === "Escape") return hide();
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
  });

  const scale = el("div", { class: "heat-scale" }, el("span", {}, `≤ ${quantity(kNearest, "m", 1)}`), el("span", { class: "ramp", style: `background:linear-gradient(90deg, ${kStops.join(", ")})` }), el("span", {}, `≥ ${quantity(kFarthest, "m", 1)}`));
  return el(
    "figure",
    { class: "panel agreement-panel" },
    el(
      "figcaption",
      {},
      el("h3", {}, "Agreement"),
      el("p", { class: "sub" }, `Mean distance of the bodies between two contenders' own runs at ${timestep(of.timestep_ms)} ms. Dark: the same motion.`),
      el("div", { class: "time-row" }, el("label", { for: id }, "Time"), slider, shown),
      scale,
    ),
    canvas,
  );
}
