// How a contender looks in every plot: a hue per engine family, a dash, a marker and a shade per variant in it.
import {
  symbolCircle, symbolCross, symbolDiamond, symbolSquare, symbolStar, symbolTriangle, symbolWye, symbol, type SymbolType,
} from "d3-shape"; // prettier-ignore

import type { Contender, Report } from "./data";

export interface Look {
  family: string;
  color: string; // CSS
  dash: string;
  path: (size: number) => string;
  turn: number; // degrees
}

// Fixed places in the palette and the mark of the first contender there, so that an engine looks the same in every
// report and in the figures (src/report/look.cc).
const kSlots: Record<string, [hue: number, mark: number]> = {
  mujoco: [0, 0], bullet: [1, 2], "bullet/joint": [2, 4], ode: [3, 3], simbody: [4, 1], dart: [5, 2], physx: [6, 5],
  "physx/joint": [7, 7], havok: [8, 6], jolt: [9, 7], rapier: [10, 3], "rapier/joint": [11, 4],
}; // prettier-ignore
const kSlotCount = 12;

const kMarks: { marker: SymbolType; turn: number }[] = [
  { marker: symbolCircle, turn: 0 },
  { marker: symbolSquare, turn: 0 },
  { marker: symbolTriangle, turn: 0 },
  { marker: symbolDiamond, turn: 0 },
  { marker: symbolTriangle, turn: 180 },
  { marker: symbolCross, turn: 45 },
  { marker: symbolStar, turn: 0 },
  { marker: symbolWye, turn: 0 },
];

const kVariants: { dash: string; mix: string }[] = [
  { dash: "", mix: "" },
  { dash: "7 3", mix: "var(--ink) 28%" },
  { dash: "2 3", mix: "var(--paper) 22%" },
  { dash: "9 3 2 3", mix: "var(--ink) 45%" },
  { dash: "12 4", mix: "var(--paper) 30%" },
  { dash: "4 2", mix: "var(--ink) 14%" },
  { dash: "1 3", mix: "var(--paper) 12%" },
  { dash: "9 2 1 2 1 2", mix: "var(--ink) 36%" },
];

// Whom a report of many contenders shows at first: today's versions of the paper's, MuJoCo's two solvers among them.
const kPapers = [
  "mujoco-euler", "mujoco-euler-dense", "mujoco-rk4", "bullet-si-f64", "bullet-mb", "ode-quick", "physx-d6-pgs", "havok",
]; // prettier-ignore
const kMany = 16;

export function shownAtFirst(contenders: string[]): string[] {
  const chosen = kPapers.filter((name) => contenders.includes(name));
  return contenders.length <= kMany || chosen.length < 3 ? contenders : chosen;
}

export function engineOf(contender: Contender): string {
  return contender.engine.replace(/-(f32|f64)$/, "");
}

function isJoint(contender: Contender): boolean {
  return contender.capabilities["coordinates"] === "joint";
}

export class Palette {
  private readonly looks = new Map<string, Look>();

  constructor(report: Report) {
    const mixed = new Set<string>();
    for (const a of report.contenders) {
      for (const b of report.contenders) {
        if (engineOf(a) === engineOf(b) && isJoint(a) !== isJoint(b)) mixed.add(engineOf(a));
      }
    }
    const families = new Map<string, Contender[]>();
    for (const contender of report.contenders) {
      const engine = engineOf(contender);
      const family = mixed.has(engine) && isJoint(contender) ? `${engine}/joint` : engine;
      families.set(family, [...(families.get(family) ?? []), contender]);
    }
    const taken = new Set([...families.keys()].map((family) => kSlots[family]?.[0]));
    let next = 0;
    for (const [family, members] of families) {
      let slot = kSlots[family]?.[0];
      const first = kSlots[family]?.[1] ?? 0;
      if (slot === undefined) {
        while (taken.has(next) && next < kSlotCount) next += 1;
        slot = next % kSlotCount;
        taken.add(slot);
        next += 1;
      }
      members.forEach((contender, index) => {
        const variant = kVariants[index % kVariants.length]!;
        const mark = kMarks[(first + index) % kMarks.length]!;
        const hue = `var(--hue-${slot})`;
        this.looks.set(contender.name, {
          family,
          color: variant.mix ? `color-mix(in oklab, ${hue}, ${variant.mix})` : hue,
          dash: variant.dash,
          path: (size) => symbol(mark.marker, size)() ?? "",
          turn: mark.turn,
        });
      });
    }
  }

  look(contender: string): Look {
    return (
      this.looks.get(contender) ?? { family: contender, color: "var(--ink)", dash: "", path: (size) => symbol(symbolCircle, size)() ?? "", turn: 0 }
    );
  }
}
