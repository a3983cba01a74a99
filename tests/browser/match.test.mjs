// The page of measured motion, of a real match in headless Chromium: the example's swing in four logs, two contenders.
//   ASSAY  the program assay
import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { fileURLToPath } from "node:url";

import { launch } from "../../web/browser.mjs";
import { axeFindings, dataIn, downloads, openReport, replaysIn, withDataIn } from "./page.mjs";

const example = fileURLToPath(new URL("../../examples/match/", import.meta.url));
const work = mkdtempSync(join(tmpdir(), "assay-match-"));
const report = join(work, "matched", "report.html");
const kPhone = { width: 390, height: 844, phone: true };
const kLogs = 4;
let browser;
let match;
let missing = "";

before(async () => {
  assert.ok(process.env.ASSAY, "ASSAY must name the program");
  const [head, ...rows] = readFileSync(join(example, "swing.csv"), "utf8").trim().split("\n");
  const names = Array.from({ length: kLogs }, (_, log) => {
    const name = join(work, `swing_${log + 1}.csv`);
    writeFileSync(name, [head, ...rows.slice((log * rows.length) / kLogs, ((log + 1) * rows.length) / kLogs)].join("\n"));
    return name;
  });
  writeFileSync(join(work, "match.toml"), "[held_out]\nleave_one_out = true\n[windows]\nreport_s = 0.5\n");
  const words = ["match", join(example, "pendulum.xml"), "--log", ...names, "--config", join(work, "match.toml"), "--contenders", "mujoco-euler,mujoco-rk4", "--fit", "damping", "--fit", "dry_friction", "--budget", "20", "--out", join(work, "matched")];
  const done = spawnSync(process.env.ASSAY, words, { encoding: "utf8" });
  if (/setup match/.test(done.stderr)) missing = "the optimiser is not set up: ./assay setup match";
  else {
    assert.equal(done.status, 0, done.stderr);
    assert.ok(done.stdout.includes(`report: ${report}`), "the command does not say where the report is");
    ({ match } = dataIn(report));
  }
  browser = await launch({ webgl: true });
});

after(async () => {
  await browser?.close();
  rmSync(work, { recursive: true, force: true });
});

const group = (name, options, tests) =>
  describe(name, () => {
    const opened = {};
    before(async () => {
      if (!missing) Object.assign(opened, await openReport(browser, report, options));
    });
    after(async () => {
      if (missing) return;
      assert.deepEqual(opened.trouble, []);
      await opened.page.close();
    });
    const check = (title, body) =>
      test(title, async (context) => {
        if (missing) context.skip(missing);
        else await body(opened.page);
      });
    tests(check);
  });

const text = (page, selector) => page.$eval(selector, (node) => node.textContent);

