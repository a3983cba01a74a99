// Names at the ends of lines, where they fit: each takes the first place around its line's ends that is free.
import { svg, textWidth } from "../dom";

export interface LineEnd {
  name: string;
  color: string;
  ends: [x: number, y: number][]; // the preferred end first
}

export interface Box {
  left: number;
  right: number;
  top: number;
  bottom: number;
}

const kSize = 11.5; // px

export function endLabels(lines: LineEnd[], marks: [x: number, y: number][], frame: Box, taken: Box[] = []): SVGGElement {
  const group = svg("g", { class: "end-labels", "aria-hidden": "true" });
  const boxes = [...taken];
  const crowd = (box: Box) => marks.filter(([x, y]) => x > box.left - 3 && x < box.right + 3 && y > box.top - 2 && y < box.bottom + 2).length;
  const free = (box: Box) =>
    box.left >= frame.left + 2 && box.right <= frame.right - 2 && box.top >= frame.top + 1 && box.bottom <= frame.bottom - 1 &&
    !boxes.some((other) => box.left < other.right && box.right > other.left && box.top < other.bottom && box.bottom > other.top); // prettier-ignore
  for (const { name, color, ends } of lines) {
    const width = textWidth(name, kSize);
    const at = (x: number, y: number): Box => ({ left: x, right: x + width, top: y - kSize + 1, bottom: y + 3 });
    const places = ends.flatMap(([x, y], index) =>
      [at(x + 9, y + 4), at(x - 9 - width, y + 4), at(x - width / 2, y - 9), at(x - width / 2, y + 19), at(x + 7, y - 9), at(x - width - 7, y - 9)]
        .filter(free)
        .map((box, place) => ({ box, cost: crowd(box) * 2 + place * 0.1 + index * 0.5 })),
    );
    const best = places.sort((a, b) => a.cost - b.cost)[0];
    if (!best || best.cost >= 4) continue;
    boxes.push(best.box);
    group.append(svg("text", { x: best.box.left, y: best.box.bottom - 3, "data-contender": name, style: `--line:${color}` }, name));
  }
  return group;
}
