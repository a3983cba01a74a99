// Raw speed of every contender at one timestep, fastest first.
import { scaleLinear } from "d3-scale";

import type { SystemView } from "../data";
import { el, svg } from "../dom";
import { interval, quantity, realtime, timestep } from "../format";
import type { Palette } from "../palette";
import { state } from "../state";
import { facts, tooltip } from "../tooltip";
import { downloads } from "../download";
import { drawContenders } from "./canvas";

interface Bar {
  contender: string;
  value: number;
  low: number | null;
  high: number | null;
  unit: string;
}

export function bars(view: SystemView, palette: Palette): HTMLElement {
  const steps = view.timesteps("raw_speed");
  const contenders = view.lines.map((line) => view.standIn(line));
  const box = el("figure", { class: "panel bars-panel" });
  const caption = el("figcaption", {}, el("h3", {}, "Raw speed"));
  box.append(caption);
  if (steps.length === 0) {
    box.append(el("p", { class: "quiet" }, "No timing was made on this system."));
    return box;
  }
  // 1 ms is what the literature quotes; else the timestep that most contenders were timed at.
  const count = (step: number) => contenders.filter((name) => view.entry(name, step, "raw_speed")?.value).length;
  let step = steps.reduce((best, candidate) => {
    if (count(candidate) !== count(best)) return count(candidate) > count(best) ? candidate : best;
    return Math.abs(Math.log(candidate)) < Math.abs(Math.log(best)) ? candidate : best;
  });

  const choice = el("select", { "aria-label": "Timestep of the speed bars" });
  for (const candidate of steps) {
    choice.append(el("option", { value: candidate, selected: candidate === step }, `${timestep(candidate)} ms`));
  }
  const sub = el("p", { class: "sub" }, "At ");
  sub.append(steps.length > 1 ? choice : el("b", {}, `${timestep(step)} ms`), ", thousand steps a second with 95 % interval");
  caption.append(sub);
  const canvas = el("div", { class: "canvas" });
  caption.prepend(
    downloads(() => `raw-speed-${view.system}-${step}ms`, canvas, () => [
      ["contender", "timestep_ms", "value", "unit", "low", "high"],
      ...contenders.flatMap((contender) => {
        const value = view.entry(contender, step, "raw_speed")?.value;
        return value && !state.isHidden(contender) ? [[contender, step, value.value, value.unit, value.low, value.high]] : [];
      }),
    ]),
  );
  const missing = el("p", { class: "quiet note" });
  box.append(canvas, missing);

  const draw = (width: number) => {
    const list: Bar[] = [];
    const absent: string[] = [];
    let off = 0;
    for (const contender of contenders) {
      const entry = view.entry(contender, step, "raw_speed");
      if (state.isHidden(contender)) {
        if (entry?.value) off += 1;
        continue;
      }
      if (entry?.value) {
        list.push({ contender, value: entry.value.value!, low: entry.value.low, high: entry.value.high, unit: entry.value.unit });
      } else if (entry) {
        absent.push(`${contender} (${entry.cell.outcome})`);
      } else {
        absent.push(contender);
      }
    }
    list.sort((a, b) => b.value - a.value || a.contender.localeCompare(b.contender));
    const notes = [
      absent.length > 0 ? `Without a figure at ${timestep(step)} ms: ${absent.join(", ")}.` : "",
      contenders.length < view.contenders.length ? "For a swept contender the bar shows the settings that were not varied; the table of all figures has the others." : "",
      off > 0 ? `${off} more ${off === 1 ? "is" : "are"} switched off in the legend.` : "",
    ];
    missing.textContent = notes.filter(Boolean).join(" ");
    missing.hidden = missing.textContent === "";
    if (list.length === 0) {
      canvas.append(el("p", { class: "quiet" }, "No contender has a speed here."));
      return;
    }
    const row = 25;
    const labelWidth = Math.min(0.42 * width, 8 + 7.1 * Math.max(4, ...list.map((bar) => bar.contender.length)));
    const valueWidth = 74;
    const x = scaleLinear()
      .domain([0, Math.max(...list.map((bar) => Math.max(bar.value, bar.high ?? 0)))])
      .range([labelWidth, width - valueWidth]);
    const height = list.length * row + 24;
    const drawing = svg("svg", {
      class: "bars", width, height, viewBox: `0 0 ${width} ${height}`, role: "img",
      "aria-label": `Raw speed at ${timestep(step)} ms: ${list.map((bar) => `${bar.contender} ${quantity(bar.value, bar.unit)}`).join(", ")}`,
    }); // prettier-ignore
    const ticks = x.ticks(Math.max(2, Math.floor((width - labelWidth - valueWidth) / 70)));
    for (const tick of ticks) {
      const at = Math.round(x(tick)) + 0.5;
      drawing.append(svg("line", { class: "tick-line", x1: at, x2: at, y1: 0, y2: height - 20 }));
      drawing.append(svg("text", { class: "tick", x: at, y: height - 6, "text-anchor": "middle" }, String(tick)));
    }
    list.forEach((bar, index) => {
      const look = palette.look(bar.contender);
      const top = index * row;
      const middle = top + row / 2 - 1;
      const group = svg("g", { class: "bar", "data-contender": bar.contender, "data-value": bar.value });
      group.append(svg("rect", { class: "hit", x: 0, y: top, width, height: row }));
      const label = svg("text", { class: "name", x: labelWidth - 10, y: middle + 4, "text-anchor": "end" }, bar.contender);
      group.append(label);
      group.append(
        svg("rect", { class: "fill", x: labelWidth, y: top + 4, width: Math.max(1, x(bar.value) - labelWidth), height: row - 10, rx: 1.5, style: `fill:${look.color}` }),
      );
      if (bar.low !== null && bar.high !== null) {
        const [a, b] = [x(bar.low), x(bar.high)];
        group.append(
          svg("path", { class: "whisker", d: `M${a},${middle - 4}v8M${a},${middle}H${b}M${b},${middle - 4}v8` }),
        );
      }
      group.append(
        svg("text", { class: "value", x: Math.max(x(bar.value), x(bar.high ?? 0)) + 8, y: middle + 4 }, quantity(bar.value, bar.unit)),
      );
      group.addEventListener("pointermove", (event) => {
        state.setHighlight(bar.contender);
        const stepTime = view.entry(bar.contender, step, "step_time")?.value;
        tooltip.show(
          event.clientX,
          event.clientY,
          el("strong", {}, bar.contender),
          facts([
            ["timestep", `${timestep(step)} ms`],
            ["raw speed", quantity(bar.value, bar.unit)],
            ["interval", interval("raw_speed", bar.low, bar.high, bar.unit)],
            ["step time", stepTime ? quantity(stepTime.value, stepTime.unit) : null],
            ["real time", realtime(view.speed(bar.contender, step)?.value)],
          ]),
        );
      });
      group.addEventListener("click", () => state.choose({ system: view.system, contender: bar.contender, timestep: step }));
      group.addEventListener("pointerleave", () => {
        state.setHighlight(null);
        tooltip.hide();
      });
      drawing.append(group);
    });
    canvas.append(drawing);
  };
  const redraw = drawContenders(canvas, draw);
  choice.addEventListener("change", () => {
    step = Number(choice.value);
    redraw();
  });
  return box;
}
