// The replay of a system: its kept runs on one clock, their distances below.
import { replayAt, replayOf, type SystemView } from "../data";
import { replayHooks } from "../details";
import { clear, el, uniqueId } from "../dom";
import { quantity, timestep } from "../format";
import type { Palette } from "../palette";
import { swatch } from "../plots/legend";
import { picture } from "../plots/picture";
import { markContenders, state } from "../state";
import { onTheme } from "../theme";
import { wishes } from "../wishes";
import { Clock } from "./clock";
import { canUnpack, distances, farthest, Motions, unpackPictures, type Motion, type Replay } from "./decode";
import { DistancePlot } from "./distance_plot";
import { openContext, resolveColor, Stage, type Mode } from "./stage";

const kBusy = 25; // ms after which the page is let go on
const kSpeeds = [1 / 16, 1 / 8, 1 / 4, 1 / 2, 1, 2, 4];

function speedText(speed: number): string {
  return speed < 1 ? `1/${Math.round(1 / speed)}×` : `${speed}×`;
}

// The reference of "each its own": a run of its own contender at the smallest timestep.
const kOwn = -1;

// How the replay of a measured motion differs: its first run, what was measured, is drawn translucent among the others.
export interface MeasuredReplay {
  title: string;
  text: string;
}

const kShownSeconds = 2; // a shorter measured motion is shown slowly

class ReplayPanel {
  readonly element: HTMLElement;
  readonly contenders: string[];
  private readonly steps: number[]; // ms, ascending; the first is the references'
  private readonly clock: Clock;
  private readonly plot: DistancePlot;
  private readonly motions: Motions;
  private readonly view = el("div", { class: "replay-view" });
  private readonly still = el("div", { class: "replay-still", role: "status" });
  private readonly canvas = el("canvas", { class: "replay-canvas" });
  private readonly labels = el("div", { class: "replay-labels", "aria-hidden": "true" });
  private readonly slider: HTMLInputElement;
  private readonly clockText = el("output", { class: "replay-time" });
  private readonly playButton = el("button", { type: "button", class: "replay-play", "data-action": "play" }, "Play");
  private readonly speed: HTMLSelectElement;
  private readonly failing = el("p", { class: "note", "aria-live": "polite" });
  private readonly reference: HTMLSelectElement;
  private readonly step: HTMLSelectElement;
  private readonly trail: HTMLSelectElement;
  private readonly collision = el("input", { type: "checkbox", "data-action": "collision" });
  private readonly modes: HTMLInputElement[] = [];
  private stage: Stage | null = null;
  private waiting = false;
  private started = false;
  private ready = false;
  private isChosen = false; // the timestep, by the reader

