// Elements in one expression.

export type Child = Node | string | null | undefined | false;
type Attributes = Record<string, string | number | boolean | null | undefined | ((event: Event) => void)>;

export function el<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === "function") node.addEventListener(name, value);
    else node.setAttribute(name, value === true ? "" : String(value));
  }
  for (const child of children) if (child) node.append(child);
  return node;
}

const kSvg = "http://www.w3.org/2000/svg";

export function svg<K extends keyof SVGElementTagNameMap>(
  tag: K,
  attributes: Record<string, string | number> = {},
  ...children: (Node | string)[]
): SVGElementTagNameMap[K] {
  const node = document.createElementNS(kSvg, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, String(value));
  node.append(...children);
  return node;
}

export function clear(node: Element): void {
  node.replaceChildren();
}

let ruler: CanvasRenderingContext2D | null = null;
let family = ""; // of the page's font

// Width of a text in the page's font, px.
export function textWidth(text: string, size: number): number {
  ruler ??= document.createElement("canvas").getContext("2d");
  if (!ruler) return 0.6 * size * text.length;
  family ||= getComputedStyle(document.body).fontFamily;
  ruler.font = `${size}px ${family}`;
  return ruler.measureText(text).width;
}

interface Waiting {
  node: HTMLElement;
  update: (width: number) => void;
}
const waiting: Waiting[] = [];

// Draws whenever the element's width changes, so that text keeps its size; the first time with drawWaiting().
export function onWidth(node: HTMLElement, draw: (width: number) => void): () => void {
  let last = 0;
  const update = (width: number) => {
    if (width > 0 && width !== last) {
      last = width;
      draw(width);
    }
  };
  new ResizeObserver(() => update(Math.floor(node.clientWidth))).observe(node);
  waiting.push({ node, update });
  return () => {
    if (last > 0) draw(last);
  };
}

// What was made for elements that were not yet part of the page. All widths are read before anything is drawn: a width
// after a change would lay out the whole page again.
export function drawWaiting(): void {
  const now = waiting.splice(0);
  const widths = now.map(({ node }) => Math.floor(node.clientWidth));
  now.forEach(({ update }, index) => update(widths[index] ?? 0));
}

let ids = 0;
export function uniqueId(stem: string): string {
  ids += 1;
  return `${stem}-${ids}`;
}
