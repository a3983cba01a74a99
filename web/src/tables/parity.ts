// Parity: whether a file means the same robot in every engine, by contender and joint, and what differs between two
// files. The marks are signs and words, so
// that they read without colour.
import type { Parity, ParityCertificate, ParityJoint, ParityLimit, ParityPair, Report } from "../data";
import { el, type Child } from "../dom";
import { counted, plain, quantity, sentenceList } from "../format";
import { modelNotes } from "../notes";
import { scrollFrame } from "./sortable";

const kKinds = ["inertia", "gravity", "Coriolis", "springs", "damping", "armature", "dry friction", "torque"] as const;
const kVerdicts: Record<ParityCertificate["verdict"], { sign: string; word: string; style: string }> = {
  same: { sign: "✓", word: "same", style: "good" },
  differs: { sign: "≠", word: "differs", style: "bad" },
  unexplained: { sign: "≠", word: "differs, unexplained", style: "bad" },
  "not settled": { sign: "?", word: "not settled", style: "open" },
  "not examined": { sign: "–", word: "not examined", style: "none" },
};
const kLimitTolerance = 2e-3; // of the joint's range, as in src/check/parity/parity.cc

// Bounds below this say nothing that a reader needs.
const kNothing = 1e-5;

function share(value: number): string {
  return `${plain(100 * value, 2)} %`;
}

type Mark = { sign: string; style: string; text: string };

// An error that is above what rounding and the steps' own error explain.
function markOf(error: number, noise: number, certificate: ParityCertificate): Mark {
  const hidden = Math.max(4 * noise, certificate.tolerance);
  if (certificate.verdict === "not settled") return { sign: "?", style: "open", text: `< ${share(Math.max(hidden, error))}` };
  if (error > hidden) return { sign: "≠", style: "bad", text: share(error) };
  return { sign: "✓", style: "good", text: hidden < kNothing ? "" : `< ${share(hidden)}` };
}

function markCell(mark: Mark | null): HTMLElement {
  if (!mark) return el("td", { class: "parity-cell none" }, "–");
  return el("td", { class: `parity-cell ${mark.style}` }, el("span", { class: "sign" }, mark.sign), mark.text ? ` ${mark.text}` : null);
}

// The joint whose error stands out most.
function worst(certificate: ParityCertificate, kind: string): Mark | null {
  const marks = certificate.joints.flatMap((joint) => {
    const part = joint[kind];
    if (!part || typeof part === "string") return [];
    return [{ mark: markOf(part.error, part.noise, certificate), by: part.error / Math.max(4 * part.noise, certificate.tolerance) }];
  });
  return marks.sort((a, b) => b.by - a.by)[0]?.mark ?? null;
}

function limitMark(limit: ParityLimit, range: number): Mark {
  if (!limit.found || limit.place === null) return { sign: "?", style: "open", text: "not found" };
  const off = Math.abs(limit.place - limit.expected);
  const text = plain(limit.place, 4);
  return off > kLimitTolerance * range ? { sign: "≠", style: "bad", text } : { sign: "✓", style: "good", text };
}

function limitsOf(certificate: ParityCertificate, joint: string | null): Mark | null {
  const marks: Mark[] = [];
  for (const limit of certificate.limits) {
    if (joint !== null && limit.joint !== joint) continue;
    const both = certificate.limits.filter((other) => other.joint === limit.joint).map((other) => other.expected);
    marks.push(limitMark(limit, Math.max(...both) - Math.min(...both)));
  }
  if (marks.length === 0) return null;
  const bad = marks.filter((mark) => mark.style === "bad");
  const open = marks.filter((mark) => mark.style === "open");
  if (joint !== null) {
    const style = bad.length > 0 ? "bad" : open.length > 0 ? "open" : "good";
    return { sign: (bad[0] ?? open[0] ?? marks[0])!.sign, style, text: marks.map((mark) => mark.text).join(", ") };
  }
  if (bad.length > 0) return { sign: "≠", style: "bad", text: `${bad.length} of ${marks.length}` };
  return open.length > 0 ? { sign: "?", style: "open", text: `${marks.length - open.length} of ${marks.length} found` } : { sign: "✓", style: "good", text: `${marks.length}` };
}

