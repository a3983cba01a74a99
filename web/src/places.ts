// Parts of the page that a reader can go to: folded ones open, and a page of its own is shown alone.

interface Place {
  element: HTMLElement;
  open?: () => void; // draws what was not drawn yet
  alone: boolean;
}

const places = new Map<string, Place>();

export function addPlace(element: HTMLElement, open?: () => void, alone = false): void {
  places.set(element.id, { element, alone, ...(open ? { open } : {}) });
  if (alone) element.hidden = true;
}

// Shows the part of this name, or what holds the element of this name; false where there is none.
export function reach(id: string): boolean {
  const own = places.get(id);
  const target = own?.element ?? document.getElementById(id);
  if (!target) return false;
  const page = target.closest<HTMLElement>("[data-alone]");
  for (const place of places.values()) if (place.alone) place.element.hidden = place.element !== page;
  document.body.classList.toggle("alone", page !== null);
  (page ? places.get(page.id) : own)?.open?.();
  for (let node: Element | null = target; node; node = node.parentElement) if (node instanceof HTMLDetailsElement) node.open = true;
  if (page === target) window.scrollTo({ top: 0, behavior: "instant" });
  else target.scrollIntoView();
  return true;
}
