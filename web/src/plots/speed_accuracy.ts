// Error against realtime factor, one line a contender, a marker per timestep. Of a contender whose settings were swept the
// line is the front over all of them, and what is not on it is a dot.
import { line } from "d3-shape";

import { onRestored } from "../address";
import { exceeds } from "../answer";
import { isReference, valueInfo, type Cell, type Outcome, type Speed, type SystemView } from "../data";
import { clear, el, onWidth, svg, textWidth, uniqueId } from "../dom";
import { downloads, type CsvRow } from "../download";
import { belowFloor, bounded, figure, floorText, hasPrefixes, interval, quantity, realtime, timestep, timestepRange, unitText } from "../format";
import { markPath, type Palette } from "../palette";
import { markContenders, state } from "../state";
import { facts, tooltip } from "../tooltip";
import { wishes } from "../wishes";
import { errorLabel, factorLabel, frameOf, grid, logScale, ticks, type LogScale } from "./axes";
import { keyStrip, type KeyEntry } from "./key";
import { endLabels } from "./labels";

interface Point {
  contender: string;
  timestep: number;
  along: number; // realtime factor; the timestep where the system was not timed
  speed: Speed | null;
  sound: boolean;
  error: number | null; // null: no value, drawn at the edge
  low: number | null;
  high: number | null;
  cell: Cell;
  x: number;
  y: number;
}

interface Series {
  contender: string; // whose line it is
  points: Point[];
  others: Point[]; // of swept settings: what is not on the front
  swept: boolean;
  floor: number | null;
}

// What ended a curve.
const kOutcomeMarks: Partial<Record<Outcome, string>> = {
  diverged: "M-4,-4L4,4M-4,4L4,-4",
  unstable: "M-5,0H5M0,-5V5",
  timeout: "M-4,-5H4L-4,5H4Z",
  crashed: "M-4,-4H4V4H-4ZM-4,-4L4,4M-4,4L4,-4",
};
const kOutcomeWords: Partial<Record<Outcome, string>> = { diverged: "diverged", unstable: "unstable", timeout: "out of time", crashed: "crashed" };

const kReach = 26; // px around a point that a mouse reaches
const kFinger = 32; // px that a tap reaches
const kNarrow = 440; // px that a plot has without its axes
const kFailBand = 26; // room above the plot for points without a value
const kZeroBand = 22; // room below it for errors of exactly zero

// Timesteps of a contender's points that have an error and no speed, and whether other points of it are shown.
interface Unplaced {
  contender: string;
  range: string;
  partly: boolean;
}

function collect(view: SystemView, name: string): { series: Series[]; unplaced: Unplaced[]; failed: string[] } {
  const series: Series[] = [];
  const unplaced: Unplaced[] = [];
  const failed: string[] = [];
  const timed = view.isTimed;
  const measured = (contender: string, step: number) => {
    const entry = view.entry(contender, step, name);
    if (!entry || entry.cell.outcome === "unsupported") return null;
    return name.startsWith("consistency") && isReference(entry.cell) ? null : entry;
  };
  const placed = (contender: string, step: number): Point | null => {
    const entry = measured(contender, step);
    const speed = view.speed(contender, step);
    if (!entry || (timed && !speed)) return null;
    const error = entry.value?.value ?? null;
    return {
      contender, timestep: step, along: speed?.value ?? step, speed, sound: view.point(contender, step)?.sound ?? entry.cell.outcome === "ok", error: error === null ? null : Math.abs(error),
      low: entry.value?.low ?? null, high: entry.value?.high ?? null, cell: entry.cell, x: 0, y: 0,
    }; // prettier-ignore
  };
  for (const line of view.lines) {
    const settings = view.settingsOf(line);
    if (settings.length > 1) {
      const front = (view.json.swept?.[name]?.[line] ?? []).map((point) => view.json.points[point]!);
      const points = front.flatMap((of) => placed(of.contender, of.timestep_ms) ?? []).filter((point) => point.error !== null).reverse();
      const onFront = new Set(points.map((point) => `${point.contender} ${point.timestep}`));
      const all = settings.flatMap((contender) => view.errorTimesteps(name).flatMap((step) => placed(contender, step) ?? []));
      const others = all.filter((point) => point.error !== null && !onFront.has(`${point.contender} ${point.timestep}`));
      if (points.length + others.length > 0) series.push({ contender: line, points, others, swept: true, floor: null });
      else failed.push(`${line} (all ${settings.length} settings)`);
      continue;
    }
    const contender = settings[0]!;
    const points: Point[] = [];
    const noSpeed: number[] = [];
    const outcomes = new Set<string>();
    for (const step of view.errorTimesteps(name)) {
      const entry = measured(contender, step);
      if (!entry) continue;
      const point = placed(contender, step);
      if (point) points.push(point);
      else if (entry.value) noSpeed.push(step);
      else outcomes.add(entry.cell.outcome);
    }
    const floor = name === "consistency" ? view.single(contender, "restart_floor") : null;
    if (points.length > 0) series.push({ contender, points, others: [], swept: false, floor });
    if (noSpeed.length > 0) unplaced.push({ contender, range: timestepRange(noSpeed), partly: points.length > 0 });
    if (outcomes.size > 0) failed.push(`${contender} (${[...outcomes].join(", ")})`);
  }
  return { series, unplaced, failed };
}

