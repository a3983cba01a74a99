// Takes a picture of a report, as the README shows it. The file's text "Description" has the words of the grid and of the
// question, by which a test knows whether it is current.
//
//   node screenshot.mjs RESULTS_DIR|REPORT.html OUT.png [--width 1400] [--height N] [--dark] [--from SELECTOR]
//                       [--to SELECTOR] [--scale N] [--replay SECONDS]
//
// The picture ends with the first system's plot, after --height pixels, or where the element of --to ends ("main" for
// all). --from starts at an element, "#planar-chain" for one. Replays in the picture stand at --replay, else at 0 s.
import { existsSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { parseArgs } from "node:util";

import { launch } from "./browser.mjs";
import { shownWords, withDescription } from "./picture_text.mjs";

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    width: { type: "string", default: "1400" },
    height: { type: "string" },
    dark: { type: "boolean", default: false },
    from: { type: "string" },
    to: { type: "string" },
    scale: { type: "string", default: "1" },
    replay: { type: "string", default: "0" },
  },
});
const [source, out] = positionals;
if (!source || !out) {
  console.error("usage: node screenshot.mjs RESULTS_DIR|REPORT.html OUT.png [--width N] [--height N] [--dark] [--from SELECTOR] [--to SELECTOR] [--scale N] [--replay SECONDS]");
  process.exit(2);
}
const file = existsSync(source) && statSync(source).isDirectory() ? join(source, "report.html") : source;
if (!existsSync(file)) {
  console.error(`no report at '${file}': make it with \`assay report\``);
  process.exit(2);
}

const browser = await launch({ webgl: true });
try {
  const page = await browser.newPage();
  await page.setViewport({ width: Number(values.width), height: 1000, deviceScaleFactor: Number(values.scale) });
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: values.dark ? "dark" : "light" }]);
  await page.goto(pathToFileURL(resolve(file)).href, { waitUntil: "load" });
  await page.waitForSelector("body[data-ready]");
  // What is sticky would be repeated or cover what is below it.
  await page.addStyleTag({ content: "nav, .legend-box { position: static !important; max-height: none !important; }" });
  const top = values.from ? await page.$eval(values.from, (node) => node.getBoundingClientRect().top + window.scrollY) : 0;
  const whole = await page.evaluate(() => document.documentElement.scrollHeight);
  let bottom = values.height ? top + Number(values.height) : whole;
  if (!values.height) {
    const last = await page.$(values.to ?? ".system .accuracy-panel");
    if (values.to && !last) throw new Error(`the page has no '${values.to}'`);
    if (last) bottom = 16 + (await last.evaluate((node) => node.getBoundingClientRect().bottom + window.scrollY));
  }
  for (const panel of await page.$$(".replay-panel")) {
    const seen = await panel.evaluate((node, from, to) => {
      const box = node.getBoundingClientRect();
      return box.top + window.scrollY < to && box.bottom + window.scrollY > from;
    }, top, bottom); // prettier-ignore
    if (!seen) continue;
    await panel.evaluate((node) => node.scrollIntoView({ block: "center", behavior: "instant" }));
    await page.waitForFunction((node) => "ready" in node.dataset, {}, panel);
    await panel.evaluate(async (node, time) => {
      node.replay.seek(time);
      for (let i = 0; i < 2; i += 1) await new Promise((done) => requestAnimationFrame(done));
    }, Number(values.replay)); // prettier-ignore
  }
  const height = Math.min(bottom, whole) - top;
  await page.screenshot({ path: out, clip: { x: 0, y: top, width: Number(values.width), height }, captureBeyondViewport: true });
  writeFileSync(out, withDescription(readFileSync(out), await shownWords(page)));
} finally {
  await browser.close();
}
