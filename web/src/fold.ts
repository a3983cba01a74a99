// A part that is a line until the reader opens it.
import { el, type Child } from "./dom";

export function fold(title: string, note: string, ...content: Child[]): HTMLDetailsElement {
  return el("details", { class: "fold" }, el("summary", {}, el("span", { class: "fold-title" }, title), note ? el("span", { class: "fold-note" }, note) : null), ...content);
}
