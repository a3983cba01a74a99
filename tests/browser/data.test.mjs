// The types of the page's data (web/src/data.ts) are those of the JSON that the program writes: a member that either side
// lacks, adds or names otherwise is an error.
//   ASSAY          the program assay
//   ASSAY_RESULTS  the folder results/
import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { closeSync, mkdirSync, mkdtempSync, openSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { fileURLToPath } from "node:url";

import { dataIn, replaysIn } from "./page.mjs";

const web = fileURLToPath(new URL("../../web/", import.meta.url));
const ts = createRequire(join(web, "package.json"))("typescript");
const work = mkdtempSync(join(tmpdir(), "assay-data-"));
const run = (...words) => execFileSync(process.env.ASSAY, words, { cwd: work, stdio: ["ignore", "ignore", "pipe"] });

// For the sections on contenders, on changes since earlier results, on parity, and for replays of every kind of shape.
const kCampaign = `
name = "types"
contenders = ["mujoco-euler", "mujoco-rk4", "ode-quick"]
timesteps_ms = [1, 4]
reference_ms = "1/2"
measures = ["raw_speed", "consistency", "drift", "agreement"]
[timing]
rounds = 6
processes = 3
batch_ms = 1
[[system]]
name = "planar-chain"
duration_s = 0.256
sample_ms = 4
piece_ms = 64
pieces = 4
[[system]]
name = "shapes"
model = "./shapes.xml"
contenders = ["mujoco-euler", "mujoco-rk4"]
measures = ["consistency"]
duration_s = 0.064
sample_ms = 4
piece_ms = 64
pieces = 1
[[system]]
name = "again"
model = "./shapes.xml"
contenders = ["mujoco-euler"]
measures = ["consistency"]
timesteps_ms = [1]
duration_s = 0.064
sample_ms = 4
piece_ms = 64
pieces = 1
[[sweep]]
contenders = ["ode-quick"]
iterations = [2, 10]
`;

const kShapes = `<mujoco>
  <asset>
    <mesh name="wedge" vertex="0 0 0  0.3 0 0  0 0.3 0  0 0 0.3  0.3 0.3 0"/>
    <hfield name="hills" nrow="2" ncol="2" size="1.5 1.5 0.2 0.1" elevation="0 0 1 0"/>
  </asset>
  <worldbody>
    <geom type="hfield" hfield="hills"/>
    <body name="box" pos="-0.9 -0.9 0.6"><freejoint/><geom type="box" size="0.2 0.15 0.1"/></body>
    <body name="stone" pos="0.9 0.9 0.6"><freejoint/><geom type="mesh" mesh="wedge"/>
      <geom type="mesh" mesh="wedge" contype="0" conaffinity="0" mass="0"/></body>
  </worldbody>
</mujoco>`;

function measured() {
  writeFileSync(join(work, "shapes.xml"), kShapes);
  writeFileSync(join(work, "types.toml"), kCampaign);
  for (const out of ["before", "now"]) run("run", "types.toml", "--out", out);
  // its exit status says whether they mean the same robot, which two samples do not settle
  spawnSync(process.env.ASSAY, ["parity", "planar-chain", "mujoco-euler", "ode-quick", "--samples", "2", "--out", "now"], { cwd: work });
  for (const damping of [1, 2]) writeFileSync(join(work, `arm${damping}.xml`), `<mujoco><worldbody><body name="arm"><joint name="hinge" axis="0 1 0" damping="${damping}"/><geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.3"/></body></worldbody></mujoco>`);
  // its exit status says whether the files differ
  spawnSync(process.env.ASSAY, ["parity", "arm1.xml", "arm2.xml", "--out", "now"], { cwd: work });
  run("report", "now", "--against", "before", "--history", "before", "now");
  return join(work, "now", "report.html");
}

// Committed results of a kind, by the present program.
function committed(name, ...options) {
  mkdirSync(join(work, name));
  const database = openSync(join(work, name, "assay.sqlite"), "w");
  execFileSync("xz", ["-dc", join(process.env.ASSAY_RESULTS, name, "assay.sqlite.xz")], { stdio: ["ignore", database, "inherit"] });
  closeSync(database);
  run("report", name, ...options);
  return join(work, name, "report.html");
}

// A match; nothing where its optimiser is not set up.
function matched() {
  const model = fileURLToPath(new URL("../../examples/match/pendulum.xml", import.meta.url));
  const done = spawnSync(process.env.ASSAY, ["match", model, "--like", "mujoco-rk4", "--contenders", "mujoco-euler,simbody-euler", "--fit", "damping", "--budget", "10", "--out", "matched"], { cwd: work, encoding: "utf8" });
  if (/setup match/.test(done.stderr)) return [];
  assert.equal(done.status, 0, done.stderr);
  return [join(work, "matched", "report.html")];
}

// Of each list the objects that differ in their members: one of a kind is enough for the types.
function kinds(json) {
  if (Array.isArray(json)) {
    if (typeof json[0] !== "object" || json[0] === null) return json.length > 20 ? json.slice(0, 20) : json;
    const found = new Map();
    for (const each of json.map(kinds)) {
      const shape = JSON.stringify(each, (key, value) => (typeof value === "number" ? 0 : typeof value === "string" && /[ .]/.test(value) ? "" : value));
      if (!found.has(shape)) found.set(shape, each);
    }
    return [...found.values()];
  }
  if (typeof json !== "object" || json === null) return json;
  return Object.fromEntries(Object.entries(json).map(([key, value]) => [key, kinds(value)]));
}

// Members that none of the reports has: the page adds it, a unit that the catalogue does not have, figures near a floor,
// a grasp, runs of which little was timed.
const kOwn = ["ReplayScene.meshes", "StoredValue.unit", "StoredValue.bound", "Candidate.held", "Candidate.note"];
const kTypes = { report: "ReportJson", cells: "StoredCell[]", replays: "Replay[]" };

// The compiler's complaints about the JSON as values of the page's types, and the members of these types that no JSON has.
function compare(files) {
  const parts = files.map((file) => {
    const { cells, ...report } = dataIn(file);
    return { report, cells, replays: replaysIn(file) ?? [] };
  });
  const lines = [`import type { ReportJson, StoredCell } from "${web}src/data";`, `import type { Replay } from "${web}src/replay/decode";`];
  parts.forEach((part, index) => {
    for (const [name, type] of Object.entries(kTypes)) lines.push(`export const ${name}${index}: ${type} = ${JSON.stringify(kinds(part[name]))};`);
  });
  const file = join(work, "data.ts");
  writeFileSync(file, lines.join("\n"));
  const { config } = ts.readConfigFile(join(web, "tsconfig.json"), ts.sys.readFile);
  const { options } = ts.convertCompilerOptionsFromJson(config.compilerOptions, web);
  const program = ts.createProgram([file], options);
  const checker = program.getTypeChecker();
  const source = program.getSourceFile(file);
  const diagnostics = [...program.getSyntacticDiagnostics(source), ...program.getSemanticDiagnostics(source)];
  const wrong = [...new Set(diagnostics.map((each) => ts.flattenDiagnosticMessageText(each.messageText, " ")))];

  const seen = new Map(); // by the member's place in the source
  const walk = (type, json) => {
    if (type.isUnion()) return type.types.forEach((each) => walk(each, json));
    if (!(type.flags & (ts.TypeFlags.Object | ts.TypeFlags.Intersection))) return;
    if (checker.isArrayType(type)) {
      const [element] = checker.getTypeArguments(type);
      if (Array.isArray(json)) json.forEach((each) => walk(element, each));
      return;
    }
    if (checker.isTupleType(type) || Array.isArray(json) || typeof json !== "object" || json === null) return;
    const index = type.getStringIndexType();
    if (index) Object.values(json).forEach((each) => walk(index, each));
    for (const member of type.getProperties()) {
      const place = `${checker.typeToString(type)}.${member.name}`;
      seen.set(place, (seen.get(place) ?? false) || member.name in json);
      if (member.name in json) walk(checker.getTypeOfSymbol(member), json[member.name]);
    }
  };
  for (const statement of source.statements.filter(ts.isVariableStatement)) {
    const [declared] = statement.declarationList.declarations;
    const [, name, index] = /^([a-z]+)(\d+)$/.exec(declared.name.text);
    walk(checker.getTypeAtLocation(declared), parts[Number(index)][name]);
  }
  return { wrong, unseen: [...seen].filter(([place, found]) => !found && !kOwn.includes(place)).map(([place]) => place) };
}

after(() => rmSync(work, { recursive: true, force: true }));

test("the JSON has the members of the page's types and no others", () => {
  assert.ok(process.env.ASSAY && process.env.ASSAY_RESULTS, "ASSAY must name the program, ASSAY_RESULTS the folder results/");
  const reports = [measured(), committed("cart-pole-2026-11-23"), committed("quadruped-rough-2026-11-27"), committed("worlds-2026-11-25")];
  const matches = matched();
  const { wrong, unseen } = compare([...reports, ...matches]);
  assert.deepEqual(wrong, []);
  assert.deepEqual(matches.length > 0 ? unseen : unseen.filter((place) => place !== "ReportJson.match"), []);
});