function isNearFloor(point: Point, name: string): boolean {
  return name === "consistency" && point.cell.values.some((value) => value.name === "consistency_floor");
}

function isBound(point: Point, name: string): boolean {
  return point.cell.values.some((value) => value.name === name && value.bound);
}

// Lines of slope 1, 2 and 4 from the emptiest corner: how an error of that order falls with the timestep. In a narrow
// plot without an empty corner there are none.
function orderGuide(x: LogScale, y: LogScale, points: Point[], frame: Frame): SVGGElement {
  const group = svg("g", { class: "order-guide" });
  const slope = Math.abs(y(10) - y(1)) / Math.abs(x(10) - x(1)); // pixels up per pixel right, at order 1
  const width = 74;
  const height = 66;
  const corners: [number, number][] = [
    [frame.right - width - 60, frame.bottom - 22],
    [frame.left + 16, frame.top + height + 22],
    [frame.right - width - 60, frame.top + height + 22],
    [frame.left + 40, frame.bottom - 22],
  ];
  const crowd = ([cx, cy]: [number, number]) =>
    points.filter((p) => p.x > cx - 14 && p.x < cx + width + 60 && p.y < cy + 22 && p.y > cy - height - 18).length;
  const emptiest = corners.reduce((best, corner) => (crowd(corner) < crowd(best) ? corner : best));
  if (frame.right - frame.left < kNarrow && crowd(emptiest) > 0) return group;
  const [ox, oy] = emptiest;
  const ends: { order: number; x: number; y: number }[] = [];
  for (const order of [1, 2, 4]) {
    const rise = order * slope;
    const reach = Math.min(width, height / rise);
    ends.push({ order, x: ox + reach, y: oy - reach * rise });
    group.append(svg("line", { x1: ox, y1: oy, x2: ox + reach, y2: oy - reach * rise }));
  }
  // Labels stand at the ends, pushed apart where the ends are close: steep lines along the top, flat ones at the right.
  let lastX = -Infinity;
  for (const end of [...ends].reverse()) {
    if (end.y > oy - height + 1) continue;
    lastX = Math.max(end.x, lastX + 12);
    group.append(svg("text", { x: lastX, y: end.y - 4, "text-anchor": "middle" }, String(end.order)));
  }
  let lastY = Infinity;
  for (const end of ends) {
    if (end.y <= oy - height + 1) continue;
    lastY = Math.min(end.y + 4, lastY - 12);
    group.append(svg("text", { x: end.x + 5, y: lastY }, String(end.order)));
  }
  group.append(svg("text", { x: ox - 4, y: oy + 13, class: "guide-title" }, "slope of order 1, 2, 4"));
  return group;
}

interface Frame {
  left: number;
  right: number;
  top: number;
  bottom: number;
}

const kPhone = 500; // px of a row that may be wider than the window

export class SpeedAccuracy {
  readonly element: HTMLElement;
  private readonly canvas = el("div", { class: "canvas" });
  private readonly key = el("ul", { class: "plot-key", "aria-label": "Marks of the plot" });
  private readonly note = el("p", { class: "quiet note" });
  private readonly lists = el("div", { class: "quiet note" });
  private readonly meaning = el("p", { class: "sub" });
  private readonly redraw: () => void;
  private series: Series[] = [];
  private cursor: Point | null = null;
  private overlay: SVGGElement | null = null;
  private answer: SVGGElement | null = null;
  private scale: LogScale | null = null; // of errors
  private onFront = new Set<string>();
  private front: SVGPathElement | null = null;
  private names: SVGGElement | null = null;
  private frame: Frame | null = null;
  private taken: Frame[] = []; // what the names must not cover
  private labelled = "";
  private answerBox: Frame | null = null; // of its name
  private readonly marks = new Map<Point, SVGElement>();
  private collected: ({ name: string } & ReturnType<typeof collect>) | null = null;

