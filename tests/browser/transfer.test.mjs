// The report's section "Where does the policy work?" of a real run in headless Chromium. Recorded actions stand for a policy: nothing is
// pushed, so the pole falls.
//   ASSAY  the program assay
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { closeSync, copyFileSync, mkdirSync, mkdtempSync, openSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";

import { launch } from "../../web/browser.mjs";
import { axeFindings, dataIn, openReport, replaysIn } from "./page.mjs";

const example = fileURLToPath(new URL("../../examples/cart-pole-policy/", import.meta.url));
const work = mkdtempSync(join(tmpdir(), "assay-transfer-"));
const report = join(work, "results", "report.html");
const kPhone = { width: 390, height: 844, phone: true };
const kPanel = ".transfer-panel";
let browser;
let matrix;

const open = (options) => openReport(browser, report, options);

before(async () => {
  assert.ok(process.env.ASSAY, "ASSAY must name the program");
  for (const name of ["cart_pole.xml", "policy.toml"]) copyFileSync(join(example, name), join(work, name));
  writeFileSync(join(work, "nothing.csv"), "slider\n0\n");
  const run = (...words) => execFileSync(process.env.ASSAY, words, { cwd: work, stdio: ["ignore", "ignore", "inherit"] });
  run("run", "cart_pole.xml", "--policy-config", "policy.toml", "--policy", "nothing.csv", "--out", "results", "--seeds", "12", "--seconds", "2", "--timesteps", "5,10", "--contenders", "mujoco-euler,mujoco-rk4,mujoco-implicit");
  run("report", "results");
  [matrix] = dataIn(report).transfer;
  browser = await launch({ webgl: true });
});

after(async () => {
  await browser?.close();
  rmSync(work, { recursive: true, force: true });
});

test("the answer first, then each contender and timestep with a sign, a word and the count", async () => {
  const { page, trouble } = await open();
  assert.equal(await page.$eval("#transfer h2", (node) => node.textContent), "Where does the policy work?");
  const answer = await page.$eval(`${kPanel} .transfer-answer`, (node) => node.textContent);
  assert.equal(answer.toLowerCase(), `${matrix.answer[0]}.`.toLowerCase());
  const heads = await page.$$eval(`${kPanel} thead th`, (nodes) => nodes.map((node) => node.textContent));
  assert.deepEqual(heads, ["Contender", "5 ms (training)", "10 ms", "Power, × training", "First body to separate", "Replay"]);
  const cells = await page.$$eval(`${kPanel} .transfer-button`, (nodes) => nodes.map((node) => ({ contender: node.dataset.contenderOf, step: Number(node.dataset.timestep), text: node.textContent })));
  assert.equal(cells.length, 6);
  const signs = { "stays up": "✓", falls: "✗", "not settled": "?", "no run": "–" };
  for (const { contender, step, text } of cells) {
    const row = matrix.rows.find((each) => each.contender === contender && each.timestep_ms === step);
    const fallen = Math.round(row.values.fall_rate.value * row.runs);
    const { low, high } = row.values.fall_rate;
    const [, from, to] = / fall \((\d+) to (\d+) %\)$/.exec(text);
    assert.ok(Math.abs(from - 100 * low) <= 0.5 && Math.abs(to - 100 * high) <= 0.5, text);
    assert.equal(text.replace(/ \(.*/, ""), `${signs[row.verdict]} ${row.verdict} ${fallen} of ${row.runs} fall`);
  }
  // the pole falls from every start but perhaps the upright one
  assert.ok(cells.every(({ text }) => text.startsWith("✗ falls")));
  assert.deepEqual(trouble, []);
  await page.close();
});

test("what parts first is named, and a link shows both runs side by side before it", async () => {
  const { page, trouble } = await open();
  const row = matrix.rows.find((each) => each.contender === "mujoco-rk4" && each.timestep_ms === 5);
  const told = await page.$$eval(`${kPanel} tbody tr`, (nodes) => nodes.map((node) => node.textContent).find((text) => text.startsWith("mujoco-rk4")));
  assert.ok(told.includes(`${row.parting.body} by ${row.parting.joint}`), told);
  const replay = replaysIn(report).find((each) => each.system === matrix.system);
  assert.deepEqual([...new Set(replay.runs.map((run) => run.timestep_ms))], [5], "runs are kept at the timestep of training");
  const link = `${kPanel} a[data-action="side-by-side"][href*="mujoco-rk4"]`;
  await page.$eval(link, (node) => node.click());
  const panel = `.replay-panel[data-system="${matrix.system}"]`;
  await page.waitForSelector(`${panel}[data-ready]`);
  const time = Math.max(0, row.parting.shown_s - 0.2);
  await page.waitForFunction((at, expected) => Math.abs(document.querySelector(at).replay.state().time - expected) < 0.01, {}, panel, time);
  assert.equal(await page.$eval(panel, (node) => node.replay.state().playing), false);
  assert.equal((await page.$$(`${panel} .replay-labels > div`)).length, 2, "both runs and no other");
  const seen = await page.$eval(panel, (node) => {
    const { top, bottom } = node.getBoundingClientRect();
    return { top, bottom };
  });
  assert.ok(seen.top < 900 && seen.bottom > 0, "the replay is on the screen");
  assert.deepEqual(trouble, []);
  // the address says it all
  const href = await page.evaluate(() => location.href);
  assert.match(href, /replay=/);
  const again = await browser.newPage();
  await again.goto(href, { waitUntil: "load" });
  await again.waitForSelector(`${panel}[data-ready]`);
  assert.ok(Math.abs((await again.$eval(panel, (node) => node.replay.state().time)) - time) < 0.01);
  await again.close();
  await page.close();
});

test("a click on a figure opens its details", async () => {
  const { page, trouble } = await open();
  await page.$eval(`${kPanel} .transfer-button[data-contender-of="mujoco-implicit"][data-timestep="10"]`, (node) => node.click());
  await page.waitForSelector(".drawer:not([hidden])");
  const text = await page.$eval(".drawer", (node) => node.innerText);
  assert.match(text, /mujoco-implicit/);
  assert.match(text, /10 ms/);
  assert.deepEqual(trouble, []);
  await page.close();
});

test("a row is told apart from training, and one that stays up with an excess has a sign and words of its own", async () => {
  const folder = join(work, "rough");
  mkdirSync(folder);
  const database = openSync(join(folder, "assay.sqlite"), "w");
  execFileSync("xz", ["-dc", fileURLToPath(new URL("../../results/quadruped-rough-2026-11-27/assay.sqlite.xz", import.meta.url))], { stdio: ["ignore", database, "inherit"] });
  closeSync(database);
  execFileSync(process.env.ASSAY, ["report", folder], { stdio: ["ignore", "ignore", "inherit"] });
  const of = dataIn(join(folder, "report.html")).transfer.find(({ system }) => system === "rough");
  const { page, trouble } = await openReport(browser, join(folder, "report.html"));
  const cells = await page.$$eval('.transfer-panel[data-system="rough"] .transfer-button', (nodes) => nodes.map((node) => ({ contender: node.dataset.contenderOf, text: node.textContent, title: node.title, verdict: node.parentElement.dataset.verdict })));
  assert.equal(cells.length, of.rows.length);
  for (const { contender, text, title, verdict } of cells) {
    const row = of.rows.find((each) => each.contender === contender);
    assert.equal(verdict, row.verdict);
    assert.equal(text.startsWith("!"), row.verdict === "stays up, but worse");
    assert.equal(text.includes("than in training"), row.against_training !== null && row.against_training !== "not told apart");
    for (const words of [row.excess, row.against_training]) assert.ok(words === null || (text.includes(words) && title.includes(words)), text);
  }
  assert.ok(cells.some(({ text }) => text.startsWith("!")) && cells.some(({ text }) => text.includes("falls more often")));
  assert.deepEqual(trouble, []);
  await page.$eval("#transfer", (node) => node.scrollIntoView());
  assert.deepEqual(await axeFindings(page, "#transfer"), []);
  if (process.env.ASSAY_SCREENSHOTS) await (await page.$("#transfer")).screenshot({ path: `${process.env.ASSAY_SCREENSHOTS}/transfer-rough.png` });
  await page.close();
});

for (const [name, options] of [["light", {}], ["dark", { dark: true }], ["phone", kPhone]]) {
  test(`${name}: axe has no finding, and nothing is wider than the window`, async () => {
    const { page, trouble } = await open(options);
    await page.$eval("#transfer", (node) => node.scrollIntoView());
    assert.deepEqual(await axeFindings(page, "#transfer"), []);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth + 1));
    if (process.env.ASSAY_SCREENSHOTS) {
      await (await page.$("#transfer")).screenshot({ path: `${process.env.ASSAY_SCREENSHOTS}/transfer-${name}.png` });
    }
    assert.deepEqual(trouble, []);
    await page.close();
  });
}
