// The replay of a real campaign's report in headless Chromium: what is drawn is what was stored, on one clock.
//   ASSAY  the program assay
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { launch } from "../../web/browser.mjs";
import { openReport, replaysIn } from "./page.mjs";

const kCampaign = `
name = "replay"
contenders = ["mujoco-euler", "mujoco-rk4", "mujoco-implicit"]
timesteps_ms = [1, 4]
reference_ms = 1
measures = ["consistency"]
[[system]]
name = "planar-chain"
duration_s = 1.024
sample_ms = 32
pieces = 2
piece_ms = 32
[[system]]
name = "capsules-27"
duration_s = 0.256
sample_ms = 32
pieces = 2
piece_ms = 32
[[system]]
name = "shapes"
model = "shapes.xml"
duration_s = 0.512
sample_ms = 32
pieces = 2
piece_ms = 32
`;
// Every kind of shape, and two meshes: one that is only drawn, and one that collides and has nothing drawn beside it.
const kShapes = `<mujoco model="shapes">
  <asset>
    <mesh name="wedge" vertex="0 0 0  0.3 0 0  0 0.3 0  0 0 0.3  0.3 0.3 0"/>
    <mesh name="hat" vertex="-0.2 -0.2 0.2  0.2 -0.2 0.2  0.2 0.2 0.2  -0.2 0.2 0.2  0 0 0.6"/>
    <hfield name="hills" nrow="5" ncol="5" size="1.5 1.5 0.2 0.1" elevation="0 0 0 0 0  0 1 0 1 0  0 0 0 0 0  0 1 0 1 0  0 0 0 0 0"/>
  </asset>
  <worldbody>
    <geom type="hfield" hfield="hills" rgba="0.4 0.6 0.4 1"/>
    <body name="box" pos="-0.9 -0.9 0.6"><freejoint/><geom type="box" size="0.2 0.15 0.1" rgba="0.8 0.3 0.2 1"/></body>
    <body name="can" pos="0.9 -0.9 0.6"><freejoint/><geom type="cylinder" size="0.15 0.2" rgba="0.2 0.5 0.8 1"/></body>
    <body name="egg" pos="-0.9 0.9 0.6"><freejoint/><geom type="ellipsoid" size="0.2 0.15 0.1" rgba="0.9 0.7 0.2 1"/></body>
    <body name="stone" pos="0.9 0.9 0.6"><freejoint/><geom type="mesh" mesh="wedge" rgba="0.5 0.5 0.5 1"/></body>
    <body name="head" pos="0 0 0.6"><freejoint/><geom type="sphere" size="0.2" rgba="0.7 0.6 0.5 1"/>
      <geom type="mesh" mesh="hat" contype="0" conaffinity="0" mass="0" rgba="0.3 0.2 0.6 1"/></body>
  </worldbody>
</mujoco>`;
const kPanel = '.replay-panel[data-system="planar-chain"]';

const work = mkdtempSync(join(tmpdir(), "assay-replay-"));
const report = join(work, "results", "report.html");
let browser;
let replays;

function assay(...words) {
  const env = { ...process.env, XDG_CACHE_HOME: join(work, "cache") };
  execFileSync(process.env.ASSAY, words, { cwd: work, env, stdio: ["ignore", "ignore", "pipe"] });
}

// states[sample][body] = [x, y, z, qw, qx, qy, qz], as exported: the page's numbers went another way.
function stored(system, contender) {
  const [header, ...rows] = readFileSync(join(work, "states", system, `${contender}.csv`), "utf8").trim().split("\n");
  assert.equal(header.split(",").slice(2, 9).join(), "x,y,z,qw,qx,qy,qz");
  const samples = new Map();
  for (const row of rows) {
    const fields = row.split(",");
    samples.set(fields[0], [...(samples.get(fields[0]) ?? []), fields.slice(2, 9).map(Number)]);
  }
  return [...samples.values()];
}

// q = [w, x, y, z]
function turned([w, x, y, z], [a, b, c]) {
  const t = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [a + w * t[0] + y * t[2] - z * t[1], b + w * t[1] + z * t[0] - x * t[2], c + w * t[2] + x * t[1] - y * t[0]];
}

async function open(options = {}) {
  const opened = await openReport(browser, report, { width: 1000, ...options });
  await opened.page.$eval(kPanel, (node) => node.scrollIntoView({ block: "center", behavior: "instant" }));
  await opened.page.waitForSelector(`${kPanel}[data-ready]`);
  return opened;
}

