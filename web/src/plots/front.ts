// The front of a value in words: the sound points that no other beats in both speed and error, the fastest first.
import { valueInfo, type SystemView } from "../data";
import { el } from "../dom";
import { quantity, realtime, sentenceList, timestep } from "../format";
import type { Palette } from "../palette";
import { roving } from "../roving";
import { state } from "../state";
import { swatch } from "./legend";

const kAtOnce = 8;

export function frontList(view: SystemView, palette: Palette, name: string): HTMLElement {
  const info = valueInfo(name);
  const front = view.json.fronts[name] ?? [];
  const item = ({ point, equals }: { point: number; equals: string[] }) => {
    const of = view.json.points[point]!;
    const button = el("button", { type: "button", class: "answer-link" }, swatch(palette, of.contender), el("b", {}, `${of.contender} at ${timestep(of.timestep_ms)} ms`));
    button.addEventListener("click", () => {
      state.setShown([of.contender], true);
      state.choose({ system: view.system, contender: of.contender, timestep: of.timestep_ms });
    });
    const error = of.worst?.[name]?.value ?? view.entry(of.contender, of.timestep_ms, name)?.value?.value;
    return el("li", {}, button, el("span", { class: "figures" }, `${realtime(of.speed?.value)} real time, ${info.short} ${quantity(error, info.unit)}${equals.length > 0 ? `; not told apart from ${sentenceList(equals)}` : ""}`));
  };
  const box = el("div", { class: "panel front-panel" }, el("h3", {}, "Unbeaten in speed and error"));
  if (front.length === 0) {
    box.append(el("p", { class: "quiet" }, view.isTimed ? `No sound point has both a speed and a ${info.label.toLowerCase()}.` : "This system was not timed, so there is no front."));
    return box;
  }
  box.append(el("p", { class: "sub" }, `No sound point is faster with a smaller ${info.label.toLowerCase()}. The fastest comes first.`));
  const list = el("ul", { class: "front" }, ...front.slice(0, kAtOnce).map(item));
  box.append(list);
  if (front.length > kAtOnce) {
    const more = el("button", { type: "button", class: "more" }, `Show all ${front.length}`);
    more.addEventListener("click", () => {
      list.replaceChildren(...front.map(item));
      refresh();
      more.remove();
    });
    box.append(more);
  }
  const refresh = roving(list);
  return box;
}
