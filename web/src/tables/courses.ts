// Contenders' courses over results, as `assay history` found them: a line for each course that changed.
import type { Course, Courses, Report } from "../data";
import { el, svg, type Child } from "../dom";
import { quantity, timestep } from "../format";
import { scrollFrame, sortableTable, type Column } from "./sortable";

const kWidth = 220;
const kHeight = 36;
const kMargin = 4;

// The values in the order of the runs, with a mark at each change.
function line(course: Course, runs: number): SVGSVGElement {
  const shown = course.points.filter((point) => point.value !== null);
  const values = shown.flatMap((point) => [point.low, point.high, point.value!]);
  const least = Math.min(...values);
  const span = Math.max(...values) - least || 1;
  const x = (run: number) => kMargin + ((kWidth - 2 * kMargin) * run) / Math.max(1, runs - 1);
  const y = (value: number) => kHeight - kMargin - ((kHeight - 2 * kMargin) * (value - least)) / span;
  const parts: Node[] = course.changes.map((change) =>
    svg("line", { x1: x(change.run - 0.5), x2: x(change.run - 0.5), y1: 0, y2: kHeight, stroke: "currentColor", "stroke-dasharray": "3 3", opacity: 0.6 }),
  );
  for (const point of shown) {
    parts.push(svg("line", { x1: x(point.run), x2: x(point.run), y1: y(point.low), y2: y(point.high), stroke: "currentColor", opacity: 0.35 }));
  }
  const path = shown.map((point, index) => `${index === 0 ? "M" : "L"}${x(point.run).toFixed(1)} ${y(point.value!).toFixed(1)}`).join("");
  parts.push(svg("path", { d: path, fill: "none", stroke: "currentColor", "stroke-width": 1.5 }));
  const label = `${course.value} of ${course.contender} on ${course.system} over ${runs} runs`;
  return svg("svg", { width: kWidth, height: kHeight, viewBox: `0 0 ${kWidth} ${kHeight}`, role: "img", "aria-label": label }, ...parts);
}

export function courses(report: Report, history: Courses): Child[] {
  const changed = history.courses.filter((course) => course.changes.length > 0);
  const steady = history.courses.length - changed.length;
  const since = (course: Course) =>
    course.changes.map((change) => {
      const run = history.runs[change.run];
      return el("div", {}, change.change === "worse" ? el("b", { class: "bad" }, change.text) : change.text, ` since ${run?.dir ?? ""} (${run?.started ?? ""})`);
    });
  const last = (course: Course) => course.points[course.points.length - 1]?.value ?? null;
  const columns: Column<Course>[] = [
    { title: "Contender", key: (course) => course.contender, cell: (course) => report.title(course.contender), head: true, className: "sticky" },
    { title: "System", key: (course) => course.system, cell: (course) => course.system, className: "name" },
    { title: "Timestep", key: (course) => course.timestep_ms, cell: (course) => `${timestep(course.timestep_ms)} ms` },
    { title: "Value", key: (course) => course.value, cell: (course) => course.value.replace(/_/g, " ") },
    { title: "Course", cell: (course) => line(course, history.runs.length) },
    { title: "Now", key: last, cell: (course) => (last(course) === null ? "" : history.control ? String(last(course)) : quantity(last(course), course.unit)), className: "figure" },
    { title: "Changes", cell: (course) => el("div", {}, ...since(course)), className: "wider" },
  ];
  const text = `Dashed: a change of level. ${steady} other courses did not change${history.control ? `; times relative to ${history.control}` : ""}.`;
  if (changed.length === 0) return [el("p", { class: "sub table-text" }, `Nothing changed in ${history.courses.length} courses.`)];
  return [el("div", { class: "panel matrix-panel" }, scrollFrame("History", text, sortableTable(columns, changed)))];
}
