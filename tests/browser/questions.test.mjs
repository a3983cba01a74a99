// Five questions of a roboticist, on committed results: each is answered on the first screen or within one click of it, on a
// desktop and on a phone.
//   ASSAY          the program assay
//   ASSAY_RESULTS  the folder results/
import assert from "node:assert/strict";
import { execFile, execFileSync } from "node:child_process";
import { closeSync, mkdirSync, mkdtempSync, openSync, readdirSync, readFileSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { promisify } from "node:util";

import { launch } from "../../web/browser.mjs";
import { descriptionOf, shownWords } from "../../web/picture_text.mjs";
import { axeFindings, dataIn, keepOneOfEachKind, openReport } from "./page.mjs";

const work = mkdtempSync(join(tmpdir(), "assay-questions-"));
const kWindows = { desktop: { width: 1280, height: 800 }, phone: { width: 390, height: 844, phone: true } };
const kPages = ["robots", "field", "quadruped", "gpu"]; // the newest folder of each
const kMostBytes = 10e6;
const kMostScreens = 25;
let browser;

const reportOf = (name) => join(work, name, "report.html");

before(async () => {
  assert.ok(process.env.ASSAY && process.env.ASSAY_RESULTS, "ASSAY must name the program, ASSAY_RESULTS the folder results/");
  for (const name of kPages) {
    const folder = readdirSync(process.env.ASSAY_RESULTS).filter((each) => new RegExp(`^${name}-\\d{4}-`).test(each)).sort().at(-1);
    mkdirSync(join(work, name));
    const database = openSync(join(work, name, "assay.sqlite"), "w");
    execFileSync("xz", ["-dc", join(process.env.ASSAY_RESULTS, folder, "assay.sqlite.xz")], { stdio: ["ignore", database, "inherit"] });
    closeSync(database);
    execFileSync(process.env.ASSAY, ["report", join(work, name)], { stdio: ["ignore", "ignore", "inherit"] });
  }
  browser = await launch();
});

after(async () => {
  await browser?.close();
  rmSync(work, { recursive: true, force: true });
});

// What `assay recommend` answers.
async function recommended(name, system, ...words) {
  const { stdout } = await promisify(execFile)(process.env.ASSAY, ["recommend", join(work, name), system, ...words, "--json"], { maxBuffer: 1 << 26 }).catch((error) => error);
  return JSON.parse(stdout);
}

// Whether an element is wholly in the window.
const inSight = (page, selector) =>
  page.$eval(selector, (node) => {
    const { top, bottom, left, right } = node.getBoundingClientRect();
    return top >= 0 && left >= 0 && right <= window.innerWidth + 1 && bottom <= window.innerHeight && node.checkVisibility();
  });

const limits = (page) =>
  page.$$eval(".pick-limit", (rows) => rows.map((row) => `${row.querySelector(".pick-error").value} ${row.querySelector(".pick-unit").selectedOptions[0].textContent}`));

// The report of the robots that the README links to.
const readme = () => readFileSync(join(process.env.ASSAY_RESULTS, "../README.md"), "utf8");
const robotsOfReadme = () => join(process.env.ASSAY_RESULTS, /\]\(results\/(robots-[\d-]+\/report\.html)\)/.exec(readme())[1]);

test("the README's picture of the report says what the report says", async () => {
  const [, picture] = /\]\((docs\/report\.png)\)/.exec(readme());
  const [, report] = /\]\(results\/([\w-]+\/report\.html)\)/.exec(readme());
  const { page } = await openReport(browser, join(process.env.ASSAY_RESULTS, report), { width: 1280, height: 800, folded: true });
  assert.equal(descriptionOf(readFileSync(join(process.env.ASSAY_RESULTS, "..", picture))), await shownWords(page), "make it again as web/README.md says");
  await page.close();
});

