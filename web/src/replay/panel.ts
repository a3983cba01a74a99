// The replay of a system: its kept runs on one clock, their distances below.
import type { SystemView } from "../data";
import { replayHooks } from "../details";
import { clear, el, uniqueId } from "../dom";
import { quantity, timestep } from "../format";
import type { Palette } from "../palette";
import { swatch } from "../plots/legend";
import { Clock } from "./clock";
import { canUnpack, distances, farthest, unpack, type Motion, type Replay } from "./decode";
import { DistancePlot } from "./distance_plot";
import { gridColumns, resolveColor, Stage, type Mode } from "./stage";

const kShownAtFirst = 6;
const kSpeeds = [1 / 16, 1 / 8, 1 / 4, 1 / 2, 1, 2, 4];

function speedText(speed: number): string {
  return speed < 1 ? `1/${Math.round(1 / speed)}×` : `${speed}×`;
}

class ReplayPanel {
  readonly element: HTMLElement;
  private readonly clock: Clock;
  private readonly plot: DistancePlot;
  private readonly view = el("div", { class: "replay-view" });
  private readonly canvas = el("canvas", { class: "replay-canvas" });
  private readonly labels = el("div", { class: "replay-labels", "aria-hidden": "true" });
  private readonly note = el("p", { class: "quiet note" });
  private readonly slider: HTMLInputElement;
  private readonly clockText = el("output", { class: "replay-time" });
  private readonly playButton = el("button", { type: "button", class: "replay-play", "data-action": "play" }, "Play");
  private readonly speed: HTMLSelectElement;
  private readonly boxes: HTMLInputElement[] = [];
  private readonly reference: HTMLSelectElement;
  private readonly modes: HTMLInputElement[] = [];
  private motions: Motion[] | null = null;
  private stage: Stage | null = null;
  private waiting = false;
  private started = false;
  private shown: number[];

  constructor(
    private readonly replay: Replay,
    private readonly palette: Palette,
  ) {
    const frame = replay.frame_ms / 1000;
    this.clock = new Clock((replay.frames - 1) * frame, frame);
    this.plot = new DistancePlot(this.clock);
    this.shown = replay.runs.map((_, index) => index).slice(0, kShownAtFirst);
    const id = uniqueId("replay");
    this.slider = el("input", { type: "range", min: 0, max: replay.frames - 1, step: 1, value: 0, "aria-label": "Time" });
    this.slider.addEventListener("input", () => {
      this.clock.pause();
      this.clock.seek(Number(this.slider.value) * frame);
    });
    this.playButton.addEventListener("click", () => this.clock.toggle());
    this.speed = el("select", { "aria-label": "Speed" }, ...kSpeeds.map((speed) => el("option", { value: speed, selected: speed === 1 }, speedText(speed))));
    this.speed.addEventListener("change", () => (this.clock.speed = Number(this.speed.value)));
    this.reference = el("select", { id: `${id}-reference` }, ...replay.runs.map((run, index) => el("option", { value: index }, run.contender)));
    this.reference.addEventListener("change", () => this.changed());
    const trail = el(
      "select",
      { id: `${id}-trail` },
      el("option", { value: -1 }, "none"),
      ...replay.scene.bodies.map((body, index) => el("option", { value: index }, body.name || `body ${index + 1}`)),
    );
    trail.addEventListener("change", () => this.setTrail(Number(trail.value)));
    this.trail = trail;
    const home = el("button", { type: "button", class: "more", click: () => this.home() }, "Reset the view");

    this.element = el(
      "figure",
      { class: "panel replay-panel", tabindex: 0, "data-system": replay.system, "aria-label": `Replay of ${replay.system}: space plays and pauses, arrow keys step` },
      el(
        "figcaption",
        {},
        el("h3", {}, "Replay"),
        el("p", { class: "sub" }, this.caption()),
      ),
      el(
        "div",
        { class: "replay-bar" },
        el("div", { class: "segments", role: "radiogroup", "aria-label": "Views" }, ...this.mode(id, "side", "Side by side"), ...this.mode(id, "overlay", "Ghosts over the reference")),
        el("label", { for: `${id}-reference` }, "Reference ", this.reference),
        el("label", { for: `${id}-trail` }, "Trail of ", trail),
        home,
      ),
      el("div", { class: "replay-runs", role: "group", "aria-label": "Contenders in the replay" }, ...replay.runs.map((run, index) => this.chip(run.contender, index))),
      this.view,
      el("div", { class: "replay-bar replay-controls" }, this.playButton, this.slider, this.clockText, this.speed),
      this.plot.element,
      this.note,
    );
    this.view.append(this.canvas, this.labels);
    this.note.textContent = this.notes();
    this.element.addEventListener("keydown", (event) => this.key(event));
    this.clock.subscribe(() => this.tick());
    this.tick();
    this.watch();
    // For the tests: what is drawn, and when.
    Object.assign(this.element, {
      replay: {
        state: () => ({ time: this.clock.time, playing: this.clock.playing, drawn: this.stage !== null, ms: this.stage?.milliseconds ?? null }),
        places: (index: number) => this.stage?.places(index) ?? null,
      },
    });
  }