const frames = (page, count = 2) =>
  page.evaluate(async (times) => {
    for (let i = 0; i < times; i += 1) await new Promise((done) => requestAnimationFrame(done));
  }, count);

const stateOf = (page) => page.$eval(kPanel, (node) => node.replay.state());

async function seek(page, frame) {
  await page.$eval(`${kPanel} .replay-controls input`, (node, value) => {
    node.value = String(value);
    node.dispatchEvent(new Event("input"));
  }, frame); // prettier-ignore
  await frames(page);
}

// Whether each capsule of the chain is drawn where `file`'s states have it.
async function drawnAsStored(page, contender, file, frame) {
  const replay = replays[0];
  const state = stored("planar-chain", file)[frame];
  const drawn = await page.$eval(kPanel, (node, name) => node.replay.places(name), contender);
  const expected = replay.scene.shapes.filter((shape) => shape.body >= 0).map((shape) => {
    const [x, y, z, ...q] = state[shape.body];
    const cm = replay.scene.bodies[shape.body].cm;
    const offset = turned(q, shape.p.map((value, axis) => value - cm[axis]));
    return [x + offset[0], y + offset[1], z + offset[2]];
  });
  assert.equal(drawn.length, expected.length);
  for (const place of expected) {
    const nearest = Math.min(...drawn.map((other) => Math.hypot(...other.map((value, axis) => value - place[axis]))));
    assert.ok(nearest < 2 * replay.position_error_m + 1e-5, `${contender}, frame ${frame}: ${nearest} m off`);
  }
}

before(async () => {
  assert.ok(process.env.ASSAY, "ASSAY must name the program");
  writeFileSync(join(work, "replay.toml"), kCampaign);
  writeFileSync(join(work, "shapes.xml"), kShapes);
  assay("run", "replay.toml", "--out", "results");
  assay("report", "results", "--replays", "4");
  assay("export", "results", "--trajectories", "csv", "--out", "states");
  replays = replaysIn(report);
  browser = await launch({ webgl: true });
});

after(async () => {
  await browser?.close();
  rmSync(work, { recursive: true, force: true });
});

test("every system with kept runs has a replay; bodies are drawn where the stored states say", async () => {
  assert.deepEqual(replays.map((replay) => replay.system), ["planar-chain", "capsules-27", "shapes"]);
  const replay = replays[0];
  const { page, trouble } = await open();
  assert.equal((await page.$$(".replay-panel")).length, 3);
  for (const frame of [0, 1, 17, 32]) {
    await seek(page, frame);
    assert.ok(Math.abs((await stateOf(page)).time - 0.032 * frame) < 1e-9);
    for (const run of replay.runs.filter((candidate) => candidate.timestep_ms === 1)) {
      await drawnAsStored(page, run.contender, run.contender, frame);
    }
  }
  assert.deepEqual(trouble, []);
  await page.close();
});

test("until the runs are drawn there is a still, and the page answers", async () => {
  const { page, trouble } = await openReport(browser, report, { width: 1000 });
  const still = `${kPanel} .replay-still`;
  assert.match(await page.$eval(still, (node) => node.innerText), /Drawing the runs/);
  assert.ok((await page.$$(`${still} .picture .outline`)).length >= 5, "the chain's links");
  await page.$eval(kPanel, (node) => node.scrollIntoView({ block: "center", behavior: "instant" }));
  await page.focus(kPanel);
  await page.keyboard.press("ArrowRight");
  assert.ok(Math.abs((await stateOf(page)).time - 0.032) < 1e-9, "keys work before anything is drawn");
  await page.waitForSelector(`${kPanel}[data-ready]`);
  assert.equal(await page.$(still), null);
  assert.equal((await stateOf(page)).drawn, true);
  assert.deepEqual(trouble, []);
  await page.close();
});

test("runs of another timestep, each against its own reference", async () => {
  const { page, trouble } = await open();
  await page.select(`${kPanel} select[id$="-step"]`, "4");
  await page.waitForFunction((panel) => document.querySelector(panel).replay.places("mujoco-euler")?.length > 0, {}, kPanel);
  await seek(page, 32);
  for (const name of ["mujoco-euler", "mujoco-rk4"]) await drawnAsStored(page, name, `${name}-4ms`, 32);
  const lines = () => page.$$eval(`${kPanel} .replay-distance [data-contender]`, (nodes) => nodes.map((node) => node.dataset.contender));
  assert.deepEqual(await lines(), ["mujoco-euler", "mujoco-rk4", "mujoco-implicit"], "the reference is at 1 ms");
  await page.select(`${kPanel} select[id$="-reference"]`, "-1");
  await frames(page);
  assert.ok((await lines()).includes("mujoco-euler"));
  assert.deepEqual(trouble, []);
  await page.close();
});

