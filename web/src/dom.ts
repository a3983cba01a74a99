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

const waiting: (() => void)[] = [];

// Draws whenever the element's width changes, so that text keeps its size; the first time with drawWaiting().
export function onWidth(node: HTMLElement, draw: (width: number) => void): () => void {
  let last = 0;
  const update = () => {
    const width = Math.floor(node.clientWidth);
    if (width > 0 && width !== last) {
      last = width;
      draw(width);
    }
  };
  new ResizeObserver(update).observe(node);
  waiting.push(update);
  return () => {
    if (last > 0) draw(last);
  };
}

// What was made for elements that were not yet part of the page.
export function drawWaiting(): void {
  for (const draw of waiting.splice(0)) draw();
}

let ids = 0;
export function uniqueId(stem: string): string {
  ids += 1;
  return `${stem}-${ids}`;
}
