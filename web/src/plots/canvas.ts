// The element that a plot of contenders is drawn in.
import { clear, onWidth } from "../dom";
import { markContenders, state } from "../state";

// Draws anew when the width or what the reader shows changes, and marks what is highlighted. `draw` finds it empty.
// Returns what draws it anew.
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
