// How a contender looks in every plot, as the program says it. Colours are variables, so that they follow the theme.
import {
  symbol, symbolCircle, symbolCross, symbolDiamond, symbolSquare, symbolStar, symbolTriangle, symbolWye, type SymbolType,
} from "d3-shape"; // prettier-ignore

import type { Contender, Report } from "./data";
import { el } from "./dom";

export interface Look {
  family: string;
  color: string; // CSS
  dash: string;
  path: (size: number) => string;
  turn: number; // degrees
}

const kMarks: Record<string, [shape: SymbolType, turn: number]> = {
  circle: [symbolCircle, 0], square: [symbolSquare, 0], triangle: [symbolTriangle, 0], diamond: [symbolDiamond, 0],
  "triangle-down": [symbolTriangle, 180], cross: [symbolCross, 45], star: [symbolStar, 0], wye: [symbolWye, 0],
}; // prettier-ignore

export function engineOf(contender: Contender): string {
  return contender.engine.replace(/-(f32|f64)$/, "");
}

// A mark of a shape's name.
export function markPath(mark: string, size: number): string {
  return symbol((kMarks[mark] ?? kMarks["circle"]!)[0], size)() ?? "";
}

export class Palette {
  private readonly looks = new Map<string, Look>();

  constructor(private readonly report: Report) {
    const light: string[] = [];
    const dark: string[] = [];
    Object.entries(report.json.looks ?? {}).forEach(([name, look], index) => {
      light.push(`--c${index}:${look.light}`);
      dark.push(`--c${index}:${look.dark}`);
      const turn = kMarks[look.mark]?.[1] ?? 0;
      this.looks.set(name, { family: look.family, color: `var(--c${index})`, dash: look.dash, path: (size) => markPath(look.mark, size), turn });
    });
    const text = `:root{${light.join(";")}}@media screen{:root[data-theme="dark"]{${dark.join(";")}}}`;
    document.head.append(el("style", {}, text));
  }

  look(contender: string): Look {
    return this.looks.get(contender) ?? { family: contender, color: "var(--ink)", dash: "", path: (size) => markPath("circle", size), turn: 0 };
  }

  // Contenders shown when the report opens.
  get first(): string[] {
    const names = [...new Set(this.report.contenders.map((contender) => this.report.varied(contender.name)))];
    // Where each has a point or two, all are read at once.
    const steps = Math.max(0, ...(this.report.json.views ?? []).map((view) => new Set(view.points.filter((point) => point.speed).map((point) => point.timestep_ms)).size));
    if (steps === 1) return names;
    return names.filter((name) => this.report.json.looks?.[name]?.first ?? true);
  }
}