  private readonly trail: HTMLSelectElement;

  private caption(): string {
    const steps = [...new Set(this.replay.runs.map((run) => run.timestep_ms))].map((step) => `${timestep(step)} ms`);
    return `Each contender's own run at ${steps.join(", ")}, from the same start. Drag turns the view, Shift and wheel bring it nearer.`;
  }

  private notes(): string {
    const { position_error_m, rotation_error_rad, frame_ms, left_out } = this.replay;
    const rounding = `A state each ${Number(frame_ms.toPrecision(4))} ms; in between it is interpolated. Rounding moved positions by at most ${quantity(position_error_m, "m", 2)} and turned bodies by at most ${quantity(rotation_error_rad, "rad", 2)}.`;
    return left_out.length > 0 ? `${rounding} No room was left for ${left_out.join(", ")}.` : rounding;
  }

  private mode(id: string, value: Mode, text: string): HTMLElement[] {
    const input = el("input", { type: "radio", name: `${id}-mode`, id: `${id}-${value}`, value, checked: value === "side" });
    input.addEventListener("change", () => this.changed());
    this.modes.push(input);
    return [input, el("label", { for: input.id }, text)];
  }

  private chip(contender: string, index: number): HTMLElement {
    const box = el("input", { type: "checkbox", value: index, checked: this.shown.includes(index) });
    box.addEventListener("change", () => {
      this.shown = this.boxes.flatMap((one, place) => (one.checked ? [place] : []));
      this.changed();
    });
    this.boxes.push(box);
    return el("label", { class: "replay-chip", "data-contender": contender }, box, swatch(this.palette, contender), contender);
  }

  get contenders(): string[] {
    return this.replay.runs.map((run) => run.contender);
  }

  // Shows these, the first of them as the reference where there are two.
  only(indices: number[]): void {
    this.shown = [...indices].sort((a, b) => a - b);
    this.boxes.forEach((box, index) => (box.checked = this.shown.includes(index)));
    this.changed();
  }

  private get overlay(): boolean {
    return this.modes.some((input) => input.checked && input.value === "overlay");
  }

