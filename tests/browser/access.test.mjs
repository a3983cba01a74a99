// The page for touch, keyboard, colour-blind eyes and links.
//   ASSAY_FIXTURE  the program browser_fixture
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";

import { launch } from "../../web/browser.mjs";
import { axeFindings, dataIn, downloads, keepOneOfEachKind, openReport } from "./page.mjs";

const work = mkdtempSync(join(tmpdir(), "assay-access-"));
const report = join(work, "programme", "report.html");
const kPhone = { width: 390, height: 844, phone: true };
let browser;

const open = (options) => openReport(browser, report, options);

before(async () => {
  assert.ok(process.env.ASSAY_FIXTURE, "ASSAY_FIXTURE must name the program browser_fixture");
  execFileSync(process.env.ASSAY_FIXTURE, ["programme", join(work, "programme")], { stdio: "inherit" });
  browser = await launch();
});

after(async () => {
  await browser?.close();
  rmSync(work, { recursive: true, force: true });
});

// What the tests of a group look at: one page, since a page of this size takes seconds to open.
const group = (name, options, tests) =>
  describe(name, () => {
    const opened = {};
    before(async () => Object.assign(opened, await open(options)));
    after(async () => {
      assert.deepEqual(opened.trouble, []);
      await opened.page.close();
    });
    tests(() => opened.page);
  });

// The last of a group, for it changes the page. `rules`: the only ones, or null for all.
const axeTest = (pageOf, rules) =>
  test("axe has no finding, with the drawer and all details open", async () => {
    const page = pageOf();
    await page.$eval("#humanoid .answer-link", (node) => node.click());
    await page.$$eval("details", (nodes) => nodes.forEach((node) => (node.open = true)));
    assert.ok((await keepOneOfEachKind(page)) > 300, "the tables have many rows");
    assert.deepEqual(await axeFindings(page, "html", rules), []);
  });

// The answer is in sight when the page opens, and next to it, or below it on a phone, the grid.
function answerTest(pageOf, width, height) {
  test("which engine for the humanoid is answered without scrolling", async () => {
    const page = pageOf();
    await page.evaluate(() => window.scrollTo(0, 0));
    const box = await page.$eval(".pick-answer", (node) => {
      const { top, left, right } = node.getBoundingClientRect();
      const bottom = node.querySelector(".pick-best, .pick-none").getBoundingClientRect().bottom;
      return { top, bottom, left, right, text: node.innerText };
    });
    assert.ok(box.top >= 0 && box.bottom <= height && box.left >= 0 && box.right <= width, JSON.stringify(box));
    assert.match(box.text, /humanoid: .* at .* ms|no contender on humanoid/i);
    assert.deepEqual(await page.$$eval(".pick-error", ([node]) => [node.value, node.closest(".limit").querySelector("select").selectedOptions[0].textContent]), ["1", "mm"]);
    const grid = await page.$eval(".grid-table tbody", (node) => node.getBoundingClientRect().top);
    // On a phone it follows the question, of which all is open here.
    assert.ok(grid > 0 && (grid < height || width < 600), `the grid begins at ${grid} px`);
  });
}

