// The distribution of a cell's samples.
import type { Samples } from "../data";
import { el, svg } from "../dom";
import { quantity } from "../format";

const kTitles: Record<string, [title: string, unit: string]> = {
  window_step_time_us: ["Time of a step, by round and part of the run", "us"],
  step_time_us: ["Time of a step", "us"], // of version 0.1
  run_time_s: ["Time of the whole run", "s"],
  piece_error_m: ["Error of each piece", "m"],
};

const kWidth = 300;
const kHeight = 84;

interface Bins {
  from: number;
  to: number;
  counts: number[];
  above: number;
}

function binned(samples: Samples): Bins {
  if (samples.bins) {
    return { from: samples.from ?? 0, to: samples.to ?? 0, counts: samples.bins, above: samples.above ?? 0 };
  }
  const values = samples.values ?? [];
  const from = Math.min(...values);
  const to = Math.max(...values);
  const counts = new Array<number>(Math.max(1, Math.min(12, values.length))).fill(0);
  for (const value of values) {
    const place = to > from ? Math.floor(((value - from) / (to - from)) * counts.length) : 0;
    const at = Math.min(counts.length - 1, place);
    counts[at] = (counts[at] ?? 0) + 1;
  }
  return { from, to, counts, above: 0 };
}

export function histogram(samples: Samples): HTMLElement {
  const [title, unit] = kTitles[samples.name] ?? [samples.name.replace(/_/g, " "), ""];
  const { from, to, counts, above } = binned(samples);
  const most = Math.max(...counts, 1);
  const step = kWidth / counts.length;
  const drawing = svg("svg", {
    class: "histogram", width: kWidth, height: kHeight + 16, viewBox: `0 0 ${kWidth} ${kHeight + 16}`, role: "img",
    "aria-label": `${title}: ${samples.count} samples from ${quantity(from, unit)} to ${quantity(to, unit)}`,
    "data-samples": samples.name, "data-count": samples.count,
  }); // prettier-ignore
  counts.forEach((count, index) => {
    const height = (count / most) * (kHeight - 4);
    drawing.append(
      svg("rect", { class: "bin", x: index * step + 0.5, y: kHeight - height, width: Math.max(1, step - 1), height, "data-count": count }),
    );
  });
  drawing.append(
    svg("line", { class: "ground", x1: 0, x2: kWidth, y1: kHeight + 0.5, y2: kHeight + 0.5 }),
    svg("text", { class: "tick", x: 0, y: kHeight + 14 }, quantity(from, unit)),
    svg("text", { class: "tick", x: kWidth, y: kHeight + 14, "text-anchor": "end" }, quantity(to, unit)),
  );
  const tail = above > 0 ? `, ${above} of them above ${quantity(to, unit)}` : "";
  return el("figure", { class: "histogram-figure" }, el("figcaption", {}, `${title}, ${samples.count} samples${tail}`), drawing);
}