  constructor(
    private readonly view: SystemView,
    private readonly palette: Palette,
    private name: string,
    names: string[],
    onMeasure: (name: string) => void,
  ) {
    const group = uniqueId("measure");
    const choices = el("div", { class: "segments", role: "radiogroup", "aria-label": "Measure of the plot" });
    for (const candidate of names) {
      const id = uniqueId(group);
      const input = el("input", { type: "radio", name: group, id, value: candidate, checked: candidate === name });
      const choose = () => {
        this.name = candidate;
        this.cursor = null;
        tooltip.hide();
        this.redraw();
        onMeasure(candidate);
      };
      input.addEventListener("change", () => {
        state.measures.set(view.system, candidate);
        state.kept();
        choose();
      });
      onRestored(() => {
        if (state.measures.get(view.system) !== candidate || this.name === candidate) return;
        input.checked = true;
        choose();
      });
      choices.append(input, el("label", { for: id }, valueInfo(candidate).label));
    }
    // On a phone the row is wider than the window: the chosen one is in it.
    onWidth(choices, (width) => {
      const chosen = width < kPhone && choices.querySelector("input:checked + label");
      if (chosen instanceof HTMLElement) choices.scrollLeft = Math.max(0, chosen.offsetLeft - choices.offsetLeft - (width - chosen.offsetWidth) / 2);
    });
    this.element = el(
      "figure",
      { class: "panel accuracy-panel" },
      el("figcaption", {}, downloads(() => `${this.view.system}-${this.name}`, this.canvas, () => this.rows()), el("h3", {}, "Speed and accuracy")),
      names.length > 1 ? choices : null,
      this.canvas,
      this.key,
      this.meaning,
      this.note,
      this.lists,
    );
    this.redraw = onWidth(this.canvas, (width) => this.draw(width));
    let shown = state.shownKey;
    state.subscribe(() => {
      // The axes are cut to what is shown.
      if (shown === state.shownKey) return this.mark();
      shown = state.shownKey;
      this.redraw();
    });
    state.onChoice(() => this.mark());
    let answering = this.answerLine;
    wishes.subscribe(() => {
      if (answering === this.answerLine) {
        this.drawAnswer();
        this.label();
        return this.mark();
      }
      answering = this.answerLine;
      this.redraw();
    });
  }

  private get best() {
    return wishes.answer(this.view).found.passing[0]?.point ?? null;
  }

  // The line of the answer, which is shown whatever the legend says.
  private get answerLine(): string {
    return this.best ? this.view.report.varied(this.best.contender) : "";
  }

  // Of a contender that the legend does not show, the answer's line stands in the plot, else its points on the front.
  private isWhole(one: Series): boolean {
    return !state.isHidden(one.contender) || one.contender === this.answerLine;
  }

  private shownOf(one: Series): Point[] {
    if (this.isWhole(one)) return [...one.points, ...one.others];
    return [...one.points, ...one.others].filter((point) => point.error !== null && this.onFront.has(`${point.contender} ${point.timestep}`));
  }

