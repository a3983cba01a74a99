// Kept runs as src/report/replays.cc packs them, and their states.

export interface ReplayShape {
  type: "sphere" | "capsule" | "plane" | "box" | "cylinder" | "ellipsoid" | "hull" | "height_field" | "mesh";
  body: number; // -1: the world
  p: [number, number, number];
  q: [number, number, number, number]; // w, x, y, z
  radius: number;
  half_length: number;
  rgba: [number, number, number, number];
  half_size?: [number, number, number]; // box, ellipsoid
  data?: number; // hull, height field, mesh: its place in the scene's list
  collides?: false; // only drawn
}

// Lengths are whole numbers of `step` m.
export interface ReplayHull {
  step: number;
  v: number[]; // x, y, z of each corner
}

export interface ReplayHeightField {
  rows: number;
  columns: number;
  half_x: number;
  half_y: number;
  base: number;
  step: number;
  h: number[]; // row by row
}

// Triangles that are only looked at.
export interface ReplayMesh extends ReplayHull {
  f: number[]; // three corners of each
}

export interface ReplayPart {
  mesh: number;
  body: number;
  p: [number, number, number];
  q: [number, number, number, number];
  rgba: [number, number, number, number];
}

export interface Pictures {
  meshes: ReplayMesh[];
  parts: ReplayPart[];
}

export interface ReplayScene {
  bodies: ReplayBody[];
  hinges: string[]; // of slides too
  control: Record<string, unknown>;
  shapes: ReplayShape[];
  hulls?: ReplayHull[];
  height_fields?: ReplayHeightField[];
  meshes?: ReplayMesh[]; // unpacked from the replay's pictures
}

export interface ReplayBody {
  name: string;
  parent: number;
  cm: [number, number, number];
  anchor: [number, number, number];
  start: { p: [number, number, number]; q: [number, number, number, number] };
}

export interface ReplayRun {
  contender: string;
  timestep_ms: number;
  frames: number;
  distance_m: (number | null)[]; // from the first run, frame by frame
  data: string;
}

export interface Replay {
  system: string;
  scene: ReplayScene;
  pictures?: { data: string } | { like: number }; // packed, or those of another replay
  frame_ms: number;
  frames: number;
  bodies: number;
  position_step_m: number;
  rotation_step: number;
  position_error_m: number;
  rotation_error_rad: number;
  runs: ReplayRun[];
  left_out: string[];
}

// x, y, z of the centre of mass, then the body frame's w, x, y, z.
export const kColumns = 7;

export interface Motion {
  run: ReplayRun;
  states: Float64Array; // frame by frame, body by body, kColumns each; quaternions normalised
}

export function canUnpack(): boolean {
  return typeof DecompressionStream !== "undefined";
}

