// What the reader has chosen, shared by every plot of the page.

type Listener = () => void;

class State {
  private readonly hidden = new Set<string>();
  private highlighted: string | null = null;
  private readonly listeners: Listener[] = [];

  subscribe(listener: Listener): void {
    this.listeners.push(listener);
  }

  isHidden(contender: string): boolean {
    return this.hidden.has(contender);
  }

  get highlight(): string | null {
    return this.highlighted;
  }

  setHighlight(contender: string | null): void {
    if (this.highlighted === contender) return;
    this.highlighted = contender;
    this.changed();
  }

  toggle(contender: string): void {
    if (!this.hidden.delete(contender)) this.hidden.add(contender);
    this.changed();
  }

  show(contenders: string[], all: string[]): void {
    this.hidden.clear();
    for (const name of all) if (!contenders.includes(name)) this.hidden.add(name);
    this.changed();
  }

  private changed(): void {
    for (const listener of this.listeners) listener();
  }
}

export const state = new State();

// Marks elements that belong to a contender as hidden, dimmed or highlighted.
export function markContenders(root: ParentNode): void {
  for (const node of root.querySelectorAll<HTMLElement | SVGElement>("[data-contender]")) {
    const name = node.dataset.contender ?? "";
    node.classList.toggle("off", state.isHidden(name));
    node.classList.toggle("lit", state.highlight === name);
    node.classList.toggle("dim", state.highlight !== null && state.highlight !== name);
  }
}
