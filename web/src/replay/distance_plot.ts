// How far each run is from the reference over time, tied to the replay's clock.
import { extent } from "d3-array";
import { scaleLinear } from "d3-scale";

import { clear, el, onWidth, svg } from "../dom";
import { quantity } from "../format";
import { errorLabel, grid, logScale, ticks } from "../plots/axes";
import { timeNumbers } from "../plots/linear";
import type { Clock } from "./clock";

export interface Series {
  contender: string;
  color: string;
  dash: string;
  values: (number | null)[]; // m, a frame each
}

const kHeight = 166;
const kLeastShare = 1e-7; // of the largest distance: less is drawn at the bottom
const kMargin = { left: 62, right: 10, top: 24, bottom: 22 };

export class DistancePlot {
  readonly element = el("div", { class: "canvas replay-distance" });
  private series: Series[] = [];
  private floor = 0; // m: less is the packing's rounding
  // An element of its own: it moves while the lines stay as they are drawn.
  private readonly cursor = el("div", { class: "replay-cursor", style: `top:${kMargin.top}px;height:${kHeight - kMargin.top - kMargin.bottom}px` });
  private width = 0;
  private readonly redraw: () => void;

  constructor(
    private readonly clock: Clock,
    private readonly title: string,
  ) {
    this.redraw = onWidth(this.element, (width) => this.draw(width));
    clock.subscribe(() => this.move());
  }

  show(series: Series[], floor: number): void {
    this.series = series;
    this.floor = floor;
    this.redraw();
  }

  private x(time: number): number {
    return kMargin.left + ((this.width - kMargin.left - kMargin.right) * time) / this.clock.length;
  }

  private move(): void {
    this.cursor.style.transform = `translateX(${this.x(this.clock.time).toFixed(1)}px)`;
  }

  private draw(width: number): void {
    this.width = width;
    clear(this.element);
    const [bottom, right] = [kHeight - kMargin.bottom, width - kMargin.right];
    const drawing = svg("svg", {
      class: "accuracy", width, height: kHeight, viewBox: `0 0 ${width} ${kHeight}`, role: "img",
      "aria-label": `${this.title}, over time`,
    }); // prettier-ignore
    drawing.append(svg("text", { class: "axis-title", x: 4, y: 14 }, this.title));
    const positive = this.series.flatMap((one) => one.values.filter((value): value is number => value !== null && value > this.floor));
    if (positive.length === 0) {
      const text = this.series.length === 0 ? "Choose a second contender to see its distance." : `All stay within ${quantity(Math.max(this.floor, 1e-15), "m", 1)} of the reference.`;
      drawing.append(svg("text", { x: kMargin.left, y: kHeight / 2 }, text));
    } else {
      const [low, high] = extent(positive) as [number, number];
      const y = logScale([Math.max(low, high * kLeastShare), high], [bottom, kMargin.top]);
      const least = y.domain()[0] ?? low;
      drawing.append(grid(y, "y", kMargin.left, right));
      for (const value of ticks(y, 26)) {
        drawing.append(svg("text", { class: "tick", x: kMargin.left - 6, y: y(value) + 4, "text-anchor": "end" }, errorLabel(value, "m")));
      }
      for (const one of this.series) {
        let path = "";
        let pen = "M";
        one.values.forEach((value, frame) => {
          if (value === null) {
            pen = "M";
            return;
          }
          path += `${pen}${this.x(frame * this.clock.frame).toFixed(1)},${y(Math.max(value, least)).toFixed(1)}`;
          pen = "L";
        });
        const group = svg("g", { class: "series", style: `--line:${one.color}`, "data-contender": one.contender });
        group.append(svg("path", { class: "line", d: path, "stroke-dasharray": one.dash }));
        drawing.append(group);
      }
    }
    const x = scaleLinear().domain([0, this.clock.length]).range([kMargin.left, right]);
    drawing.append(timeNumbers(x, bottom));
    const seek = (event: PointerEvent) => {
      const box = drawing.getBoundingClientRect();
      const share = (event.clientX - box.left - kMargin.left) / (width - kMargin.left - kMargin.right);
      this.clock.pause();
      this.clock.seek(share * this.clock.length);
    };
    drawing.addEventListener("pointerdown", (event) => {
      drawing.setPointerCapture(event.pointerId);
      seek(event);
    });
    drawing.addEventListener("pointermove", (event) => {
      if (event.buttons & 1) seek(event);
    });
    this.element.append(drawing, this.cursor);
    this.move();
  }
}