async function inflate(base64: string): Promise<Uint8Array> {
  const packed = Uint8Array.from(atob(base64), (digit) => digit.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// The meshes of a robot's file as shapes of the replay's scene, and with them what else is seen of the robot: shapes that
// are only drawn, and those of bodies that no mesh shows. Nothing where there are no meshes.
export async function unpackPictures(replay: Replay, at: (index: number) => Replay | undefined): Promise<ReplayShape[]> {
  let packed = replay.pictures;
  if (packed && "like" in packed) packed = at(packed.like)?.pictures;
  if (!packed || !("data" in packed)) return [];
  const { meshes, parts } = JSON.parse(new TextDecoder().decode(await inflate(packed.data))) as Pictures;
  replay.scene.meshes = meshes;
  const seen = new Set(parts.map((part) => part.body));
  const shapes = replay.scene.shapes.filter((shape) => shape.collides === false || !seen.has(shape.body));
  return [...shapes, ...parts.map(({ mesh, body, p, q, rgba }): ReplayShape => ({ type: "mesh", body, p, q, rgba, radius: 0, half_length: 0, data: mesh }))];
}

export async function unpack(replay: Replay, run: ReplayRun): Promise<Motion> {
  const bytes = await inflate(run.data);
  const { bodies } = replay;
  const states = new Float64Array(run.frames * bodies * kColumns);
  let at = 0;
  const next = () => {
    // In floats, for a number may have more than 32 bits.
    let number = 0;
    for (let scale = 1; ; scale *= 128) {
      const byte = bytes[at++] ?? 0;
      number += (byte & 0x7f) * scale;
      if (byte < 0x80) break;
    }
    return number % 2 === 0 ? number / 2 : -(number + 1) / 2;
  };
  for (let body = 0; body < bodies; body += 1) {
    for (let column = 0; column < kColumns; column += 1) {
      const step = column < 3 ? replay.position_step_m : replay.rotation_step;
      let value = 0;
      let change = 0;
      for (let frame = 0; frame < run.frames; frame += 1) {
        change += next();
        value += change;
        states[(frame * bodies + body) * kColumns + column] = value * step;
      }
    }
  }
  for (let i = 0; i < states.length; i += kColumns) {
    const size = Math.hypot(states[i + 3]!, states[i + 4]!, states[i + 5]!, states[i + 6]!) || 1;
    for (let k = 3; k < kColumns; k += 1) states[i + k]! /= size;
  }
  return { run, states };
}

// Runs unpacked when they are asked for, once.
export class Motions {
  private readonly asked = new Map<number, Promise<Motion>>();
  private readonly there = new Map<number, Motion>();

  constructor(private readonly replay: Replay) {}

  get(index: number): Motion | undefined {
    return this.there.get(index);
  }

  async load(indices: number[]): Promise<void> {
    await Promise.all(
      indices.map((index) => {
        const run = this.replay.runs[index];
        if (!run) return undefined;
        let motion = this.asked.get(index);
        if (!motion) {
          motion = unpack(this.replay, run);
          this.asked.set(index, motion);
        }
        return motion.then((done) => this.there.set(index, done));
      }),
    );
  }
}

// The state at a frame that need not be whole: between two stored ones it is interpolated. `out` is overwritten.
export function stateAt(motion: Motion, bodies: number, frame: number, out: Float64Array): Float64Array {
  const last = motion.run.frames - 1;
  const place = Math.min(Math.max(frame, 0), last);
  const from = Math.floor(place);
  const share = place - from;
  const size = bodies * kColumns;
  const a = from * size;
  if (share === 0) {
    out.set(motion.states.subarray(a, a + size));
    return out;
  }
  const b = a + size;
  for (let i = 0; i < size; i += 1) out[i] = motion.states[a + i]! * (1 - share) + motion.states[b + i]! * share;
  for (let i = 0; i < size; i += kColumns) {
    const norm = Math.hypot(out[i + 3]!, out[i + 4]!, out[i + 5]!, out[i + 6]!) || 1;
    for (let k = 3; k < kColumns; k += 1) out[i + k]! /= norm;
  }
  return out;
}

// Mean distance of the bodies from another run, frame by frame. From the first run it was computed before the packing.
export function distances(replay: Replay, motion: Motion, reference: Motion): (number | null)[] {
  if (reference.run === replay.runs[0] && motion !== reference) return motion.run.distance_m;
  const { bodies } = replay;
  const count = Math.min(motion.run.frames, reference.run.frames);
  const found: number[] = [];
  for (let frame = 0; frame < count; frame += 1) {
    let sum = 0;
    for (let body = 0; body < bodies; body += 1) {
      const at = (frame * bodies + body) * kColumns;
      const [a, b] = [motion.states, reference.states];
      sum += Math.hypot(a[at]! - b[at]!, a[at + 1]! - b[at + 1]!, a[at + 2]! - b[at + 2]!);
    }
    found.push(sum / bodies);
  }
  return found;
}

// The body that goes the longest way.
export function farthest(motion: Motion, bodies: number): number {
  let best = 0;
  let longest = -1;
  for (let body = 0; body < bodies; body += 1) {
    let way = 0;
    for (let frame = 1; frame < motion.run.frames; frame += 1) {
      const at = (frame * bodies + body) * kColumns;
      const before = at - bodies * kColumns;
      const s = motion.states;
      way += Math.hypot(s[at]! - s[before]!, s[at + 1]! - s[before + 1]!, s[at + 2]! - s[before + 2]!);
    }
    if (way > longest) [best, longest] = [body, way];
  }
  return best;
}