  // `still` is shown until the runs are drawn.
  constructor(
    private readonly system: SystemView,
    private readonly replay: Replay,
    private readonly palette: Palette,
    still: SVGSVGElement | null,
    private readonly measured: MeasuredReplay | null = null,
  ) {
    const frame = replay.frame_ms / 1000;
    const id = uniqueId("replay");
    this.contenders = [...new Set(replay.runs.map((run) => run.contender))];
    this.steps = [...new Set(replay.runs.map((run) => run.timestep_ms))].sort((a, b) => a - b);
    this.clock = new Clock((replay.frames - 1) * frame, frame);
    if (measured) this.clock.speed = [...kSpeeds].reverse().find((speed) => speed <= 1 && this.clock.length >= speed * kShownSeconds) ?? kSpeeds[0]!;
    this.plot = new DistancePlot(this.clock, measured ? "Mean distance of the bodies from what was measured" : "Mean distance of the bodies from the reference");
    this.motions = new Motions(replay);
    this.slider = el("input", { type: "range", min: 0, max: replay.frames - 1, step: 1, value: 0, "aria-label": "Time" });
    this.slider.addEventListener("input", () => {
      this.clock.pause();
      this.clock.seek(Number(this.slider.value) * frame);
    });
    this.playButton.addEventListener("click", () => this.clock.toggle());
    this.speed = el("select", { "aria-label": "Speed" }, ...kSpeeds.map((speed) => el("option", { value: speed, selected: speed === this.clock.speed }, speedText(speed))));
    this.speed.addEventListener("change", () => (this.clock.speed = Number(this.speed.value)));
    this.step = el("select", { id: `${id}-step` }, ...this.steps.map((step) => el("option", { value: step }, `${timestep(step)} ms`)));
    this.step.addEventListener("change", () => {
      this.isChosen = true;
      void this.changed();
    });
    const first = `${timestep(this.steps[0] ?? 0)} ms`;
    this.reference = el(
      "select",
      { id: `${id}-reference` },
      ...this.contenders.map((name, index) => el("option", { value: index }, name)),
      this.steps.length > 1 ? el("option", { value: kOwn }, "each its own") : null,
    );
    this.reference.addEventListener("change", () => void this.changed());
    this.trail = el(
      "select",
      { id: `${id}-trail` },
      el("option", { value: -1 }, "none"),
      ...replay.scene.bodies.map((body, index) => el("option", { value: index }, body.name || `body ${index + 1}`)),
    );
    this.trail.addEventListener("change", () => this.setTrail());
    this.collision.addEventListener("change", () => {
      this.stage?.setCollision(this.collision.checked);
      this.request();
    });
    const home = el("button", { type: "button", class: "more", click: () => this.home() }, "Reset the view");

    this.element = el(
      "figure",
      { class: "panel replay-panel", tabindex: 0, "data-system": replay.system, "aria-label": `Replay of ${replay.system}: space plays and pauses, arrow keys step` },
      el(
        "figcaption",
        {},
        el("h3", {}, measured ? measured.title : "Replay"),
        el("p", { class: "sub" }, measured ? measured.text : `The runs of the contenders that the legend shows, from the same start${this.steps.length > 1 ? "" : `, at ${first}`}. Drag to turn the view; hold Shift and turn the wheel to zoom.`),
      ),
      el(
        "div",
        { class: "replay-bar" },
        el("div", { class: "segments", role: "radiogroup", "aria-label": "Views" }, ...this.mode(id, "side", "Side by side"), ...this.mode(id, "overlay", measured ? "In one picture" : "Over the reference")),
        this.steps.length > 1 ? el("label", { for: `${id}-step` }, "Timestep ", this.step) : null,
        el("label", { for: `${id}-reference` }, "Reference ", this.reference, this.steps.length > 1 ? ` at ${first}` : ""),
        el("label", { for: `${id}-trail` }, "Trail of ", this.trail),
        replay.pictures ? el("label", {}, this.collision, " Collision shapes") : null,
        home,
      ),
      this.view,
      el("div", { class: "replay-bar replay-controls" }, this.playButton, this.slider, this.clockText, this.speed),
      this.plot.element,
      this.failing,
      el("p", { class: "quiet note" }, this.notes()),
    );
    this.recommend();
    wishes.subscribe(() => {
      if (this.recommend()) void this.changed();
    });
    this.still.append(...(still ? [still] : []), el("p", { class: "quiet" }, "Drawing the runs…"));
    this.view.append(this.canvas, this.labels, this.still);
    this.element.addEventListener("keydown", (event) => this.key(event));
    this.clock.subscribe(() => this.tick());
    this.tick();
    this.watch();
    let shown = state.shownKey;
    state.subscribe(() => {
      if (shown !== state.shownKey) void this.changed();
      else markContenders(this.element);
      shown = state.shownKey;
    });
    state.onMoment(() => this.asked());
    this.asked();
    // For tests and screenshots: what is drawn, and when.
    Object.assign(this.element, {
      replay: {
        state: () => ({ time: this.clock.time, playing: this.clock.playing, drawn: this.stage !== null, ms: this.stage?.milliseconds ?? null }),
        places: (contender: string) => this.stage?.places(this.run(contender)) ?? null,
        seek: (time: number) => this.clock.seek(time),
        pixels: () => {
          this.stage?.draw(this.clock.time / this.clock.frame);
          return this.canvas.toDataURL();
        },
      },
    });
  }

  private notes(): string {
    const { position_error_m, rotation_error_rad, frame_ms, left_out } = this.replay;
    const rounding = `A state each ${Number(frame_ms.toPrecision(4))} ms; in between it is interpolated. Rounding moved positions by at most ${quantity(position_error_m, "m", 2)} and turned bodies by at most ${quantity(rotation_error_rad, "rad", 2)}.`;
    return left_out.length > 0 ? `${rounding} No room was left for ${left_out.join(", ")}.` : rounding;
  }

  private mode(id: string, value: Mode, text: string): HTMLElement[] {
    const input = el("input", { type: "radio", name: `${id}-mode`, id: `${id}-${value}`, value, checked: value === (this.measured ? "overlay" : "side") });
    input.addEventListener("change", () => void this.changed());
    this.modes.push(input);
    return [input, el("label", { for: input.id }, text)];
  }