function causeText(certificate: ParityCertificate): string {
  const cause = certificate.causes[0];
  if (cause) {
    const more = certificate.causes.length - 1;
    const alike = (cause.alike ?? []).length > 0 ? ` (or, which acts the same, ${cause.alike!.join(", or ")})` : "";
    return `${cause.element}: ${cause.parameter} ${cause.seen}${alike}${more > 0 ? ` (and ${more} more)` : ""}`;
  }
  if (certificate.failure) return certificate.failure;
  if (certificate.verdict === "not settled") return `its own error in one small step is up to ${share(certificate.noise)}, which hides what is looked for`;
  if (certificate.verdict === "unexplained") return `${share(certificate.unexplained)} of a joint's inertia times 20 rad/s² stay unexplained by any one parameter`;
  return "";
}

function verdictCell(certificate: ParityCertificate): HTMLElement {
  const { sign, word, style } = kVerdicts[certificate.verdict] ?? { sign: "?", word: certificate.verdict, style: "open" };
  return el("td", { class: `parity-cell ${style}` }, el("span", { class: "sign" }, sign), " ", word);
}

// "joint 'knee'" and "free body 'torso'", as the certificate names them.
function jointRow(joint: ParityJoint, certificate: ParityCertificate): HTMLElement {
  const name = /^joint '(.*)'$/.exec(joint.element)?.[1] ?? null;
  const cells = kKinds.map((kind) => {
    const part = joint[kind];
    // ball joints and free bodies have no row of their own for these two
    const own = kind !== "armature" && kind !== "torque";
    if (!part || typeof part === "string" || (!own && part.error === 0 && part.noise === 0)) return markCell(null);
    return markCell(markOf(part.error, part.noise, certificate));
  });
  const limits = name === null ? null : limitsOf(certificate, name);
  return el("tr", {}, el("th", { scope: "row", class: "sticky" }, joint.element), ...cells, markCell(limits));
}

function joints(certificate: ParityCertificate): HTMLElement {
  const head = el("tr", {}, el("th", { scope: "col", class: "sticky" }, "Joint"), ...[...kKinds, "limits"].map((kind) => el("th", { scope: "col" }, kind)));
  const table = el("table", { class: "parity-table" }, el("thead", {}, head), el("tbody", {}, ...certificate.joints.map((joint) => jointRow(joint, certificate))));
  return scrollFrame(`Joints of ${certificate.contender}`, `Joints as ${certificate.contender} moves them.`, table);
}

// What is declared in the same words of several elements stands once.
function declared(certificate: ParityCertificate): string[] {
  const elements = new Map<string, string[]>();
  for (const text of certificate.declared) {
    const at = text.indexOf(": ");
    const [element, how] = at < 0 ? ["", text] : [text.slice(0, at), text.slice(at + 2)];
    elements.set(how, [...(elements.get(how) ?? []), element]);
  }
  return [...elements].map(([how, of]) => `${of.length > 3 ? `${of[0]} and ${of.length - 1} more` : sentenceList(of)}: ${how}`);
}

// Filled when it is first opened: a robot has many joints.
function unfolding(certificate: ParityCertificate): HTMLElement | null {
  if (certificate.joints.length === 0) return null;
  const details: HTMLDetailsElement = el("details", { class: "gate-all" }, el("summary", {}, `Joints of ${certificate.contender}`));
  details.addEventListener("toggle", () => {
    if (!details.open || details.querySelector("table")) return;
    details.append(joints(certificate));
    if (certificate.declared.length > 0) {
      details.append(el("p", { class: "sub" }, "Declared by its adapter:"), el("ul", {}, ...declared(certificate).map((text) => el("li", {}, text))));
    }
    if (certificate.raised) details.append(el("p", { class: "quiet" }, `Examined with ${certificate.raised}.`));
  });
  return details;
}