test("pictures differ where times do, and are the same at the same time", async () => {
  const { page, trouble } = await open();
  const shot = async (frame) => {
    await seek(page, frame);
    return page.$eval(kPanel, (node) => node.replay.pixels());
  };
  const first = await shot(0);
  const later = await shot(20);
  assert.ok(first.length > 2000, "something is drawn");
  assert.notEqual(first, later, "the chain has moved");
  assert.ok(first === (await shot(0)), "the same time is the same picture");
  const trail = `${kPanel} select[id$="-trail"]`;
  const followed = await page.$eval(trail, (node) => node.value);
  await page.select(trail, "-1");
  assert.notEqual(later, await shot(20), "the trail has gone");
  await page.select(trail, followed);
  assert.ok(later === (await shot(20)), "the trail is back");
  await page.$eval(`${kPanel} input[value="overlay"]`, (node) => node.click());
  assert.notEqual(first, await shot(0), "ghosts over the reference are another picture");
  assert.match(await page.$eval(`${kPanel} .replay-labels`, (node) => node.innerText), /mujoco-euler \(solid\)/);
  assert.deepEqual(trouble, []);
  await page.close();
});

test("keys: space, arrows, home, end, speed", async () => {
  const { page, trouble } = await open();
  await page.focus(kPanel);
  const time = async () => (await stateOf(page)).time;
  await page.keyboard.press("ArrowRight");
  assert.ok(Math.abs((await time()) - 0.032) < 1e-9);
  await page.keyboard.down("Shift");
  await page.keyboard.press("ArrowRight");
  await page.keyboard.up("Shift");
  assert.ok(Math.abs((await time()) - 0.352) < 1e-9);
  await page.keyboard.press("ArrowLeft");
  assert.ok(Math.abs((await time()) - 0.32) < 1e-9);
  await page.keyboard.press("End");
  assert.ok(Math.abs((await time()) - 1.024) < 1e-9);
  await page.keyboard.press("ArrowRight");
  assert.ok(Math.abs((await time()) - 1.024) < 1e-9, "there is nothing behind the end");
  await page.keyboard.press("Home");
  assert.equal(await time(), 0);
  const speed = () => page.$eval(`${kPanel} .replay-controls select`, (node) => node.value);
  await page.keyboard.press("ArrowDown");
  assert.equal(await speed(), "0.5");
  await page.keyboard.press("ArrowUp");
  assert.equal(await speed(), "1");
  // Slowly, so that it is not at its end before a loaded machine looks again.
  for (let i = 0; i < 4; i += 1) await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Space");
  await page.waitForFunction((panel) => document.querySelector(panel).replay.state().time > 0.02, {}, kPanel);
  assert.equal((await stateOf(page)).playing, true);
  await page.keyboard.press("Space");
  const stopped = await stateOf(page);
  assert.equal(stopped.playing, false);
  await frames(page, 5);
  assert.equal(await time(), stopped.time, "it stands still");
  // In a list of choices the arrows choose.
  await page.focus(`${kPanel} select[id$="-trail"]`);
  await page.keyboard.press("ArrowRight");
  assert.equal(await time(), stopped.time);
  // It ends at the end, and starts over from there.
  await page.focus(kPanel);
  for (let i = 0; i < 4; i += 1) await page.keyboard.press("ArrowUp");
  await page.keyboard.press("End");
  await page.keyboard.press("Space");
  await page.waitForFunction((panel) => {
    const { time: at, playing } = document.querySelector(panel).replay.state();
    return at === 1.024 && !playing;
  }, {}, kPanel); // prettier-ignore
  assert.deepEqual(trouble, []);
  await page.close();
});

