// A table whose columns sort on a click, with one tab stop. Rows may carry a detail row that stays below them.
import { el, type Child } from "../dom";
import type { Palette } from "../palette";
import { swatch } from "../plots/legend";
import { roving } from "../roving";

export interface Column<Row> {
  title: string | Node;
  hint?: string;
  // What the column sorts by; null sorts last in both directions. Without it the column does not sort.
  key?: (row: Row) => number | string | null;
  cell: (row: Row) => Child | HTMLTableCellElement;
  className?: string;
  head?: boolean; // the row's own heading
}

// The heading of rows that are contenders' names.
export function contenderColumn(palette: Palette): Column<string> {
  return {
    title: "Contender",
    key: (contender) => contender,
    cell: (contender) => el("span", { class: "contender" }, swatch(palette, contender), contender),
    className: "sticky",
    head: true,
  };
}

function compare(a: number | string | null, b: number | string | null): number {
  if (a === null || b === null) return a === b ? 0 : a === null ? Infinity : -Infinity;
  return typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b));
}

// Shows the first `limit` rows of the order.
export function sortableTable<Row>(columns: Column<Row>[], rows: Row[], limit = Infinity): HTMLTableElement {
  const body = el("tbody");
  const heads = columns.map((column) => {
    const head = el("th", { scope: "col", class: column.className ?? null, title: column.hint ?? null });
    if (column.key) head.append(el("button", { type: "button", class: "sort" }, column.title));
    else head.append(column.title);
    return head;
  });
  let sorted = -1;
  let descending = false;
  let refresh = () => {};

  const fill = () => {
    const key = columns[sorted]?.key;
    const order = rows.map((row, index) => ({ row, index }));
    if (key) {
      order.sort((a, b) => {
        const difference = compare(key(a.row), key(b.row));
        if (!Number.isFinite(difference)) return difference > 0 ? 1 : -1;
        return (descending ? -difference : difference) || a.index - b.index;
      });
    }
    body.replaceChildren(
      ...order.slice(0, limit).map(({ row }) => {
        const line = el("tr");
        for (const column of columns) {
          const content = column.cell(row);
          if (content instanceof HTMLTableCellElement) {
            line.append(content);
          } else if (column.head) {
            line.append(el("th", { scope: "row", class: column.className ?? null }, content));
          } else {
            line.append(el("td", { class: column.className ?? null }, content));
          }
        }
        return line;
      }),
    );
    refresh();
  };
  heads.forEach((head, index) => {
    head.querySelector("button")?.addEventListener("click", () => {
      descending = sorted === index ? !descending : false;
      sorted = index;
      heads.forEach((other, at) => {
        if (at === index) other.setAttribute("aria-sort", descending ? "descending" : "ascending");
        else other.removeAttribute("aria-sort");
      });
      fill();
    });
  });
  fill();
  const table = el("table", { class: "sortable" }, el("thead", {}, el("tr", {}, ...heads)), body);
  refresh = roving(table);
  return table;
}

// Wide tables scroll inside their own frame, never the page. What has to be said of the table stands above it, where it
// does not scroll away.
export function scrollFrame(label: string, text: string, table: HTMLTableElement): HTMLElement {
  table.setAttribute("aria-label", label);
  return el(
    "div",
    {},
    text ? el("p", { class: "sub table-text" }, text) : null,
    el("div", { class: "scroll", tabindex: table.querySelector("button") ? null : 0 }, table),
  );
}
