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

// Fixed places in the palette, so that an engine has the same hue in every report.
const kSlots: Record<string, number> = {
  mujoco: 0, bullet: 1, "bullet/joint": 2, ode: 3, simbody: 4, dart: 5, physx: 6, "physx/joint": 7, havok: 8, jolt: 9,
  rapier: 10, "rapier/joint": 11,
}; // prettier-ignore
const kSlotCount = 12;

const kVariants: { marker: SymbolType; turn: number; dash: string; mix: string }[] = [
  { marker: symbolCircle, turn: 0, dash: "", mix: "" },
  { marker: symbolSquare, turn: 0, dash: "7 3", mix: "var(--ink) 28%" },
  { marker: symbolTriangle, turn: 0, dash: "2 3", mix: "var(--paper) 22%" },
  { marker: symbolDiamond, turn: 0, dash: "9 3 2 3", mix: "var(--ink) 45%" },
  { marker: symbolTriangle, turn: 180, dash: "12 4", mix: "var(--paper) 30%" },
  { marker: symbolCross, turn: 45, dash: "4 2", mix: "var(--ink) 14%" },
  { marker: symbolStar, turn: 0, dash: "1 3", mix: "var(--paper) 12%" },
  { marker: symbolWye, turn: 0, dash: "9 2 1 2 1 2", mix: "var(--ink) 36%" },
];

function engineOf(contender: Contender): string {
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
    const taken = new Set([...families.keys()].map((family) => kSlots[family]));
    let next = 0;
    for (const [family, members] of families) {
      let slot = kSlots[family];
      if (slot === undefined) {
        while (taken.has(next) && next < kSlotCount) next += 1;
        slot = next % kSlotCount;
        taken.add(slot);
        next += 1;
      }
      members.forEach((contender, index) => {
        const variant = kVariants[index % kVariants.length]!;
        const hue = `var(--hue-${slot})`;
        this.looks.set(contender.name, {
          family,
          color: variant.mix ? `color-mix(in oklab, ${hue}, ${variant.mix})` : hue,
          dash: variant.dash,
          path: (size) => symbol(variant.marker, size)() ?? "",
          turn: variant.turn,
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