  private draw(width: number): void {
    const info = valueInfo(this.name);
    const unit = this.view.unit(this.name);
    if (this.collected?.name !== this.name) this.collected = { name: this.name, ...collect(this.view, this.name) };
    const { series, unplaced, failed } = this.collected;
    this.series = series;
    this.onFront = new Set((this.view.json.fronts[this.name] ?? []).map(({ point }) => this.view.json.points[point]!).map((point) => `${point.contender} ${point.timestep_ms}`));
    this.meaning.textContent = `${info.label}: ${info.meaning}.`;
    clear(this.canvas);
    const everything = series.flatMap((one) => [...one.points, ...one.others]);
    // The axes are cut to what is seen; all of them where the legend hides all.
    const visible = series.flatMap((one) => this.shownOf(one));
    const seen = visible.length > 0 ? visible : everything;
    const isBelow = (point: Point) => point.error !== null && (point.error === 0 || belowFloor(point.error, unit));
    const valued = seen.filter((point) => point.error !== null && !isBelow(point));
    const notes: string[] = [];
    const absent: HTMLElement[] = [];
    const list = (what: string, contenders: string[]) => {
      if (contenders.length > 0 && everything.length > 0) absent.push(el("p", {}, `${what}: ${contenders.join(", ")}.`));
    };
    const written = (some: Unplaced[]) => some.map((one) => `${one.contender} (${one.range})`);
    list("Not shown, because no speed is known", written(unplaced.filter((one) => !one.partly)));
    // Of contenders that are shown at other timesteps.
    const partly = unplaced.filter((one) => one.partly);
    const ranges = new Set(partly.map((one) => one.range));
    if (ranges.size === 1) list(`Not shown at ${[...ranges][0]}, where no speed is known`, partly.map((one) => one.contender));
    else list("Shown but for these timesteps, where no speed is known", written(partly));
    list("Neither speed nor error", failed);
    const missing = new Set([...unplaced.map((one) => one.contender), ...failed]).size;
    clear(this.lists);
    if (absent.length > 0) this.lists.append(el("details", {}, el("summary", {}, `Not all in the plot: ${missing} of ${this.view.lines.length} contenders`), ...absent));
    this.key.replaceChildren();
    this.marks.clear();
    this.answer = this.overlay = this.names = null;
    if (everything.length === 0) {
      this.canvas.append(el("p", { class: "quiet empty" }, `Nothing to place: no contender has both a ${info.label.toLowerCase()} and a timing here.`));
      this.note.textContent = notes.join(" ");
      this.note.hidden = notes.length === 0;
      return;
    }

    const timed = this.view.isTimed;
    const hasZero = seen.some(isBelow);
    const hasFailed = seen.some((point) => point.error === null);
    const height = Math.round(Math.max(340, Math.min(560, 0.55 * window.innerHeight, 0.7 * width)));
    const frame: Frame = {
      left: 64,
      right: width - 14,
      top: hasFailed ? kFailBand + 6 : 10,
      bottom: height - 50 - (hasZero ? kZeroBand : 0),
    };
    const x = logScale(seen.map((point) => point.along), [frame.left, frame.right], 1);
    const errors = valued.map((point) => point.error!);
    const y = logScale(errors.length > 0 ? errors : [1e-3], [frame.bottom, frame.top], 2);
    this.scale = y;
    for (const point of everything) {
      point.x = x(point.along);
      if (point.error === null) point.y = frame.top - kFailBand / 2 - 2;
      else if (isBelow(point)) point.y = frame.bottom + kZeroBand / 2 + 2;
      else point.y = y(point.error);
    }

    const drawing = svg("svg", {
      class: "accuracy", width, height, viewBox: `0 0 ${width} ${height}`, tabindex: 0, role: "application",
      "aria-label": `${info.label} against ${timed ? "realtime factor" : "timestep"}; arrow keys move between timesteps and contenders, Enter opens the details`,
    }); // prettier-ignore
    drawing.append(grid(x, "x", frame.top, frame.bottom), grid(y, "y", frame.left, frame.right));
    drawing.append(
      frameOf(frame),
    );
    if (hasFailed) {
      drawing.append(
        svg("rect", { class: "fail-band", x: frame.left, y: frame.top - kFailBand - 2, width: frame.right - frame.left, height: kFailBand }),
        svg("text", { class: "band-label", x: frame.left - 8, y: frame.top - kFailBand / 2 + 2, "text-anchor": "end" }, "failed"),
      );
    }
    if (hasZero) {
      drawing.append(
        svg("rect", { class: "zero-band", x: frame.left, y: frame.bottom + 2, width: frame.right - frame.left, height: kZeroBand }),
        svg("text", { class: "band-label", x: frame.left - 8, y: frame.bottom + kZeroBand / 2 + 6, "text-anchor": "end" }, seen.some((point) => point.error !== 0 && isBelow(point)) ? floorText(unit).replace("below", "<") : "exactly 0"),
      );
    }

    const axis = svg("g", { class: "axis" });
    const ground = frame.bottom + (hasZero ? kZeroBand : 0);
    for (const value of ticks(x, 44)) {
      axis.append(svg("text", { class: "tick tick-x", x: x(value), y: ground + 18, "text-anchor": "middle" }, timed ? factorLabel(value) : `${Number(value.toPrecision(2))} ms`));
    }
    for (const value of ticks(y, 20)) {
      const at = y(value);
      if (hasZero && at > frame.bottom - 8) continue; // the band's own label stands there
      axis.append(svg("text", { class: "tick tick-y", x: frame.left - 8, y: at + 4, "text-anchor": "end" }, errorLabel(value, unit)));
    }
    const narrow = frame.right - frame.left < kNarrow;
    const titles = narrow ? [timed ? "faster →" : "timestep →", "↓ better"] : [timed ? "realtime factor, faster →" : "timestep (this system was not timed) →", `↓ smaller ${info.label.toLowerCase()}${hasPrefixes(unit) || !unitText(unit) ? "" : ` (${unitText(unit)})`}`];
    axis.append(
      svg("text", { class: "axis-title", x: frame.right, y: height - 8, "text-anchor": "end" }, titles[0]!),
      svg("text", { class: "axis-title", x: frame.left, y: height - 8, "text-anchor": "start" }, titles[1]!),
    );
    drawing.append(axis);

    this.taken = [];
    const [slowest = 1, fastest = 1] = x.domain();
    if (timed && slowest < 1 && fastest > 1) {
      const at = Math.round(x(1)) + 0.5;
      // The label stands at the end of the line where fewer points are.
      const crowd = (top: number) =>
        seen.filter((point) => point.x > at - 8 && point.x < at + 22 && point.y > top - 10 && point.y < top + 70).length;
      const top = crowd(frame.bottom - 60) <= crowd(frame.top) ? frame.bottom - 8 : frame.top + 58;
      this.taken.push({ left: at, right: at + 15, top: top - 52, bottom: top });
      drawing.append(
        svg("line", { class: "realtime-line", x1: at, x2: at, y1: frame.top, y2: frame.bottom }),
        svg("text", { class: "realtime-label", transform: `translate(${at + 11},${top}) rotate(-90)` }, "real time"),
      );
    }
    // Only an error of integration has an order.
    const guide = /^(truth_error|consistency)/.test(this.name) ? orderGuide(x, y, seen, frame) : svg("g");
    drawing.append(guide);
    for (const text of guide.querySelectorAll("text")) {
      const width = textWidth(text.textContent ?? "", 11);
      const left = Number(text.getAttribute("x")) - (text.hasAttribute("text-anchor") ? width / 2 : 0);
      const line = Number(text.getAttribute("y"));
      this.taken.push({ left, right: left + width, top: line - 10, bottom: line + 3 });
    }

    this.front = svg("path", { class: "front-line" });
    drawing.append(this.front);
    const clip = uniqueId("frame");
    const inside = { x: frame.left, y: frame.top, width: frame.right - frame.left, height: frame.bottom - frame.top };
    drawing.append(svg("clipPath", { id: clip }, svg("rect", inside)));
    const path = line<Point>((point) => point.x, (point) => point.y); // prettier-ignore
    const [lowest = 0, highest = 0] = y.domain();
    for (const one of series) {
      const look = this.palette.look(one.contender);
      const frontOnly = !this.isWhole(one);
      const kept = frontOnly && this.shownOf(one).length > 0;
      const group = svg("g", { class: `series${one.contender === this.answerLine ? " answering" : ""}${kept ? " front-only" : ""}`, "data-contender": one.contender, style: `--line:${look.color}` });
      if (one.floor !== null && one.floor > lowest && one.floor < highest) {
        const at = y(one.floor);
        group.append(svg("line", { class: "floor", x1: frame.left, x2: frame.right, y1: at, y2: at }));
      }
      for (const point of one.others) {
        group.append(svg("circle", { class: `setting${this.onFront.has(`${point.contender} ${point.timestep}`) ? " on-front" : ""}${point.error === 0 || point.sound ? "" : " unsound"}`, cx: point.x, cy: point.y, r: 1.8, "data-timestep": point.timestep }));
      }
      // A line stops at a point without a value and goes on after it.
      let run: Point[] = [];
      const runs: Point[][] = [run];
      for (const point of one.points) {
        if (point.error === null) runs.push((run = []));
        else run.push(point);
      }
      const broken = one.points.findIndex((point) => point.error === null);
      if (broken > 0 && one.points[broken - 1]!.error !== null) {
        const [last, end] = [one.points[broken - 1]!, one.points[broken]!];
        group.append(svg("line", { class: "to-failure", x1: last.x, y1: last.y, x2: end.x, y2: end.y }));
      }
      for (const piece of runs) {
        if (piece.length > 1) group.append(svg("path", { class: "line", d: path(piece) ?? "", "stroke-dasharray": look.dash }));
      }
      for (const point of one.points) {
        if (point.error === null) {
          group.append(svg("path", { class: "failed", d: kOutcomeMarks[point.cell.outcome] ?? kOutcomeMarks.diverged!, "data-outcome": point.cell.outcome, transform: `translate(${point.x},${point.y})`, "data-timestep": point.timestep }));
          continue;
        }
        const bars = this.intervalPath(point, x, y);
        if (bars) group.append(svg("path", { class: "interval", d: bars, "clip-path": `url(#${clip})` }));
        const hollow = point.speed !== null && !point.speed.timed;
        const pale = isNearFloor(point, this.name) || !point.sound;
        const mark =
          svg("path", { class: `mark${this.onFront.has(`${point.contender} ${point.timestep}`) ? " on-front" : ""}${hollow ? " hollow" : ""}${pale ? " pale" : ""}${point.sound ? "" : " unsound"}`, d: look.path(46 * (point.timestep === 1 ? 2 : 1)), transform: `translate(${point.x},${point.y}) rotate(${look.turn})`, "data-timestep": point.timestep });
        group.append(mark);
        this.marks.set(point, mark);
        if (isBound(point, this.name)) group.append(svg("path", { class: "bound", d: "M0,5V13M-3,9.5L0,13L3,9.5", transform: `translate(${point.x},${point.y})` }));
        if (!point.sound) group.append(svg("path", { class: "strike", d: "M-5.5,5.5L5.5,-5.5", transform: `translate(${point.x},${point.y})` }));
      }
      drawing.append(group);
    }
    this.names = svg("g");
    this.answer = svg("g", { class: "answer-marks" });
    this.overlay = svg("g", { class: "overlay" });
    drawing.append(this.names, this.answer, this.overlay);
    this.frame = frame;
    this.listen(drawing);
    this.canvas.append(drawing);
    this.labelled = "";

    const drawn = series.filter((one) => this.isWhole(one) && one.floor !== null && one.floor > lowest && one.floor < highest);
    this.drawKey(seen, drawn.length > 0, timed);
    const flat = this.name.startsWith("truth_error") ? series.filter((one) => this.view.single(one.contender, "truth_floor") !== null) : [];
    if (flat.length > 0) notes.push(`Stops shrinking with the timestep, far above rounding: ${flat.map((one) => one.contender).join(", ")}.`);
    this.drawAnswer();
    this.note.textContent = notes.join(" ");
    this.note.hidden = notes.length === 0;
    this.mark();
  }

