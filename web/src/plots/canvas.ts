// The element that a plot of contenders is drawn in.
import { clear, onWidth, svg } from "../dom";
import { markContenders, state } from "../state";

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
