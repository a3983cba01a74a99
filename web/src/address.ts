// What the reader has chosen, kept in the page's address behind the section: "#humanoid&show=mujoco-euler,ode-quick".
import type { Report } from "./data";
import { reach } from "./places";
import { state, type Moment } from "./state";

const kSettled = 200; // ms; browsers refuse an address that changes too often

interface Kept {
  section: string;
  words: URLSearchParams;
}

function read(): Kept {
  const [first = "", ...rest] = location.hash.slice(1).split("&");
  const isSection = !first.includes("=");
  return { section: isSection ? decodeURIComponent(first) : "", words: new URLSearchParams((isSection ? rest : [first, ...rest]).join("&")) };
}

function word(name: string, value: string): string {
  return `${name}=${encodeURIComponent(value).replace(/%2C/g, ",").replace(/%3A/g, ":").replace(/%2F/g, "/")}`;
}

function momentText({ system, timestep, time }: Moment): string {
  return [system, timestep, Number(time.toFixed(3))].join("/");
}

// The address of a moment of a replay that shows these contenders.
export function momentLink(moment: Moment, contenders: string[]): string {
  return `#${[encodeURIComponent(moment.system), word("show", contenders.join()), word("replay", momentText(moment))].join("&")}`;
}

const restored: (() => void)[] = [];

// Calls back after an address was read, for parts that do not follow `state` by themselves.
export function onRestored(listener: () => void): void {
  restored.push(listener);
}

export class Address {
  private section = "";
  private timer = 0;
  private seen = ""; // the address that is known here
  private readonly everyone: string[];

  constructor(
    report: Report,
    private readonly first: string[],
  ) {
    this.everyone = [...new Set(report.contenders.map((contender) => report.varied(contender.name)))];
    this.seen = location.hash;
    this.restore();
    state.kept = () => this.write();
    window.addEventListener("hashchange", () => {
      this.seen = location.hash;
      const { section, words } = read();
      // A link of the page names only a section: what was chosen stays.
      if (words.size === 0) {
        this.section = section;
        reach(section);
        this.write();
      } else {
        this.restore();
        this.show();
      }
    });
  }

  // The section that the reader looks at.
  at(section: string): void {
    // Until all is drawn, parts move by themselves.
    if (section === this.section || !("ready" in document.body.dataset)) return;
    this.section = section;
    this.write();
  }

  // Scrolls to the section that the address names.
  show(): void {
    const { section, words } = read();
    const moment = words.has("replay") ? state.moment : null;
    if (moment) reach(moment.system);
    const panel = moment && document.querySelector(`.replay-panel[data-system="${CSS.escape(moment.system)}"]`);
    if (panel) {
      panel.scrollIntoView({ block: "center" });
      return;
    }
    const system = section || words.get("cell")?.split("/")[0] || (words.has("claim") ? "claims" : words.has("pick") ? "pick" : "");
    if (system) reach(system);
  }

  private restore(): void {
    const { section, words } = read();
    this.section = section;
    const list = (name: string) => (words.get(name) ?? "").split(",").filter(Boolean);
    const pair = (text: string): [string, string] => [text.slice(0, text.indexOf(":")), text.slice(text.indexOf(":") + 1)];
    state.show(words.has("show") ? list("show") : this.first, this.everyone);
    state.measures.clear();
    for (const [system, name] of list("plot").map(pair)) state.measures.set(system, name);
    const limits = list("limit").map(pair).map(([name, largest]): [string, number] => [name, Number(largest)]);
    const realtime = Number(words.get("realtime"));
    const asked = words.get("pick");
    state.question = asked ? { system: asked, limits: limits.filter(([, largest]) => largest > 0), realtime: realtime > 0 ? realtime : null } : null;
    state.claim = Number(words.get("claim")) || null;
    const [system = "", contender = "", step = ""] = (words.get("cell") ?? "").split("/");
    state.choose(system && contender && Number(step) > 0 ? { system, contender, timestep: Number(step) } : null);
    const moment = (words.get("replay") ?? "").split("/");
    const atTime = Number(moment.pop());
    const atStep = Number(moment.pop());
    const ofSystem = moment.join("/");
    state.askMoment(ofSystem && atStep > 0 && atTime >= 0 ? { system: ofSystem, timestep: atStep, time: atTime } : null);
    for (const listener of restored) listener();
  }

  private write(): void {
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => {
      if (location.hash !== this.seen) return; // a new address is about to be read
      const parts: string[] = [];
      const add = (name: string, value: string) => parts.push(word(name, value));
      const shown = this.everyone.filter((name) => !state.isHidden(name));
      if (shown.join() !== this.first.join()) add("show", shown.join());
      if (state.measures.size > 0) add("plot", [...state.measures].map((pair) => pair.join(":")).join());
      if (state.question) {
        add("pick", state.question.system);
        if (state.question.limits.length > 0) add("limit", state.question.limits.map((pair) => pair.join(":")).join());
        if (state.question.realtime !== null) add("realtime", String(state.question.realtime));
      }
      if (state.claim !== null) add("claim", String(state.claim));
      if (state.moment) add("replay", momentText(state.moment));
      const choice = state.choice;
      if (choice) add("cell", `${choice.system}/${choice.contender}/${choice.timestep}`);
      const hash = [encodeURIComponent(this.section), ...parts].filter((part, index) => index > 0 || part).join("&");
      if (hash !== location.hash.slice(1)) history.replaceState(null, "", hash ? `#${hash}` : location.pathname + location.search);
      this.seen = location.hash;
    }, kSettled);
  }
}