  // What the marks stand for that are in the plot.
  private drawKey(seen: Point[], floors: boolean, timed: boolean): void {
    const dot = (x: number, kind = "", size = 30) => svg("path", { class: `mark${kind}`, d: markPath("circle", size), transform: `translate(${x},8)` });
    const wire = () => svg("path", { class: "line", d: "M2,8H32" });
    const series = (...parts: SVGElement[]) => [svg("g", { class: "sample", style: "--line:var(--soft)" }, ...parts)];
    const entries: KeyEntry[] = [{ text: "timesteps, the smallest at the left", draw: () => series(wire(), dot(5), dot(17), dot(29)) }];
    if (this.best) entries.push({ text: "the answer", draw: () => [svg("circle", { class: "answer-ring", cx: 17, cy: 8, r: 6.5 })] });
    const { limits, realtime: rate } = wishes.of(this.view);
    if (limits.some(([name]) => name === this.name)) entries.push({ text: "your limit", draw: () => [svg("line", { class: "limit-line", x1: 2, x2: 32, y1: 8, y2: 8 })] });
    if (rate !== null || limits.some(([name]) => name !== this.name)) entries.push({ text: "not within another limit, or not judged by it", draw: () => series(dot(17, " misses", 60)) });
    if (timed) entries.push({ text: "front: none is faster and more accurate", draw: () => [svg("path", { class: "front-line", d: "M2,4H18V12H32" })] });
    if (seen.some((point) => point.timestep === 1)) entries.push({ text: "1 ms", draw: () => series(dot(17, "", 80)) });
    const estimated = seen.filter((point) => point.speed && !point.speed.timed).length;
    if (estimated > 0) entries.push({ text: `speed interpolated (${estimated} of ${seen.length})`, draw: () => series(dot(17, " hollow", 40)) });
    if (seen.some((point) => point.error !== null && !point.sound)) entries.push({ text: "not sound", draw: () => series(dot(17, " pale", 46), svg("path", { class: "strike", d: "M-5.5,5.5L5.5,-5.5", transform: "translate(17,8)" })) });
    if (this.series.some((one) => one.swept)) entries.push({ text: "settings beaten by others of theirs", draw: () => series(...[8, 17, 26].map((x) => svg("circle", { class: "setting", cx: x, cy: 8, r: 1.8 }))) });
    if (seen.some((point) => isNearFloor(point, this.name))) entries.push({ text: "too near the floor to tell", draw: () => series(dot(17, " pale", 46)) });
    if (seen.some((point) => isBound(point, this.name))) entries.push({ text: "upper bound", draw: () => series(dot(17, "", 30), svg("path", { class: "bound", d: "M0,2V8M-3,5L0,8L3,5", transform: "translate(17,8)" })) });
    if (floors) entries.push({ text: "restart floor", draw: () => series(svg("line", { class: "floor", x1: 2, x2: 32, y1: 8, y2: 8 })) });
    for (const outcome of new Set(seen.filter((point) => point.error === null).map((point) => point.cell.outcome))) {
      entries.push({ text: kOutcomeWords[outcome] ?? outcome, draw: () => series(svg("path", { class: "failed", d: kOutcomeMarks[outcome] ?? kOutcomeMarks.diverged!, transform: "translate(17,8)" })) });
    }
    keyStrip(this.key, entries);
  }

