// The key of a plot, drawn: each mark beside what it stands for.
import { el, svg } from "../dom";

export interface KeyEntry {
  text: string;
  draw: () => SVGElement[]; // in a box of 34 by 16 px
}

export function keyStrip(list: HTMLElement, entries: KeyEntry[]): void {
  list.replaceChildren(...entries.map(({ text, draw }) => el("li", {}, svg("svg", { width: 34, height: 16, viewBox: "0 0 34 16", "aria-hidden": "true" }, ...draw()), text)));
}
