// Tables of measured motion: the ranking, what was fitted, what the logs' check found.
import type { LogFinding, Match, MatchedContender, MatchedParameter } from "../data";
import { el, type Child } from "../dom";
import { plain, quantity, timestep, unitText } from "../format";
import type { Palette } from "../palette";
import { swatch } from "../plots/legend";
import { scrollFrame } from "./sortable";

const kMostFindings = 200;

const head = (...titles: string[]) => el("thead", {}, el("tr", {}, ...titles.map((title, index) => el("th", { scope: "col", class: index === 0 ? "sticky" : "figure" }, title))));

// "2.81°", "27.1 % / 21.4°"
export function errorText(figures: Record<string, number> | undefined, digits = 3): string {
  if (!figures) return "–";
  const parts: string[] = [];
  if (figures["joints_deg"] !== undefined) parts.push(`${plain(figures["joints_deg"], digits)}°`);
  if (figures["position_percent"] !== undefined) parts.push(`${plain(figures["position_percent"], digits)} %`);
  if (figures["rotation_deg"] !== undefined) parts.push(`${plain(figures["rotation_deg"], digits)}°`);
  return parts.join(" / ") || "–";
}

function place(one: MatchedContender, best: MatchedContender): string {
  if (one === best) return "best";
  const behind = one.behind_best;
  if (!behind) return "–";
  const range = `${behind.low > 0 ? "+" : ""}${plain(behind.low, 2)} to ${behind.high > 0 ? "+" : ""}${plain(behind.high, 2)}`;
  return one.as_good_as_best ? `as good (${range})` : `behind by ${plain(behind.value, 2)} (${range})`;
}

function contenderName(palette: Palette, name: string): HTMLElement {
  return el("th", { scope: "row", class: "sticky" }, el("span", { class: "contender" }, swatch(palette, name), name));
}

export function ranking(match: Match, palette: Palette): HTMLElement {
  const best = match.contenders[0];
  const several = match.contenders.length > 1;
  // answers of older programs do not have it
  const isWorse = (one: MatchedContender) => one.worse_than_untuned ?? (one.score !== undefined && one.score.value > one.untuned_score!.value);
  const noted = match.contenders.some(isWorse);
  const titles = ["Contender", "Fitted", "Untuned", "Noise floor", ...(several ? ["Against the best (95 %)"] : []), ...(noted ? ["Note"] : [])];
  const rest = String(titles.length - 1);
  const rows = match.contenders.map((one) =>
    one.failure
      ? el("tr", {}, contenderName(palette, one.contender), el("td", { colspan: rest }, el("b", { class: "bad" }, "not fitted"), `: ${one.failure}`))
      : el(
          "tr",
          {},
          contenderName(palette, one.contender),
          el("td", { class: "figure" }, errorText(one.held_out)),
          el("td", { class: "figure" }, errorText(one.untuned)),
          el("td", { class: "figure" }, errorText(one.floor, 2)),
          several ? el("td", { class: "figure" }, place(one, best!)) : null,
          noted ? el("td", {}, isWorse(one) ? el("b", { class: "bad" }, "the fit is worse than the model as it is: do not use it") : "") : null,
        ),
  );
  const waiting = match.to_do.map((name) => el("tr", {}, contenderName(palette, name), el("td", { colspan: rest, class: "quiet" }, "not fitted yet")));
  const table = el("table", { class: "match-table" }, head(...titles), el("tbody", {}, ...rows, ...waiting));
  return scrollFrame("Ranking of contenders by held-out logs", "Mean over held-out logs: of joints the root mean square, of free bodies the distance in percent of the body's size and the rotation.", table);
}

// Errors before, at and after the first impact; null where motions are not whole.
export function phases(match: Match, palette: Palette): HTMLElement | null {
  const contenders = match.contenders.filter((one) => (one.phases ?? []).length > 0);
  const names = [...new Set(contenders.flatMap((one) => one.phases!.map(({ phase }) => phase)))];
  if (names.length === 0) return null;
  const cell = (one: MatchedContender, name: string) => {
    const { phase, ...figures } = one.phases!.find((each) => each.phase === name) ?? { phase: "" };
    return el("td", { class: "figure" }, phase ? errorText(figures as Record<string, number>) : "–");
  };
  const rows = contenders.map((one) => el("tr", {}, contenderName(palette, one.contender), ...names.map((name) => cell(one, name))));
  const table = el("table", { class: "match-table" }, head("Contender", ...names.map((name) => name.charAt(0).toUpperCase() + name.slice(1))), el("tbody", {}, ...rows));
  return el("div", { class: "panel" }, scrollFrame("Errors of fitted contenders by phase", "Fitted, over all held-out logs; at the first impact: the 50 ms from it on.", table));
}

