// Every contender with its line; a click hides or shows it in all plots and replays of the page.
import type { SystemView } from "../data";
import { el, svg } from "../dom";
import { engineOf, type Palette } from "../palette";
import { roving } from "../roving";
import { markContenders, state } from "../state";

export function swatch(palette: Palette, contender: string): SVGSVGElement {
  const look = palette.look(contender);
  return svg(
    "svg",
    { class: "swatch", width: 30, height: 12, viewBox: "0 0 30 12", "aria-hidden": "true" },
    svg("line", { x1: 0, x2: 30, y1: 6, y2: 6, style: `stroke:${look.color}`, "stroke-width": 2, "stroke-dasharray": look.dash }),
    svg("path", { d: look.path(38), transform: `translate(15,6) rotate(${look.turn})`, style: `fill:${look.color}`, class: "mark" }),
  );
}

export function legend(view: SystemView, palette: Palette): HTMLElement {
  const everyone = [...new Set(view.report.contenders.map((contender) => view.report.varied(contender.name)))];
  const engines = new Map<string, string[]>();
  for (const name of view.lines) {
    const contender = view.report.contenderByName.get(name);
    const engine = contender ? engineOf(contender) : name;
    engines.set(engine, [...(engines.get(engine) ?? []), name]);
  }
  const items: HTMLElement[] = [];
  const heads: [HTMLElement, string[]][] = [];
  const item = (contender: string) => {
    const settings = view.settingsOf(contender).length;
    const button = el("button", { type: "button", class: "legend-item", role: "checkbox", "data-contender": contender, "aria-checked": "true" }, swatch(palette, contender), el("span", {}, contender, settings > 1 ? el("span", { class: "quiet" }, ` ${settings} settings`) : null));
    const enter = () => state.setHighlight(contender);
    const leave = () => state.setHighlight(null);
    button.addEventListener("click", () => state.toggle(contender));
    button.addEventListener("pointerenter", (event) => event.pointerType === "mouse" && enter());
    button.addEventListener("pointerleave", leave);
    button.addEventListener("focus", () => button.matches(":focus-visible") && enter());
    button.addEventListener("blur", leave);
    items.push(button);
    return button;
  };
  const groups = [...engines].map(([engine, names]) => {
    const head = el("button", { type: "button", class: "legend-engine", role: "checkbox", "aria-checked": "true", "aria-label": `All of ${engine}` }, engine);
    head.addEventListener("click", () => state.setShown(names, names.some((name) => state.isHidden(name))));
    heads.push([head, names]);
    return el("div", { class: "legend-group", role: "group", "aria-label": engine }, head, ...names.map(item));
  });
  const families = new Map<string, string>();
  for (const name of view.lines) {
    const family = palette.look(name).family;
    if (!families.has(family)) families.set(family, name);
  }
  const action = (title: string, shown: string[]) =>
    el("button", { type: "button", class: "legend-all", click: () => state.show(shown, everyone) }, title);
  const first = palette.first;
  const actions = el(
    "div",
    { class: "legend-actions" },
    first.length < everyone.length ? action("The paper's", first) : null,
    action("All", everyone),
    action("None", []),
    action("One per family", [...families.values()]),
  );
  const box = el("div", { class: "legend", role: "group", "aria-label": "Contenders shown" }, actions, ...groups);
  const count = el("span", {});
  const toggle = el("button", { type: "button", class: "legend-toggle", "aria-expanded": "false" }, count);
  const whole = el("div", { class: "legend-box" }, toggle, box);
  toggle.addEventListener("click", () => toggle.setAttribute("aria-expanded", String(whole.classList.toggle("open"))));
  roving(box);
  const update = () => {
    for (const button of items) button.setAttribute("aria-checked", String(!state.isHidden(button.dataset.contender ?? "")));
    for (const [head, names] of heads) {
      const hidden = names.filter((name) => state.isHidden(name)).length;
      head.setAttribute("aria-checked", hidden === 0 ? "true" : hidden === names.length ? "false" : "mixed");
    }
    count.textContent = `Contenders: ${view.lines.filter((name) => !state.isHidden(name)).length} of ${view.lines.length} shown`;
    markContenders(box);
  };
  state.subscribe(update);
  update();
  return whole;
}
