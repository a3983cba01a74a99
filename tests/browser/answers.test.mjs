// The page's picker says the words of tests/answers/cases.json, as the command does (tests/unit/results/answer_test.cc).
//   ASSAY_FIXTURE       the program browser_fixture
//   ASSAY_ANSWER_CASES  cases.json
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { launch } from "../../web/browser.mjs";
import { dataIn, openReport } from "./page.mjs";

const work = mkdtempSync(join(tmpdir(), "assay-answers-"));
const { questions } = JSON.parse(readFileSync(process.env.ASSAY_ANSWER_CASES, "utf8"));
let browser;

before(async () => {
  execFileSync(process.env.ASSAY_FIXTURE, ["answers", join(work, "results")], { stdio: "inherit" });
  browser = await launch();
});

after(async () => {
  await browser?.close();
  rmSync(work, { recursive: true, force: true });
});

// "truth_error_max=2mm" as the page's address has it: "truth_error_max:0.002".
function inAddress(data, limit) {
  const [name, quantity] = limit.split("=");
  const [, number, unit] = /^([\d.e+-]+)(.*)$/.exec(quantity);
  const { scale } = (data.units[data.catalogue.find((info) => info.name === name).unit] ?? []).find((each) => each.text === unit) ?? { scale: 1 };
  return `${name}:${Number((Number(number) * scale).toPrecision(12))}`;
}

// Where a page breaks no line, and where a limit is as it was typed, a number's unit stands apart or not.
const joined = (words) => JSON.parse(JSON.stringify(words).replace(/(\d)[ \u00a0](?=[µmk]?(?:m|s|J|kg)\b)/g, "$1"));

function said() {
  const texts = (selector) => [...document.querySelectorAll(`.pick-answer ${selector}`)];
  const cells = (row) => [...row.cells].map((cell) => cell.textContent);
  const line = (node) => (node.dataset.label ? `${node.dataset.label}: ${node.lastChild.textContent.slice(1)}` : node.textContent);
  const [each] = texts(".pick-each");
  const words = document.querySelector(".pick-none")
    ? { none: document.querySelector(".pick-none").textContent }
    : {
        heading: document.querySelector(".pick-best strong").textContent,
        lines: [...texts(".pick-facts li").map(line), ...[...each.querySelectorAll("p")].map((node) => node.textContent)],
        columns: cells(each.querySelector("thead tr")).slice(0, -1), // the margins are the page's own
        rows: [...each.querySelectorAll("tbody tr")].map((row) => cells(row).slice(0, -1)),
      };
  words.grounds = texts(".pick-grounds p").map((node) => node.textContent);
  words.left_out = texts(".pick-excluded li").map((item) => [...item.children].map((node) => node.textContent));
  return words;
}

test("the page gives every answer in the words of the cases", async () => {
  const file = join(work, "results", "report.html");
  const data = dataIn(file);
  const { page, trouble } = await openReport(browser, file);
  assert.ok(questions.length >= 20, `${questions.length} questions`);
  for (const { name, system = "pile", limits, usual, realtime, expected } of questions) {
    const defaults = data.views.find((view) => view.system === system).usual.filter((one) => usual && !limits.some((limit) => limit.startsWith(`${one.value}=`)));
    const all = [...limits.map((limit) => inAddress(data, limit)), ...defaults.map((one) => `${one.value}:${one.largest}`)];
    const asked = [`limit=${all.join()}`, realtime === null ? "" : `realtime=${Number(realtime)}`];
    const hash = ["pick", `pick=${system}`, ...asked.filter((word) => !word.endsWith("="))].filter(Boolean).join("&");
    await page.evaluate(async (address) => {
      await new Promise((done) => {
        window.addEventListener("hashchange", done, { once: true });
        location.hash = address;
      });
    }, hash);
    assert.deepEqual(joined(await page.evaluate(said)), joined(expected), name);
  }
  assert.deepEqual(trouble, []);
  await page.close();
});