test("distances from the reference are the stored ones and tied to the clock", async () => {
  const { page, trouble } = await open();
  const [reference, other] = ["mujoco-euler", "mujoco-rk4"].map((name) => stored("planar-chain", name));
  const run = replays[0].runs.find((candidate) => candidate.contender === "mujoco-rk4");
  run.distance_m.forEach((distance, frame) => {
    const each = other[frame].map((body, i) => Math.hypot(...[0, 1, 2].map((axis) => body[axis] - reference[frame][i][axis])));
    const mean = each.reduce((sum, value) => sum + value, 0) / each.length;
    assert.ok(Math.abs(distance - mean) <= 6e-3 * mean, `frame ${frame}: ${distance} and ${mean}`);
  });
  const lines = () => page.$$eval(`${kPanel} .replay-distance [data-contender]`, (nodes) => nodes.map((node) => node.dataset.contender));
  assert.deepEqual(await lines(), ["mujoco-rk4", "mujoco-implicit"]);
  await page.select(`${kPanel} select[id$="-reference"]`, "1");
  assert.deepEqual(await lines(), ["mujoco-euler", "mujoco-implicit"]);
  await page.$eval('#planar-chain .legend-item[data-contender="mujoco-implicit"]', (node) => node.click());
  await frames(page);
  assert.deepEqual(await lines(), ["mujoco-euler"], "the replay follows the legend");
  assert.equal((await page.$$(`${kPanel} .replay-labels > div`)).length, 2);
  const cursor = () => page.$eval(`${kPanel} .replay-cursor`, (node) => node.getBoundingClientRect().left - node.parentNode.getBoundingClientRect().left);
  await seek(page, 0);
  const start = await cursor();
  await seek(page, 32);
  const end = await cursor();
  await seek(page, 16);
  assert.ok(Math.abs((await cursor()) - (start + end) / 2) < 0.2);
  const box = await page.$eval(`${kPanel} .replay-distance svg`, (node) => {
    const { left, top, height } = node.getBoundingClientRect();
    return { left, y: top + height / 2 };
  });
  await page.mouse.click(box.left + start + (end - start) / 4, box.y);
  assert.ok(Math.abs((await stateOf(page)).time - 0.256) < 0.01, "a click in the plot is a time");
  assert.deepEqual(trouble, []);
  await page.close();
});

test("without WebGL the page says so in a line, and the distances stay", async () => {
  const { page, trouble } = await open({ without: "webgl2" });
  const text = await page.$eval(`${kPanel} .replay-view`, (node) => node.innerText);
  assert.match(text, /no WebGL/);
  assert.equal(text.trim().split("\n").length, 1);
  assert.equal((await stateOf(page)).drawn, false);
  assert.equal((await page.$$(`${kPanel} .replay-distance [data-contender]`)).length, 2);
  await seek(page, 16);
  assert.ok(Math.abs((await stateOf(page)).time - 0.512) < 1e-9);
  assert.deepEqual(trouble, []);
  await page.close();
});

test("every kind of shape is drawn; meshes of the file instead of what collides, until the reader asks for it", async () => {
  const panel = '.replay-panel[data-system="shapes"]';
  const replay = replays.find((candidate) => candidate.system === "shapes");
  assert.deepEqual(replay.scene.shapes.map((shape) => shape.type), ["height_field", "box", "cylinder", "ellipsoid", "hull", "sphere"]);
  for (const looks of [{}, { dark: true }, { width: 400, phone: true }]) {
    const { page, trouble } = await openReport(browser, report, { width: 1000, ...looks });
    await page.$eval(panel, (node) => node.scrollIntoView({ block: "center", behavior: "instant" }));
    await page.waitForSelector(`${panel}[data-ready]`);
    await frames(page);
    const pixels = () => page.$eval(panel, (node) => node.replay.pixels());
    const places = () => page.$eval(panel, (node) => node.replay.places("mujoco-euler"));
    const [drawn, drawnAt] = [await pixels(), await places()];
    assert.equal(drawnAt.length, 5, "one for each body: the sphere is behind the hat");
    if (process.env.ASSAY_SCREENSHOTS) {
      await (await page.$(panel)).screenshot({ path: `${process.env.ASSAY_SCREENSHOTS}/shapes-${Object.keys(looks).join("-") || "desktop"}.png` });
    }
    await page.click(`${panel} [data-action="collision"]`);
    await frames(page, 4);
    const [shapes, shapesAt] = [await pixels(), await places()];
    assert.equal(shapesAt.length, 5);
    assert.notEqual(shapes, drawn, "the hat is gone and the sphere is there");
    // the sphere's centre is that of its body; the hat's frame lies above it
    const head = (list) => list.map(([x, y, z]) => ({ z, off: Math.hypot(x, y) })).sort((a, b) => a.off - b.off)[0];
    assert.ok(head(drawnAt).z > head(shapesAt).z + 0.1);
    await page.click(`${panel} [data-action="collision"]`);
    await frames(page, 4);
    assert.equal(await pixels(), drawn);
    assert.deepEqual(trouble, []);
    await page.close();
  }
  assert.equal(await (async () => {
    const { page } = await open();
    const found = await page.$$(`${kPanel} [data-action="collision"]`);
    await page.close();
    return found.length;
  })(), 0, "a system without meshes has no such switch"); // prettier-ignore
});
