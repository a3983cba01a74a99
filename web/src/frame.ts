// What every report's page stands in: its head, sections that are drawn one after the other, and the bar that names them.
import type { Address } from "./address";
import type { Report } from "./data";
import { drawWaiting, el, type Child } from "./dom";
import { deviceName } from "./format";
import { sectionBar } from "./nav";
import { Pieces } from "./pieces";
import { addPlace } from "./places";
import { themeSwitch } from "./theme";
import { tooltip } from "./tooltip";

// A part of the page that is filled later; until then it holds its place.
export function part(id: string, title: string, text: string): HTMLElement {
  return el("section", { id, class: "part", "aria-busy": "true" }, el("h2", {}, title), text ? el("p", { class: "sub" }, text) : null);
}

// One that is a line until the reader opens it; `note` says in a few words what is in it.
export function folded(id: string, title: string, note: string, text: string): HTMLElement {
  return el("details", { id, class: "part fold", "aria-busy": "true" }, el("summary", {}, el("h2", { class: "fold-title" }, title), el("span", { class: "fold-note" }, note)), text ? el("p", { class: "sub" }, text) : null);
}

// "2026-11-27 · Intel(R) Xeon(R) Processor · NVIDIA H100 80GB HBM3 · assay 0.1.0"
function dateline(report: Report): string {
  const date = (report.manifest("finished") ?? report.manifest("started"))?.slice(0, 10);
  const version = report.manifest("assay_version");
  const devices = report.json.manifest.filter(({ key }) => key.startsWith("device ")).map(({ value }) => deviceName(value));
  return [date, report.manifest("cpu"), ...devices, version && `assay ${version}`].filter(Boolean).join(" · ");
}

export function mastheadOf(report: Report, masthead: HTMLElement, title: string, lead: string): void {
  const line = dateline(report);
  masthead.append(
    el("div", { class: "title" }, el("p", { class: "wordmark" }, "assay"), el("h1", {}, title)),
    el("p", { class: "lead" }, el("span", { class: "dateline" }, line), el("span", { class: "counts" }, line ? ` · ${lead}` : lead)),
    themeSwitch(),
  );
}

export class Frame {
  readonly pieces = new Pieces();
  readonly links: [id: string, name: string][] = [];

  constructor(
    private readonly nav: HTMLElement,
    private readonly page: HTMLElement,
    private readonly address: Address,
  ) {}

  // A section with a name in the bar, filled now or in its turn.
  add(section: HTMLElement, name: string, fill: () => Child[], now = false): void {
    this.links.push([section.id, name]);
    addPlace(section);
    this.page.append(section);
    const draw = () => {
      for (const child of fill()) if (child) section.append(child);
      section.removeAttribute("aria-busy");
    };
    if (now) draw();
    else this.pieces.add(section, draw);
  }

  // Draws what is there, and the rest in pieces; `more` adds what no section holds.
  finish(more: () => void = () => undefined): void {
    sectionBar(this.nav, this.links, (section) => this.address.at(section));
    tooltip.attach();
    drawWaiting();
    performance.mark("assay:first-plots");

    let moved = false; // by the reader
    const move = () => (moved = true);
    for (const type of ["wheel", "touchstart", "pointerdown", "keydown"]) window.addEventListener(type, move, { once: true, passive: true });
    const rest = () => {
      more();
      this.pieces.start(() => {
        // What an address names may have been pushed away by what was drawn above it.
        if (!moved) this.address.show();
        document.body.dataset.ready = "";
      });
    };
    if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", rest, { once: true });
    else rest();
  }
}
