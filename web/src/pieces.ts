// The page drawn piece by piece, each in a task of its own, so that the first plots are there at once and the page
// answers meanwhile. Pieces near the window come first; printing wants all of them.
import { drawWaiting } from "./dom";

interface Piece {
  place: Element;
  draw: () => void;
}

const kBackground = 500; // ms without a picture
const kNear = "40% 0px"; // of the window's height

export class Pieces {
  private readonly list: Piece[] = [];
  private readonly near = new Set<Element>();
  private readonly observer = new IntersectionObserver(
    (entries) => {
      for (const entry of entries) {
        if (entry.isIntersecting) this.near.add(entry.target);
        else this.near.delete(entry.target);
      }
    },
    { rootMargin: kNear },
  );

  // Pieces of one place are drawn in their order.
  add(place: Element, ...draws: (() => void)[]): void {
    for (const draw of draws) this.list.push({ place, draw });
    this.observer.observe(place);
  }

  start(done: () => void): void {
    const all = () => {
      while (this.list.length > 0) this.drawNext();
    };
    window.addEventListener("beforeprint", all);
    const next = () => {
      if (this.list.length > 0) {
        this.drawNext();
        setTimeout(next, 0);
        return;
      }
      window.removeEventListener("beforeprint", all);
      this.observer.disconnect();
      done();
    };
    afterPaint(next);
  }

  private drawNext(): void {
    const index = Math.max(0, this.list.findIndex((piece) => this.near.has(piece.place)));
    const [piece] = this.list.splice(index, 1);
    piece?.draw();
    drawWaiting();
  }
}

// When what is there has been painted; a page in the background is not painted at all.
function afterPaint(task: () => void): void {
  let begun = false;
  const once = () => {
    if (!begun) task();
    begun = true;
  };
  requestAnimationFrame(() => setTimeout(once, 0));
  setTimeout(once, kBackground);
}
