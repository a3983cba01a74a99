// One floating card for the whole page: what is under the pointer or the keyboard's cursor.
import { el, type Child } from "./dom";
import { state } from "./state";

class Tooltip {
  private readonly card = el("div", { class: "tooltip", role: "status", "aria-live": "polite", hidden: true });

  attach(): void {
    document.body.append(this.card);
    window.addEventListener("scroll", () => this.hide(), { passive: true });
    state.onChoice(() => this.hide()); // the drawer says more
  }

  // `x`, `y` in the window's coordinates; the card stays inside the window.
  show(x: number, y: number, ...content: Child[]): void {
    this.card.replaceChildren(...content.filter((child): child is Node | string => Boolean(child)));
    this.card.hidden = false;
    const { width, height } = this.card.getBoundingClientRect();
    const room = document.documentElement.clientWidth;
    let left = x + 14;
    if (left + width > room - 8) left = x - 14 - width;
    let top = y + 14;
    if (top + height > window.innerHeight - 8) top = y - 14 - height;
    this.card.style.left = `${Math.max(8, Math.min(left, room - width - 8))}px`;
    this.card.style.top = `${Math.max(8, top)}px`;
  }

  hide(): void {
    this.card.hidden = true;
  }
}

export const tooltip = new Tooltip();

// Rows of a tooltip: what and how much.
export function facts(rows: [string, string | null | undefined][]): HTMLElement {
  const list = el("dl", { class: "facts" });
  for (const [name, value] of rows) {
    if (value) list.append(el("dt", {}, name), el("dd", {}, value));
  }
  return list;
}
