// Opens a report in the browser for a test, and reads what is in it.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

// Opens what the page folds into lines, and waits until it is drawn.
export async function unfold(page) {
  await page.evaluate(async () => {
    for (const node of document.querySelectorAll("details.fold, details.pick-full")) node.open = true;
    for (let i = 0; i < 3; i += 1) await new Promise((done) => requestAnimationFrame(done));
  });
}

// `trouble` collects whatever a report must never do. `without` is a kind of canvas that the browser shall not have. `folded`
// leaves the page as a reader finds it.
export async function openReport(browser, file, { width = 1400, height = 900, dark = false, phone = false, without = "", folded = false } = {}) {
  const page = await browser.newPage();
  // A slow machine is no fault of the page: ctest ends what hangs.
  page.setDefaultTimeout(0);
  const trouble = [];
  page.on("console", (message) => {
    if (["error", "warning", "warn"].includes(message.type())) trouble.push(`console: ${message.text()}`);
  });
  page.on("pageerror", (error) => trouble.push(`exception: ${error.message}`));
  page.on("request", (request) => {
    if (!request.url().startsWith("data:") && !request.isNavigationRequest()) trouble.push(`request: ${request.url()}`);
  });
  await page.setViewport({ width, height, isMobile: phone, hasTouch: phone });
  // A scroll that goes on would carry what is looked at away from the pointer.
  await page.emulateMediaFeatures([
    { name: "prefers-color-scheme", value: dark ? "dark" : "light" },
    { name: "prefers-reduced-motion", value: "reduce" },
  ]);
  if (without) {
    await page.evaluateOnNewDocument((kind) => {
      const get = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (asked, ...rest) {
        return asked === kind ? null : get.call(this, asked, ...rest);
      };
    }, without);
  }
  await page.goto(pathToFileURL(file).href, { waitUntil: "load" });
  await page.waitForSelector("body[data-ready]");
  if (!folded) await unfold(page);
  return { page, trouble };
}

// The texts of the files that the page offers when these buttons are clicked, in their order.
export function downloads(page, selectors) {
  return page.evaluate(async (buttons) => {
    const kept = [];
    const make = URL.createObjectURL;
    URL.createObjectURL = (blob) => {
      kept.push(blob);
      return make.call(URL, blob);
    };
    for (const button of buttons) document.querySelector(button).click();
    URL.createObjectURL = make;
    return Promise.all(kept.map((blob) => blob.text()));
  }, selectors);
}

const element = (name) => `<script type="application/json" ${name}>`;

function jsonIn(html, name) {
  const from = html.indexOf(element(name));
  return from < 0 ? null : JSON.parse(html.slice(from + element(name).length, html.indexOf("</script>", from)));
}

// What the page is made of; each system's cells are an element of their own.
export function dataIn(file) {
  const html = readFileSync(file, "utf8");
  const data = jsonIn(html, 'id="assay-data"');
  data.cells = data.systems.flatMap((_, index) => jsonIn(html, `data-cells="${index}"`) ?? []);
  return data;
}

// `html` with other data, which have the same systems in the same order.
export function withDataIn(html, { cells, ...data }) {
  const put = (name, json) => {
    const from = html.indexOf(element(name));
    if (from < 0) return;
    const text = JSON.stringify(json).replace(/</g, "\\u003c");
    html = html.slice(0, from + element(name).length) + text + html.slice(html.indexOf("</script>", from));
  };
  put('id="assay-data"', data);
  data.systems.forEach((system, index) => put(`data-cells="${index}"`, cells.filter((cell) => cell.system === system.name)));
  return html;
}

export const replaysIn = (file) => jsonIn(readFileSync(file, "utf8"), 'id="assay-replays"');

const axe = readFileSync(createRequire(new URL("../../web/package.json", import.meta.url)).resolve("axe-core/axe.min.js"), "utf8");

// What axe finds in the part of the page at `selector`, or in all of it, a text each. `rules` are the only ones to ask for.
export async function axeFindings(page, selector = "html", rules = null) {
  await page.evaluate(axe);
  return page.evaluate(async (at, only) => {
    const options = { resultTypes: ["violations"], ...(only ? { runOnly: only } : {}) };
    const { violations } = await window.axe.run(at === "html" ? document : document.querySelector(at), options);
    return violations.map(({ id, nodes }) => `${id}: ${nodes.slice(0, 3).map((node) => node.html.slice(0, 120)).join(" | ")}`);
  }, selector, rules); // prettier-ignore
}

// Removes those rows of long tables that hold nothing but what two earlier rows of the table hold, too: elements of the same tags,
// classes, roles and looks. axe takes its time for each of them.
export function keepOneOfEachKind(page) {
  return page.evaluate(() => {
    const kind = (node) => [node.tagName, node.getAttribute("class"), node.getAttribute("role"), node.getAttribute("style"), node.getAttribute("tabindex")].join("|");
    let removed = 0;
    for (const body of document.querySelectorAll("tbody")) {
      const seen = new Map();
      for (const row of [...body.rows]) {
        const kinds = new Set([row, ...row.querySelectorAll(":not([aria-hidden] *)")].map(kind));
        if ([...kinds].every((each) => (seen.get(each) ?? 0) >= 2)) {
          row.remove();
          removed += 1;
        } else {
          for (const each of kinds) seen.set(each, (seen.get(each) ?? 0) + 1);
        }
      }
    }
    return removed;
  });
}
