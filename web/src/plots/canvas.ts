// The element that a plot of contenders is drawn in.
import { clear, el, onWidth, svg } from "../dom";
import { markContenders, state } from "../state";
import { facts, tooltip } from "../tooltip";

// Draws again when the width or the shown contenders change, and marks what is highlighted. `draw` finds `canvas` empty.
// Returns a function that draws again.
export function drawContenders(canvas: HTMLElement, draw: (width: number) => void): () => void {
  const redraw = onWidth(canvas, (width) => {
    clear(canvas);
    draw(width);
    markContenders(canvas);
  });
  let shown = state.shownKey;
  state.subscribe(() => {
    if (shown !== state.shownKey) redraw();
    else markContenders(canvas);
    shown = state.shownKey;
  });
  return redraw;
}

// The room around a mark that a pointer or a finger reaches.
export function hitArea(x: number, y: number): SVGCircleElement {
  return svg("circle", { class: "hit", cx: x, cy: y, r: 11 });
}

// Under the pointer the node highlights its contender and shows the rows of facts.
export function explain(node: SVGElement, contender: string, name: string, rows: () => Parameters<typeof facts>[0]): void {
  node.addEventListener("pointerenter", (event) => {
    state.setHighlight(contender);
    tooltip.show(event.clientX, event.clientY, el("strong", {}, name), facts(rows()));
  });
  node.addEventListener("pointerleave", () => {
    state.setHighlight(null);
    tooltip.hide();
  });
}