// What each fit is worth at other timesteps; null where it was judged at one.
export function byTimestep(match: Match, palette: Palette): HTMLElement | null {
  const contenders = match.contenders.filter((one) => (one.timesteps ?? []).length > 1);
  const steps = [...new Set(contenders.flatMap((one) => one.timesteps!.map(({ timestep_ms }) => timestep_ms)))].sort((a, b) => a - b);
  if (steps.length === 0) return null;
  const cell = (one: MatchedContender, step: number) => {
    const at = one.timesteps!.find(({ timestep_ms }) => timestep_ms === step);
    if (!at) return el("td", { class: "figure" }, "–");
    return el("td", { class: "figure" }, errorText(at.held_out), at.failed > 0 ? el("small", { class: "match-bound" }, `${at.failed} of ${at.windows} end early`) : null);
  };
  const rows = contenders.map((one) => el("tr", {}, contenderName(palette, one.contender), ...steps.map((step) => cell(one, step))));
  const table = el("table", { class: "match-table" }, head("Contender", ...steps.map((step) => `${timestep(step)} ms`)), el("tbody", {}, ...rows));
  return el("div", { class: "panel" }, scrollFrame("Errors of fitted contenders by timestep", `Held out, by timestep: the fits were made at ${timestep(match.timestep_ms)} ms.`, table));
}

function parameterCell(one: MatchedParameter | undefined): HTMLElement {
  if (!one) return el("td", { class: "figure quiet" }, "–");
  if (one.status === "not identified") {
    return el("td", { class: "figure", "data-status": one.status, title: one.with ? `only the combination ${one.with} is determined` : null }, el("span", { class: "quiet" }, "not identified"));
  }
  const range = one.low !== null && one.high !== null ? `${quantity(one.low, "1")} to ${quantity(one.high, "1")}` : "";
  return el("td", { class: "figure", "data-status": one.status }, quantity(one.value, "1"), range ? el("small", { class: "match-range" }, range) : null, one.status === "fitted" ? null : el("small", { class: "match-bound" }, one.status));
}

export function fittedParameters(match: Match, palette: Palette): Child[] {
  const contenders = match.contenders.filter((one) => (one.parameters ?? []).length > 0);
  const names = new Map<string, MatchedParameter>();
  for (const one of contenders) for (const parameter of one.parameters!) if (!names.has(parameter.name)) names.set(parameter.name, parameter);
  const rows = [...names.values()].map((parameter) =>
    el(
      "tr",
      {},
      el("th", { scope: "row", class: "sticky" }, parameter.name, parameter.unit ? el("small", { class: "match-range" }, unitText(parameter.unit)) : null),
      el("td", { class: "figure" }, quantity(parameter.model, "1")),
      ...contenders.map((one) => parameterCell(one.parameters!.find(({ name }) => name === parameter.name))),
    ),
  );
  const title = (one: MatchedContender) => el("th", { scope: "col", class: "figure" }, el("span", { class: "contender" }, swatch(palette, one.contender), one.contender));
  const table = el("table", { class: "match-table" }, el("thead", {}, el("tr", {}, el("th", { scope: "col", class: "sticky" }, "Parameter"), el("th", { scope: "col", class: "figure" }, "Model's file"), ...contenders.map(title))), el("tbody", {}, ...rows));
  const open = contenders.flatMap((one) => (one.not_identified ?? []).map((combination) => el("li", {}, el("b", {}, one.contender), `: ${combination.members.join(" × ")} is not identified (its 95 % interval spans ${plain(combination.relative_interval, 2)} times itself); ${combination.frozen} stays ${combination.as_found ? "as found, because the model's value fits worse" : "as in the model"}`)));
  return [
    el(
      "div",
      { class: "panel" },
      scrollFrame("Fitted parameters by contender", "Below each value its 95 % interval, by bootstrap over logs.", table),
      open.length > 0 ? el("ul", { class: "note" }, ...open) : null,
    ),
  ];
}

// A sentence for each thing that a reader should know of a fit or a log.
export function matchWarnings(match: Match): string[] {
  return [...match.warnings, ...match.contenders.flatMap((one) => one.warnings.map((text) => `${one.contender}: ${text}`)), ...match.unpredictable.map((text) => `not predictable, ${text}`)];
}

export function checks(match: Match): Child[] {
  const warnings = matchWarnings(match);
  const shown = match.findings.slice(0, kMostFindings);
  const row = (one: LogFinding) => el("tr", {}, el("th", { scope: "row", class: "sticky" }, one.log ?? "all logs"), el("td", {}, one.severity === "wrong" ? el("b", { class: "bad" }, one.severity) : one.severity), el("td", { class: "match-finding" }, one.quantity ? `${one.quantity}: ${one.message}` : one.message), el("td", { class: "match-finding" }, one.fix ?? ""));
  const table = el("table", { class: "match-table" }, el("thead", {}, el("tr", {}, ...["Log", "Kind", "Finding", "What to do"].map((text, index) => el("th", { scope: "col", class: index === 0 ? "sticky" : null }, text)))), el("tbody", {}, ...shown.map(row)));
  const more = match.findings.length > shown.length ? ` The first ${shown.length} of ${match.findings.length} are shown; logs.json has all.` : "";
  return [
    warnings.length > 0 ? el("ul", { class: "match-warnings" }, ...warnings.map((text) => el("li", {}, text))) : null,
    shown.length > 0 ? scrollFrame("What the check of the logs found", `What the check of the logs found, the most serious first.${more}`, table) : null,
    warnings.length + shown.length === 0 ? el("p", { class: "quiet" }, "Nothing was found in the logs, and no fit has a warning.") : null,
  ];
}