  // The reader's limit as a line, what is beyond it shaded, and a ring with the name of what answers.
  private drawAnswer(): void {
    const { answer, frame, scale } = this;
    if (!answer || !frame || !scale) return;
    clear(answer);
    this.answerBox = null;
    const { limits, realtime: rate } = wishes.of(this.view);
    const largest = limits.find(([name]) => name === this.name)?.[1];
    if (largest !== undefined) {
      const at = Math.max(frame.top, Math.min(frame.bottom, scale(largest)));
      answer.append(
        svg("rect", { class: "beyond", x: frame.left, y: frame.top, width: frame.right - frame.left, height: Math.max(0, at - frame.top) }),
        svg("line", { class: "limit-line", x1: frame.left, x2: frame.right, y1: at, y2: at, "data-limit": largest }),
      );
    }
    // What misses another limit, or was not judged by it, is no answer however it lies here.
    const others = limits.filter(([name]) => name !== this.name);
    for (const [point, mark] of this.marks) {
      const worst = this.view.point(point.contender, point.timestep)?.worst ?? {};
      const within = others.every(([name, most]) => worst[name] && !exceeds(worst[name].value, most)) && (rate === null || (point.speed !== null && point.speed.value >= rate));
      mark.classList.toggle("misses", !within);
    }
    const { best } = this;
    const point = best && this.series.flatMap((one) => [...one.points, ...one.others]).find((one) => one.contender === best.contender && one.timestep === best.timestep_ms);
    if (!best || !point) return;
    const text = `${best.contender} at ${timestep(best.timestep_ms)} ms`;
    const width = textWidth(text, 13) + 8;
    const left = point.x + 14 + width > frame.right ? point.x - 14 - width : point.x + 14;
    const near = Math.max(frame.left + 4, left);
    const line = point.y - 12 < frame.top + 12 ? point.y + 20 : point.y - 8;
    answer.append(
      svg("circle", { class: "answer-ring", cx: point.x, cy: point.y, r: 10, "data-contender-of": best.contender, "data-timestep": best.timestep_ms }),
      svg("text", { class: "answer-name", x: near, y: line }, text),
    );
    this.answerBox = { left: near, right: near + width, top: line - 12, bottom: line + 3 };
  }

