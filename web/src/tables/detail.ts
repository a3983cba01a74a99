// The row that unfolds below a table's row and says everything that is known of one of its cells.
import { el, type Child } from "../dom";

// For a cell's button: opens the detail row with `content`, or closes it when it is this button's; one row is open at a
// time.
export function unfold(button: HTMLElement, content: () => Child[]): void {
  const row = button.closest("tr");
  if (!row) return;
  const open = button.getAttribute("aria-expanded") === "true";
  for (const other of row.querySelectorAll("[aria-expanded=true]")) other.setAttribute("aria-expanded", "false");
  const next = row.nextElementSibling;
  if (next?.classList.contains("detail")) next.remove();
  if (open) return;
  button.setAttribute("aria-expanded", "true");
  const box = el("div", { class: "detail-box" }, ...content());
  row.after(el("tr", { class: "detail" }, el("td", { colspan: String(row.cells.length) }, box)));
}