  private get base(): number {
    return Number(this.reference.value);
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
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolor());
  }

  private async start(): Promise<void> {
    if (!canUnpack()) {
      this.without("This browser cannot unpack the replays: it has no DecompressionStream.");
      return;
    }
    this.motions = await Promise.all(this.replay.runs.map((run) => unpack(this.replay, run)));
    // Asked for here, for the library complains on the console where there is none.
    const context = this.canvas.getContext("webgl2", { alpha: true, antialias: true });
    if (context) {
      this.stage = new Stage(this.canvas, context, this.replay, this.motions, () => this.request());
      const first = this.motions[0];
      if (first) this.trail.value = String(farthest(first, this.replay.bodies));
      this.setTrail(Number(this.trail.value));
    } else {
      this.without("This browser has no WebGL, so the bodies cannot be drawn; their distances are below.");
    }
    this.recolor();
    this.resized();
    this.changed();
    this.element.dataset.ready = "true";
  }

  private without(text: string): void {
    this.view.replaceChildren(el("p", { class: "quiet replay-missing" }, text));
  }

  private setTrail(body: number): void {
    if (!this.stage) return;
    this.stage.trails = body >= 0;
    this.stage.setTrail(body >= 0 ? body : null);
    this.request();
  }

  private recolor(): void {
    this.stage?.setColors({
      rule: resolveColor("var(--rule)", this.element),
      faint: resolveColor("var(--faint)", this.element),
      contenders: this.contenders.map((name) => resolveColor(this.palette.look(name).color, this.element)),
    });
    this.request();
  }

  private resized(): void {
    const { clientWidth, clientHeight } = this.view;
    if (clientWidth === 0) return;
    this.stage?.resize(clientWidth, clientHeight);
    this.relabel();
    this.request();
  }

  private changed(): void {
    this.stage?.setMode(this.overlay ? "overlay" : "side");
    this.stage?.setShown(this.shown, this.base);
    this.relabel();
    this.replot();
    this.request();
  }

  // Names over the views; the colours of the ghosts are those of the chips above.
  private relabel(): void {
    clear(this.labels);
    if (!this.stage) return;
    const label = (index: number, suffix = "") => {
      const name = this.contenders[index] ?? "";
      return el("span", {}, swatch(this.palette, name), ` ${name}${suffix}`);
    };
    if (this.overlay) {
      this.labels.style.gridTemplateColumns = "1fr";
      const ghosts = this.shown.filter((index) => index !== this.base);
      this.labels.append(el("div", { class: "replay-names" }, label(this.base, " (solid)"), ...ghosts.map((index) => label(index))));
      return;
    }
    const columns = gridColumns(this.shown.length, this.view.clientWidth, this.view.clientHeight);
    this.labels.style.gridTemplateColumns = `repeat(${columns}, 1fr)`;
    this.labels.append(...this.shown.map((index) => el("div", {}, label(index))));
  }

  private replot(): void {
    const motions = this.motions;
    const base = motions?.[this.base];
    if (!motions || !base) return;
    const series = this.shown.flatMap((index) => {
      const motion = motions[index];
      if (!motion || index === this.base) return [];
      const look = this.palette.look(motion.run.contender);
      return [{ contender: motion.run.contender, color: look.color, dash: look.dash, values: distances(this.replay, motion, base) }];
    });
    this.plot.show(series, this.base === 0 ? 0 : 2 * this.replay.position_error_m);
  }

  private tick(): void {
    const { time, frame, playing, length } = this.clock;
    this.slider.value = String(Math.round(time / frame));
    this.slider.setAttribute("aria-valuetext", `${time.toFixed(2)} s`);
    this.clockText.textContent = `${time.toFixed(2)} of ${length.toFixed(2)} s`;
    this.playButton.textContent = playing ? "Pause" : "Play";
    this.playButton.setAttribute("aria-pressed", String(playing));
    this.request();
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

// Null for a system without kept runs.
export function replayPanel(view: SystemView, palette: Palette): HTMLElement | null {
  const replay = view.report.json.replays?.find((candidate) => candidate.system === view.system);
  if (!replay || replay.runs.length === 0 || replay.frames < 2) return null;
  const panel = new ReplayPanel(replay, palette);
  replayHooks.push((slot, choice) => {
    if (choice.system !== view.system) return;
    const index = panel.contenders.indexOf(choice.contender);
    const run = replay.runs[index];
    if (run) {
      const other = run.timestep_ms !== choice.timestep ? ` at ${timestep(run.timestep_ms)} ms` : "";
      const button = el("button", { type: "button", class: "more", "data-action": "replay" }, `Show its run${other}`);
      button.addEventListener("click", () => {
        panel.only(index === 0 ? [0] : [0, index]);
        panel.element.scrollIntoView({ block: "center" });
        panel.element.focus({ preventScroll: true });
      });
      slot.append(el("h4", {}, "Replay"), button);
    } else {
      slot.append(el("h4", {}, "Replay"), el("p", { class: "quiet note" }, "The report holds no replay of this contender."));
    }
    slot.append(
      el("p", { class: "quiet note" }, "As a movie: ", el("code", {}, `assay movie DIR ${view.system} --contenders ${choice.contender} --timestep ${timestep(choice.timestep)} --out ${view.system}.mp4`)),
    );
  });
  return panel.element;
}