  private intervalPath(point: Point, x: LogScale, y: LogScale): string {
    const parts: string[] = [];
    const { low, high } = point.speed ?? { low: 0, high: 0 };
    if (low > 0) {
      const [a, b] = [x(low), x(high)];
      if (b - a > 9) parts.push(`M${a},${point.y}H${b}`);
    }
    if (point.low !== null && point.high !== null && point.low > 0) {
      const [a, b] = [Math.min(y(point.low), y.range()[0] ?? 0), y(point.high)];
      if (a - b > 9) parts.push(`M${point.x},${a}V${b}`);
    }
    return parts.join("");
  }

  // The program's front as a staircase from the fastest to the most accurate.
  private frontPath(): string {
    const at = new Map(this.series.flatMap((one) => [...one.points, ...one.others]).map((point) => [`${point.contender} ${point.timestep}`, point]));
    const front = (this.view.json.fronts[this.name] ?? []).flatMap(({ point }) => {
      const of = this.view.json.points[point];
      const placed = of && at.get(`${of.contender} ${of.timestep_ms}`);
      return placed && placed.error !== null ? [placed] : [];
    });
    return front.map((point, index) => (index === 0 ? `M${point.x},${point.y}` : `H${point.x}V${point.y}`)).join("");
  }

  // Names at the ends of the lines that are shown, and of those that the pointer is on.
  private label(): void {
    if (!this.names || !this.frame) return;
    clear(this.names);
    const shown = this.series.filter((one) => this.shownOf(one).length > 0);
    const valued = (one: Series) => this.shownOf(one).filter((point) => point.error !== null && (this.isWhole(one) ? one.points.includes(point) : true));
    // A lone point that is ringed has its name there.
    const lines = shown.filter((one) => valued(one).length > (one.contender === this.answerLine ? 1 : 0)).map((one) => {
      const points = valued(one);
      const ends = [points[points.length - 1]!, points[0]!].map((point): [number, number] => [point.x, point.y]);
      return { name: one.contender, color: this.palette.look(one.contender).color, ends };
    });
    this.names.append(endLabels(lines, shown.flatMap(valued).map((point) => [point.x, point.y]), this.frame, this.answerBox ? [...this.taken, this.answerBox] : this.taken));
  }

  private rows(): CsvRow[] {
    const unit = this.view.unit(this.name);
    const rows = this.visible().map((point): CsvRow => {
      const { speed } = point;
      return [point.contender, point.timestep, point.error, unit, point.low, point.high, speed?.value ?? null, speed?.low ?? null, speed?.high ?? null, speed ? (speed.timed ? "timed" : "interpolated") : null, point.sound ? "sound" : "not sound", point.cell.outcome];
    });
    return [["contender", "timestep_ms", this.name, "unit", "low", "high", "realtime_factor", "realtime_low", "realtime_high", "speed", "soundness", "outcome"], ...rows];
  }

  private choose(point: Point): void {
    state.choose({ system: this.view.system, contender: point.contender, timestep: point.timestep });
  }

  private visible(): Point[] {
    return this.series.flatMap((one) => this.shownOf(one));
  }

  private listen(drawing: SVGSVGElement): void {
    const release = () => {
      this.cursor = null;
      state.setHighlight(null);
      tooltip.hide();
      this.mark();
    };
    const nearest = (event: MouseEvent, reach: number): Point | null => {
      const box = drawing.getBoundingClientRect();
      let found: Point | null = null;
      let least = reach;
      for (const point of this.visible()) {
        const away = Math.hypot(point.x - (event.clientX - box.left), point.y - (event.clientY - box.top));
        if (away < least) [least, found] = [away, point];
      }
      return found;
    };
    drawing.addEventListener("pointermove", (event) => {
      if (event.pointerType === "touch") return; // a finger scrolls, or taps
      const point = nearest(event, kReach);
      if (point) this.point(point, drawing);
      else if (this.cursor) release();
    });
    drawing.addEventListener("pointerleave", release);
    drawing.addEventListener("blur", release);
    drawing.addEventListener("click", (event) => {
      const point = nearest(event, kFinger);
      if (point) this.choose(point);
    });
    drawing.addEventListener("keydown", (event) => {
      const shown = this.series.filter((one) => this.isWhole(one) && one.points.length > 0);
      if (event.key === "Escape") {
        if (!this.cursor) state.choose(null);
        return release();
      }
      if ((event.key === "Enter" || event.key === " ") && this.cursor) {
        event.preventDefault();
        return this.choose(this.cursor);
      }
      if (!["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"].includes(event.key) || shown.length === 0) return;
      event.preventDefault();
      const from = this.cursor;
      let row = from ? shown.findIndex((one) => one.points.includes(from) || one.others.includes(from)) : -1;
      if (!from || row < 0) return this.point(shown[0]!.points[0]!, drawing);
      const turn = event.key === "ArrowDown" ? 1 : event.key === "ArrowUp" ? -1 : 0;
      row = (row + turn + shown.length) % shown.length;
      const { points, swept } = shown[row]!;
      // along a front the timesteps are in no order: the nearest in speed
      const away = (point: Point) => Math.abs(Math.log(point.along / from.along));
      let column = swept ? points.reduce((best, point, at) => (away(point) < away(points[best]!) ? at : best), 0) : points.findIndex((point) => point.timestep >= from.timestep);
      if (column < 0) column = points.length - 1;
      column += event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
      this.point(points[Math.max(0, Math.min(points.length - 1, column))]!, drawing);
    });
  }

