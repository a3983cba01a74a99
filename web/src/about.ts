// What the page's words mean, and how to cite the results.
import type { Report } from "./data";
import { copyable } from "./details";
import { el } from "./dom";

export function glossary(report: Report): HTMLElement {
  const terms = report.json.glossary ?? [];
  return el("dl", { class: "glossary" }, ...terms.map(({ term, meaning }) => el("div", {}, el("dt", {}, term), el("dd", {}, meaning))));
}

export function citation(report: Report): HTMLElement {
  const version = report.manifest("assay_version") ?? "";
  const commit = report.manifest("commit")?.slice(0, 12);
  const measured = report.manifest("finished") ?? report.manifest("started") ?? "";
  const title = report.manifest("campaign_title") || report.manifest("campaign") || "results";
  const year = /\d{4}/.exec(measured)?.[0];
  const note = [version && `version ${version}`, commit && `commit ${commit}`, report.manifest("cpu") && `measured on ${report.manifest("cpu")}`, measured && `on ${measured}`].filter(Boolean).join(", ");
  const text = `@misc{assay${year ?? ""},\n  title = {assay: ${title}},\n${year ? `  year = {${year}},\n` : ""}  note = {${note}}\n}`;
  return el("div", {}, el("p", { class: "sub" }, "The version, the commit and the machine belong to every figure that you quote."), copyable(text, "command citation"));
}