for (const [name, window] of Object.entries(kWindows)) {
  const open = (page) => openReport(browser, reportOf(page), { ...window, folded: true });
  const close = async ({ page, trouble }) => {
    assert.deepEqual(trouble, []);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth + 1), "nothing is wider than the window");
    await page.close();
  };

  // Of the results, and in the report that the README leads to.
  for (const [which, file] of [["results", () => reportOf("robots")], ["README", robotsOfReadme]]) {
    test(`${name}: which engine for a Go2 within 1 mm and 5 mm of penetration (${which})`, async () => {
      const opened = await openReport(browser, file(), { ...window, folded: true });
      const { page } = opened;
      await page.select("#pick-system", "go2");
      assert.deepEqual(await limits(page), ["1 mm", "5 mm"]);
      const { recommended: best, relaxations } = await recommended("robots", "go2", "--error", "1mm");
      assert.ok(await inSight(page, best ? ".pick-best" : ".pick-none"));
      const text = await page.$eval(".pick-answer", (node) => node.innerText);
      for (const { contender } of best ? [best] : relaxations.map((way) => way.recommended)) assert.ok(text.includes(`${contender} at `), text);
      await close(opened);
    });
  }

  test(`${name}: a model that overlaps itself at its start is no engine's fault`, async () => {
    const opened = await open("robots");
    const { page } = opened;
    const overlap = Object.fromEntries(dataIn(reportOf("robots")).views.map((view) => [view.system, view.overlap]));
    // docs/lab/robots.md has these depths by `assay check`
    for (const [system, depth] of [["talos", "93 mm"], ["romeo", "81 mm"], ["tiago", "59 mm"], ["b1", "13 mm"]]) {
      assert.ok(overlap[system].replaceAll("\u00a0", " ").includes(` by ${depth} at its start`), overlap[system]);
      assert.equal(await page.$eval(`.card[data-system="${system}"] .caveat`, (node) => node.textContent.trim().replaceAll("\u00a0", " ")), overlap[system]);
    }
    assert.equal(overlap["ur5"], "");
    await page.select("#pick-system", "tiago");
    assert.equal(await page.$eval(".pick-overlap", (node) => node.textContent.replaceAll("\u00a0", " ")), overlap["tiago"]);
    await close(opened);
  });

  test(`${name}: how much faster if I accept 10 mm`, async () => {
    const opened = await open("field");
    const { page } = opened;
    const system = await page.$eval("#pick-system", (node) => node.value);
    const { main } = dataIn(reportOf("field")).views.find((view) => view.system === system);
    const [now, then] = [await recommended("field", system, "--limit", `${main}=1mm`), await recommended("field", system, "--limit", `${main}=10mm`)].map((answer) => answer.recommended);
    assert.ok(await inSight(page, ".pick-what-if"));
    const said = await page.$eval(".pick-what-if", (node) => node.innerText);
    const [, times] = /^Accept 10\smm: ([\d.]+) times faster/.exec(said) ?? [];
    assert.ok(times && Math.abs(Number(times) / (then.realtime_factor.value / now.realtime_factor.value) - 1) < 0.06, `${said}: ${then.realtime_factor.value} after ${now.realtime_factor.value}`);
    assert.ok(said.includes(`${then.contender} at `), said);
    await page.$eval(".pick-what-if a", (node) => node.click());
    assert.equal((await limits(page))[0], "10 mm");
    assert.equal(await page.$eval(".pick-best", (node) => node.dataset.contenderOf), then.contender);
    await close(opened);
  });

  test(`${name}: why not Bullet on the grasp`, async () => {
    const opened = await open("field");
    const { page } = opened;
    const row = await page.$$eval(".grid-table tbody tr", (rows) => rows.findIndex((each) => each.cells[0].textContent === "bullet"));
    const link = `.grid-table tbody tr:nth-child(${row + 1}) a[href="#grasp"]`;
    const { grade, title } = await page.$eval(link, (node) => ({ grade: node.dataset.grade, title: node.title }));
    const [, contender] = /grasp: (\S+) at /.exec(title);
    assert.match(grade, /^[A-D]$/);
    const { recommended: best } = await recommended("field", "grasp", "--error", "1mm");
    await page.$eval(link, (node) => node.click());
    assert.ok(await inSight(page, ".drawer-why"));
    const why = await page.$eval(".drawer-why", (node) => node.innerText);
    assert.ok(why.includes(contender) && (grade === "D" || /times|slower|fastest/.test(why)), why);
    assert.equal(await page.$eval("#grasp .answer-ring", (node) => node.dataset.contenderOf), best.contender);
    await close(opened);
  });

  test(`${name}: does my policy walk in PhysX`, async () => {
    const opened = await open("quadruped");
    const { page } = opened;
    const [matrix] = dataIn(reportOf("quadruped")).transfer;
    const row = matrix.rows.find(({ contender }) => contender.startsWith("physx"));
    const cell = `.transfer-panel[data-system="${matrix.system}"] .transfer-button[data-contender-of="${row.contender}"]`;
    assert.ok((await page.$eval(cell, (node) => node.textContent)).includes(` ${Math.round(row.values.fall_rate.value * row.runs)} of ${row.runs} fall`));
    const top = await page.$eval(cell, (node) => node.getBoundingClientRect().top);
    assert.ok(top < (name === "phone" ? 3 : 1) * window.height, `it is at ${top} px`);
    assert.ok(await inSight(page, ".transfer-answer"));
    await close(opened);
  });

  test(`${name}: what is the fastest for 4096 worlds`, async () => {
    const opened = await open("gpu");
    const { page } = opened;
    const [batches] = dataIn(reportOf("gpu")).batches;
    const there = batches.rows.filter(({ worlds, values }) => worlds === 4096 && values.batch_rate?.value > 0);
    const best = there.reduce((most, each) => (each.values.batch_rate.value > most.values.batch_rate.value ? each : most));
    assert.equal(await page.$eval(".batch-answer select", (node) => node.value), "4096");
    assert.ok(await inSight(page, ".batch-answer"));
    assert.ok((await page.$eval(".batch-answer b + *, .batch-answer", (node) => node.closest(".batch-answer").innerText)).includes(best.contender));
    await close(opened);
  });

  for (const page of kPages) {
    test(`${name}: the page '${page}' is short and small, and axe finds nothing in light and dark`, async () => {
      assert.ok(statSync(reportOf(page)).size < kMostBytes);
      for (const dark of [false, true]) {
        const opened = await openReport(browser, reportOf(page), { ...window, dark, folded: true });
        if (name === "desktop") {
          const screens = (await opened.page.evaluate(() => document.documentElement.scrollHeight)) / window.height;
          assert.ok(screens <= kMostScreens, `${screens} screens`);
        }
        await keepOneOfEachKind(opened.page);
        assert.deepEqual(await axeFindings(opened.page, "html", dark ? ["color-contrast", "link-in-text-block"] : null), []);
        await close(opened);
      }
    });
  }
}
