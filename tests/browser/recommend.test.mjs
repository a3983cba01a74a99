// The picker of the page against `assay recommend`, pair by pair, on the committed full run and on a sweep of settings.
//   ASSAY          the program assay
//   ASSAY_FIXTURE  the program browser_fixture
//   ASSAY_RESULTS  the folder results/
import assert from "node:assert/strict";
import { execFile, execFileSync } from "node:child_process";
import { closeSync, mkdirSync, mkdtempSync, openSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { promisify } from "node:util";

import { launch } from "../../web/browser.mjs";
import { dataIn, openReport } from "./page.mjs";

const kQuestions = 12; // of each system: every mix of limits
const kRates = [1, 5, 20, 100];

const work = mkdtempSync(join(tmpdir(), "assay-recommend-"));
const results = join(work, "results");
const settings = join(work, "settings");
let browser;

before(async () => {
  assert.ok(process.env.ASSAY && process.env.ASSAY_RESULTS && process.env.ASSAY_FIXTURE, "ASSAY and ASSAY_FIXTURE must name the programs, ASSAY_RESULTS the folder results/");
  const [machine] = readdirSync(process.env.ASSAY_RESULTS).filter((name) => /cores$/.test(name));
  mkdirSync(results);
  const database = openSync(join(results, "assay.sqlite"), "w");
  execFileSync("xz", ["-dc", join(process.env.ASSAY_RESULTS, machine, "assay.sqlite.xz")], { stdio: ["ignore", database, "inherit"] });
  closeSync(database);
  execFileSync(process.env.ASSAY, ["report", results], { stdio: ["ignore", "ignore", "inherit"] });
  execFileSync(process.env.ASSAY_FIXTURE, ["settings", settings], { stdio: "inherit" });
  browser = await launch();
});

after(async () => {
  await browser?.close();
  rmSync(work, { recursive: true, force: true });
});

// Limits from all over what the candidates have; every third question limits two values, every fourth the speed.
function questions(view) {
  const list = [];
  for (let i = 0; i < kQuestions; i += 1) {
    const limits = new Map();
    const limit = (name, share) => {
      const all = view.candidates.map(({ point }) => view.points[point].worst?.[name]?.value).filter((value) => value > 0).sort((a, b) => a - b);
      const value = all[Math.floor(share * all.length)];
      if (value !== undefined) limits.set(name, Number(value.toPrecision(2)));
    };
    limit(view.errors[i % view.errors.length], i / kQuestions);
    if (i % 3 === 1) limit(view.errors[(i + 1) % view.errors.length], 1 - 0.5 * (i / kQuestions));
    const realtime = i % 4 === 2 ? kRates[(i >> 2) % kRates.length] : null;
    // and what nothing meets: half of the least of a value
    if (i % 6 === 5) for (const [name, value] of limits) limits.set(name, value / (i === 5 ? 50 : 1e3));
    if (limits.size > 0 || realtime !== null) list.push({ system: view.system, limits: [...limits], realtime });
  }
  return list;
}

async function said(dir, data, { system, limits, realtime }) {
  const words = limits.flatMap(([name, largest]) => {
    const { unit } = data.catalogue.find((info) => info.name === name);
    const { text, scale } = data.units[unit].find((each) => each.scale === 1) ?? data.units[unit][0];
    return ["--limit", `${name}=${largest / scale}${text}`];
  });
  if (realtime !== null) words.push("--realtime", String(realtime));
  // the page asks what it shows, and nothing by default
  if (!limits.some(([name]) => name.startsWith("penetration"))) words.push("--penetration", "any");
  if (!limits.some(([name]) => name === "grasp_slip")) words.push("--slip", "any");
  const answer = promisify(execFile)(process.env.ASSAY, ["recommend", dir, system, ...words, "--json"], { maxBuffer: 1 << 26 });
  const { stdout } = await answer.catch((error) => error); // the status says whether there is an answer
  assert.ok(stdout, `assay recommend ${system} ${words.join(" ")}`);
  return JSON.parse(stdout);
}

async function compare(dir, least) {
  const data = dataIn(join(dir, "report.html"));
  const { page, trouble } = await openReport(browser, join(dir, "report.html"));
  const all = data.views.filter((view) => view.candidates.length > 0).flatMap(questions);
  assert.ok(all.length >= least, `${all.length} questions`);
  let answered = 0;
  let sweeps = 0;
  let exceeding = 0;
  let edges = 0;
  let relaxed = 0;
  for (const question of all) {
    const { system, limits, realtime } = question;
    const words = [`pick=${system}`, limits.length > 0 ? `limit=${limits.map((limit) => limit.join(":")).join()}` : "", realtime === null ? "" : `realtime=${realtime}`];
    const hash = `pick&${words.filter(Boolean).join("&")}`;
    const place = ({ contender, timestep_ms: step }) => `${contender} at ${step}`;
    const [expected, shown] = await Promise.all([
      said(dir, data, question),
      page.evaluate(async (address) => {
        await new Promise((done) => {
          window.addEventListener("hashchange", done, { once: true });
          if (location.hash === `#${address}`) done();
          else location.hash = address;
        });
        const best = document.querySelector(".pick-best")?.dataset;
        const fact = (label) => [...document.querySelectorAll(`.pick-facts [data-label="${label}"]`)].map((node) => node.lastChild.textContent.trim());
        return {
          system: document.querySelector("#pick-system").value,
          heading: document.querySelector(".pick-best strong")?.textContent ?? null,
          best: best ? `${best.contenderOf} at ${best.timestep}` : null,
          alike: [...(fact("not told apart by speed")[0] ?? "").matchAll(/([\w-][^,]*) at /g)].map((match) => match[1]),
          margin: fact("margin")[0] ?? null,
          settings: fact("setting").join("; "),
          warned: [...document.querySelectorAll(".pick-facts li")].some((node) => node.textContent.startsWith("its 95 % interval reaches beyond the limit")),
          none: document.querySelector(".pick-none")?.textContent ?? null,
          passing: [...document.querySelectorAll(".pick-answer .pick-each tbody tr")].map((row) => row.cells[0].textContent),
        };
      }, hash),
    ]);
    assert.equal(shown.system, system, hash);
    assert.equal(shown.best, expected.recommended === null ? null : place(expected.recommended), hash);
    for (const { setting, value, default: otherwise, unit } of expected.recommended?.settings ?? []) {
      const of = unit ? ` ${unit}` : "";
      const text = otherwise === null ? `${setting} ${value}${of}` : `${setting} ${value}${of} instead of ${otherwise}${of}`;
      assert.ok(shown.settings.includes(text), `${hash}: ${shown.settings}`);
    }
    const beyond = expected.recommended?.exceeds;
    const factor = beyond && Math.round((100 * beyond.timestep_ms) / expected.recommended.timestep_ms) / 100;
    assert.equal(/ at ([\d.]+) times this step [^;]*, above the limit; /.exec(shown.margin)?.[1], beyond ? String(factor) : undefined, `${hash}: ${shown.margin}`);
    exceeding += beyond ? 1 : 0;
    if (expected.recommended !== null) sweeps += expected.recommended.varies === expected.recommended.contender ? 0 : 1;
    const certain = expected.certain && place(expected.certain);
    assert.equal(shown.warned, shown.best !== null && certain !== shown.best, hash);
    const ways = expected.relaxations.map(({ recommended }) => `: ${recommended.contender} at `);
    if (expected.nearest) for (const way of ways.length > 0 ? ways : [`the nearest is ${expected.nearest.contender} at `]) assert.ok(shown.none.includes(way), `${hash}: ${shown.none}`);
    if (expected.recommended?.edge) assert.ok(shown.heading.endsWith(`, ${expected.recommended.edge}`), `${hash}: ${shown.heading}`);
    edges += expected.recommended?.edge ? 1 : 0;
    relaxed += ways.length;
    assert.deepEqual(shown.alike, expected.not_told_apart.map(({ contender }) => contender), hash);
    assert.deepEqual(shown.passing, expected.contenders.map(({ contender }) => contender), hash);
    if (expected.recommended !== null) answered += 1;
  }
  assert.ok(answered > all.length / 2, `${answered} of ${all.length} questions have an answer`);
  assert.ok(exceeding > all.length / 10, `${exceeding} of ${all.length} answers name the limit that a larger timestep exceeds`);
  assert.ok(edges > 0 && relaxed > 0, `${edges} answers at an edge, ${relaxed} relaxations`);
  assert.deepEqual(trouble, []);
  await page.close();
  return sweeps;
}

test("page and command give the same answer to every question", async () => {
  await compare(results, 60);
});

test("where settings were swept, both answer with settings, one for each contender that was varied", async () => {
  const sweeps = await compare(settings, 18);
  assert.ok(sweeps > 5, `${sweeps} answers with settings that a sweep made`);
});

test("where settings were swept, plots and legend have one line for each contender that was varied", async () => {
  const data = dataIn(join(settings, "report.html"));
  const { page, trouble } = await openReport(browser, join(settings, "report.html"));
  const lines = new Set(data.contenders.map((contender) => contender.varies));
  assert.ok(lines.size < data.contenders.length / 3, `${lines.size} lines of ${data.contenders.length} settings`);
  for (const view of data.views) {
    const at = `[id="${view.system}"]`;
    const shown = await page.evaluate((section) => {
      const all = (selector) => [...document.querySelectorAll(`${section} ${selector}`)];
      return {
        legend: all(".legend-item").map((item) => item.dataset.contender),
        series: all("svg.accuracy .series").map((group) => ({ name: group.dataset.contender, paths: group.querySelectorAll("path.line").length, marks: group.querySelectorAll(".mark").length, dots: group.querySelectorAll(".setting").length })),
        bars: all("svg.bars .bar").length,
      };
    }, at);
    assert.deepEqual(new Set(shown.legend), lines);
    assert.equal(shown.legend.length, lines.size);
    assert.equal(shown.bars, lines.size);
    assert.deepEqual(new Set(shown.series.map(({ name }) => name)), lines);
    for (const { name, paths, marks, dots } of shown.series) {
      const front = view.swept[view.main][name];
      assert.ok(paths <= 1, `${name} has ${paths} lines`);
      if (!front) continue; // one setting only
      assert.equal(marks, front.length, `${name}: the markers are the front's points`);
      assert.ok(dots > 0, `${name}: what is not on the front is a dot`);
    }
  }
  // the legend hides all settings of a contender together
  const system = data.views[0].system;
  await page.$eval(`[id="${system}"] .legend-item[data-contender="mujoco-euler"]`, (item) => item.click());
  const left = await page.$eval(`[id="${system}"] svg.accuracy .series[data-contender="mujoco-euler"]`, (group) => ({
    off: group.classList.contains("off"),
    answers: group.classList.contains("answering"),
    seen: [...group.children].filter((node) => node.checkVisibility()).map((node) => node.classList.contains("on-front")),
  }));
  assert.ok(left.off && (left.answers || left.seen.every(Boolean)), "but for the answer and the front");
  assert.deepEqual(trouble, []);
  await page.close();
});