  private point(point: Point, drawing: SVGSVGElement): void {
    this.cursor = point;
    state.setHighlight(point.contender);
    this.mark();
    const box = drawing.getBoundingClientRect();
    const unit = this.view.unit(this.name);
    const info = valueInfo(this.name);
    const speed = this.view.entry(point.contender, point.timestep, "raw_speed")?.value;
    tooltip.show(
      box.left + point.x,
      box.top + point.y,
      el("strong", {}, point.contender),
      facts([
        ["timestep", `${timestep(point.timestep)} ms`],
        ...this.settings(point.contender),
        [info.label.toLowerCase(), point.error === null ? point.cell.outcome : bounded(this.name, point.error, unit, isBound(point, this.name))],
        ["interval", interval(this.name, point.low, point.high, unit)],
        // an error of contacts says little without how far they give way
        ...["penetration_max", "grasp_slip", "rebound"].filter((name) => name !== this.name).map((name): [string, string | null] => {
          const value = this.view.entry(point.contender, point.timestep, name)?.value;
          return [valueInfo(name).short, value ? figure(value) : null];
        }),
        ["restart floor", this.name === "consistency" ? quantity(this.view.single(point.contender, "restart_floor"), unit) : null],
        ["real time", point.speed && realtime(point.speed.value) + (point.speed.timed || !point.speed.between ? "" : ` (timed at ${point.speed.between.map(timestep).join(" and ")} ms)`)],
        ["interval", point.speed && interval("realtime_factor", point.speed.low, point.speed.high, "1")],
        ["raw speed", speed ? quantity(speed.value, speed.unit) : null],
        ["truth floor", this.name.startsWith("truth_error") && this.view.single(point.contender, "truth_floor") !== null ? quantity(this.view.single(point.contender, "truth_floor"), unit) : null],
        ["outcome", point.cell.outcome === "ok" || point.error === null ? null : point.cell.outcome],
        ["reason", point.cell.reason],
        ["not sound", point.sound || point.cell.outcome !== "ok" ? null : this.view.point(point.contender, point.timestep)?.why],
      ]),
      el("p", { class: "hint" }, "Click or press Enter for all figures"),
    );
  }

  // What a sweep changed, where the contender is one of several settings.
  private settings(contender: string): [string, string | null][] {
    const { report } = this.view;
    if (this.view.settingsOf(report.varied(contender)).length < 2) return [];
    const changes = report.contenderByName.get(contender)?.changes ?? [];
    return changes.length === 0 ? [["settings", "the adapter's defaults"]] : changes.map((text): [string, string] => ["setting", text]);
  }

  // Hidden, dimmed and highlighted lines; rings around the other contenders' points at the cursor's timestep.
  private mark(): void {
    markContenders(this.canvas);
    if (!this.overlay) return;
    clear(this.overlay);
    if (this.labelled !== state.shownKey || this.labelled === "") {
      this.labelled = state.shownKey || " ";
      this.label();
    }
    this.front?.setAttribute("d", this.frontPath());
    for (const point of this.visible()) {
      if (state.isChosen(this.view.system, point.contender, point.timestep)) {
        this.overlay.append(svg("circle", { class: "chosen", cx: point.x, cy: point.y, r: 11 }));
      }
    }
    const lit = this.series.find((one) => one.contender === state.highlight && !state.isHidden(one.contender));
    let lastLabel = -Infinity;
    for (const point of lit?.points ?? []) {
      if (point === this.cursor || point.x - lastLabel < 30) continue;
      lastLabel = point.x;
      const setting = lit?.swept ? point.contender.slice(lit.contender.length) : "";
      if (setting) lastLabel += textWidth(setting, 11);
      this.overlay.append(svg("text", { class: "step-label", x: point.x, y: point.y - 10, "text-anchor": "middle" }, timestep(point.timestep) + setting));
    }
    if (!this.cursor) return;
    for (const point of this.visible()) {
      if (point !== this.cursor && (point.timestep !== this.cursor.timestep || this.series.some((one) => one.swept))) continue;
      this.overlay.append(
        svg("circle", { class: point === this.cursor ? "cursor" : "same-step", cx: point.x, cy: point.y, r: point === this.cursor ? 9 : 6.5 }),
      );
    }
  }
}
