// The page of a report in headless Chromium: what it draws, says and does. The fixture makes results of known figures.
//   ASSAY_FIXTURE  the program browser_fixture
//   ASSAY          the program assay, for the tests that compare the page with it
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { pathToFileURL } from "node:url";

import { launch } from "../../web/browser.mjs";
import { dataIn, downloads, openReport, withDataIn } from "./page.mjs";

const work = mkdtempSync(join(tmpdir(), "assay-browser-"));
const kinds = ["full", "programme", "empty", "started", "failed"];
let browser;

const reportOf = (kind) => join(work, kind, "report.html");
const open = (kind, options) => openReport(browser, reportOf(kind), options);
const read = new Map();
function dataOf(kind) {
  if (!read.has(kind)) read.set(kind, dataIn(reportOf(kind)));
  return read.get(kind);
}

// A report whose data were changed; returns its file.
function withData(kind, name, change) {
  const data = dataIn(reportOf(kind));
  change(data);
  const file = join(work, `${name}.html`);
  writeFileSync(file, withDataIn(readFileSync(reportOf(kind), "utf8"), data));
  return file;
}

function valueOf(data, system, contender, step, name) {
  for (const cell of data.cells) {
    if (cell.system !== system || cell.contender !== contender || cell.timestep_ms !== step) continue;
    const value = cell.values.find((candidate) => candidate.name === name);
    if (value) return value.value;
  }
  return undefined;
}

// Where the marker of a contender and timestep is in the window, scrolled into view.
async function marker(page, system, contender, step) {
  const selector = `#${system} .series[data-contender="${contender}"] [data-timestep="${step}"]`;
  await page.$eval(selector, (node) => node.scrollIntoView({ block: "center", behavior: "instant" }));
  // Scrolling hides the tooltip, and its event comes with the next frame.
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  return page.$eval(selector, (node) => {
    const box = node.getBoundingClientRect();
    return { x: box.left + box.width / 2, y: box.top + box.height / 2 };
  });
}

async function chooseMeasure(page, system, name) {
  await page.$eval(`#${system} .segments input[value="${name}"]`, (node) => node.click());
}

before(async () => {
  assert.ok(process.env.ASSAY_FIXTURE, "ASSAY_FIXTURE must name the program browser_fixture");
  for (const kind of kinds) execFileSync(process.env.ASSAY_FIXTURE, [kind, join(work, kind)], { stdio: "inherit" });
  browser = await launch();
});

after(async () => {
  await browser?.close();
  rmSync(work, { recursive: true, force: true });
});

