// What the reader accepts, over all systems: every plot, the grid and the picker follow it, and a question to one system is
// a question to all that have its values.
import { pick, type Picked } from "./answer";
import { valueInfo, type SystemView } from "./data";
import { state, type Question } from "./state";

// The one that the system's card answers first.
export function firstQuestion(view: SystemView): Question {
  const first = view.json.card.answers.find((one) => Object.keys(one.limits ?? {}).length > 0 || (one.realtime ?? null) !== null);
  // the error that the system is judged by, then what is limited of contacts, as the command has it
  const place = (name: string) => (name === view.json.main ? -1 : view.json.usual.findIndex((one) => one.value === name));
  const limits = Object.entries(first?.limits ?? {}).sort(([a], [b]) => place(a) - place(b));
  return { system: view.system, limits, realtime: first ? (first.realtime ?? null) : 1 };
}

// The error that a system is judged by is another value on another system, as the penetration of older results is.
function role(view: SystemView, name: string): string {
  if (name === view.json.main) return `error in ${valueInfo(name).unit}`;
  return view.json.usual.find((one) => one.value === name)?.option ?? name;
}

export interface Answered {
  question: Question;
  found: Picked;
}

class Wishes {
  // By what a limit is for: the largest, or null for one that was taken away. What is not here is as it was at first.
  private readonly limits = new Map<string, number | null>();
  private rate: number | null | undefined;
  private readonly listeners: (() => void)[] = [];
  private known = new Map<string, Answered>();

  subscribe(listener: () => void): void {
    this.listeners.push(listener);
  }

  // Takes what differs from the system's first question.
  ask(view: SystemView, question: Question): void {
    const first = firstQuestion(view);
    for (const name of view.json.errors) {
      const own = question.limits.find(([each]) => each === name)?.[1];
      const usual = first.limits.find(([each]) => each === name)?.[1];
      if (own === usual) this.limits.delete(role(view, name));
      else this.limits.set(role(view, name), own ?? null);
    }
    this.rate = question.realtime === first.realtime ? undefined : question.realtime;
    this.changed();
  }

  // Asks with another limit of one value; null takes it away.
  limit(view: SystemView, name: string, largest: number | null): void {
    const { limits, ...rest } = this.of(view);
    const others = limits.map(([each, old]): [string, number | null] => [each, each === name ? largest : old]);
    if (!limits.some(([each]) => each === name)) others.push([name, largest]);
    const next = { ...rest, limits: others.filter((one): one is [string, number] => one[1] !== null) };
    state.question = next;
    this.ask(view, next);
    state.kept();
  }

  reset(): void {
    this.limits.clear();
    this.rate = undefined;
    this.changed();
  }

  of(view: SystemView): Question {
    const first = firstQuestion(view);
    const limits: [string, number][] = [];
    for (const name of new Set([...first.limits.map(([each]) => each), ...view.json.errors])) {
      const wish = this.limits.get(role(view, name));
      const largest = wish === undefined ? first.limits.find(([each]) => each === name)?.[1] : wish;
      if (largest !== undefined && largest !== null) limits.push([name, largest]);
    }
    return { system: view.system, limits, realtime: this.rate === undefined ? first.realtime : this.rate };
  }

  // The system's answer to what the reader asks.
  answer(view: SystemView): Answered {
    let answered = this.known.get(view.system);
    if (!answered) {
      const question = this.of(view);
      const asked = question.limits.filter(([, largest]) => largest > 0).map(([name, largest]) => ({ name, largest, text: "" }));
      this.known.set(view.system, (answered = { question, found: pick(view, { asked, realtime: question.realtime }) }));
    }
    return answered;
  }

  private changed(): void {
    this.known = new Map();
    for (const listener of this.listeners) listener();
  }
}

export const wishes = new Wishes();
