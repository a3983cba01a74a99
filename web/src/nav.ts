// The bar of sections, and the mark of the one that the reader looks at.
import { el } from "./dom";

export function sectionBar(nav: HTMLElement, links: [id: string, name: string][], changed: (id: string) => void): void {
  const list = el("ul", {}, ...links.map(([id, name]) => el("li", {}, el("a", { href: `#${id}` }, name))));
  nav.append(list);
  const anchors = [...list.querySelectorAll("a")];
  let current = -1;
  const mark = () => {
    if (document.body.classList.contains("alone")) return; // of the parts none is there
    const line = nav.getBoundingClientRect().bottom + 0.25 * window.innerHeight;
    let found = -1;
    links.forEach(([id], index) => {
      const top = document.getElementById(id)?.getBoundingClientRect().top;
      if (top !== undefined && top <= line) found = index;
    });
    if (window.scrollY < 40) found = -1;
    if (found === current) return;
    anchors[current]?.removeAttribute("aria-current");
    current = found;
    const anchor = anchors[current];
    anchor?.setAttribute("aria-current", "location");
    // The bar scrolls by itself where it does not show all.
    if (anchor) list.scrollTo({ left: anchor.offsetLeft - 0.4 * list.clientWidth });
    changed(links[current]?.[0] ?? "");
  };
  let waiting = false;
  window.addEventListener(
    "scroll",
    () => {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => {
        waiting = false;
        mark();
      });
    },
    { passive: true },
  );
}