// What empty, unfinished and failed results say, on a wide page (a phone shows less of the head).
const kSaid = {
  empty: [["main", /Nothing has been measured yet/]],
  started: [["#planar-chain", /there are only reference runs/], ["#capsules-27", /No cell of this system has been run yet/]],
  failed: [["body", /none of the \d+ cells has a sound result/], ["body", /the worker ended by signal 6/], ["body", /no end after 600 s/]],
}; // prettier-ignore
for (const kind of kinds) {
  for (const width of [1400, 390]) {
    test(`${kind}, ${width} px: no errors, no requests, no holes in the text, no sideways scrolling`, async () => {
      const { page, trouble } = await open(kind, { width });
      const seen = await page.evaluate(() => ({
        text: document.body.innerText,
        markup: document.getElementById("page").outerHTML,
        wide: document.documentElement.scrollWidth - document.documentElement.clientWidth,
        title: document.title,
      }));
      assert.deepEqual(trouble, []);
      assert.ok(seen.text.length > 200, "the page is nearly empty");
      // "null" is also the name of an engine, which is always said to do nothing.
      assert.doesNotMatch(seen.text, /\b(NaN|undefined|Infinity)\b|\bnull\b(?! \(does nothing\))/);
      const holes = /.{0,80}(NaN|undefined|="null"(?!>null \(does nothing\))|Infinity|\[object).{0,80}/.exec(seen.markup);
      assert.equal(holes?.[0], undefined);
      assert.ok(seen.wide <= 0, `the page is ${seen.wide} px wider than the window`);
      assert.equal(seen.title, "assay report", "text from the data was run as a script");
      for (const [selector, said] of (width > 1000 && kSaid[kind]) || []) assert.match(await page.$eval(selector, (node) => node.innerText), said);
      await page.close();
    });
  }
}

test("the first plots are there before the rest of the page is drawn", async () => {
  const page = await browser.newPage();
  await page.setViewport({ width: 1400, height: 900 });
  await page.evaluateOnNewDocument(() => {
    const watch = new MutationObserver(() => {
      if (!document.querySelector("svg.accuracy .series")) return;
      watch.disconnect();
      const plots = [...document.querySelectorAll(".system")].map((node) => node.querySelectorAll("svg.accuracy").length);
      window.atFirst = { plots, ready: "ready" in document.body.dataset };
    });
    watch.observe(document, { childList: true, subtree: true });
  });
  await page.goto(pathToFileURL(reportOf("programme")).href, { waitUntil: "load" });
  await page.waitForSelector("body[data-ready]");
  const { plots, ready } = await page.evaluate(() => window.atFirst);
  assert.equal(plots[0], 1);
  assert.ok(plots.slice(1).every((count) => count === 0), `plots of the systems: ${plots.join()}`);
  assert.equal(ready, false);
  assert.equal((await page.$$('[aria-busy="true"]')).length, 0, "all is drawn when the page says so");
  assert.equal(await page.evaluate(() => performance.getEntriesByName("assay:first-plots").length), 1);
  await page.close();
});

test("an address that names a part shows it, whatever is drawn above it later; a reader who has scrolled stays", async () => {
  const page = await browser.newPage();
  await page.setViewport({ width: 1400, height: 900 });
  await page.emulateMediaFeatures([{ name: "prefers-reduced-motion", value: "reduce" }]);
  const address = `${pathToFileURL(reportOf("programme")).href}#grasp`;
  const top = () => page.$eval("#grasp", (node) => node.getBoundingClientRect().top);
  await page.goto(address, { waitUntil: "load" });
  await page.waitForSelector("body[data-ready]");
  assert.ok((await top()) >= -1 && (await top()) < 120, `grasp is at ${await top()} px`);
  await page.evaluateOnNewDocument(() => {
    document.addEventListener("DOMContentLoaded", () => {
      window.dispatchEvent(new WheelEvent("wheel", { deltaY: -100 }));
      const jump = Element.prototype.scrollIntoView;
      Element.prototype.scrollIntoView = function (...words) {
        window.jumped = true;
        return jump.apply(this, words);
      };
    });
  });
  await page.goto("about:blank");
  await page.goto(address, { waitUntil: "load" });
  await page.waitForSelector("body[data-ready]");
  assert.equal(await page.evaluate(() => window.jumped), undefined);
  await page.close();
});

test("printing before all is drawn prints all of it, and no table is cut on paper", async () => {
  const page = await browser.newPage();
  await page.setViewport({ width: 688, height: 900 }); // A4 without its margins, in CSS pixels
  await page.evaluateOnNewDocument(() => {
    const busy = () => document.querySelectorAll('[aria-busy="true"]').length;
    document.addEventListener("DOMContentLoaded", () =>
      setTimeout(() => {
        window.busy = [busy()];
        window.dispatchEvent(new Event("beforeprint"));
        window.busy.push(busy());
      }),
    );
  });
  await page.goto(pathToFileURL(reportOf("programme")).href, { waitUntil: "load" });
  await page.waitForSelector("body[data-ready]");
  const [before, then] = await page.evaluate(() => window.busy);
  assert.ok(before > 5, `${before} parts were still to be drawn`);
  assert.equal(then, 0);
  await page.emulateMediaType("print");
  const cut = await page.evaluate(() => {
    const room = document.documentElement.clientWidth;
    const tables = [...document.querySelectorAll(".system table, #scaling table, #values table, #failures table")];
    const wide = tables.filter((table) => table.getBoundingClientRect().right > room + 1);
    return { count: tables.length, wide: wide.map((table) => table.getAttribute("aria-label")) };
  });
  assert.ok(cut.count > 10, `${cut.count} tables`);
  assert.deepEqual(cut.wide, []);
  await page.close();
});

describe("full results", () => {
  const data = () => dataOf("full");
  const chain = "planar-chain";
  const labelOf = (name) => data().catalogue.find((info) => info.name === name).label;
  let page;
  let trouble;

  before(async () => {
    ({ page, trouble } = await open("full"));
  });
  after(async () => {
    assert.deepEqual(trouble, []);
    await page.close();
  });

  test("bars are sorted, equal the data, and are as long as they say", async () => {
    for (const system of [chain, "capsules-27"]) {
      const bars = await page.$$eval(`#${system} .bars .bar`, (nodes) =>
        nodes.map((node) => ({
          contender: node.dataset.contender,
          value: Number(node.dataset.value),
          length: node.querySelector(".fill").getBoundingClientRect().width,
          top: node.querySelector(".fill").getBoundingClientRect().top,
          whisker: node.querySelector(".whisker")?.getBoundingClientRect().width ?? 0,
          text: node.querySelector(".value").textContent,
        })),
      );
      const expected = data()
        .contenders.map((contender) => contender.name)
        .filter((name) => name !== "null" && valueOf(data(), system, name, 1, "raw_speed") !== undefined);
      assert.deepEqual(bars.map((bar) => bar.contender).sort(), expected.sort());
      const scale = bars[0].length / bars[0].value;
      bars.forEach((bar, index) => {
        assert.equal(bar.value, valueOf(data(), system, bar.contender, 1, "raw_speed"));
        assert.ok(Math.abs(bar.length - bar.value * scale) < 1.5, `${bar.contender}: ${bar.length} px`);
        assert.ok(bar.whisker > 0, `${bar.contender} has no whisker`);
        assert.match(bar.text, /kHz$/);
        assert.ok(Math.abs(Number.parseFloat(bar.text) - bar.value) <= 0.005 * bar.value, bar.text);
        if (index > 0) {
          assert.ok(bars[index - 1].value >= bar.value, "bars are not sorted");
          assert.ok(bars[index - 1].top < bar.top, "bars are not drawn in their order");
        }
      });
    }
    const missing = await page.$eval("#capsules-27 .bars-panel .note", (node) => node.textContent);
    assert.match(missing, /bullet-mb-rk4 \(unsupported\)/);
  });

  test("what is taken away is what assay export writes", { skip: !process.env.ASSAY || !existsSync(process.env.ASSAY) }, async () => {
    const [json] = await downloads(page, ['#values [data-format="json"]']);
    const exported = execFileSync(process.env.ASSAY, ["export", join(work, "full"), "--format", "json"], { maxBuffer: 1 << 26 });
    const text = (row) => JSON.stringify(Object.entries(row).sort(([a], [b]) => (a < b ? -1 : 1)));
    assert.deepEqual(JSON.parse(json).map(text).sort(), JSON.parse(exported).map(text).sort());
  });

  test("bars follow the chosen timestep", async () => {
    const at = (step) => page.$$eval("#capsules-27 .bars .bar", (nodes) => nodes.length).then((count) => ({ step, count }));
    await page.select("#capsules-27 .bars-panel select", "0.25");
    assert.equal((await at(0.25)).count, 13);
    assert.match(await page.$eval("#capsules-27 .bars", (node) => node.getAttribute("aria-label")), /1\/4 ms/);
    await page.select("#capsules-27 .bars-panel select", "1");
  });

  test("markers lie where speed and error put them", async () => {
    const points = await page.$$eval(`#planar-chain .series .mark`, (nodes) =>
      nodes.map((node) => {
        const [, x, y] = /translate\(([-\d.]+),([-\d.]+)\)/.exec(node.getAttribute("transform"));
        return { contender: node.parentNode.dataset.contender, step: Number(node.dataset.timestep), x: Number(x), y: Number(y) };
      }),
    );
    assert.equal(points.length, 14 * 12 - 1, "every cell but the one that diverged");
    const place = (point) => ({
      speed: Math.log10(valueOf(data(), chain, point.contender, point.step, "realtime_factor")),
      error: Math.log10(valueOf(data(), chain, point.contender, point.step, "truth_error")),
    });
    // Two points far apart fix both axes; all others must agree.
    const slow = points.find((point) => point.contender === "mujoco-rk4" && point.step === 1 / 2);
    const fast = points.find((point) => point.contender === "mujoco-euler" && point.step === 32);
    const [a, b] = [place(slow), place(fast)];
    assert.ok(fast.x > slow.x && fast.y < slow.y, "faster is right, a larger error is up");
    const floor = await page.$eval(`#${chain} .zero-band`, (node) => Number(node.getAttribute("y")));
    for (const point of points) {
      const { speed, error } = place(point);
      // what is below a picometre is only said to be that
      if (error < -12) {
        assert.ok(point.y > floor, `${point.contender} at ${point.step} ms`);
        continue;
      }
      const x = slow.x + ((speed - a.speed) / (b.speed - a.speed)) * (fast.x - slow.x);
      const y = slow.y + ((error - a.error) / (b.error - a.error)) * (fast.y - slow.y);
      assert.ok(Math.hypot(point.x - x, point.y - y) < 0.5, `${point.contender} at ${point.step} ms`);
    }
  });

  test("hover shows contender, timestep, values and intervals, and lights the line", async () => {
    const at = await marker(page, chain, "mujoco-rk4", 0.5);
    await page.mouse.move(at.x, at.y);
    const tip = await page.$eval(".tooltip", (node) => (node.hidden ? "" : node.innerText));
    assert.match(tip, /mujoco-rk4/);
    assert.match(tip, /1\/2 ms/);
    assert.match(tip, /131 pm/); // 2.1 nm / 2^4
    assert.match(tip, /128×/);
    assert.match(tip, /126× to 130×/);
    assert.match(tip, /256 kHz/);
    const lit = await page.$$eval("#planar-chain .series.lit", (nodes) => nodes.map((node) => node.dataset.contender));
    assert.deepEqual(lit, ["mujoco-rk4"]);
    const inside = await page.$eval(".tooltip", (node) => {
      const box = node.getBoundingClientRect();
      return box.left >= 0 && box.top >= 0 && box.right <= window.innerWidth && box.bottom <= window.innerHeight;
    });
    assert.ok(inside, "the tooltip leaves the window");
    await page.mouse.click(at.x, at.y);
    assert.ok(await page.$eval(".tooltip", (node) => node.hidden), "it lies over the drawer");
    await page.$eval(".drawer .close", (node) => node.click());
    await page.mouse.move(2, 2);
    assert.ok(await page.$eval(".tooltip", (node) => node.hidden));
  });

  test("where a timestep was not timed, the speed lies between its neighbours", async () => {
    const tipAt = async (step) => {
      const at = await marker(page, "capsules-27", "mujoco-rk4", step);
      await page.mouse.move(at.x, at.y);
      const tip = await page.$eval(".tooltip", (node) => (node.hidden ? "" : node.innerText));
      await page.mouse.move(2, 2);
      return tip;
    };
    // 4.3 kHz at 1 ms and 0.81 of it at 4 ms: 0.9 of it halfway.
    assert.match(await tipAt(2), /7\.74× \(timed at 1 and 4 ms\)/);
    assert.doesNotMatch(await tipAt(1), /timed at/);
    const marks = await page.$$eval('#capsules-27 .series[data-contender="mujoco-rk4"] .mark', (nodes) => nodes.map((node) => [Number(node.dataset.timestep), node.classList.contains("hollow")]));
    const hollow = new Map(marks);
    for (const step of [0.25, 0.5, 1, 4, 8, 16, 32]) assert.equal(hollow.get(step), false, `${step} ms was timed`);
    assert.equal(hollow.get(2), true);
    assert.ok(!hollow.has(1 / 32), "a speed beyond what was timed");
    const notes = await page.$$eval("#capsules-27 .accuracy-panel .note", (nodes) => nodes.map((node) => node.textContent).join(" "));
    assert.match(notes, /(Not shown at 1\/32 to 1\/8 ms|Shown but for these timesteps), where no speed is known: .*mujoco-euler/);
  });

  test("the keyboard walks over the points", async () => {
    await page.$eval("#planar-chain svg.accuracy", (node) => node.focus());
    await page.keyboard.press("ArrowRight");
    await page.keyboard.press("ArrowRight");
    const first = await page.$eval(".tooltip", (node) => node.innerText);
    assert.match(first, /mujoco-euler\n/);
    assert.match(first, /1\/32 ms/);
    await page.keyboard.press("ArrowDown");
    const second = await page.$eval(".tooltip", (node) => node.innerText);
    assert.match(second, /mujoco-rk4/);
    assert.match(second, /1\/32 ms/);
    await page.keyboard.press("Escape");
    assert.ok(await page.$eval(".tooltip", (node) => node.hidden));
  });

  test("what is unstable or failed is marked and explained", async () => {
    const unsound = await page.$$eval("#planar-chain .mark.unsound", (nodes) =>
      nodes.map((node) => `${node.parentNode.dataset.contender} ${node.dataset.timestep}`),
    );
    assert.deepEqual(unsound, ["bullet-si-f32 32"]);
    assert.equal((await page.$$("#planar-chain svg.accuracy .strike")).length, 1);
    const failed = await page.$$eval("#planar-chain svg.accuracy .failed", (nodes) =>
      nodes.map((node) => `${node.parentNode.dataset.contender} ${node.dataset.timestep}`),
    );
    assert.deepEqual(failed, ["ode-step 32"]);
    const cross = await page.$eval("#planar-chain svg.accuracy .failed", (node) => node.getBoundingClientRect().bottom);
    const frame = await page.$eval("#planar-chain .frame", (node) => node.getBoundingClientRect().top);
    assert.ok(cross <= frame, "the cross lies inside the plot, as if it had a value");
    const at = await marker(page, chain, "ode-step", 32);
    await page.mouse.move(at.x, at.y);
    const tip = await page.$eval(".tooltip", (node) => node.innerText);
    assert.match(tip, /diverged/);
    assert.match(tip, /not finite at 0.416 s/);
    await page.mouse.move(2, 2);
  });

  test("failures are listed with their reasons", async () => {
    const rows = await page.$$eval("#failures .failure-list tbody tr", (nodes) => nodes.map((node) => node.innerText.replace(/\s+/g, " ")));
    assert.equal(rows.length, 9);
    assert.ok(rows.some((row) => /ode-step planar-chain truth 32 ms diverged a state that is not finite/.test(row)));
    assert.ok(rows.some((row) => /bullet-mb-rk4 capsules-27 raw speed all, 1\/64 to 32 ms unsupported not scored/.test(row)));
    assert.match(await page.$eval("#failures", (node) => node.innerText), /physx-d6-pgs: the engine physx is not built here/);
    assert.ok(rows.some((row) => row.includes("</script><script>document.title='broken'</script>")));
  });

  test("what failed is counted by outcome, contender and system; numbers, choices and words narrow it down", async () => {
    const bad = data().cells.filter((cell) => cell.outcome !== "ok" && cell.contender !== "null");
    const text = await page.$eval("#failures .failure-sum", (node) => node.textContent);
    assert.ok(text.startsWith(`${bad.length} of ${data().cells.filter((cell) => cell.contender !== "null").length} cells`), text);
    for (const outcome of new Set(bad.map((cell) => cell.outcome))) {
      assert.ok(text.includes(`${bad.filter((cell) => cell.outcome === outcome).length} ${outcome}`), text);
    }
    const table = await page.$$eval("#failures .failure-counts tr", (rows) => [...rows].map((row) => [...row.cells].map((cell) => cell.innerText.trim())));
    const [head, ...rows] = table;
    const systems = head.slice(2).map((name) => name.trim());
    for (const [name, all, ...each] of rows) {
      const own = bad.filter((cell) => name === "All" || cell.contender === name);
      assert.equal(Number(all), own.length, name);
      each.forEach((count, index) => {
        const expected = own.filter((cell) => cell.system === systems[index]).length;
        assert.equal(count === "·" ? 0 : Number(count), expected, `${name} on ${systems[index]}`);
      });
    }
    const listed = () => page.$$eval("#failures .failure-list tbody tr", (nodes) => nodes.map((node) => [node.cells[0].innerText, node.cells[1].innerText]));
    const words = () => page.$eval('#failures [aria-live="polite"]', (node) => node.textContent);
    // By keyboard: the number of bullet-mb-rk4 on capsules-27.
    await page.$$eval("#failures .failure-counts button", (nodes) => nodes.find((node) => /of bullet-mb-rk4 on capsules-27:/.test(node.getAttribute("aria-label"))).focus());
    await page.keyboard.press("Enter");
    const chosen = await listed();
    assert.ok(chosen.length > 0 && chosen.every(([contender, system]) => contender === "bullet-mb-rk4" && system === "capsules-27"));
    const count = bad.filter((cell) => cell.contender === "bullet-mb-rk4" && cell.system === "capsules-27").length;
    assert.match(await words(), new RegExp(`^${count} cells in ${chosen.length} rows?$`));
    assert.ok(await page.evaluate(() => document.activeElement.closest("#failures .failure-list") !== null), "the list is next");
    await page.$eval("#failures .filters .more", (node) => node.click());
    assert.equal((await listed()).length, 9);
    await page.type("#failures .filters input", "not finite");
    assert.deepEqual(await listed(), [["ode-step", "planar-chain"]]);
    await page.$eval("#failures .filters .more", (node) => node.click());
    assert.equal((await listed()).length, 9);
  });

  test("measures can be chosen; errors of exactly zero are shown as such", async () => {
    await chooseMeasure(page, chain, "consistency");
    assert.ok((await page.$eval("#planar-chain .accuracy-panel .sub", (node) => node.textContent)).startsWith(`${labelOf("consistency")}: `));
    assert.equal(await page.$eval("#planar-chain .matrix-panel select", (node) => node.value), "consistency");
    assert.ok((await page.$$("#planar-chain .series .floor")).length >= 5, "restart floors are drawn");
    const note = () => page.$eval("#planar-chain .accuracy-panel .note", (node) => node.textContent);
    assert.match(await page.$eval("#planar-chain .plot-key", (node) => node.textContent), /too near the floor/);
    assert.ok((await page.$$("#planar-chain .mark.pale")).length > 0);
    // The reference's own timestep is the floor and no point of the line.
    assert.equal((await page.$$('#planar-chain .series [data-timestep="0.015625"]')).length, 0);
    await chooseMeasure(page, chain, "angular_momentum_drift");
    const ticks = await page.$$eval("#planar-chain .tick-y", (nodes) => nodes.map((node) => node.textContent));
    assert.match(await page.$eval("#planar-chain svg.accuracy .axis", (node) => node.textContent), new RegExp(`${labelOf("angular_momentum_drift").toLowerCase()} \\(kg m²/s\\)`));
    assert.ok(ticks.length > 3 && ticks.every((tick) => /^10[⁻⁰¹²³⁴-⁹]+$|^1$/.test(tick)), ticks.join());
    await chooseMeasure(page, chain, "truth_error");
    assert.match(await note(), /Stops shrinking .*: bullet-si-f32/);
  });

  test("the legend hides lines everywhere and brings them back", async () => {
    const shown = (name) =>
      page.$$eval(`.series[data-contender="${name}"]`, (nodes) => nodes.map((node) => getComputedStyle(node).display !== "none"));
    const button = '#planar-chain .legend-item[data-contender="ode-quick"]';
    const tipAt = async (at) => {
      await page.mouse.move(at.x, at.y);
      return page.$eval(".tooltip", (node) => (node.hidden ? "" : node.innerText));
    };
    const at = await marker(page, chain, "ode-quick", 1);
    assert.match(await tipAt(at), /ode-quick/);
    await page.mouse.move(2, 2);
    assert.deepEqual(await shown("ode-quick"), [true, true]);
    await page.$eval(button, (node) => node.click());
    assert.deepEqual(await shown("ode-quick"), [false, false]);
    assert.equal(await page.$eval(button, (node) => node.getAttribute("aria-checked")), "false");
    assert.doesNotMatch(await tipAt(at), /ode-quick/, "a hidden point answers the pointer");
    await page.mouse.move(2, 2);
    await page.focus(button);
    await page.keyboard.press("Enter");
    assert.deepEqual(await shown("ode-quick"), [true, true]);
    const press = (text) =>
      page.$$eval("#planar-chain .legend-all", (nodes, label) => nodes.find((node) => node.textContent === label).click(), text);
    await press("One per family");
    const families = await page.$$eval("#planar-chain .series:not(.off)", (nodes) => nodes.map((node) => node.dataset.contender));
    assert.deepEqual(families, ["mujoco-euler", "bullet-si-f64", "bullet-mb", "ode-quick"]);
    await press("None");
    assert.equal((await page.$$("#planar-chain .series:not(.off)")).length, 0);
    await press("All");
    assert.equal((await page.$$("#planar-chain .series:not(.off)")).length, 14);
  });

  test("every contender looks different", async () => {
    const looks = await page.$$eval("#planar-chain .legend-item", (nodes) =>
      nodes.map((node) => {
        const line = node.querySelector("line");
        return [getComputedStyle(line).stroke, line.getAttribute("stroke-dasharray"), node.querySelector("path").getAttribute("d"), node.querySelector("path").getAttribute("transform")].join(" ");
      }),
    );
    assert.equal(looks.length, 14);
    assert.equal(new Set(looks).size, 14);
  });

  test("the table holds the figures, sorts, and opens details", async () => {
    const table = "#planar-chain .matrix-panel table";
    const column = (index) =>
      page.$$eval(`${table} tbody tr:not(.detail)`, (rows, at) => rows.map((row) => row.cells[at].innerText.trim()), index);
    const names = () => column(0);
    assert.equal((await names())[0], "mujoco-euler");
    const rk4 = (await names()).indexOf("mujoco-rk4");
    assert.equal((await column(7))[rk4], "2.10 nm");
    const sort = (index) => page.$$eval(`${table} thead .sort`, (nodes, at) => nodes[at].click(), index);
    await sort(7);
    const error = (name) => valueOf(data(), chain, name, 1, "truth_error");
    const ascending = (await names()).map(error);
    assert.deepEqual(ascending, [...ascending].sort((a, b) => a - b));
    assert.equal(await page.$eval(`${table} th:nth-child(8)`, (node) => node.getAttribute("aria-sort")), "ascending");
    await sort(7);
    const descending = (await names()).map(error);
    assert.deepEqual(descending, [...descending].sort((a, b) => b - a));
    await sort(12); // the column with a failure: it has no value and comes last
    assert.equal((await names()).at(-1), "ode-step");
    await sort(12);
    assert.equal((await names()).at(-1), "ode-step");
    await sort(0);
    const alphabetic = await names();
    assert.deepEqual(alphabetic, [...alphabetic].sort((a, b) => a.localeCompare(b)));

    const cell = `${table} tbody tr:last-child td:last-child button`;
    await page.$eval(cell, (node) => node.click());
    const detail = await page.$eval(`${table} .detail`, (node) => node.innerText);
    assert.match(detail, /ode-step at 32 ms/);
    assert.match(detail, /diverged/);
    assert.match(detail, /not finite at 0.416 s/);
    await page.$eval(`${table} tbody tr:nth-last-child(2) td:last-child button`, (node) => node.click());
    assert.equal((await page.$$(`${table} .detail`)).length, 0);
  });

  // Of a contender: sound up to the smallest timestep with a cell that did not end well; the largest error so far.
  const candidatesOf = (system, measure, value, skip) => {
    const list = [];
    for (const contender of new Set(data().cells.filter((cell) => cell.system === system && cell.contender !== "null").map((cell) => cell.contender))) {
      const own = data().cells.filter((cell) => cell.system === system && cell.contender === contender);
      let worst = 0;
      for (const step of [...new Set(own.map((cell) => cell.timestep_ms))].sort((a, b) => a - b)) {
        const here = own.filter((cell) => cell.timestep_ms === step);
        if (here.some((cell) => cell.outcome !== "ok")) break;
        const error = here.flatMap((cell) => cell.values).find((one) => one.name === value)?.value;
        if (error === undefined || step === skip) continue;
        worst = Math.max(worst, Math.abs(error));
        const speed = valueOf(data(), system, contender, step, "realtime_factor");
        if (speed !== undefined) list.push({ contender, step, worst, speed });
      }
    }
    return list.sort((a, b) => b.speed - a.speed);
  };

  test("a tile answers the question within the reader's limits; other answers and what to know are a line to open", async () => {
    const all = candidatesOf(chain, "truth", "truth_error");
    const fastest = all.find((one) => one.worst <= 1e-3);
    const tile = `.card[data-system="${chain}"]`;
    const { contenderOf, timestep } = await page.$eval(`${tile} .answer-link`, (node) => ({ ...node.dataset }));
    assert.deepEqual([contenderOf, Number(timestep)], [fastest.contender, fastest.step]);
    assert.ok(await page.$(`${tile} .answer-ring`), "the answer is ringed in the small plot");
    for (const view of data().views) {
      const said = await page.$$eval(`[id="${view.system}"] .other-answers li`, (nodes) => nodes.map((node) => node.textContent));
      for (const { id, question, text } of view.card.answers.slice(1)) assert.ok(said.includes(`${question}: ${text}`), `${view.system}: ${id}`);
      if (view.card.caveat) assert.ok(said.includes(view.card.caveat), view.system);
    }
    const live = all.filter((one) => one.speed >= 1);
    const least = Math.min(...live.map((one) => one.worst));
    const given = data().views.find((view) => view.system === chain).card.answers.find(({ id }) => id === "most-accurate-realtime");
    const chosen = live.find((one) => one.contender === given.contender && one.step === given.timestep_ms);
    assert.ok(chosen.worst <= 1.01 * Math.max(least, 1e-12), `${chosen.contender}: ${chosen.worst}, the least is ${least}`);
    await page.$eval(`${tile} .answer-link`, (node) => node.click());
    assert.match(await page.$eval(".drawer h2", (node) => node.textContent), new RegExp(fastest.contender));
    await page.$eval(".drawer .close", (node) => node.click());
  });

  test("the slider of the limit moves the line, the ring and every answer; the picker and the grid follow", async () => {
    const all = candidatesOf(chain, "truth", "truth_error");
    const slide = (value) =>
      page.$eval(`#${chain} .limit-range`, (node, to) => {
        node.value = String(to);
        node.dispatchEvent(new Event("input"));
      }, value); // prettier-ignore
    const look = () =>
      page.evaluate((system) => {
        const ring = document.querySelector(`#${system} .canvas .answer-ring`);
        const line = document.querySelector(`#${system} .canvas .limit-line`);
        const picked = document.querySelector(".pick-best")?.dataset;
        return {
          ring: ring && `${ring.dataset.contenderOf} ${ring.dataset.timestep}`,
          limit: line && Number(line.dataset.limit),
          y: line && Number(line.getAttribute("y1")),
          asked: document.querySelector(`#${system} .system-answer`).textContent,
          picked: picked ? `${document.querySelector("#pick-system").value} ${picked.contenderOf} ${picked.timestep}` : null,
          grades: [...document.querySelectorAll(".grid-table .grade")].map((node) => node.dataset.grade).join(""),
        };
      }, chain);
    const most = Number(await page.$eval(`#${chain} .limit-range`, (node) => node.max));
    const seen = [];
    for (const at of [Math.round(0.8 * most), Math.round(0.5 * most), Math.round(0.2 * most)]) {
      await slide(at);
      const now = await look();
      const expected = all.find((one) => one.worst <= now.limit * (1 + 1e-12));
      const place = expected ? `${expected.contender} ${expected.step}` : null;
      assert.equal(now.ring, place, `within ${now.limit}`);
      if (place) {
        assert.equal(now.picked, `${chain} ${place}`);
        assert.ok(now.asked.includes(`${expected.contender} at `), now.asked);
      }
      seen.push(now);
    }
    assert.ok(seen[0].y < seen[1].y && seen[1].y <= seen[2].y, "a smaller limit lies lower");
    assert.ok(new Set(seen.map(({ ring }) => ring)).size > 1 && new Set(seen.map(({ grades }) => grades)).size > 1, "answers and grades change");
    await slide(most);
    assert.equal((await look()).limit, null, "no limit at the right end");
    // as at first
    await page.evaluate((system) => { location.hash = `pick&pick=${system}&limit=truth_error:0.001`; }, chain);
    await page.waitForFunction((system) => Number(document.querySelector(`#${system} .canvas .limit-line`)?.dataset.limit) === 0.001, {}, chain);
  });

  test("the grid grades each engine by its best contender against the fastest of all within the limits", async () => {
    const all = candidatesOf(chain, "truth", "truth_error");
    const within = all.filter((one) => one.worst <= 1e-3);
    const engineOf = (contender) => data().contenders.find(({ name }) => name === contender).engine.replace(/-(f32|f64)$/, "");
    const shown = await page.$$eval(".grid-table tbody tr", (rows, system) => {
      const column = [...rows[0].closest("table").tHead.rows[0].cells].findIndex((cell) => cell.querySelector("a")?.getAttribute("href") === `#${system}`);
      return rows.map((row) => ({ engine: row.cells[0].textContent, grade: row.cells[column].querySelector("a").dataset.grade, title: row.cells[column].querySelector("a").title }));
    }, chain); // prettier-ignore
    assert.ok(shown.length >= 3);
    for (const { engine, grade, title } of shown) {
      const best = within.find((one) => engineOf(one.contender) === engine);
      const tried = all.some((one) => engineOf(one.contender) === engine);
      if (!best) {
        assert.ok(tried ? grade === "D" : "F–".includes(grade), `${engine}: ${grade}`);
        continue;
      }
      const slower = within[0].speed / best.speed;
      assert.ok(title.includes(`${best.contender} at `), title);
      assert.ok(grade === (slower <= 2 ? "A" : slower <= 10 ? "B" : "C") || (grade === "A" && /not told apart/.test(title)), `${engine}: ${grade} at ${slower}`);
    }
    const link = `.grid-table a[href="#${chain}"].grade-d, .grid-table tbody a[href="#${chain}"]`;
    const why = await page.$eval(link, (node) => node.title);
    await page.$eval(link, (node) => node.click());
    const told = await page.$eval(".drawer", (node) => node.querySelector(".drawer-why")?.textContent ?? "");
    assert.ok(told.includes(why.replace(/^[^:]*: /, "")), `${why} | ${told}`);
    await page.$eval(".drawer .close", (node) => node.click());
  });

  test("the front is the one that the figures give, in the plot and in words", async () => {
    const all = candidatesOf(chain, "truth", "truth_error");
    const error = (one) => Math.max(one.worst, 1e-12);
    const beaten = (a) => all.some((b) => error(b) < 0.99 * error(a) && b.speed >= a.speed);
    const front = data().views.find((view) => view.system === chain).fronts.truth_error;
    const points = data().views.find((view) => view.system === chain).points;
    assert.ok(front.length > 5);
    for (const { point } of front) {
      const one = all.find((each) => each.contender === points[point].contender && each.step === points[point].timestep_ms);
      assert.ok(one && !beaten(one), `${points[point].contender} at ${points[point].timestep_ms} ms is no point of the front`);
    }
    const corners = [...(await page.$eval(`#${chain} .front-line`, (node) => node.getAttribute("d"))).matchAll(/[MV]/g)];
    assert.equal(corners.length, front.length);
    await page.$$eval(`#${chain} .front-panel .more`, ([node]) => node?.click());
    const names = await page.$$eval(`#${chain} .front li b`, (nodes) => nodes.map((node) => node.textContent.split(" at ")[0]));
    assert.deepEqual(names, front.map(({ point }) => points[point].contender));
    assert.match(await page.$eval(`#${chain} .front-panel`, (node) => node.innerText), /not told apart from .*mujoco-euler-cg/);
  });

  test("gate, fairness table and manifest are there", async () => {
    const gate = await page.$$eval("#gate .gate-cell", (nodes) => {
      const count = {};
      for (const node of nodes) count[node.classList[1]] = (count[node.classList[1]] ?? 0) + 1;
      return count;
    });
    const expected = {};
    for (const result of data().conformance) expected[result.status] = (expected[result.status] ?? 0) + 1;
    assert.deepEqual(gate, expected);
    const verdict = await page.$eval("#gate .gate-verdict", (node) => node.innerText);
    for (const result of data().conformance) {
      if (result.status !== "fail" && result.status !== "deviation") continue;
      assert.ok(verdict.includes(result.contender) && verdict.includes(result.test), `the verdict lacks ${result.contender} ${result.test}`);
    }
    await page.$eval("#gate details", (node) => { node.open = true; });
    await page.$eval("#gate .gate-cell.fail", (node) => node.click());
    const detail = await page.$eval("#gate .detail", (node) => node.innerText);
    assert.match(detail, /rests 19 mm too low/i);
    assert.match(detail, /19.3 mm/);
    assert.match(detail, /1.00 mm/);
    assert.equal((await page.$$("#fairness tbody tr")).length, 14);
    assert.match(await page.$eval("#fairness", (node) => node.innerText), /torque-free-top: single precision leaves/);
    const manifest = await page.$eval("#manifest", (node) => node.innerText);
    for (const fact of ["Example CPU @ 2.50GHz", "performance", "-ffp-contract=off", "0123456789abcdef", "engine that does nothing", "0.20 %", "96 %", "16.0 GiB"]) {
      assert.ok(manifest.includes(fact), `the manifest lacks ${fact}`);
    }
  });

  test("the engine that does nothing is no contender", async () => {
    assert.equal((await page.$$('[data-contender="null"]')).length, 0);
  });
});

for (const width of [1400, 820, 390]) {
  test(`${width} px: axis labels do not overlap and nothing is cut off`, async () => {
    const { page } = await open("full", { width });
    for (const name of ["truth_error", "consistency", "energy_drift", "angular_momentum_drift"]) {
      await chooseMeasure(page, "planar-chain", name);
      const problems = await page.evaluate(() => {
        const found = [];
        const texts = [...document.querySelectorAll("svg.bars text, svg.accuracy text")].filter((node) => node.textContent);
        const boxes = texts.map((node) => ({ text: node.textContent, svg: node.ownerSVGElement, box: node.getBoundingClientRect() }));
        for (let i = 0; i < boxes.length; i += 1) {
          const a = boxes[i];
          const frame = a.svg.getBoundingClientRect();
          if (a.box.left < frame.left - 1 || a.box.right > frame.right + 1 || a.box.bottom > frame.bottom + 1) {
            found.push(`'${a.text}' leaves its drawing`);
          }
          for (let j = i + 1; j < boxes.length; j += 1) {
            const b = boxes[j];
            if (a.svg !== b.svg) continue;
            const x = Math.min(a.box.right, b.box.right) - Math.max(a.box.left, b.box.left);
            const y = Math.min(a.box.bottom, b.box.bottom) - Math.max(a.box.top, b.box.top);
            if (x > 1 && y > 3) found.push(`'${a.text}' and '${b.text}' overlap`);
          }
        }
        return found;
      });
      assert.deepEqual(problems, [], `measure ${name}`);
    }
    await page.close();
  });
}

test("dark mode is dark and readable", async () => {
  const look = async (dark) => {
    const { page } = await open("full", { dark });
    const colors = await page.evaluate(() => {
      const paint = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
      // Any CSS colour as relative luminance.
      const luminance = (color) => {
        paint.fillStyle = color;
        paint.fillRect(0, 0, 1, 1);
        const [r, g, b] = [...paint.getImageData(0, 0, 1, 1).data].map((byte) => {
          const share = byte / 255;
          return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
        });
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
      };
      return {
        paper: luminance(getComputedStyle(document.body).backgroundColor),
        ink: luminance(getComputedStyle(document.body).color),
        panel: luminance(getComputedStyle(document.querySelector(".panel")).backgroundColor),
        soft: luminance(getComputedStyle(document.querySelector(".sub")).color),
        lines: [...document.querySelectorAll("#planar-chain .series .line")].map((node) => luminance(getComputedStyle(node).stroke)),
      };
    });
    await page.close();
    return colors;
  };
  const contrast = (a, b) => (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  for (const dark of [false, true]) {
    const colors = await look(dark);
    assert.ok(dark ? colors.paper < 0.05 : colors.paper > 0.8);
    assert.ok(contrast(colors.paper, colors.ink) > 7);
    assert.ok(contrast(colors.paper, colors.soft) > 4.5);
    assert.ok(colors.lines.length > 10);
    for (const line of colors.lines) assert.ok(contrast(colors.panel, line) > 2.5, `a line's contrast is ${contrast(colors.panel, line)}`);
  }
});

test("the page prints on paper's width", async () => {
  const { page, trouble } = await open("full");
  const pdf = await page.pdf({ format: "A4" });
  assert.ok(pdf.length > 20000);
  assert.deepEqual(trouble, []);
  await page.close();
});

test("the screenshot shows the top of the page as far as the first plots", async () => {
  const script = new URL("../../web/screenshot.mjs", import.meta.url).pathname;
  const out = join(work, "shot.png");
  execFileSync(process.execPath, [script, join(work, "full"), out, "--width", "1200"]);
  const png = readFileSync(out);
  assert.equal(png.toString("latin1", 1, 4), "PNG");
  assert.equal(png.readUInt32BE(16), 1200);
  const { page } = await open("full", { width: 1200, height: 1000, folded: true });
  const bottom = await page.$eval(".system .accuracy-panel", (node) => node.getBoundingClientRect().bottom + window.scrollY);
  await page.close();
  assert.ok(Math.abs(png.readUInt32BE(20) - bottom) < 40, `${png.readUInt32BE(20)} px high, the plots end at ${bottom}`);
  assert.throws(() => execFileSync(process.execPath, [script, join(work, "nowhere"), out], { stdio: "pipe" }), /no report at/);
});

// The data of these contenders alone, as the program would write them.
function only(data, names) {
  data.contenders = data.contenders.filter(({ name }) => names.includes(name));
  data.measured.contenders = data.measured.contenders.filter((name) => names.includes(name));
  data.cells = data.cells.filter(({ contender }) => names.includes(contender));
  data.conformance = data.conformance.filter(({ contender }) => names.includes(contender));
  data.agreement = [];
  for (const view of data.views) {
    const place = new Map();
    const points = view.points.filter(({ contender }, index) => names.includes(contender) && place.set(index, place.size));
    const kept = (list) => list.filter(({ point }) => place.has(point)).map((one) => ({ ...one, point: place.get(one.point) }));
    view.candidates = kept(view.candidates);
    view.fronts = Object.fromEntries(Object.entries(view.fronts).map(([name, front]) => [name, kept(front).map((one) => ({ ...one, equals: [] }))]));
    view.left_out = view.left_out.filter(({ contender }) => names.includes(contender));
    view.points = points;
    view.card.answers = view.card.answers.map((one) => (names.includes(one.contender) ? one : { ...one, contender: null, timestep_ms: null, text: "No contender", figures: "No contender" }));
  }
}

// A thousand that differ in the name alone, each a little slower than the one before.
function thousand(data) {
  only(data, ["mujoco-rk4"]);
  const copies = Array.from({ length: 999 }, (_, i) => `copy-${String(i).padStart(3, "0")}`);
  data.contenders.push(...copies.map((name) => ({ ...data.contenders[0], name, varies: name })));
  data.measured.contenders.push(...copies);
  const view = data.views.find(({ system }) => system === "planar-chain");
  const [points, candidates] = [[...view.points], [...view.candidates]];
  copies.forEach((contender, i) => {
    const start = view.points.length;
    const slower = 1 + (i + 1) / 1e4;
    for (const point of points) view.points.push({ ...point, contender, speed: point.speed && { ...point.speed, value: point.speed.value / slower, low: point.speed.low / slower, high: point.speed.high / slower } });
    view.candidates.push(...candidates.map((one) => ({ ...one, point: one.point + start })));
  });
  view.candidates.sort((a, b) => view.points[b.point].speed.value - view.points[a.point].speed.value);
}

for (const [name, change] of [["one contender", (data) => only(data, ["mujoco-rk4", "null"])], ["a thousand contenders", thousand]]) {
  test(`${name}: the answer is right, in the picker, the grid and the plot`, async () => {
    const file = withData("full", name.replace(/ /g, "-"), change);
    const began = performance.now();
    const { page, trouble } = await openReport(browser, file, { folded: true });
    assert.ok(performance.now() - began < 60000, "the page is there in a minute, on a slow machine");
    const data = dataIn(file);
    const view = data.views.find(({ system }) => system === "planar-chain");
    const best = view.candidates.map(({ point }) => view.points[point]).find(({ worst }) => worst.truth_error.value <= 1e-3);
    assert.equal(best.contender, "mujoco-rk4");
    await page.evaluate(() => { location.hash = "pick&pick=planar-chain&limit=truth_error:0.001"; });
    await page.waitForFunction(() => document.querySelector("#pick-system").value === "planar-chain");
    assert.deepEqual(await page.$eval(".pick-best", (node) => [node.dataset.contenderOf, Number(node.dataset.timestep)]), [best.contender, best.timestep_ms]);
    assert.deepEqual(await page.$eval("#planar-chain .canvas .answer-ring", (node) => [node.dataset.contenderOf, Number(node.dataset.timestep)]), [best.contender, best.timestep_ms]);
    assert.deepEqual(await page.$$eval(".grid-table tbody th", (nodes) => nodes.map((node) => node.textContent)), ["mujoco"]);
    assert.match(await page.$eval(".lead", (node) => node.textContent), new RegExp(`${data.measured.contenders.length} contender`));
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth));
    // without kept states there is the command that draws the answer's motion
    await page.waitForSelector("#planar-chain .replay-panel, #planar-chain .replay-none");
    const none = await page.$$eval("#planar-chain .replay-none code", (nodes) => nodes.map((node) => node.textContent));
    assert.ok(none.every((text) => text.startsWith("assay draw DIR planar-chain --contenders mujoco-rk4 ")), none.join());
    assert.deepEqual(trouble, []);
    await page.close();
  });
}

