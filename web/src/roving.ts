// One tab stop for many controls: the arrow keys move between them. In a table up and down stay in the column.

// Returns a function to call after the controls were made again.
export function roving(root: HTMLElement, selector = "button"): () => void {
  const all = () => [...root.querySelectorAll<HTMLElement>(selector)];
  let current: HTMLElement | null = null;
  const update = () => {
    const items = all();
    if (!current || !items.includes(current)) current = items[0] ?? null;
    for (const item of items) item.tabIndex = item === current ? 0 : -1;
  };
  root.addEventListener("focusin", (event) => {
    const item = (event.target as HTMLElement).closest<HTMLElement>(selector);
    if (!item || item === current) return;
    if (current) current.tabIndex = -1;
    item.tabIndex = 0;
    current = item;
  });
  root.addEventListener("keydown", (event) => {
    const item = (event.target as HTMLElement).closest<HTMLElement>(selector);
    if (!item || event.ctrlKey || event.metaKey || event.altKey) return;
    const next = neighbour(item, event.key, all());
    if (!next) return;
    event.preventDefault();
    next.focus();
  });
  update();
  return update;
}

function neighbour(item: HTMLElement, key: string, items: HTMLElement[]): HTMLElement | null {
  const at = items.indexOf(item);
  const cell = item.closest<HTMLTableCellElement>("td, th");
  if (cell && (key === "ArrowUp" || key === "ArrowDown")) {
    const rows = [...(cell.closest("table")?.rows ?? [])];
    const turn = key === "ArrowUp" ? -1 : 1;
    const from = rows.findIndex((row) => row.contains(cell));
    for (let row = from + turn; row >= 0 && row < rows.length; row += turn) {
      const found = items.find((other) => rows[row]?.cells[cell.cellIndex]?.contains(other));
      if (found) return found;
    }
    return null;
  }
  const places: Record<string, number> = { ArrowRight: at + 1, ArrowDown: at + 1, ArrowLeft: at - 1, ArrowUp: at - 1, Home: 0, End: items.length - 1 };
  const place = places[key];
  return place === undefined ? null : (items[place] ?? null);
}
