// What a model leaves out of its file or reads in another way, as `assay check` names it.
import { el } from "./dom";

// `notes` as results or a certificate hold them: nothing where there are none, or where they are no list of texts.
export function modelNotes(notes: unknown): HTMLElement | null {
  const texts = Array.isArray(notes) ? notes.filter((note): note is string => typeof note === "string") : [];
  if (texts.length === 0) return null;
  const summary = texts.length === 1 ? "What the model leaves out of its file: 1 note" : `What the model leaves out of its file: ${texts.length} notes`;
  return el("details", { class: "model-notes" }, el("summary", {}, summary), el("ul", {}, ...texts.map((text) => el("li", {}, text))));
}