  // Place of a contender's run at a timestep, the chosen one where none is given; -1 where there is none.
  run(contender: string, step = Number(this.step.value)): number {
    return this.replay.runs.findIndex((run) => run.contender === contender && run.timestep_ms === step);
  }

  // Shows a contender at this timestep, beside what is shown already.
  also(contender: string, step: number): void {
    this.isChosen = true;
    this.step.value = String(step);
    state.setShown([contender], true);
    void this.changed();
  }

  // Shows the moment that an address or a link asks for.
  private asked(): void {
    const moment = state.moment;
    if (moment?.system !== this.replay.system || !this.steps.includes(moment.timestep)) return;
    this.isChosen = true;
    this.step.value = String(moment.timestep);
    this.clock.pause();
    this.clock.seek(moment.time);
    void this.changed();
  }

  // What answers the reader's question is among the runs, at its timestep where that is kept.
  private get answer() {
    return wishes.answer(this.system).found.passing[0]?.point ?? null;
  }

  // Whether the runs that are shown are others now.
  private recommend(): boolean {
    const { answer } = this;
    const before = [this.answering, this.step.value].join();
    this.answering = answer && this.contenders.includes(answer.contender) ? answer.contender : null;
    if (answer && !this.isChosen && this.run(answer.contender, answer.timestep_ms) >= 0) this.step.value = String(answer.timestep_ms);
    return before !== [this.answering, this.step.value].join();
  }

  private answering: string | null = null;

  private get chosen(): string[] {
    return this.contenders.filter((name) => !state.isHidden(name) || name === this.answering);
  }

  private get overlay(): boolean {
    return this.modes.some((input) => input.checked && input.value === "overlay");
  }

  // The run that a contender's is compared with.
  private base(contender: string): number {
    const index = Number(this.reference.value);
    return this.run(index === kOwn ? contender : (this.contenders[index] ?? ""), this.steps[0]);
  }

  // What is drawn solid among the ghosts.
  private get solid(): number {
    return this.base(this.chosen[0] ?? "");
  }

  private home(): void {
    this.stage?.resetView();
    this.request();
  }

  // Nothing is unpacked before the panel comes near.
  private watch(): void {
    const observer = new IntersectionObserver(
      (entries) => {
        const near = entries.some((entry) => entry.isIntersecting);
        if (!near) this.clock.pause();
        if (!near || this.started) return;
        this.started = true;
        void this.start();
      },
      { rootMargin: "300px" },
    );
    observer.observe(this.element);
    new ResizeObserver(() => this.resized()).observe(this.view);
    onTheme(() => this.recolor());
  }

  private async start(): Promise<void> {
    if (!canUnpack()) {
      this.without("This browser cannot unpack the replays: it has no DecompressionStream.");
      return;
    }
    const references = this.contenders.map((name) => this.run(name, this.steps[0])).filter((index) => index >= 0);
    await this.motions.load(references);
    await pause();
    // Asked for here, for the library complains on the console where there is none.
    const opened = openContext(this.canvas);
    if (opened) {
      await pause();
      const motions = references.map((index) => this.motions.get(index)).filter((motion): motion is Motion => motion !== undefined);
      const pictures = await unpackPictures(this.replay, replayAt);
      this.stage = new Stage(this.canvas, opened.context, opened.coarse, this.replay, pictures, motions, () => this.request());
      const first = motions[0];
      if (first) this.trail.value = String(farthest(first, this.replay.bodies));
      this.setTrail();
    } else {
      this.without("This browser has no WebGL, so the bodies cannot be drawn; their distances are below.");
    }
    this.recolor();
    this.resized();
    this.ready = true;
    await this.changed();
    if (this.measured) this.seekFarthest();
    await this.drawn();
    this.still.remove();
    this.element.dataset.ready = "true";
  }

  private without(text: string): void {
    this.view.replaceChildren(el("p", { class: "quiet replay-missing" }, text));
  }

  private setTrail(): void {
    const body = Number(this.trail.value);
    this.stage?.setTrail(body >= 0 ? body : null);
    this.request();
  }

  private recolor(): void {
    this.stage?.setColors({
      panel: resolveColor("var(--panel)", this.element),
      rule: resolveColor("var(--rule)", this.element),
      faint: resolveColor("var(--faint)", this.element),
      runs: this.replay.runs.map((run) => resolveColor(this.palette.look(run.contender).color, this.element)),
    });
    this.request();
  }