function summary(certificates: ParityCertificate[]): string {
  const count = (verdicts: ParityCertificate["verdict"][]) => certificates.filter((each) => verdicts.includes(each.verdict)).length;
  const words: [number, string][] = [
    [count(["same"]), "the same robot as the file"],
    [count(["differs", "unexplained"]), "another one"],
    [count(["not settled"]), "one that is not settled"],
    [count(["not examined"]), "none to examine"],
  ];
  const present = words.filter(([number]) => number > 0);
  return `Of ${certificates.length} contenders ${sentenceList(present.map(([number, text], i) => `${number} ${i === 0 ? (number === 1 ? "has " : "have ") : ""}${text}`))}.`;
}

function one(parity: Parity): Child[] {
  const order = ["differs", "unexplained", "not settled", "same", "not examined"];
  const certificates = [...parity.certificates].sort((a, b) => order.indexOf(a.verdict) - order.indexOf(b.verdict));
  const head = el(
    "tr",
    {},
    ...["Contender", "Robot", ...kKinds, "limits", "First cause"].map((title, i) => el("th", { scope: "col", class: i === 0 ? "sticky" : null }, title)),
  );
  const rows = certificates.map((certificate) =>
    el(
      "tr",
      { "data-verdict": certificate.verdict },
      el("th", { scope: "row", class: "sticky" }, certificate.contender),
      verdictCell(certificate),
      ...kKinds.map((kind) => markCell(worst(certificate, kind))),
      markCell(limitsOf(certificate, null)),
      el("td", { class: "parity-cause" }, causeText(certificate)),
    ),
  );
  const table = el("table", { class: "parity-table" }, el("thead", {}, head), el("tbody", {}, ...rows));
  return [
    el("h3", {}, parity.model),
    el("p", {}, summary(certificates)),
    modelNotes(parity.notes),
    scrollFrame(
      `Parity of ${parity.model}`,
      "The largest error of a joint's force of each kind, relative to its largest force of that kind; armature: relative to its inertia; torque: of the gain with which its actuators' torque arrives. ✓ indistinguishable from rounding and the steps' own error, ≠ differs, ? not settled, – none.",
      table,
    ),
    ...certificates.map(unfolding),
  ];
}

// Two files: what differs, what moves the robot most first.
function two(pair: ParityPair): Child[] {
  const head = el("tr", {}, ...["Effect", "Element", "Parameter", "B's instead of A's"].map((title) => el("th", { scope: "col" }, title)));
  const rows = pair.differences.map((each) =>
    el("tr", {}, el("td", {}, share(each.effect)), el("th", { scope: "row" }, each.element), el("td", {}, each.parameter), el("td", { class: "parity-cause" }, each.words)),
  );
  const { motion } = pair;
  const told = [...pair.findings, ...pair.not_in_a_format.map((each) => ({ ...each, what: `not compared: ${each.what}` }))];
  const moved = motion.contender && !motion.failure ? ` After one second in ${motion.contender} bodies are up to ${quantity(motion.distance, "m")} apart.` : "";
  return [
    el("h3", {}, `${pair.a.file} and ${pair.b.file}`),
    el("p", {}, `${pair.joints_matched} of ${pair.a.joints} and ${counted(pair.b.joints, "joint")} match; ${pair.verdict === "same" ? "nothing differs" : `${counted(pair.differences.length, "value")} differ`}.${moved}`),
    told.length > 0 ? el("ul", {}, ...told.map((each) => el("li", {}, `${each.element}: ${each.what}`))) : null,
    modelNotes(pair.notes),
    rows.length > 0
      ? scrollFrame(
          `Parity of ${pair.a.file} and ${pair.b.file}`,
          "Effect: the change of A's joint forces in random motions with this one value of B's, where it is felt most; of limits relative to the range, of drives and contact friction to A's value, of shapes to their size.",
          el("table", { class: "parity-table" }, el("thead", {}, head), el("tbody", {}, ...rows)),
        )
      : null,
  ];
}

export function parity(report: Report): HTMLElement {
  return el("div", { class: "parity" }, ...(report.json.parity ?? []).flatMap((each) => ("differences" in each ? two(each) : one(each))));
}