group("1440x900", { width: 1440, height: 900 }, (pageOf) => {
  answerTest(pageOf, 1440, 900);

  test("a skip link leads past the sections' bar; the bar marks where the reader is", async () => {
    const page = pageOf();
    await page.keyboard.press("Tab");
    assert.equal(await page.evaluate(() => document.activeElement.className), "skip");
    assert.ok(await page.$eval(".skip", (node) => node.getBoundingClientRect().left >= 0));
    await page.keyboard.press("Enter");
    assert.equal(await page.evaluate(() => document.activeElement.id), "page");
    await page.$eval("#grasp .accuracy-panel", (node) => node.scrollIntoView({ behavior: "instant" }));
    await page.waitForFunction(() => document.querySelector("nav [aria-current]")?.textContent === "grasp");
    const { top, left, right } = await page.$eval("nav [aria-current]", (node) => node.getBoundingClientRect().toJSON());
    assert.ok(top >= 0 && top < 40 && left >= 0 && right <= 1440, "the mark is in sight");
    const legend = await page.$eval("#grasp .legend-box", (node) => node.getBoundingClientRect().toJSON());
    assert.ok(legend.top > 0 && legend.top < 80 && legend.bottom <= 900, "the legend stays beside the plots");
  });

  test("within a family dash and mark differ; looks of the page are those of the data", async () => {
    const page = pageOf();
    const { looks } = dataIn(report);
    const kinds = await page.$$eval("#planar-chain .legend-item", (nodes) => nodes.map((node) => ({ name: node.dataset.contender, dash: node.querySelector("line").getAttribute("stroke-dasharray"), mark: node.querySelector("path").getAttribute("d") + node.querySelector("path").getAttribute("transform") })));
    for (const a of kinds) {
      assert.equal(a.dash, looks[a.name].dash);
      for (const b of kinds) {
        if (a.name === b.name || looks[a.name].family !== looks[b.name].family) continue;
        assert.notEqual(a.dash, b.dash, `${a.name} and ${b.name}`);
        assert.notEqual(a.mark, b.mark, `${a.name} and ${b.name}`);
      }
    }
    const names = await page.$$eval("#humanoid .accuracy .end-labels text", (nodes) => nodes.map((node) => node.textContent));
    const shown = await page.$$eval("#humanoid .accuracy .series", (nodes) => nodes.filter((node) => getComputedStyle(node).display !== "none").map((node) => node.dataset.contender));
    assert.ok(names.length >= 0.7 * shown.length && names.every((name) => shown.includes(name)), `${names} stand at the ends of ${shown}`);
  });

  test("a plot can be taken away as a drawing and as figures", async () => {
    const page = pageOf();
    const save = (format) => `#humanoid .accuracy-panel [data-save="${format}"]`;
    const [drawing, csv] = await downloads(page, [save("svg"), save("csv")]);
    const alone = await browser.newPage();
    await alone.setContent(`<img src="data:image/svg+xml,${encodeURIComponent(drawing)}">`);
    assert.ok(await alone.$eval("img", (node) => node.decode().then(() => node.naturalWidth > 300)), "no drawing of its own");
    await alone.close();
    assert.doesNotMatch(drawing, /var\(--|class=/, "the drawing needs the page's style sheet");
    const rows = csv.trim().split("\n").map((line) => line.split(","));
    assert.deepEqual(rows[0].slice(0, 3), ["contender", "timestep_ms", "consistency"]);
    const data = dataIn(report);
    const [contender, step, error] = rows[5];
    const cell = data.cells.find((one) => one.system === "humanoid" && one.contender === contender && one.timestep_ms === Number(step) && one.measure === "consistency");
    assert.equal(Number(error), cell.values.find((value) => value.name === "consistency").value);
  });

  test("glossary and citation", async () => {
    const page = pageOf();
    const terms = await page.$$eval(".glossary dt", (nodes) => nodes.map((node) => node.textContent));
    assert.deepEqual(terms, dataIn(report).glossary.map(({ term }) => term));
    assert.ok(terms.some((term) => /contender/i.test(term)));
    assert.match(await page.$eval("#cite .citation", (node) => node.textContent), /^@misc\{assay/);
  });

  test("fewer than 400 tab stops; arrow keys move in legends and tables", async () => {
    const page = pageOf();
    const stops = await page.evaluate(() => {
      const groups = new Set();
      return [...document.querySelectorAll("a[href], button, input, select, summary, [tabindex]")].filter((node) => {
        if (node.tabIndex < 0 || node.disabled || !node.checkVisibility()) return false;
        if (node.type !== "radio") return true;
        const first = !groups.has(node.name);
        groups.add(node.name);
        return first;
      }).length;
    });
    assert.ok(stops > 40 && stops < 400, `${stops} tab stops`);
    const focused = () => page.evaluate(() => document.activeElement.textContent.trim());
    await page.focus('#humanoid .legend-item[data-contender="mujoco-euler"]');
    await page.keyboard.press("ArrowDown");
    assert.equal(await focused(), "mujoco-rk4");
    assert.equal((await page.$$('#humanoid .legend [tabindex="0"]')).length, 1);
    await page.focus("#humanoid .matrix-panel tbody tr:nth-child(2) td:nth-child(3) button");
    const cell = () => page.evaluate(() => [document.activeElement.closest("tr").sectionRowIndex, document.activeElement.closest("td, th").cellIndex]);
    await page.keyboard.press("ArrowDown");
    assert.deepEqual(await cell(), [2, 2]);
    await page.keyboard.press("ArrowRight");
    assert.deepEqual(await cell(), [2, 3]);
    await page.keyboard.press("Home");
    assert.deepEqual(await cell(), [0, 0]);
  });

  axeTest(pageOf, null);
});

group("dark", { dark: true }, (pageOf) => {
  test("the theme switch overrules the system's choice, and paper is always light", async () => {
    const page = pageOf();
    const paper = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor.match(/\d+/g).map(Number));
    assert.ok((await paper())[0] < 60);
    await page.select(".theme", "light");
    assert.ok((await paper())[0] > 200);
    await page.select(".theme", "system");
    assert.ok((await paper())[0] < 60);
    await page.emulateMediaType("print");
    assert.ok((await paper())[0] > 200);
    await page.emulateMediaType(null);
  });

  // Dark differs in colours only.
  axeTest(pageOf, ["color-contrast", "link-in-text-block"]);
});

group("390x844", kPhone, (pageOf) => {
  answerTest(pageOf, 390, 844);

  test("on a phone a tap on a point opens the drawer below the plot, and nothing is wider than the window", async () => {
    const page = pageOf();
    assert.equal(await page.evaluate(() => window.innerWidth), 390, "something is wider than the window");
    const mark = '#humanoid .series[data-contender="mujoco-rk4"] [data-timestep="2"]';
    await page.$eval(mark, (node) => node.scrollIntoView({ block: "center", behavior: "instant" }));
    const at = await page.$eval(mark, (node) => {
      const box = node.getBoundingClientRect();
      return { x: box.left + box.width / 2 + 6, y: box.top + box.height / 2 + 6 };
    });
    await page.touchscreen.tap(at.x, at.y);
    const drawer = await page.$eval(".drawer", (node) => ({ text: node.innerText, top: node.getBoundingClientRect().top, hidden: node.hidden }));
    assert.equal(drawer.hidden, false);
    assert.match(drawer.text, /real time/);
    const chosen = await page.$eval("#humanoid .chosen", (node) => node.getBoundingClientRect().bottom);
    assert.ok(chosen > 0 && chosen <= drawer.top, `the point is at ${chosen} px, the drawer begins at ${drawer.top} px`);
    await page.touchscreen.tap(195, 400);
    const legend = "#humanoid .legend-box";
    await page.$eval(".drawer .close", (node) => node.click());
    assert.equal(await page.$eval(`${legend} .legend`, (node) => getComputedStyle(node).display), "none");
    await page.$eval(`${legend} .legend-toggle`, (node) => node.click());
    const sizes = await page.$$eval(`${legend} .legend-item`, (nodes) => nodes.map((node) => node.getBoundingClientRect().height));
    assert.ok(sizes.every((height) => height >= 32), "too small for a finger");
  });

  axeTest(pageOf, null);
});

test("the address keeps what was chosen, and restores it", async () => {
  const { page } = await open();
  await page.$eval('#humanoid .legend-item[data-contender="jolt-f32"]', (node) => node.click());
  await page.$eval('#humanoid .segments input[value="penetration_max"]', (node) => node.click());
  await page.$eval('.claim[data-claim="5"] summary', (node) => node.click());
  await page.select("#pick-system", "grasp");
  await page.$eval("#pick-realtime", (node) => {
    node.value = "3";
    node.dispatchEvent(new Event("input"));
  });
  await page.$eval('#grasp .grip-cell[data-contender-of="mujoco-euler"][data-timestep="4"]', (node) => node.click());
  await page.$eval("#grasp .bars-panel", (node) => node.scrollIntoView({ behavior: "instant" }));
  await page.waitForFunction(() => location.hash.startsWith("#grasp&") && /cell=/.test(location.hash));
  const address = await page.evaluate(() => location.href);
  await page.close();

  const again = await browser.newPage();
  again.setDefaultTimeout(0);
  await again.setViewport({ width: 1400, height: 900 });
  await again.emulateMediaFeatures([{ name: "prefers-reduced-motion", value: "reduce" }]);
  await again.goto(address, { waitUntil: "load" });
  await again.waitForSelector("body[data-ready]");
  assert.equal(await again.$eval('#humanoid .legend-item[data-contender="jolt-f32"]', (node) => node.getAttribute("aria-checked")), "true");
  assert.equal(await again.$eval("#humanoid .segments input:checked", (node) => node.value), "penetration_max");
  assert.equal(await again.$eval("#planar-chain .segments input:checked", (node) => node.value), "truth_error");
  assert.ok(await again.$eval('.claim[data-claim="5"] details', (node) => node.open));
  assert.deepEqual(await again.evaluate(() => [document.querySelector("#pick-system").value, document.querySelector("#pick-realtime").value]), ["grasp", "3"]);
  assert.match(await again.$eval(".drawer", (node) => node.innerText), /mujoco-euler[^]*4 ms on grasp/);
  const top = await again.$eval("#grasp", (node) => node.getBoundingClientRect().top);
  assert.ok(Math.abs(top) < 120, `grasp is at ${top} px`);
  // A link of the page keeps what was chosen; an address that is typed in changes it.
  await again.$eval('nav a[href="#humanoid"]', (node) => node.click());
  await again.waitForFunction(() => location.hash.startsWith("#humanoid&"));
  assert.ok(await again.evaluate(() => location.hash.includes("jolt-f32")));
  await again.evaluate(() => (location.hash = "planar-chain&show=mujoco-euler,havok"));
  await again.waitForFunction(() => document.querySelectorAll("#humanoid .series:not(.off)").length === 2);
  assert.ok(await again.$eval(".drawer", (node) => node.hidden));
  await again.close();
});
