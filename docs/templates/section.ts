// The report's section 'template': how many cells each contender has.
//
// It is this file as web/src/tables/template.ts, called in web/src/main.ts.
import type { Report } from "../data";
import { el } from "../dom";

export function template(report: Report): HTMLElement {
  const counts = (report.json as unknown as { template?: Record<string, number> }).template ?? {};
  return el("ul", {}, ...Object.entries(counts).map(([contender, cells]) => el("li", {}, `${contender}: ${cells} cells`)));
}
