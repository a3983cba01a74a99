// The reader's limit of the value that a plot shows, as a slider over what was measured.
import { limitText } from "./answer";
import { valueInfo, type SystemView } from "./data";
import { el } from "./dom";
import { belowFloor } from "./format";
import { wishes } from "./wishes";

const kSteps = [1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8]; // of a decade

// From below the smallest error to above the largest, and the limits that are asked for at first.
function stops(view: SystemView, name: string): number[] {
  const { unit } = valueInfo(name);
  const values = view.json.points.flatMap((point) => point.worst?.[name]?.value ?? []).filter((value) => value > 0 && !belowFloor(value, unit));
  const own = wishes.of(view).limits.find(([each]) => each === name)?.[1];
  if (own) values.push(own);
  if (values.length === 0) return [];
  const first = Math.floor(Math.log10(Math.min(...values)));
  const last = Math.ceil(Math.log10(Math.max(...values)));
  const all: number[] = [];
  for (let decade = first; decade < last; decade += 1) for (const step of kSteps) all.push(Number(`${step}e${decade}`));
  return [...all, Number(`1e${last}`)];
}

export class LimitSlider {
  readonly element: HTMLElement;
  private readonly range = el("input", { type: "range", step: 1, class: "limit-range" });
  private readonly output = el("output", {});
  private readonly label = el("span", {});
  private stops: number[] = [];

  constructor(
    private readonly view: SystemView,
    private name: string,
  ) {
    this.range.addEventListener("input", () => {
      const at = Number(this.range.value);
      wishes.limit(this.view, this.name, at >= this.stops.length ? null : this.stops[at]!);
    });
    this.element = el("label", { class: "limit-slider" }, this.label, this.range, this.output);
    wishes.subscribe(() => this.show());
    this.select(name);
  }

  select(name: string): void {
    this.name = name;
    const info = valueInfo(name);
    this.stops = info.limit && this.view.json.candidates.length > 0 ? stops(this.view, name) : [];
    this.element.hidden = this.stops.length === 0;
    this.range.min = "0";
    this.range.max = String(this.stops.length); // the last one: no limit
    this.label.textContent = `${info.label} at most `;
    this.show();
  }

  private show(): void {
    const largest = wishes.of(this.view).limits.find(([each]) => each === this.name)?.[1];
    const near = (stop: number) => Math.abs(Math.log(stop / (largest ?? 1)));
    const at = largest === undefined ? this.stops.length : this.stops.reduce((best, stop, index) => (near(stop) < near(this.stops[best]!) ? index : best), 0);
    this.range.value = String(at);
    const text = largest === undefined ? "any" : limitText(this.view, this.name, largest);
    this.output.textContent = text;
    this.range.setAttribute("aria-valuetext", text);
  }
}