  private resized(): void {
    const { clientWidth, clientHeight } = this.view;
    if (clientWidth === 0) return;
    this.stage?.resize(clientWidth, clientHeight, this.clock.playing);
    this.relabel();
    this.request();
  }

  // Of what is chosen; runs that were not unpacked yet are first.
  private async changed(): Promise<void> {
    if (!this.ready) return;
    const runs = this.chosen.map((name) => this.run(name));
    const wanted = [...new Set([...runs, ...this.chosen.map((name) => this.base(name)), this.solid])].filter((index) => index >= 0);
    await this.motions.load(wanted);
    let began = performance.now();
    for (const index of wanted) {
      const motion = this.motions.get(index);
      if (motion) this.stage?.add(index, motion);
      if (performance.now() - began < kBusy) continue;
      await pause();
      began = performance.now();
    }
    this.stage?.setMode(this.overlay ? "overlay" : "side");
    if (this.measured) this.stage?.setTranslucent(0);
    this.stage?.setShown(
      this.chosen.map((name) => this.run(name)),
      this.overlay ? this.solid : -1,
    );
    this.relabel();
    this.replot();
    this.request();
  }

  // The smallest timestep at which a contender fails.
  private fails(contender: string): string {
    const failed = this.system.firstFailure(contender);
    return failed ? `fails at ${timestep(failed.timestep_ms)} ms` : "";
  }

  // Names over the views, each with the timestep at which its contender fails; below them the reasons.
  private relabel(): void {
    clear(this.labels);
    const failed = this.chosen.flatMap((name) => this.system.firstFailure(name) ?? []);
    this.failing.hidden = this.chosen.length === 0 || this.measured !== null;
    const list = failed.length > 0 ? `Smallest timestep that fails: ${failed.map((point) => `${point.contender} ${timestep(point.timestep_ms)} ms (${point.why})`).join("; ")}.` : "None of the contenders shown fails at a timestep that was measured.";
    this.failing.textContent = list;
    if (!this.stage) return;
    const label = (name: string) => el("span", { "data-contender": name }, swatch(this.palette, name), ` ${name}`);
    const notes = (name: string) => [ended(name), this.fails(name)].filter(Boolean).join(", ");
    const ended = (name: string) => {
      const run = this.replay.runs[this.run(name)];
      if (!run) return `no run at ${timestep(Number(this.step.value))} ms`;
      return run.frames < this.replay.frames ? `ends at ${Number((((run.frames - 1) * this.replay.frame_ms) / 1000).toPrecision(3))} s` : "";
    };
    if (this.overlay) {
      const solid = this.replay.runs[this.solid];
      const ghosts = this.chosen.filter((name) => this.run(name) !== this.solid);
      this.labels.style.gridTemplateColumns = "1fr";
      this.labels.append(el("div", { class: "replay-names" }, solid ? label(solid.contender) : null, ...ghosts.map((name) => label(name))));
      if (solid) this.labels.querySelector("span")?.append(!this.measured ? " (solid)" : this.solid === 0 ? " (translucent)" : "");
    } else if (this.chosen.length === 0) {
      this.labels.append(el("div", {}, "No contender that the legend shows has a kept run."));
    } else {
      const columns = this.stage.columns(this.chosen.length, this.view.clientWidth, this.view.clientHeight);
      this.labels.style.gridTemplateColumns = `repeat(${columns}, 1fr)`;
      this.labels.append(...this.chosen.map((name) => el("div", { class: "replay-label" }, label(name), name === this.answering ? el("small", { class: "answering" }, "the answer") : null, notes(name) ? el("small", {}, notes(name)) : null)));
    }
    markContenders(this.labels);
  }

  // Of the runs that are shown, where they differ from their references.
  private get apart() {
    return this.chosen.flatMap((name) => {
      const [motion, base] = [this.motions.get(this.run(name)), this.motions.get(this.base(name))];
      if (!motion || !base || motion === base) return [];
      const look = this.palette.look(name);
      return [{ contender: name, color: look.color, dash: look.dash, base, values: distances(this.replay, motion, base) }];
    });
  }

  // Where one of them is farthest away.
  private seekFarthest(): void {
    if (this.clock.playing || this.clock.time > 0) return;
    const { apart } = this;
    const frames = Array.from({ length: this.replay.frames }, (_, frame) => Math.max(0, ...apart.map(({ values }) => values[frame] ?? 0)));
    this.clock.seek(frames.indexOf(Math.max(...frames)) * this.clock.frame);
  }

