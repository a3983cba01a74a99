// The report's section "Many worlds" of a real run in headless Chromium.
//   ASSAY  the program assay
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { launch } from "../../web/browser.mjs";
import { axeFindings, dataIn, downloads, openReport } from "./page.mjs";

const work = mkdtempSync(join(tmpdir(), "assay-batches-"));
const report = join(work, "results", "report.html");
const kPart = "#worlds";
const kPhone = { width: 390, height: 844, phone: true };
const kCampaign = `
name = "worlds"
contenders = ["mujoco-euler", "bullet-mb", "ode-quick"]
timesteps_ms = [1]
[timing]
rounds = 3
batch_ms = 2
[[system]]
name = "planar-chain"
measures = ["batch"]
worlds = [1, 4, 16]
duration_s = 0.256
`;
let browser;
let batches;

const open = (options) => openReport(browser, report, options);

before(async () => {
  assert.ok(process.env.ASSAY, "ASSAY must name the program");
  writeFileSync(join(work, "worlds.toml"), kCampaign);
  const run = (...words) => execFileSync(process.env.ASSAY, words, { cwd: work, stdio: ["ignore", "ignore", "inherit"] });
  run("run", "worlds.toml", "--out", "results");
  run("report", "results");
  [batches] = dataIn(report).batches;
  browser = await launch();
});

after(async () => {
  await browser?.close();
  rmSync(work, { recursive: true, force: true });
});

test("each plot has a curve a contender, its marks at the values of the table", async () => {
  const { page, trouble } = await open();
  assert.equal(await page.$eval(`${kPart} h2`, (node) => node.textContent), "Many worlds");
  for (const shown of ["batch_rate", "batch_latency"]) {
    const marks = await page.$$eval(`${kPart} [data-shows="${shown}"] g.series`, (groups) => groups.flatMap((group) => [...group.querySelectorAll(".mark")].map((mark) => [group.dataset.contender, Number(mark.dataset.worlds), Number(mark.dataset.value)])));
    const values = batches.rows.map((row) => [row.contender, row.worlds, row.values[shown].value]);
    assert.equal(values.length, 9);
    assert.deepEqual(marks, values);
  }
  const rows = await page.$$eval(`${kPart} tbody tr`, (nodes) => nodes.map((node) => node.textContent));
  assert.equal(rows.length, 9);
  assert.ok(rows.every((text) => /process/.test(text)), rows[0]);
  const note = await page.$eval(`${kPart} .matrix-panel`, (node) => node.textContent);
  assert.doesNotMatch(note, /Not comparable with the speed of one world/, "there is no such speed here");
  await page.$eval(`.grid-table tbody a`, (node) => node.click());
  assert.ok(await page.$eval(`${kPart} .batch-parts`, (node) => Math.abs(node.getBoundingClientRect().top) < 100), "a grade leads to its system's plots");
  assert.deepEqual(trouble, []);
  await page.close();
});

test("a contender that is switched off leaves the plot, and says so", async () => {
  const { page, trouble } = await open();
  await page.$eval(`${kPart} .legend-item[data-contender="bullet-mb"]`, (node) => node.click());
  const left = await page.$$eval(`${kPart} g.series`, (groups) => groups.map((group) => group.dataset.contender));
  assert.deepEqual([...new Set(left)], ["mujoco-euler", "ode-quick"]);
  const notes = await page.$$eval(`${kPart} .note`, (nodes) => nodes.map((node) => node.textContent));
  assert.equal(notes.length, 2);
  for (const note of notes) assert.match(note, /1 more contender is switched off/);
  assert.deepEqual(trouble, []);
  await page.close();
});

test("the figures come as CSV", async () => {
  const { page } = await open();
  const [text] = await downloads(page, [`${kPart} [data-save="csv"]`]);
  const lines = text.trim().split(/\r?\n/);
  assert.equal(lines.length, 1 + batches.rows.length);
  assert.match(lines[0], /^contender,timestep_ms,device,worlds,rate,low,high/);
  await page.close();
});

for (const [name, options] of [["light", {}], ["dark", { dark: true }], ["phone", kPhone]]) {
  test(`${name}: axe has no finding, and nothing is wider than the window`, async () => {
    const { page, trouble } = await open(options);
    await page.$eval(kPart, (node) => node.scrollIntoView());
    assert.deepEqual(await axeFindings(page, kPart), []);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth + 1));
    if (process.env.ASSAY_SCREENSHOTS) await (await page.$(kPart)).screenshot({ path: `${process.env.ASSAY_SCREENSHOTS}/worlds-${name}.png` });
    assert.deepEqual(trouble, []);
    await page.close();
  });
}
