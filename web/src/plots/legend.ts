// Every contender with its line; a click hides or shows it in all plots of the page.
import type { SystemView } from "../data";
import { el, svg } from "../dom";
import type { Palette } from "../palette";
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
  const items = view.contenders.map((contender) => {
    const button = el(
      "button",
      { type: "button", class: "legend-item", "data-contender": contender, "aria-pressed": "true" },
      swatch(palette, contender),
      contender,
    );
    const enter = () => state.setHighlight(contender);
    const leave = () => state.setHighlight(null);
    button.addEventListener("click", () => state.toggle(contender));
    button.addEventListener("pointerenter", enter);
    button.addEventListener("pointerleave", leave);
    button.addEventListener("focus", () => button.matches(":focus-visible") && enter());
    button.addEventListener("blur", leave);
    return button;
  });
  const families = new Map<string, string[]>();
  for (const name of view.contenders) {
    const family = palette.look(name).family;
    families.set(family, [...(families.get(family) ?? []), name]);
  }
  const everyone = view.report.contenders.map((contender) => contender.name);
  const all = el("button", { type: "button", class: "legend-all", click: () => state.show(everyone, everyone) }, "Show all");
  const none = el("button", { type: "button", class: "legend-all", click: () => state.show([], everyone) }, "Hide all");
  const first = el(
    "button",
    {
      type: "button",
      class: "legend-all",
      click: () => state.show([...families.values()].map((names) => names[0]!), everyone),
    },
    "One per family",
  );
  const box = el("div", { class: "legend", role: "group", "aria-label": "Contenders shown" }, ...items, el("div", { class: "legend-actions" }, all, none, first));
  const update = () => {
    for (const item of items) item.setAttribute("aria-pressed", String(!state.isHidden(item.dataset.contender ?? "")));
    markContenders(box);
  };
  state.subscribe(update);
  update();
  return box;
}