test("an interrupted run and one of failures alone say what is missing on the first screen", async () => {
  const started = await open("started", { folded: true });
  assert.match(await started.page.$eval("main", (node) => node.innerText), /only reference runs|No cell of this system has been run yet/);
  await started.page.close();
  const failed = await open("failed", { folded: true });
  assert.match(await failed.page.$eval(".masthead", (node) => node.textContent), /none of the \d+ cells has a sound result/);
  const grades = await failed.page.$$eval(".grid-table .grade", (nodes) => nodes.map((node) => node.dataset.grade));
  assert.ok(grades.every((grade) => "F–".includes(grade)), grades.join());
  const plots = await failed.page.$$eval(".card .card-plot", (nodes) => nodes.map((node) => node.textContent));
  assert.ok(plots.every((text) => /^None of [1-9]\d* cells? has a sound result\.$/.test(text)), plots.join());
  assert.match(await failed.page.$eval("#failures .fold-note", (node) => node.textContent), /^(\d+) of \1 cells have no sound result$/);
  await failed.page.close();
});

// ---- the paper's whole programme ----------------------------------------------------------------------------------------

describe("the programme", () => {
  const data = dataOf.bind(null, "programme");
  let page;
  let trouble;

  before(async () => {
    ({ page, trouble } = await open("programme"));
  });
  after(async () => {
    assert.deepEqual(trouble, []);
    await page.close();
  });

  const press = (selector) => page.$eval(selector, (node) => node.click());
  const shownIn = (system) => page.$$eval(`#${system} .series:not(.off)`, (nodes) => nodes.map((node) => node.dataset.contender));

  test("many contenders: the paper's are shown at first, engines can be switched on together", async () => {
    const papers = ["mujoco-euler", "mujoco-euler-dense", "mujoco-rk4", "bullet-si-f64", "bullet-mb", "ode-quick", "physx-d6-pgs", "havok"];
    assert.deepEqual((await shownIn("humanoid")).sort(), [...papers].sort());
    const bars = await page.$$eval("#humanoid .bars .bar", (nodes) => nodes.map((node) => node.dataset.contender));
    assert.deepEqual([...bars].sort(), [...papers].sort());
    const heads = await page.$$eval("#humanoid .legend-engine", (nodes) => nodes.map((node) => node.textContent));
    assert.deepEqual(heads, ["mujoco", "bullet", "ode", "physx", "havok", "jolt", "rapier", "dart", "simbody"]);
    await press("#humanoid .legend-group:nth-of-type(7) .legend-engine");
    assert.ok((await shownIn("humanoid")).includes("jolt-f64"));
    assert.ok((await shownIn("grasp")).includes("jolt-f32"), "other systems follow");
    assert.equal((await page.$$("#humanoid .bars .bar")).length, papers.length + 2);
    await press("#humanoid .legend-group:nth-of-type(7) .legend-engine");
    assert.equal((await shownIn("humanoid")).length, papers.length);
  });

  test("a contender has the same colour in the figures as on the page", async () => {
    const svg = readFileSync(join(work, "programme", "figures", "figure3.svg"), "utf8");
    const drawn = [...svg.matchAll(/rgb\(([\d.]+)%, ?([\d.]+)%, ?([\d.]+)%\)/g)].map((match) => match.slice(1).map((part) => Number(part) * 2.55));
    const looks = await page.evaluate(() => {
      const paint = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
      return [...document.querySelectorAll("#humanoid .series:not(.off)")].map((node) => {
        paint.fillStyle = getComputedStyle(node.querySelector(".line")).stroke;
        paint.fillRect(0, 0, 1, 1);
        return [node.dataset.contender, [...paint.getImageData(0, 0, 1, 1).data].slice(0, 3)];
      });
    });
    assert.ok(looks.length >= 7);
    for (const [contender, color] of looks) {
      if (contender === "mujoco-euler-dense") continue; // not in this figure
      const away = Math.min(...drawn.map((other) => Math.hypot(...other.map((value, index) => value - color[index]))));
      assert.ok(away < 3, `${contender}: ${color} is ${away.toFixed(1)} from the nearest colour of the figure`);
    }
  });

  test("each system has its picture, with as many shapes as its model", async () => {
    for (const picture of data().pictures) {
      const shapes = await page.$$eval(`#${picture.system} .picture .outline`, (nodes) => nodes.length).catch(() => null);
      if (data().systems.find((system) => system.name === picture.system).facts.family) continue;
      if (picture.image) {
        assert.equal(await page.$eval(`#${picture.system} .picture image`, (node) => node.getAttribute("href")), picture.image);
        continue;
      }
      assert.equal(shapes, picture.start.length, picture.system);
      const facts = data().systems.find((system) => system.name === picture.system).facts;
      assert.equal(shapes, facts.shapes - (picture.ground === null ? 0 : 1), `${picture.system}: all shapes but the ground`);
    }
  });

  test("a mark is grey where its point is no candidate by the limits of other values", async () => {
    for (const system of ["humanoid", "grasp"]) {
      const view = data().views.find((one) => one.system === system);
      const own = await page.$eval(`#${system} .segments input:checked`, (node) => node.value);
      const { limits } = view.card.answers.find((one) => Object.keys(one.limits ?? {}).length > 0);
      const others = Object.entries(limits).filter(([name]) => name !== own);
      assert.ok(others.length > 0);
      const marks = await page.$$eval(`#${system} .accuracy .mark[data-timestep]`, (nodes) => nodes.map((node) => ({ contender: node.parentNode.dataset.contender, step: Number(node.dataset.timestep), misses: node.classList.contains("misses"), fill: getComputedStyle(node).fill })));
      for (const { contender, step, misses } of marks) {
        const { worst = {} } = view.points.find((point) => point.contender === contender && point.timestep_ms === step);
        assert.equal(misses, !others.every(([name, most]) => worst[name]?.value <= most), `${contender} at ${step} ms`);
      }
      const grey = new Set(marks.filter(({ misses }) => misses).map(({ fill }) => fill));
      assert.equal(grey.size, 1, "whatever else the marks say");
      assert.ok(marks.every(({ misses, fill }) => misses || !grey.has(fill)));
    }
  });

  test("every measure of a system can be plotted", async () => {
    const choices = (system) => page.$$eval(`#${system} .segments input`, (nodes) => nodes.map((node) => node.value));
    assert.deepEqual(await choices("planar-chain"), ["truth_error", "consistency", "energy_drift", "angular_momentum_drift", "joint_dislocation_max"]);
    assert.deepEqual(await choices("astronaut"), ["consistency", "angular_momentum_drift", "linear_momentum_drift", "joint_dislocation_max", "penetration_max"]);
    assert.deepEqual(await choices("grasp"), ["consistency", "joint_dislocation_max", "limit_violation_max", "penetration_max", "grasp_slip"]);
    for (const name of await choices("grasp")) {
      await chooseMeasure(page, "grasp", name);
      assert.ok((await page.$$("#grasp .series .mark")).length > 50, name);
    }
    await chooseMeasure(page, "grasp", "consistency");
  });

  test("a system that was not timed is drawn over the timestep, without a front", async () => {
    const drawing = "#astronaut-energy svg.accuracy";
    assert.match(await page.$eval(`${drawing} .axis`, (node) => node.textContent), /this system was not timed/);
    assert.equal(await page.$eval(`${drawing} .front-line`, (node) => node.getAttribute("d")), "");
    const places = await page.$$eval('#astronaut-energy .accuracy .series[data-contender="havok"] .mark', (nodes) =>
      nodes.map((node) => [Number(node.dataset.timestep), Number(/translate\(([-\d.]+),/.exec(node.getAttribute("transform"))[1])]),
    );
    assert.equal(places.length, 12);
    const said = await page.$eval("#astronaut-energy .front-panel", (node) => node.textContent);
    assert.match(said, /was not timed/);
    const octave = (places[11][1] - places[0][1]) / 11;
    places.forEach(([step, x], index) => assert.ok(Math.abs(x - places[0][1] - index * octave) < 0.5, `${step} ms`));
  });

  test("a partial curve ends at the mark of its outcome", async () => {
    const ends = await page.$$eval('#grasp .series[data-contender="ode-quick"] .failed', (nodes) => nodes.map((node) => [Number(node.dataset.timestep), node.dataset.outcome]));
    assert.deepEqual(ends, [2, 4, 8, 16, 32].map((step) => [step, "diverged"]));
    const line = await page.$eval('#grasp .series[data-contender="ode-quick"] .to-failure', (node) => [node.getAttribute("x2"), node.getAttribute("y2")].join());
    const mark = await page.$eval('#grasp .series[data-contender="ode-quick"] .failed', (node) => /translate\((.*)\)/.exec(node.getAttribute("transform"))[1]);
    assert.equal(line, mark);
  });

  test("a click or Enter on a point opens its details: values, reason, settings, samples, command, place for the replay", async () => {
    const at = await marker(page, "humanoid", "mujoco-rk4", 2);
    await page.mouse.click(at.x, at.y);
    const panel = ".drawer";
    const place = () => page.$eval(panel, (node) => `${node.querySelector("h2").textContent.trim()}, ${node.querySelector(".drawer-place").textContent}`);
    assert.equal(await place(), "mujoco-rk4, 2 ms on humanoid");
    const after = await page.$eval('#humanoid .series[data-contender="mujoco-rk4"] [data-timestep="2"]', (node) => node.getBoundingClientRect().top + node.getBoundingClientRect().height / 2);
    assert.ok(Math.abs(after - at.y) < 1, `opening the details moved the plot by ${after - at.y} px`);
    const cells = data().cells.filter((cell) => cell.system === "humanoid" && cell.contender === "mujoco-rk4" && cell.timestep_ms === 2);
    const names = cells.flatMap((cell) => cell.values.map((value) => value.name));
    assert.deepEqual(await page.$$eval(`${panel} [data-value]`, (nodes) => nodes.map((node) => node.dataset.value)), names);
    assert.match(await page.$eval(panel, (node) => node.innerText), /Runge-Kutta 4/);
    const slot = await page.$eval(`${panel} [data-replay]`, (node) => ({ ...node.dataset }));
    assert.deepEqual([slot.system, slot.contender, slot.timestep], ["humanoid", "mujoco-rk4", "2"]);

    const bins = await page.$$eval(`${panel} [data-samples="step_time_us"] .bin`, (nodes) => nodes.map((node) => Number(node.dataset.count)));
    const stored = cells.flatMap((cell) => cell.samples ?? []).find((samples) => samples.name === "step_time_us");
    assert.deepEqual(bins, stored.bins);
    assert.equal(bins.reduce((sum, count) => sum + count, 0) + stored.above, stored.count);
    assert.equal(stored.count, 400);
    assert.ok(stored.above > 0 && stored.above < 8, "the spikes are told as a number");
    assert.match(await page.$eval(`${panel} [data-samples="piece_error_m"]`, (node) => node.getAttribute("aria-label")), /10 samples/);

    assert.equal(
      await page.$eval(`${panel} .command`, (node) => node.textContent),
      "assay simulate humanoid --engine mujoco-rk4 --timestep 2 --duration 5.024 --sample 32 --out humanoid_mujoco-rk4_2ms.csv",
    );
    assert.equal((await page.$$("#humanoid .overlay .chosen")).length, 1);
    await page.mouse.move(2, 2);

    await page.$eval("#grasp svg.accuracy", (node) => node.focus());
    for (const key of ["ArrowRight", "ArrowRight", "Enter"]) await page.keyboard.press(key);
    assert.equal(await place(), "mujoco-euler, 1/16 ms on grasp");
    assert.ok(await page.evaluate(() => document.activeElement.matches(".drawer .close")), "the keyboard goes into the drawer");
    await page.keyboard.press("Escape");
    assert.ok(await page.$eval(panel, (node) => node.hidden));
    assert.ok(await page.evaluate(() => document.activeElement.matches("#grasp svg.accuracy")), "and back to where it was");
  });

  test("a drop, a divergence and a leak can each be run again", async () => {
    const command = () => page.$eval(".drawer .command", (node) => node.textContent);
    await press('#grasp .grip-cell[data-contender-of="physx-d6-pgs"][data-timestep="4"]');
    assert.match(await page.$eval(".drawer", (node) => node.innerText), /Drop time/);
    assert.match(await command(), /^assay simulate grasp --engine physx-d6-pgs --timestep 4 --duration 5\.024 --sample 32 --out /);
    await page.$$eval("#failures .failure-list tbody tr", (rows) => [...rows].find((row) => /ode-quick\s+grasp\s+grasp/.test(row.innerText)).querySelector("button.link").click());
    assert.match(await page.$eval(".drawer .outcomes", (node) => node.innerText), /grasp: diverged, by 1\.3 s/);
    assert.match(await command(), /--engine ode-quick --timestep 2 /);
    await press("#astronaut-energy .damping-panel tbody tr:nth-child(19) td:last-child button");
    assert.match(await command(), /--engine havok --timestep 32 .*--gravity off --out/);
    await press(".drawer .close");
  });

  test("the commands are ones that the program takes", { skip: !process.env.ASSAY || !existsSync(process.env.ASSAY) }, async () => {
    await press('#grasp .grip-cell[data-contender-of="mujoco-euler"][data-timestep="16"]');
    const text = await page.$eval(".drawer .command", (node) => node.textContent);
    const [program, ...words] = text.split(" ");
    assert.equal(program, "assay");
    // Short enough for a test; whether the command is understood does not depend on it.
    words[words.indexOf("--duration") + 1] = "0.032";
    words[words.indexOf("--out") + 1] = join(work, "run.csv");
    execFileSync(process.env.ASSAY, words, { stdio: "pipe" });
    assert.match(readFileSync(join(work, "run.csv"), "utf8"), /^time,body,x,y,z/);
    await press(".drawer .close");
  });

  test("the grasp table shows every cell, holes too, and the largest timesteps", async () => {
    const grips = await page.$$eval("#grasp .grip-cell", (nodes) => nodes.map((node) => [node.dataset.contenderOf, Number(node.dataset.timestep), node.dataset.grip]));
    const cells = data().cells.filter((cell) => cell.measure === "grasp");
    assert.equal(grips.length, cells.length);
    for (const [contender, step, grip] of grips) {
      const cell = cells.find((one) => one.contender === contender && one.timestep_ms === step);
      const held = cell.values.find((value) => value.name === "grasp_held")?.value;
      assert.equal(grip, cell.outcome !== "ok" ? "failed" : held === 1 ? "held" : "dropped", `${contender} at ${step} ms`);
    }
    const row = await page.$$eval("#grasp .grasp-panel tbody tr", (rows) => [...rows].find((one) => one.innerText.includes("physx-d6-pgs")).innerText.split(/\s+/).filter(Boolean));
    assert.deepEqual(row, ["physx-d6-pgs", "2", "1/4"], "the hole at 1/2 ms");
  });

  test("agreement is a matrix with a time slider", async () => {
    const [agreement] = data().agreement.filter((one) => one.system === "planar-chain");
    const names = agreement.contenders;
    const index = (i, j) => i * names.length - (i * (i + 1)) / 2 + (j - i - 1);
    const shown = (i, j) => page.$eval(`#planar-chain .agreement [data-pair="${i} ${j}"]`, (node) => ({ distance: Number(node.dataset.distance), fill: getComputedStyle(node).fill }));
    const slide = (step) =>
      page.$eval("#planar-chain .agreement-panel input", (node, value) => {
        node.value = value;
        node.dispatchEvent(new Event("input"));
      }, step); // prettier-ignore
    assert.equal((await page.$$("#planar-chain .agreement [data-pair]")).length, names.length ** 2);
    const near = [0, 1];
    const far = [0, names.indexOf("ode-quick")];
    for (const step of [0, 9, agreement.time_s.length - 1]) {
      await slide(step);
      for (const [i, j] of [near, far]) {
        assert.equal((await shown(i, j)).distance, agreement.distance_m[index(i, j)][step]);
        assert.equal((await shown(j, i)).distance, agreement.distance_m[index(i, j)][step], "the matrix is symmetric");
      }
    }
    await slide(16);
    assert.notEqual((await shown(...near)).fill, (await shown(...far)).fill);
    assert.match(await page.$eval("#planar-chain .agreement-panel output", (node) => node.textContent), /^4\.93 of 10\.0 s$/);
    await page.$eval("#planar-chain svg.agreement", (node) => node.focus());
    await page.keyboard.press("ArrowRight");
    assert.match(await page.$eval(".tooltip", (node) => node.innerText), /mujoco-euler and mujoco-rk4[^]*farther than 1 mm/);
    await page.keyboard.press("Enter");
    const lines = await page.$$eval("#planar-chain .distances .series", (nodes) => nodes.map((node) => node.dataset.contender));
    assert.ok(lines.includes("ode-quick") && !lines.includes("mujoco-euler") && !lines.includes("dart"), "all that are shown but the one itself");
    const clock = await page.$eval("#planar-chain .distances .clock", (node) => Number(node.getAttribute("x1")));
    await slide(17);
    assert.ok((await page.$eval("#planar-chain .distances .clock", (node) => Number(node.getAttribute("x1")))) > clock, "the clock follows the slider");
    await page.keyboard.press("Escape");
  });

  describe("at 1280 px, with other rates of hidden damping", () => {
    let rates;
    let fresh;

    before(async () => {
      const single = data().contenders.find((one) => one.capabilities.precision === "single").name;
      const double = data().contenders.find((one) => one.capabilities.precision === "double").name;
      // contender, timestep, rate, interval, what is to be seen
      rates = [
        [double, 1, 2e-13, [1.9e-13, 2.1e-13], "rounding"], [double, 1 / 64, -1.3e-11, [-1.4e-11, -1.2e-11], "rounding"],
        [double, 2, -1e-3, [-2e-3, -1e-4], "gains"], [double, 4, -1e-3, [-2e-3, 1e-4], "none"], [double, 8, 3e-13, [2e-13, 4e-13], "loses"],
        [single, 1, -1.1e-4, [-1.2e-4, -1e-4], "rounding"], [single, 8, -1.1e-4, [-1.2e-4, -1e-4], "gains"],
      ]; // prettier-ignore
      const file = withData("programme", "damping", (changed) => {
        for (const [contender, step, rate, [low, high]] of rates) {
          for (const cell of changed.cells) {
            if (cell.system !== "astronaut-energy" || cell.contender !== contender || cell.timestep_ms !== step) continue;
            for (const value of cell.values) if (value.name === "damping_rate") Object.assign(value, { value: rate, low, high });
          }
        }
      });
      ({ page: fresh } = await openReport(browser, file, { width: 1280 }));
    });
    after(() => fresh.close());

    test("agreement begins where half of the pairs have parted, says so, and no name is cut", async () => {
      for (const agreement of data().agreement) {
        const parted = agreement.parting_s.filter((time) => time !== null).sort((a, b) => a - b);
        const middle = parted[Math.floor(parted.length / 2)];
        const found = agreement.time_s.findIndex((time) => time >= middle);
        const place = found < 0 ? agreement.time_s.length - 1 : Math.max(1, found);
        const panel = `#${agreement.system} .agreement-panel`;
        assert.equal(await fresh.$eval(`${panel} input`, (node) => Number(node.value)), place, agreement.system);
        const said = await fresh.$eval(`${panel} output`, (node) => node.textContent);
        assert.ok(Math.abs(Number.parseFloat(said) - agreement.time_s[place]) <= 0.01 * agreement.time_s[place], said);
        assert.ok((await fresh.$eval(`${panel} figcaption`, (node) => node.textContent)).includes("The slider begins at"));
        const cut = await fresh.$eval(panel, (node) => {
          const box = node.querySelector(".canvas").getBoundingClientRect();
          return [...node.querySelectorAll(".agreement .name")].filter((name) => {
            const { left, right, top } = name.getBoundingClientRect();
            return left < box.left - 1 || right > box.right + 1 || top < box.top - 1;
          }).map((name) => name.textContent); // prettier-ignore
        });
        assert.deepEqual(cut, [], agreement.system);
      }
    });

    test("what rounding could make is about 0, only what gains more than that is bold", async () => {
      const panel = "#astronaut-energy .damping-panel";
      const [head, ...rows] = await fresh.$$eval(`${panel} tr`, (nodes) =>
        nodes.map((row) => [...row.cells].map((cell) => ({ text: cell.innerText.trim(), kind: cell.querySelector("button")?.classList[2], weight: getComputedStyle(cell.querySelector(".number") ?? cell).fontWeight }))),
      );
      for (const [contender, step, , , kind] of rates) {
        const written = step < 1 ? `1/${1 / step}` : String(step);
        const shown = rows.find(([name]) => name.text === contender)[head.findIndex(({ text }) => text.split(/\s/)[0] === written)];
        assert.equal(shown.kind, kind, `${contender} at ${step} ms`);
        assert.equal(shown.text === "≈ 0", kind === "rounding", shown.text);
        assert.equal(Number(shown.weight) > 600, kind === "gains", `${contender} at ${step} ms: ${shown.weight}`);
      }
      const over = await fresh.$eval(`${panel} .scroll`, (node) => node.scrollWidth - node.clientWidth);
      assert.ok(over <= 0, `${over} px are cut at 1280 px`);
    });
  });

  test("at the reference's own timestep stand restart floors, of which none is the best", async () => {
    await page.select("#humanoid .matrix-panel select", "consistency");
    const columns = await page.$$eval("#humanoid .matrix-panel table tr", (rows) =>
      [...rows[0].cells].slice(1).map((head, index) => [head.innerText.trim(), [...rows].slice(1).filter((row) => row.cells[index + 1]?.querySelector(".best")).length]),
    );
    assert.equal(columns[0][0].replace(/\s.*/, ""), "1/64");
    assert.equal(columns[0][1], 0, "a restart floor is bold");
    for (const [step, bold] of columns.slice(1)) assert.ok(bold > 0, `nothing is bold at ${step}`);
    assert.match(await page.$eval("#humanoid .matrix-panel .table-text", (node) => node.textContent), /At 1\/64 ms the table shows restart floors/);
  });

  test("values that an engine does not give are said to be that, and are no 0", async () => {
    const columns = async (value) => {
      await page.select("#humanoid .matrix-panel select", value);
      return page.$$eval("#humanoid .matrix-panel tbody tr", (rows) => Object.fromEntries([...rows].map((row) => [row.cells[0].innerText.trim(), row.cells[1].innerText.trim()])));
    };
    const cone = await columns("cone_violation"), normal = await columns("signorini_residual");
    assert.equal(cone["havok"], "not given");
    assert.equal(cone["physx-d6-pgs"], "not given");
    assert.match(cone["ode-quick"], /^\d.*[1-9]/);
    assert.equal(normal["havok"], "not given");
    assert.match(normal["physx-d6-pgs"], /m\/s/);
  });

  test("hidden damping is listed with what it says", async () => {
    const at = await page.$$eval("#astronaut-energy .damping-panel tbody tr", (rows) => [...rows].map((row) => [row.cells[0].innerText.trim(), row.cells[7].innerText.trim()]));
    assert.equal(at.length, 26);
    assert.equal(at.find(([name]) => name === "havok")[1], "0.18");
    assert.equal(at.find(([name]) => name === "ode-quick")[1], "0.020");
  });

  test("scaling: times lie where size and time put them; powers stand beside", async () => {
    const points = await page.$$eval(`#scaling .series .mark`, (nodes) =>
      nodes.map((node) => {
        const [, x, y] = /translate\(([-\d.]+),([-\d.]+)\)/.exec(node.getAttribute("transform"));
        return { contender: node.parentNode.dataset.contender, free: node.parentNode.classList.contains("free"), size: Number(node.dataset.size), seconds: Number(node.dataset.seconds), x: Number(x), y: Number(y) };
      }),
    );
    // Of the paper's contenders bullet-mb takes no part.
    assert.equal(points.length, 7 * 20 - 1, "every cell but the one that ran out of time");
    for (const point of points) {
      assert.equal(point.seconds, valueOf(data(), `capsules-${point.size}${point.free ? "-free" : ""}`, point.contender, 10, "run_time"));
    }
    const [a, b] = [points[0], points.find((point) => point.size === 250 && point.contender === "havok")];
    for (const point of points) {
      const along = (key, first, second, value) => first[key] + ((Math.log(value(point)) - Math.log(value(first))) / (Math.log(value(second)) - Math.log(value(first)))) * (second[key] - first[key]);
      assert.ok(Math.abs(point.x - along("x", a, b, (p) => p.size)) < 0.5);
      assert.ok(Math.abs(point.y - along("y", a, b, (p) => p.seconds)) < 0.5);
    }
    const failed = await page.$$eval("#scaling .failed", (nodes) => nodes.map((node) => `${node.parentNode.dataset.contender} ${node.dataset.size}`));
    assert.deepEqual(failed, ["mujoco-euler-dense 250"]);
    const dense = valueOf(data(), "capsules-225", "mujoco-euler-dense", 10, "scaling_exponent");
    const row = await page.$$eval("#scaling tbody tr", (rows) => [...rows].find((one) => one.innerText.includes("mujoco-euler-dense")).cells[1].innerText);
    assert.ok(row.startsWith(dense.toFixed(2)), row);
    await press('#scaling button[data-contender="mujoco-euler-dense"]');
    assert.equal((await page.$$("#scaling .failed")).length, 0, "its lines are hidden, its failure too");
    await press('#scaling button[data-contender="mujoco-euler-dense"]');
  });

  test("claims say what is true now, with their verdicts and figures", async () => {
    const claims = data().claims;
    assert.equal(claims.length, 17);
    const shown = await page.$$eval("#claims .claim", (nodes) => nodes.map((node) => [Number(node.dataset.claim), node.querySelector(".verdict").classList[1], node.querySelectorAll(".claim-figures tbody tr").length]));
    assert.deepEqual(shown, claims.map((claim) => [claim.number, claim.verdict, claim.figures.length]));
    assert.ok(new Set(shown.map(([, verdict]) => verdict)).size >= 3, "the made-up results have several verdicts");
    const texts = await page.$$eval("#claims .claim", (nodes) => nodes.map((node) => node.textContent));
    claims.forEach((claim, index) => {
      for (const part of [claim.title, claim.statement, claim.threshold ?? "", claim.paper]) assert.ok(texts[index].includes(part), part);
      if (claim.now) assert.ok(texts[index].includes(claim.now.slice(0, 12)), claim.now);
    });
    const open = (number) => page.$eval(`.claim[data-claim="${number}"] details`, (node) => node.open);
    await page.$eval('.claim[data-claim="3"] summary', (node) => node.click());
    assert.ok(await open(3));
    await page.waitForFunction(() => /claim=3/.test(location.hash));
  });

  test("the picker takes several limits, names what is not told apart and what was excluded", async () => {
    await page.evaluate(() => { location.hash = "pick&pick=humanoid&limit=consistency:0.002,penetration_max:0.02&realtime=5"; });
    await page.waitForFunction(() => document.querySelector("#pick-realtime").value === "5");
    const view = data().views.find((one) => one.system === "humanoid");
    const worst = (point) => view.points[point].worst ?? {};
    const passing = view.candidates.filter(({ point }) => worst(point).consistency?.value <= 0.002 && worst(point).penetration_max?.value <= 0.02 && view.points[point].speed.value >= 5);
    assert.ok(passing.length > 3);
    const first = passing.filter((one, index) => passing.findIndex((other) => view.points[other.point].contender === view.points[one.point].contender) === index).map(({ point }) => view.points[point]);
    const best = await page.$eval(".pick-best", (node) => [node.dataset.contenderOf, Number(node.dataset.timestep)]);
    assert.deepEqual(best, [first[0].contender, first[0].timestep_ms]);
    assert.deepEqual(await page.$$eval(".pick-answer .pick-each tbody tr", (rows) => rows.map((row) => row.cells[0].textContent)), first.map((point) => point.contender));
    assert.deepEqual(await page.$$eval(".pick-limit .pick-error", (nodes) => nodes.map((node) => node.value)), ["2", "20"], "in mm");
    assert.match(await page.$eval(".pick-facts", (node) => node.innerText), /margin /);
    const excluded = await page.$eval(".pick-excluded summary", (node) => node.textContent);
    const contendersOf = (candidates) => new Set(candidates.map(({ point }) => view.points[point].contender));
    const within = contendersOf(passing);
    const beyond = new Set([...contendersOf(view.candidates.filter(({ point }) => worst(point).consistency && worst(point).penetration_max))].filter((one) => !within.has(one)));
    assert.ok(beyond.size > 0);
    const unmeasured = view.candidates.filter(({ point }) => !worst(point).consistency || !worst(point).penetration_max).length;
    const without = view.left_out.reduce((sum, one) => sum + one.steps.length, 0);
    assert.ok(unmeasured > 0 && excluded.includes(`(${without + unmeasured + beyond.size} points)`), excluded);
    assert.equal(await page.$$eval(".pick-excluded li p", (cells) => cells.filter((cell) => cell.textContent.startsWith("beyond the limits")).length), beyond.size);
    await page.$eval(".pick-limit:nth-child(2) .pick-remove", (node) => node.click());
    await page.waitForFunction(() => !/penetration/.test(location.hash));
    // Nothing is that good: the smallest there is, is named.
    await page.$eval(".pick-error", (node) => {
      node.value = "1e-9";
      node.dispatchEvent(new Event("input"));
    });
    assert.match(await page.$eval(".pick-none", (node) => node.textContent), /no contender on humanoid has .* within .*, at least 5.*× real time: relax the /);
    // What it says to relax can be chosen, and answers.
    const relax = await page.$eval(".pick-none li", (node) => node.textContent.replaceAll("\u00a0", " "));
    await page.$eval(".pick-none li a", (node) => node.click());
    const chosen = await page.$eval(".pick-best", (node) => [node.dataset.contenderOf, node.dataset.timestep]);
    assert.ok(relax.includes(`: ${chosen[0]} at `), relax);
    assert.equal(`relax the ${await page.$eval(".pick-facts [data-label]", (node) => /^asked (.*?) within/.exec(node.innerText)[1])} to `, /^.*? to /.exec(relax)[0]);
  });

  test("the picker's first question has what every question has of contacts, and another system keeps what was typed", async () => {
    const limitsOf = () => page.evaluate(() => Object.fromEntries([...document.querySelectorAll(".pick-limit")].map((row) => [row.querySelector(".pick-measure").value, Number(row.querySelector(".pick-error").value) * Number(row.querySelector(".pick-unit").value)])));
    const usual = (system) => data().views.find((view) => view.system === system).usual;
    await page.evaluate(() => { location.hash = "pick&pick=humanoid&limit=consistency:0.001,penetration_max:0.005"; });
    await page.waitForFunction(() => document.querySelectorAll(".pick-limit").length === 2 && document.querySelector("#pick-system").value === "humanoid");
    assert.deepEqual(usual("humanoid").map(({ option }) => option), ["penetration"]);
    assert.match(await page.$eval(".pick-answer", (node) => node.innerText), /penetration within 5\smm \(default\)/);
    const marked = () => page.$$eval(".pick-default", (nodes) => nodes.map((node) => node.textContent));
    assert.deepEqual(await marked(), ["default", "default"]);
    assert.match(await page.$eval(".pick-grounds", (node) => node.textContent), /did not store the penetration beyond/);
    await page.$eval(".pick-limit:nth-child(1) .pick-error", (node) => {
      node.value = "3";
      node.dispatchEvent(new Event("input"));
    });
    assert.deepEqual(await marked(), ["", "default"]);
    await page.select("#pick-system", "grasp");
    const near = (limits) => Object.fromEntries(Object.entries(limits).map(([name, largest]) => [name, Number(largest.toPrecision(6))]));
    assert.deepEqual(near(await limitsOf()), { consistency: 0.003, penetration_max: 0.005, grasp_slip: 0.005 });
    await page.$eval(".pick-limit:nth-child(3) .pick-remove", (node) => node.click());
    await page.select("#pick-system", "planar-chain");
    const main = data().views.find((view) => view.system === "planar-chain").main;
    assert.deepEqual(near(await limitsOf()), { [main]: 0.003 }, "the error by which this system is judged");
    await page.select("#pick-system", "grasp");
    assert.deepEqual(near(await limitsOf()), { consistency: 0.003, penetration_max: 0.005 }, "what was taken away stays away");
  });

  test("values can be filtered, sorted and taken away", async () => {
    const total = data().cells.reduce((sum, cell) => sum + Math.max(cell.values.length, cell.outcome === "ok" ? 0 : 1), 0);
    const count = () => page.$eval("#values .sub", (node) => node.textContent);
    assert.match(await count(), new RegExp(`^${total} of ${total} values, the first 30 shown`));
    assert.equal((await page.$$("#values tbody tr")).length, 30);
    await page.select('#values [data-filter="system"]', "grasp");
    await page.select('#values [data-filter="value"]', "drop_time");
    const drops = data().cells.flatMap((cell) => cell.values.filter((value) => value.name === "drop_time"));
    assert.match(await count(), new RegExp(`^${drops.length} of `));
    const figures = () => page.$$eval("#values tbody tr", (rows) => rows.map((row) => row.cells[4].textContent));
    await page.$$eval("#values thead .sort", (nodes) => nodes[4].click());
    const ascending = await figures();
    assert.equal(Number.parseFloat(ascending[0]), Number((Math.min(...drops.map((value) => value.value)) * 1e3).toPrecision(3)), "in ms");
    await page.$$eval("#values thead .sort", (nodes) => nodes[4].click());
    assert.notEqual((await figures())[0], ascending[0]);

    const save = (format) => `#values [data-format="${format}"]`;
    const [csv, json] = await downloads(page, [save("csv"), save("json")]);
    const lines = csv.trim().split("\n");
    assert.equal(lines[0], "system,contender,timestep_ms,measure,value,unit,outcome,low,high");
    assert.equal(lines.length - 1, drops.length);
    const sum = (list) => list.reduce((total, value) => total + value, 0);
    const expected = sum(drops.map((value) => value.value));
    assert.ok(Math.abs(sum(lines.slice(1).map((line) => Number(line.split(",")[4]))) - expected) < 1e-9 * expected);
    assert.deepEqual(JSON.parse(json).map((row) => row.value).sort(), drops.map((value) => value.value).sort());
    await page.type("#values input", "havok penetration");
    assert.match(await count(), /^0 of /);
  });

  test("the figures of the paper stand beside the report and show what was measured", async () => {
    for (const [name, parts] of [["figure3", 4], ["figure4", 5], ["figure5", 2], ["grasp-table", 1]]) {
      const svg = readFileSync(join(work, "programme", "figures", `${name}.svg`), "utf8");
      const pdf = readFileSync(join(work, "programme", "figures", `${name}.pdf`));
      assert.equal(pdf.toString("latin1", 0, 5), "%PDF-");
      const figure = await browser.newPage();
      await figure.goto(pathToFileURL(join(work, "programme", "figures", `${name}.svg`)).href);
      const { width, height, inks } = await figure.evaluate(() => ({
        width: document.documentElement.width.baseVal.value,
        height: document.documentElement.height.baseVal.value,
        inks: [...document.querySelectorAll("path")].map((node) => node.getAttribute("style") ?? node.getAttribute("fill") ?? node.getAttribute("stroke") ?? ""),
      }));
      // the contender's colour, as on the page; figure 5 has MuJoCo's solvers for many bodies
      const contender = name === "figure5" ? "mujoco-euler-cg" : "mujoco-euler";
      const colour = data().looks[contender].light.match(/[0-9a-f]{2}/gi).map((part) => (100 * parseInt(part, 16)) / 255);
      const isIts = (ink) => {
        const parts = (/rgb\(([\d.]+)%, ?([\d.]+)%, ?([\d.]+)%\)/.exec(ink) ?? []).slice(1).map(Number);
        return parts.length === 3 && parts.every((part, index) => Math.abs(part - colour[index]) < 0.01);
      };
      const marks = inks.filter(isIts).length;
      await figure.close();
      assert.ok(Math.abs(width - (516 * 96) / 72) < 1 && height > 100, `${name}: ${width} x ${height}`);
      assert.ok(marks >= parts, `${name}: ${marks} marks and lines of ${contender}`);
      assert.ok(svg.length < 1.5e6 && pdf.length < 1e6);
    }
  });
});

test("the same database gives the same bytes", () => {
  const first = readFileSync(join(work, "full", "report.html"));
  execFileSync(process.env.ASSAY_FIXTURE, ["full", join(work, "again")]);
  assert.ok(first.equals(readFileSync(join(work, "again", "report.html"))));
  for (const figure of ["figure3.svg", "figure3.pdf", "figure4.svg"]) {
    const path = (kind) => join(work, kind, "figures", figure);
    assert.ok(readFileSync(path("full")).equals(readFileSync(path("again"))), figure);
  }
});