  private replot(): void {
    const { apart } = this;
    const exact = apart.every(({ base }) => base.run === this.replay.runs[0]);
    this.plot.show(apart, exact ? 0 : 2 * this.replay.position_error_m);
  }

  private tick(): void {
    const { time, frame, playing, length } = this.clock;
    this.slider.value = String(Math.round(time / frame));
    this.slider.setAttribute("aria-valuetext", `${time.toFixed(2)} s`);
    this.clockText.textContent = `${time.toFixed(2)} of ${length.toFixed(2)} s`;
    this.playButton.textContent = playing ? "Pause" : "Play";
    if (this.playButton.getAttribute("aria-pressed") !== String(playing)) {
      this.playButton.setAttribute("aria-pressed", String(playing));
      this.stage?.resize(this.view.clientWidth, this.view.clientHeight, playing);
    }
    this.request();
  }

  // When what was asked for last is on the screen.
  private async drawn(): Promise<void> {
    if (!this.stage) return;
    this.request();
    while (this.waiting) await pause();
  }

  // One picture for all that has changed since the last.
  private request(): void {
    if (this.waiting || !this.stage) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.stage?.draw(this.clock.time / this.clock.frame);
    });
  }

  private key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.target as HTMLElement;
    // Elements that have a use of their own for a key keep it.
    if (target instanceof HTMLSelectElement) return;
    const own = target instanceof HTMLInputElement ? target.type : target.tagName.toLowerCase();
    if (event.key === " " && (own === "button" || own === "checkbox" || own === "radio")) return;
    if (own === "radio" && event.key.startsWith("Arrow")) return;
    const stride = event.shiftKey ? 10 : 1;
    const actions: Record<string, () => void> = {
      " ": () => this.clock.toggle(),
      ArrowRight: () => this.clock.step(stride),
      ArrowLeft: () => this.clock.step(-stride),
      ArrowUp: () => this.faster(1),
      ArrowDown: () => this.faster(-1),
      Home: () => this.clock.seek(0),
      End: () => this.clock.seek(this.clock.length),
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  private faster(by: number): void {
    const index = Math.min(Math.max(this.speed.selectedIndex + by, 0), kSpeeds.length - 1);
    this.speed.selectedIndex = index;
    this.clock.speed = kSpeeds[index] ?? 1;
  }
}

// Lets the page answer and draw in between; one in the background has no pictures to wait for.
function pause(): Promise<void> {
  return new Promise((done) => {
    requestAnimationFrame(() => setTimeout(done, 0));
    setTimeout(done, 100);
  });
}

// Null for a log without kept runs.
export function measuredReplay(view: SystemView, palette: Palette, how: MeasuredReplay): HTMLElement | null {
  const replay = replayOf(view.system);
  if (!replay || replay.runs.length < 2 || replay.frames < 2) return null;
  return new ReplayPanel(view, replay, palette, null, how).element;
}

// Null for a system without kept runs.
export function replayPanel(view: SystemView, palette: Palette): HTMLElement | null {
  const replay = replayOf(view.system);
  if (!replay || replay.runs.length === 0 || replay.frames < 2) return null;
  const drawn = view.report.json.pictures?.find((candidate) => candidate.system === view.system);
  const panel = new ReplayPanel(view, replay, palette, drawn ? picture(drawn, 420, 300) : null);
  replayHooks.push((slot, choice) => {
    if (choice.system !== view.system) return;
    const own = replay.runs.filter((run) => run.contender === choice.contender);
    const run = own.find((candidate) => candidate.timestep_ms === choice.timestep) ?? own[0];
    if (run) {
      const other = run.timestep_ms !== choice.timestep ? ` at ${timestep(run.timestep_ms)} ms` : "";
      const button = el("button", { type: "button", class: "more", "data-action": "replay" }, `Show its run${other}`);
      button.addEventListener("click", () => {
        panel.also(run.contender, run.timestep_ms);
        panel.element.scrollIntoView({ block: "center" });
        panel.element.focus({ preventScroll: true });
      });
      slot.append(el("h3", {}, "Replay"), button);
    } else {
      slot.append(el("h3", {}, "Replay"), el("p", { class: "quiet note" }, "The report holds no replay of this contender."));
    }
    slot.append(
      el("p", { class: "quiet note" }, "As a movie: ", el("code", {}, `assay draw DIR ${view.system} --contenders ${choice.contender} --timestep ${timestep(choice.timestep)} --out ${view.system}.mp4`)),
    );
  });
  return panel.element;
}
