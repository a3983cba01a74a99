// What the reader has chosen, shared by every plot of the page.

type Listener = () => void;

// One cell's place: what the details panel shows.
export interface Choice {
  system: string;
  contender: string;
  timestep: number; // ms
  why?: string; // what the reader asked about it
}

// What the picker asks: the largest values that the reader accepts, in SI units, and the least realtime factor.
export interface Question {
  system: string;
  limits: [name: string, largest: number][];
  realtime: number | null;
}

// A moment of a system's kept runs at a timestep, which its replay is to show.
export interface Moment {
  system: string;
  timestep: number; // ms
  time: number; // s
}

class State {
  private readonly hidden = new Set<string>();
  // The contender whose line another one is on (Report.varied): settings of one are shown, hidden and lit together.
  lineOf: (contender: string) => string = (contender) => contender;
  readonly measures = new Map<string, string>(); // the value that each system's plot shows, where the reader chose one
  question: Question | null = null;
  claim: number | null = null; // the one that is open
  // Called for whatever the page's address keeps.
  kept: () => void = () => undefined;
  private highlighted: string | null = null;
  private readonly listeners: Listener[] = [];
  private readonly choiceListeners: Listener[] = [];
  private chosen: Choice | null = null;
  private asked: Moment | null = null;
  private readonly momentListeners: Listener[] = [];

  get moment(): Moment | null {
    return this.asked;
  }

  askMoment(moment: Moment | null): void {
    this.asked = moment;
    for (const listener of this.momentListeners) listener();
    this.kept();
  }

  onMoment(listener: Listener): void {
    this.momentListeners.push(listener);
  }

  get choice(): Choice | null {
    return this.chosen;
  }

  // Chooses a cell for the details panel, or none.
  choose(choice: Choice | null): void {
    this.chosen = choice;
    for (const listener of this.choiceListeners) listener();
    this.kept();
  }

  isChosen(system: string, contender: string, timestep: number): boolean {
    const chosen = this.chosen;
    return chosen !== null && chosen.system === system && chosen.contender === contender && chosen.timestep === timestep;
  }

  onChoice(listener: Listener): void {
    this.choiceListeners.push(listener);
  }

  subscribe(listener: Listener): void {
    this.listeners.push(listener);
  }

  isHidden(contender: string): boolean {
    return this.hidden.has(this.lineOf(contender));
  }

  get highlight(): string | null {
    return this.highlighted;
  }

  setHighlight(contender: string | null): void {
    const line = contender === null ? null : this.lineOf(contender);
    if (this.highlighted === line) return;
    this.highlighted = line;
    this.changed();
  }

  toggle(contender: string): void {
    const line = this.lineOf(contender);
    if (!this.hidden.delete(line)) this.hidden.add(line);
    this.changed();
    this.kept();
  }

  // Shows or hides some and leaves the others as they are.
  setShown(contenders: string[], shown: boolean): void {
    for (const name of contenders) {
      if (shown) this.hidden.delete(this.lineOf(name));
      else this.hidden.add(this.lineOf(name));
    }
    this.changed();
    this.kept();
  }

  show(contenders: string[], all: string[]): void {
    this.hidden.clear();
    const lines = contenders.map((name) => this.lineOf(name));
    for (const name of all) if (!lines.includes(this.lineOf(name))) this.hidden.add(this.lineOf(name));
    this.changed();
    this.kept();
  }

  // Changes with what is hidden, not with what is highlighted.
  get shownKey(): string {
    return [...this.hidden].sort().join(" ");
  }

  private changed(): void {
    for (const listener of this.listeners) listener();
  }
}

export const state = new State();

// Marks elements that belong to a contender as hidden, dimmed or highlighted.
export function markContenders(root: ParentNode): void {
  for (const node of root.querySelectorAll<HTMLElement | SVGElement>("[data-contender]")) {
    const name = state.lineOf(node.dataset.contender ?? "");
    node.classList.toggle("off", state.isHidden(name));
    node.classList.toggle("lit", state.highlight === name);
    node.classList.toggle("dim", state.highlight !== null && state.highlight !== name);
  }
}