group("1400x900", { width: 1400, height: 900 }, (check) => {
  check("the answer is the program's, first of all sections", async (page) => {
    assert.equal(await text(page, ".match-answer"), match.answer.replace(/ deg\b/g, "°"));
    assert.ok(match.answer.startsWith(`${match.contenders[0].contender} moves as the robot did within `));
    assert.deepEqual(await page.$$eval("main > *", (nodes) => nodes.map((node) => node.id)), ["answer", "motion", "logs", "replays", "parameters", "checks", "manifest"]);
  });

  check("each contender has an open and a filled mark, an interval and a floor at their values", async (page) => {
    for (const one of match.contenders) {
      const row = `.match-contenders [data-contender="${one.contender}"]`;
      const [hollow, filled] = await page.$$eval(`${row} .mark`, (nodes) => nodes.map((node) => [node.classList.contains("hollow"), Number(/translate\(([\d.]+)/.exec(node.getAttribute("transform"))[1])]));
      assert.ok(hollow[0] && !filled[0]);
      assert.equal(Math.sign(hollow[1] - filled[1]), Math.sign(one.untuned_score.value - one.score.value));
      const floor = await page.$eval(`${row} .match-floor`, (node) => Number(node.getAttribute("x1")));
      assert.equal(Math.sign(floor - filled[1]), Math.sign(one.floor_score - one.score.value));
    }
    const rows = await page.$$eval("#answer tbody tr", (nodes) => nodes.map((node) => node.textContent));
    assert.equal(rows.length, 2);
    assert.ok(rows[0].startsWith(match.contenders[0].contender) && rows[0].includes("best"), rows[0]);
  });

  check("measured and simulated motion are drawn, and what is saved is what was kept", async (page) => {
    const [log] = match.motion;
    assert.ok(log.roles.includes("worst"));
    const shown = await page.$$eval(".motion-plot .series", (nodes) => nodes.map((node) => node.dataset.contender));
    const best = match.contenders[0].contender;
    assert.deepEqual(shown, [best, `${best} untuned`, match.contenders[1].contender]);
    const [csv] = await downloads(page, ['.motion-panel [data-save="csv"]']);
    const rows = csv.trim().split("\n").slice(1).map((line) => line.split(",").map(Number)); // prettier-ignore
    assert.equal(rows.length, log.time_s.length);
    for (const at of [0, Math.floor(rows.length / 2), rows.length - 1]) {
      assert.equal(rows[at][0], log.time_s[at]);
      assert.ok(Math.abs(rows[at][1] - (log.runs[0].values[0][at] * 180) / Math.PI) < 1e-9);
    }
    const button = `.motion-panel .legend-item[data-contender="${match.contenders[1].contender} untuned"]`;
    await page.$eval(button, (node) => node.click());
    assert.equal((await page.$$(".motion-plot .series")).length, 4);
    await page.$eval(button, (node) => node.click());
    await page.select('select[aria-label="Log"]', "1");
    assert.ok((await page.$eval(".motion-plot", (node) => node.getAttribute("aria-label"))).includes(match.motion[1].log));
  });

  check("each held-out log has a row with its errors", async (page) => {
    const names = await page.$$eval(".match-logs .match-name", (nodes) => nodes.map((node) => node.textContent));
    assert.deepEqual([...names].sort(), [...match.held_out].sort());
    const best = match.logs.find((one) => one.contender === match.contenders[0].contender).fitted.joints_deg;
    const errors = names.map((name) => best[match.held_out.indexOf(name)]);
    assert.deepEqual(errors, [...errors].sort((a, b) => b - a), "the worst log comes first");
  });

  check("what fits are worth at other timesteps stands by contender", async (page) => {
    const frame = '[aria-label="Errors of fitted contenders by timestep"]';
    const steps = match.contenders[0].timesteps.map(({ timestep_ms }) => timestep_ms);
    assert.deepEqual(steps, [0.5, 1, 2, 4, 8]);
    assert.deepEqual(await page.$$eval(`${frame} thead th`, (nodes) => nodes.slice(1).map((node) => node.textContent)), ["1/2 ms", "1 ms", "2 ms", "4 ms", "8 ms"]);
    const rows = await page.$$eval(`${frame} tbody tr`, (nodes) => nodes.map((row) => [...row.querySelectorAll("td")].map((node) => parseFloat(node.textContent))));
    for (const [index, one] of match.contenders.entries()) {
      for (const [at, { held_out }] of one.timesteps.entries()) assert.ok(Math.abs(rows[index][at] - held_out.joints_deg) <= 5e-3 * held_out.joints_deg, `${rows[index]}`);
    }
  });

  check("the replay has the measured motion among the simulated ones, on one clock", async (page) => {
    const replays = replaysIn(report);
    const log = match.motion.find((one) => one.roles.includes("worst"));
    const replay = replays.find((one) => one.system === log.log);
    assert.equal(replay.runs[0].contender, "measured");
    const panel = `.replay-panel[data-system="${log.log}"]`;
    await page.$eval(panel, (node) => node.scrollIntoView({ block: "center", behavior: "instant" }));
    await page.waitForSelector(`${panel}[data-ready]`);
    const shown = new Set(await page.$$eval(`${panel} .replay-distance [data-contender]`, (nodes) => nodes.map((node) => node.dataset.contender)));
    const far = replay.runs.filter((run) => shown.has(run.contender)).map((run) => run.distance_m);
    const frames = far[0].map((_, frame) => Math.max(...far.map((values) => values[frame] ?? 0)));
    const at = (await page.$eval(panel, (node) => node.replay.state().time)) / (replay.frame_ms / 1000);
    assert.equal(frames[Math.round(at)], Math.max(...frames), "it opens at the largest error");
    assert.ok((await text(page, `${panel} .replay-names`)).startsWith(" measured (translucent)"));
    // drawn where the angle says: the middle of the link is 0.2 m from its hinge
    const seconds = (replay.frame_ms / 1000) * (replay.frames - 1);
    const [from, to] = await page.$eval(panel, (node, times) => times.map((time) => {
      node.replay.seek(time);
      node.replay.pixels();
      return node.replay.places("measured")[0];
    }), [0, seconds]); // prettier-ignore
    const angles = [0, Math.round(seconds / (log.time_s[1] - log.time_s[0]))].map((sample) => log.runs[0].values[0][sample]);
    const chord = 2 * 0.2 * Math.abs(Math.sin((angles[1] - angles[0]) / 2));
    assert.ok(chord > 0.01 && Math.abs(Math.hypot(from[0] - to[0], from[2] - to[2]) - chord) < 2e-3, `${from} ${to} ${angles}`);
  });

  check("fitted parameters stand with their intervals and what became of them", async (page) => {
    const cells = await page.$$eval("#parameters [data-status]", (nodes) => nodes.map((node) => node.dataset.status));
    assert.deepEqual(cells.sort(), match.contenders.flatMap((one) => one.parameters.map(({ status }) => status)).sort());
  });

  check("axe has no finding", async (page) => assert.deepEqual(await axeFindings(page), []));
});

group("dark", { dark: true }, (check) => {
  check("axe has no finding", async (page) => assert.deepEqual(await axeFindings(page), []));
});

group("390x844", kPhone, (check) => {
  check("nothing is wider than the window", async (page) => {
    assert.equal(await page.evaluate(() => window.innerWidth), 390, "something is wider than the window");
    assert.deepEqual(await axeFindings(page), []);
  });
});

describe("what is missing", () => {
  const altered = async (change, look) => {
    const data = dataIn(report);
    change(data.match);
    const file = join(work, "altered.html");
    writeFileSync(file, withDataIn(readFileSync(report, "utf8"), data));
    const { page, trouble } = await openReport(browser, file);
    await look(page);
    assert.deepEqual(trouble, []);
    await page.close();
  };

  test("a match that was stopped says who is missing, and shows no empty section", async (context) => {
    if (missing) return context.skip(missing);
    const last = match.contenders[1].contender;
    await altered(
      (data) => {
        data.to_do = [last];
        data.contenders = data.contenders.slice(0, 1);
        data.logs = data.logs.filter((one) => one.contender !== last);
        delete data.motion;
      },
      async (page) => {
        assert.ok((await text(page, "#answer .alert")).includes(`${last} has not been fitted yet`));
        assert.deepEqual(await page.$$eval("main > *", (nodes) => nodes.map((node) => node.id)), ["answer", "logs", "parameters", "checks", "manifest"]);
        assert.equal((await page.$$(".match-contenders .series")).length, 1);
        assert.deepEqual(await page.$$eval("#answer thead th", (nodes) => nodes.map((node) => node.textContent)), ["Contender", "Fitted", "Untuned", "Noise floor"], "there is none to compare with");
      },
    );
  });

  test("where all contenders fail each reason is there", async (context) => {
    if (missing) return context.skip(missing);
    await altered(
      (data) => {
        data.contenders = data.contenders.map(({ contender }) => ({ contender, failure: "it falls apart", warnings: [] }));
        data.logs = data.logs.map(({ contender }) => ({ contender }));
        data.motion = [];
      },
      async (page) => {
        assert.deepEqual(await page.$$eval("main > *", (nodes) => nodes.map((node) => node.id)), ["answer", "checks", "manifest"]);
        const rows = await page.$$eval("#answer tbody tr", (nodes) => nodes.map((node) => node.textContent));
        assert.ok(rows.length === 2 && rows.every((row) => row.includes("not fitted: it falls apart")), rows.join());
      },
    );
  });

  test("a folder that is stopped before its first contender has a page", async (context) => {
    if (missing) return context.skip(missing);
    const kept = JSON.parse(readFileSync(join(work, "matched", "match.json"), "utf8"));
    writeFileSync(join(work, "matched", "match.json"), JSON.stringify({ ...kept, contenders: [], to_do: match.contenders.map(({ contender }) => contender), answer: "Nothing can be said yet." }));
    execFileSync(process.env.ASSAY, ["report", join(work, "matched")], { stdio: "ignore" });
    const { page, trouble } = await openReport(browser, report);
    assert.ok((await text(page, "#answer .alert")).includes("have not been fitted yet"));
    assert.equal((await page.$$("#answer tbody tr")).length, 2);
    assert.deepEqual(trouble, []);
    await page.close();
  });
});
