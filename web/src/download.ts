// Takes what a plot shows off the page: the drawing as SVG, its figures as CSV.
import { el } from "./dom";

export type CsvRow = (string | number | null)[];

export function csvText(rows: CsvRow[]): string {
  const field = (value: string | number | null) => {
    const text = value === null ? "" : String(value);
    return /[",\n\r]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text;
  };
  return rows.map((row) => `${row.map(field).join(",")}\n`).join("");
}

export function save(name: string, type: string, text: string): void {
  const url = URL.createObjectURL(new Blob([text], { type }));
  const link = el("a", { href: url, download: name, hidden: true });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

// What a drawing takes from the page's style sheet.
const kStyles = [
  "fill", "stroke", "stroke-width", "stroke-dasharray", "stroke-linejoin", "stroke-linecap", "opacity", "font-family", "font-size", "font-weight", "paint-order",
]; // prettier-ignore

// A drawing that needs no style sheet. Hidden parts are left out.
export function standalone(drawing: SVGSVGElement): string {
  const copy = drawing.cloneNode(true) as SVGSVGElement;
  const from = [drawing, ...drawing.querySelectorAll("*")];
  const to = [copy, ...copy.querySelectorAll("*")];
  const gone: Element[] = [];
  from.forEach((node, index) => {
    const style = getComputedStyle(node);
    const twin = to[index]!;
    if (style.display === "none" || style.visibility === "hidden") gone.push(twin);
    twin.removeAttribute("class");
    for (const name of [...twin.getAttributeNames()]) if (/^(data-|aria-|tabindex|role)/.test(name)) twin.removeAttribute(name);
    twin.setAttribute("style", kStyles.map((name) => `${name}:${style.getPropertyValue(name)}`).join(";"));
  });
  for (const node of gone) node.remove();
  const ground = document.createElementNS(copy.namespaceURI, "rect");
  ground.setAttribute("width", "100%");
  ground.setAttribute("height", "100%");
  ground.setAttribute("fill", getComputedStyle(document.documentElement).getPropertyValue("--panel"));
  copy.prepend(ground);
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  return new XMLSerializer().serializeToString(copy);
}

// Buttons for the plot that `canvas` holds.
export function downloads(name: () => string, canvas: HTMLElement, rows: () => CsvRow[]): HTMLElement {
  const button = (format: string, click: () => void) =>
    el("button", { type: "button", class: "save", "data-save": format, "aria-label": `Download ${name()} as ${format.toUpperCase()}`, click }, format.toUpperCase());
  return el(
    "span",
    { class: "saves" },
    button("svg", () => {
      const drawing = canvas.querySelector("svg");
      if (drawing) save(`${name()}.svg`, "image/svg+xml", standalone(drawing));
    }),
    button("csv", () => save(`${name()}.csv`, "text/csv", csvText(rows()))),
  );
}
