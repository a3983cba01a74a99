// The page's first picture: engines by tasks, in grades that follow the reader's limits.
import type { Report } from "./data";
import { el } from "./dom";
import { engineName, meanings, tasks, type Mark, type Task } from "./grades";
import { reach } from "./places";
import { roving } from "./roving";
import { state } from "./state";
import { wishes } from "./wishes";

const kWide = 9; // columns from which on there is room for letters alone

const style = (grade: string) => `grade grade-${grade === "–" ? "none" : grade.toLowerCase()}`;

const words: Record<Mark["grade"], string> = { A: "Near the fastest within your limits", B: "Within your limits", C: "Within your limits", D: "Beyond a limit", F: "No sound run", "–": "Not measured" };

function follow(mark: Mark): void {
  if (mark.point) state.setShown([mark.point.contender], true);
  reach(mark.place);
  if (mark.point) state.choose({ ...mark.point, why: `${words[mark.grade]}: ${mark.why}.` });
}

// What stands in the cells.
function caption(columns: Task[]): string {
  const has = (measure: Task["measure"]) => columns.some((task) => task.measure === measure);
  const figures = ["how many times slower than the fastest it is", has("mean speed") ? " (under speed in the mean over systems)" : "", has("timestep") ? ", or its largest timestep where no step was timed" : ""];
  return `Each engine by its best contender; the number is ${figures.join("")}. A click shows the evidence.`;
}

export function engineGrid(report: Report): HTMLElement | null {
  const columns = tasks(report);
  if (columns.length === 0) return null;
  const first = columns.map((task) => task.marks());
  const measured = new Set(report.json.measured.contenders.map((name) => engineName(report, name)));
  const engines = [...new Set([...measured, ...first.flatMap((marks) => [...marks.keys()])])].filter((engine) => engine !== "null");
  const worth: Record<string, number> = { A: 4, B: 3, C: 2, D: 0.5 };
  const score = (engine: string) => first.reduce((sum, marks) => sum + (worth[marks.get(engine)?.grade ?? "–"] ?? 0), 0);
  engines.sort((a, b) => score(b) - score(a) || (a < b ? -1 : 1));
  const compact = columns.length > kWide;
  const cells = new Map<string, HTMLAnchorElement>();
  const marksNow = new Map<string, Mark>();
  const head = columns.map((task) =>
    el("th", { scope: "col", class: compact ? "turned" : null }, el("a", { href: `#${task.place}`, title: `${task.title}: ${task.kind}` }, el("span", {}, task.title), compact ? null : el("small", {}, task.kind))),
  );
  const body = engines.map((engine) =>
    el(
      "tr",
      {},
      el("th", { scope: "row" }, engine),
      ...columns.map((task) => {
        const link = el("a", { href: `#${task.place}` });
        const key = `${engine} ${task.id}`;
        link.addEventListener("click", (event) => {
          const mark = marksNow.get(key);
          if (!mark || event.ctrlKey || event.metaKey) return;
          event.preventDefault();
          follow(mark);
        });
        cells.set(key, link);
        return el("td", {}, link);
      }),
    ),
  );
  const update = () => {
    for (const task of columns) {
      const marks = task.marks();
      for (const engine of engines) {
        const key = `${engine} ${task.id}`;
        const mark: Mark = marks.get(engine) ?? { grade: "–", text: "", why: "not run", place: task.place, point: null };
        marksNow.set(key, mark);
        const link = cells.get(key)!;
        link.className = style(mark.grade);
        link.dataset.grade = mark.grade;
        link.title = `${engine}, ${task.title}: ${mark.why}`;
        link.replaceChildren(el("b", {}, mark.grade), compact || !mark.text ? "" : el("span", {}, ` ${mark.text}`));
        link.setAttribute("aria-label", `${engine}, ${task.title}: ${mark.grade}${mark.text ? `, ${mark.text}` : ""}; ${mark.why}`);
      }
    }
  };
  update();
  wishes.subscribe(update);
  const table = el("table", { class: compact ? "grid-table compact" : "grid-table" }, el("thead", {}, el("tr", {}, el("th", { scope: "col" }, "Engine"), ...head)), el("tbody", {}, ...body));
  roving(table, "a");
  return el(
    "figure",
    { class: "panel grid-panel" },
    el("h2", {}, "Engines by task"),
    el("div", { class: "grid-scroll", tabindex: 0, role: "region", "aria-label": "Engines by task" }, table),
    el("figcaption", {}, el("ul", { class: "grid-key" }, ...meanings(columns.some(({ measure }) => measure === "speed" || measure === "timestep")).map(([grade, meaning]) => el("li", {}, el("b", { class: style(grade) }, grade), ` ${meaning}`))), el("p", { class: "quiet" }, compact ? "Each engine by its best contender. A click shows the evidence." : caption(columns))),
  );
}
