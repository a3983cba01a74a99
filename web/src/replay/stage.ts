// Runs drawn by WebGL: each in a view of its own, or all in one, as ghosts over the reference.
import {
  AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, Group, InstancedMesh, LineBasicMaterial,
  LineSegments, type Material, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, PlaneGeometry,
  Quaternion, Scene, Vector3, WebGLRenderer,
} from "three"; // prettier-ignore
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

import { kColumns, stateAt, type Motion, type Replay, type ReplayShape } from "./decode";
import { Geometries, piecesOf, reachOf } from "./shapes";

export type Mode = "side" | "overlay";

export interface Colors {
  panel: string;
  rule: string;
  faint: string;
  runs: string[]; // each run's contender's
}

const kFieldOfView = 40; // degrees
const kMargin = 1.06; // of the view around the motion
const kGhost = 0.42; // opacity
const kTrailSeconds = 1.5;
const kTrailThickness = 0.006; // radius over that of all that moves

// Columns of a grid of `count` views that leaves a motion of this shape the most room.
function gridColumns(count: number, width: number, height: number, aspect: number): number {
  let best = 1;
  let largest = 0;
  for (let columns = 1; columns <= count; columns += 1) {
    const room = Math.min(width / columns / aspect, height / Math.ceil(count / columns));
    if (room > largest * (1 + 1e-3)) [best, largest] = [columns, room];
  }
  return best;
}

// Any colour of CSS as three numbers that WebGL takes.
export function resolveColor(css: string, host: HTMLElement): string {
  const probe = document.createElement("span");
  probe.style.color = css;
  host.append(probe);
  const computed = getComputedStyle(probe).color;
  probe.remove();
  const context = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  if (!context) return "rgb(128,128,128)";
  context.fillStyle = computed;
  context.fillRect(0, 0, 1, 1);
  const [r, g, b] = context.getImageData(0, 0, 1, 1).data;
  return `rgb(${r},${g},${b})`;
}

// One piece of a body's shapes: which of its geometry's instances it is, in a frame with the body's orientation at its
// centre of mass.
interface Part {
  body: number;
  shape: number; // place among those drawn
  mesh: InstancedMesh;
  at: number;
  local: Matrix4;
}

function colorOf(shape: ReplayShape): Color {
  return new Color(...(shape.rgba.slice(0, 3) as [number, number, number])).convertSRGBToLinear();
}

// One run's bodies.
class Figure {
  readonly solid = new Group();
  readonly ghosts = new Group();
  readonly trail: InstancedMesh; // of tubes: lines are a pixel wide on every screen
  readonly ghostMaterial = new MeshLambertMaterial({ transparent: true, opacity: kGhost });
  readonly trailMaterial = new MeshBasicMaterial({ transparent: true, opacity: 0.7 });
  private readonly parts: Part[] = [];
  private readonly meshes: InstancedMesh[] = []; // one a geometry
  private shapes = 0;
  private readonly trailLength: number; // pieces, a frame each
  private pieces = new Float32Array(0); // all of the trail's, as matrices
  private readonly state: Float64Array;
  private readonly pose = new Matrix4();
  private readonly placed = new Matrix4();

  constructor(
    readonly motion: Motion,
    private readonly replay: Replay,
    shown: readonly ReplayShape[],
    solidMaterial: Material,
    geometries: Geometries,
  ) {
    this.state = new Float64Array(replay.bodies * kColumns);
    const pieces = new Map<string, { shape: ReplayShape; place: number; local: Matrix4 }[]>();
    for (const shape of shown) {
      if (shape.body < 0) continue;
      const place = this.shapes++;
      for (const { geometry, local } of piecesOf(shape, replay.scene.bodies[shape.body]?.cm ?? [0, 0, 0])) {
        pieces.set(geometry, [...(pieces.get(geometry) ?? []), { shape, place, local }]);
      }
    }
    for (const [geometry, those] of pieces) {
      const solid = new InstancedMesh(geometries.get(geometry), solidMaterial, those.length);
      const ghost = new InstancedMesh(geometries.get(geometry), this.ghostMaterial, those.length);
      ghost.instanceMatrix = solid.instanceMatrix;
      // Where it stands changes with each frame; what is out of sight is little.
      solid.frustumCulled = ghost.frustumCulled = false;
      this.solid.add(solid);
      this.ghosts.add(ghost);
      this.meshes.push(solid);
      those.forEach(({ shape, place, local }, at) => {
        solid.setColorAt(at, colorOf(shape));
        this.parts.push({ body: shape.body, shape: place, mesh: solid, at, local });
      });
    }
    this.trailLength = Math.max(1, Math.round((1000 * kTrailSeconds) / replay.frame_ms));
    this.trail = new InstancedMesh(geometries.get("tube"), this.trailMaterial, this.trailLength);
    this.trail.frustumCulled = false;
  }

  dispose(): void {
    for (const group of [this.solid, this.ghosts]) {
      for (const mesh of group.children) (mesh as InstancedMesh).dispose();
      group.removeFromParent();
    }
    this.trail.removeFromParent();
    this.trail.dispose();
    this.ghostMaterial.dispose();
    this.trailMaterial.dispose();
  }

  // The way of a body; `thickness` in m.
  setTrail(body: number | null, thickness: number): void {
    if (body === null) return;
    const { states, run } = this.motion;
    this.pieces = new Float32Array(16 * Math.max(0, run.frames - 1));
    const at = (frame: number) => new Vector3().fromArray(states, (frame * this.replay.bodies + body) * kColumns);
    const along = new Vector3(0, 0, 1);
    for (let frame = 0; frame + 1 < run.frames; frame += 1) {
      const [from, to] = [at(frame), at(frame + 1)];
      const way = to.clone().sub(from);
      const length = way.length();
      const turn = new Quaternion().setFromUnitVectors(along, length > 0 ? way.divideScalar(length) : along);
      const middle = from.add(to).divideScalar(2);
      new Matrix4().compose(middle, turn, new Vector3(thickness, thickness, length / 2)).toArray(this.pieces, 16 * frame);
    }
  }

  place(frame: number): void {
    stateAt(this.motion, this.replay.bodies, frame, this.state);
    const position = new Vector3();
    const rotation = new Quaternion();
    const unit = new Vector3(1, 1, 1);
    for (const part of this.parts) {
      const at = part.body * kColumns;
      position.set(this.state[at]!, this.state[at + 1]!, this.state[at + 2]!);
      rotation.set(this.state[at + 4]!, this.state[at + 5]!, this.state[at + 6]!, this.state[at + 3]!);
      this.pose.compose(position, rotation, unit);
      part.mesh.setMatrixAt(part.at, this.placed.multiplyMatrices(this.pose, part.local));
    }
    for (const mesh of this.meshes) mesh.instanceMatrix.needsUpdate = true;
    const end = Math.floor(Math.min(frame, this.motion.run.frames - 1));
    const start = Math.max(0, end - this.trailLength);
    this.trail.count = end - start;
    this.trail.instanceMatrix.array.set(this.pieces.subarray(16 * start, 16 * end));
    this.trail.instanceMatrix.needsUpdate = true;
  }

  // Where each shape is drawn, x, y, z: in the middle of its pieces.
  places(): [number, number, number][] {
    const sums = Array.from({ length: this.shapes }, () => ({ sum: new Vector3(), count: 0 }));
    for (const part of this.parts) {
      part.mesh.getMatrixAt(part.at, this.placed);
      const own = sums[part.shape]!;
      own.sum.add(new Vector3().setFromMatrixPosition(this.placed));
      own.count += 1;
    }
    return sums.map(({ sum, count }) => sum.divideScalar(Math.max(1, count)).toArray());
  }
}

let software: boolean | null = null;

// Whether the processor draws, for want of a graphics card.
function drawsInSoftware(): boolean {
  if (software === null) {
    const probe = document.createElement("canvas").getContext("webgl2");
    const info = probe?.getExtension("WEBGL_debug_renderer_info");
    const name = probe && info ? String(probe.getParameter(info.UNMASKED_RENDERER_WEBGL)) : "";
    software = /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
    probe?.getExtension("WEBGL_lose_context")?.loseContext();
  }
  return software;
}

// A context of `canvas`. Without a graphics card edges are not smoothed and shapes are coarse.
export function openContext(canvas: HTMLCanvasElement): { context: WebGL2RenderingContext; coarse: boolean } | null {
  const coarse = drawsInSoftware();
  const context = canvas.getContext("webgl2", { alpha: false, antialias: !coarse });
  return context && { context, coarse };
}

function median(values: number[]): number {
  return [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)] ?? 0;
}

// Where the middle of all bodies is at a frame that need not be whole, over the ground.
function middleAt(states: Float64Array, bodies: number, frame: number): [x: number, y: number] {
  const last = states.length / kColumns / bodies - 1;
  const from = Math.max(0, Math.min(last, Math.floor(frame)));
  const to = Math.min(last, from + 1);
  const share = Math.max(0, Math.min(1, frame - from));
  let [x, y] = [0, 0];
  for (let body = 0; body < bodies; body += 1) {
    const [a, b] = [kColumns * (from * bodies + body), kColumns * (to * bodies + body)];
    x += states[a]! + share * (states[b]! - states[a]!);
    y += states[a + 1]! + share * (states[b + 1]! - states[a + 1]!);
  }
  return [x / bodies, y / bodies];
}

function still(states: Float64Array, bodies: number): Float64Array {
  const moved = states.slice();
  const [x, y] = middleAt(states, bodies, 0);
  const frames = states.length / kColumns / bodies;
  for (let frame = 0; frame < frames; frame += 1) {
    const [ownX, ownY] = middleAt(states, bodies, frame);
    for (let body = 0; body < bodies; body += 1) {
      const at = kColumns * (frame * bodies + body);
      moved[at] = moved[at]! - (ownX - x);
      moved[at + 1] = moved[at + 1]! - (ownY - y);
    }
  }
  return moved;
}

// What goes further than this many times its own width is followed by the camera.
const kWalks = 2;

export class Stage {
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(kFieldOfView, 1, 0.01, 1000);
  private readonly figures = new Map<number, Figure>(); // by the run's place, made when it is first shown
  private readonly geometries: Geometries;
  private readonly solid = new MeshLambertMaterial();
  private colors: Colors | null = null;
  private trailBody: number | null = null;
  private readonly ground = new Group();
  private statics: Mesh[] = [];
  private collision = false; // whether collision shapes are shown though there are pictures
  private readonly controls: OrbitControls;
  private shown: number[] = [];
  private reference = -1; // -1: none is drawn solid
  private translucent = -1; // among runs in one picture the one that others are seen through; -1: all but the reference are
  private mode: Mode = "side";
  private follows = false; // the camera goes with what it looks at
  private line = 1; // m between lines of the ground
  private groundAt = new Vector3();
  private home = { centre: new Vector3(), position: new Vector3() };
  private radius = 1;
  private half = { across: 1, up: 1 }; // of what moves, as the home view sees it; m
  private slow = 0; // ms that a picture takes, smoothed

  // `context` and `coarse` are of `canvas`; the view is chosen for `motions`. `changed` is called when the reader has
  // turned the view.
  constructor(
    private readonly canvas: HTMLCanvasElement,
    context: WebGL2RenderingContext,
    private readonly coarse: boolean,
    private readonly replay: Replay,
    private readonly pictures: readonly ReplayShape[],
    motions: Motion[],
    changed: () => void,
  ) {
    this.renderer = new WebGLRenderer({ canvas, context, antialias: !coarse });
    const light = new DirectionalLight(0xffffff, 2.2);
    light.position.set(-1, -1.6, 3);
    this.scene.add(new AmbientLight(0xffffff, 1.5), light);
    this.geometries = new Geometries(replay.scene, coarse);
    this.look(motions);
    this.makeGround();
    // meshes of files are often open, or wound the wrong way round
    if (pictures.length > 0) this.solid.side = DoubleSide;
    this.scene.add(this.ground);
    this.makeStatic();
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    // A finger that moves up or down scrolls the page.
    canvas.style.touchAction = "pan-y";
    // The wheel scrolls the page unless a key says that the view is meant.
    this.controls.enableZoom = false;
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.shiftKey) return;
      event.preventDefault();
      this.zoom(event.deltaY > 0 || event.deltaX > 0 ? 1.1 : 1 / 1.1);
      changed();
    }, { passive: false }); // prettier-ignore
    this.resetView();
    this.controls.addEventListener("change", changed);
  }

  private readonly renderer: WebGLRenderer;

  zoom(factor: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target);
    this.camera.position.copy(this.controls.target).add(offset.multiplyScalar(factor));
    this.controls.update();
  }

  resetView(): void {
    this.controls.target.copy(this.home.centre);
    this.camera.position.copy(this.home.position);
    this.controls.update();
  }

  // The view that shows all of most runs; a flat motion is seen from its thin side (src/report/render/renderer.cc).
  private look(motions: Motion[]): void {
    const reach = this.replay.scene.bodies.map(() => 0);
    for (const shape of [...this.replay.scene.shapes, ...this.pictures]) {
      if (shape.body < 0) continue;
      const cm = this.replay.scene.bodies[shape.body]?.cm ?? [0, 0, 0];
      const far = Math.hypot(shape.p[0] - cm[0], shape.p[1] - cm[1], shape.p[2] - cm[2]) + reachOf(shape, this.replay.scene);
      reach[shape.body] = Math.max(reach[shape.body] ?? 0, far);
    }
    const { bodies } = this.replay;
    const width = (states: Float64Array) => {
      const ends = [0, 1].map((axis) => Array.from({ length: bodies }, (_, body) => states[kColumns * body + axis]!));
      return Math.max(...ends.map((list) => Math.max(...list) - Math.min(...list))) + 2 * Math.max(...reach);
    };
    const travel = (states: Float64Array) => {
      const [start, end] = [0, states.length / kColumns / bodies - 1].map((frame) => middleAt(states, bodies, frame));
      return Math.hypot(end![0] - start![0], end![1] - start![1]);
    };
    this.follows = motions.length > 0 && median(motions.map(({ states }) => travel(states) / width(states))) > kWalks;
    // As the camera sees them that follows: without the way that the middle goes.
    const seen = this.follows ? motions.map(({ states }) => still(states, bodies)) : motions.map(({ states }) => states);
    const lows: number[][] = [[], [], []];
    const highs: number[][] = [[], [], []];
    for (const states of seen) {
      const low = [Infinity, Infinity, Infinity];
      const high = [-Infinity, -Infinity, -Infinity];
      for (let i = 0; i < states.length; i += kColumns) {
        const margin = reach[(i / kColumns) % this.replay.bodies] ?? 0;
        for (let axis = 0; axis < 3; axis += 1) {
          low[axis] = Math.min(low[axis]!, states[i + axis]! - margin);
          high[axis] = Math.max(high[axis]!, states[i + axis]! + margin);
        }
      }
      for (let axis = 0; axis < 3; axis += 1) {
        lows[axis]!.push(low[axis]!);
        highs[axis]!.push(high[axis]!);
      }
    }
    const low = lows.map(median);
    const high = highs.map(median);
    const [x, y, z] = low.map((value, axis) => Math.max(1e-3, high[axis]! - value)) as [number, number, number];
    this.radius = Math.hypot(x, y, z) / 2;
    const largest = Math.max(x, y, z);
    const flat = 0.4 * largest;
    let azimuth = 135;
    let elevation = -20;
    if (z < flat && z <= Math.min(x, y)) [azimuth, elevation] = [90, -65];
    else if (y < flat && y < x) azimuth = 110;
    else if (x < flat) azimuth = 200;
    const [a, e] = [(azimuth * Math.PI) / 180, (elevation * Math.PI) / 180];
    const distance = this.radius / Math.sin((kFieldOfView / 2) * (Math.PI / 180));
    const middle = new Vector3((low[0]! + high[0]!) / 2, (low[1]! + high[1]!) / 2, (low[2]! + high[2]!) / 2);
    // Seen from there: the extent of each run across and up, of which the median counts.
    const right = new Vector3(Math.sin(a), -Math.cos(a), 0);
    const up = new Vector3(-Math.cos(a) * Math.sin(e), -Math.sin(a) * Math.sin(e), Math.cos(e));
    const extents = seen.map((states) => {
      const range = [Infinity, -Infinity, Infinity, -Infinity];
      const at = new Vector3();
      for (let i = 0; i < states.length; i += kColumns) {
        const margin = reach[(i / kColumns) % this.replay.bodies] ?? 0;
        at.fromArray(states, i).sub(middle);
        const [x, y] = [at.dot(right), at.dot(up)];
        range[0] = Math.min(range[0]!, x - margin);
        range[1] = Math.max(range[1]!, x + margin);
        range[2] = Math.min(range[2]!, y - margin);
        range[3] = Math.max(range[3]!, y + margin);
      }
      return range;
    });
    const [l, r, b, t] = [0, 1, 2, 3].map((side) => median(extents.map((range) => range[side]!))) as [number, number, number, number];
    this.half = { across: Math.max(1e-3, (r - l) / 2), up: Math.max(1e-3, (t - b) / 2) };
    this.home.centre.copy(middle).addScaledVector(right, (l + r) / 2).addScaledVector(up, (b + t) / 2);
    this.home.position.set(-Math.cos(a) * Math.cos(e), -Math.sin(a) * Math.cos(e), -Math.sin(e)).multiplyScalar(distance).add(this.home.centre);
    this.camera.near = distance / 100;
    this.camera.far = distance * 60;
  }

  // A square of floor with lines; where there is no plane, nothing.
  private makeGround(): void {
    const plane = this.replay.scene.shapes.find((shape) => shape.type === "plane");
    if (!plane) return;
    const decade = 10 ** Math.floor(Math.log10(this.radius / 2));
    const size = ([5, 2].find((times) => times * decade <= this.radius / 2) ?? 1) * decade;
    const count = Math.ceil((4 * this.radius) / size);
    const points: number[] = [];
    for (let i = -count; i <= count; i += 1) points.push(i, -count, 0, i, count, 0, -count, i, 0, count, i, 0);
    const lines = new LineSegments(
      new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(points.map((value) => value * size)), 3)),
      new LineBasicMaterial(),
    );
    const floor = new Mesh(new PlaneGeometry(2 * count * size, 2 * count * size), new MeshBasicMaterial());
    floor.position.z = -0.002 * this.radius;
    floor.material.polygonOffset = true;
    floor.material.polygonOffsetFactor = floor.material.polygonOffsetUnits = 1;
    this.ground.add(floor, lines);
    const [w, x, y, z] = plane.q;
    this.ground.quaternion.set(x, y, z, w);
    const at = Math.round(this.home.centre.x / size) * size;
    const across = Math.round(this.home.centre.y / size) * size;
    this.ground.position.set(plane.p[0] + at, plane.p[1] + across, plane.p[2]);
    this.groundAt.copy(this.ground.position);
    this.line = size;
  }

  // What belongs to the world, beside the floor.
  private makeStatic(): void {
    for (const mesh of this.statics) {
      mesh.removeFromParent();
      (mesh.material as Material).dispose();
    }
    this.statics = this.shapes
      .filter((shape) => shape.body < 0)
      .flatMap((shape) =>
        piecesOf(shape, [0, 0, 0]).map(({ geometry, local }) => {
          const mesh = new Mesh(this.geometries.get(geometry), new MeshLambertMaterial({ color: colorOf(shape), side: this.solid.side }));
          mesh.matrixAutoUpdate = false;
          mesh.matrix.copy(local);
          return mesh;
        }),
      );
    if (this.statics.length > 0) this.scene.add(...this.statics);
  }

  // What is drawn: the file's pictures where there are some, unless the collision shapes are asked for.
  private get shapes(): readonly ReplayShape[] {
    return this.pictures.length > 0 && !this.collision ? this.pictures : this.replay.scene.shapes;
  }

  // Shows the collision shapes or the file's pictures. The runs that were added are drawn anew.
  setCollision(collision: boolean): void {
    if (this.collision === collision) return;
    this.collision = collision;
    const motions = [...this.figures].map(([index, figure]) => ({ index, motion: figure.motion }));
    for (const figure of this.figures.values()) figure.dispose();
    this.figures.clear();
    this.makeStatic();
    for (const { index, motion } of motions) this.add(index, motion);
  }

  // Before a run is shown; again does nothing.
  add(index: number, motion: Motion): void {
    if (this.figures.has(index)) return;
    const figure = new Figure(motion, this.replay, this.shapes, this.solid, this.geometries);
    this.figures.set(index, figure);
    this.scene.add(figure.solid, figure.ghosts, figure.trail);
    figure.setTrail(this.trailBody, kTrailThickness * this.radius);
    if (this.colors) this.setColors(this.colors);
  }

  setColors(colors: Colors): void {
    this.colors = colors;
    this.renderer.setClearColor(colors.panel, 1);
    for (const child of this.ground.children) {
      const material = (child as Mesh).material as MeshBasicMaterial;
      material.color.set(child instanceof LineSegments ? colors.rule : colors.faint);
    }
    this.figures.forEach((figure, index) => {
      const color = colors.runs[index] ?? "gray";
      figure.ghostMaterial.color.set(color);
      figure.trailMaterial.color.set(color);
    });
  }

  setMode(mode: Mode): void {
    this.mode = mode;
  }

  setTranslucent(index: number): void {
    this.translucent = index;
  }

  setShown(shown: number[], reference: number): void {
    this.shown = shown;
    this.reference = reference;
  }

  setTrail(body: number | null): void {
    this.trailBody = body;
    for (const figure of this.figures.values()) figure.setTrail(body, kTrailThickness * this.radius);
  }

  // In CSS pixels. Where edges are not smoothed, what stands still has twice the pixels.
  resize(width: number, height: number, moves: boolean): void {
    const own = window.devicePixelRatio || 1;
    const ratio = this.coarse && !moves ? 2 : Math.min(own, this.slow > 60 ? 0.75 : 2);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
  }

  // Places and draws all shown runs at a frame that need not be whole. Returns the columns of the views.
  draw(frame: number): number {
    const began = performance.now();
    const size = { width: this.canvas.clientWidth, height: this.canvas.clientHeight };
    const renderer = this.renderer;
    for (const index of new Set([...this.shown, this.reference])) this.figures.get(index)?.place(frame);
    const show = (solid: number, ghosts: number[]) => {
      this.figures.forEach((figure, index) => {
        figure.solid.visible = index === solid;
        figure.ghosts.visible = ghosts.includes(index);
        figure.trail.visible = this.trailBody !== null && (index === solid || ghosts.includes(index));
      });
    };
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, size.width, size.height);
    renderer.clear();
    let columns = 1;
    if (this.mode === "overlay" && this.translucent >= 0) {
      this.figures.forEach(({ ghostMaterial }, index) => {
        ghostMaterial.transparent = index === this.translucent;
        ghostMaterial.opacity = ghostMaterial.transparent ? kGhost : 1;
      });
      show(-1, this.shown);
      this.render(size.width, size.height, this.reference, frame);
    } else if (this.mode === "overlay") {
      show(this.reference, this.shown.filter((index) => index !== this.reference));
      this.render(size.width, size.height, this.reference, frame);
    } else {
      const count = this.shown.length;
      columns = this.columns(count, size.width, size.height);
      const rows = Math.ceil(count / columns);
      renderer.setScissorTest(true);
      this.shown.forEach((index, i) => {
        const [column, row] = [i % columns, Math.floor(i / columns)];
        const [left, right] = [Math.floor((size.width * column) / columns), Math.floor((size.width * (column + 1)) / columns)];
        const [top, bottom] = [Math.floor((size.height * row) / rows), Math.floor((size.height * (row + 1)) / rows)];
        renderer.setViewport(left, size.height - bottom, right - left, bottom - top);
        renderer.setScissor(left, size.height - bottom, right - left, bottom - top);
        show(index, []);
        this.render(right - left, bottom - top, index, frame);
      });
    }
    const took = performance.now() - began;
    this.slow = this.slow === 0 ? took : 0.9 * this.slow + 0.1 * took;
    return columns;
  }

  // `index`: the run that the camera follows, where it does.
  private render(width: number, height: number, index: number, frame: number): void {
    this.camera.aspect = width / Math.max(1, height);
    // The motion fills the view across or up; what is nearer than its middle looks larger.
    const distance = this.home.position.distanceTo(this.home.centre) - 0.4 * this.radius;
    const half = (kMargin * Math.max(this.half.up, this.half.across / this.camera.aspect)) / distance;
    this.camera.fov = 2 * Math.atan(half) * (180 / Math.PI);
    this.camera.updateProjectionMatrix();
    const motion = this.follows ? this.figures.get(index)?.motion : undefined;
    if (!motion) {
      this.renderer.render(this.scene, this.camera);
      return;
    }
    const [start, now] = [0, frame].map((each) => middleAt(motion.states, this.replay.bodies, each));
    const [x, y] = [now![0] - start![0], now![1] - start![1]];
    const { position } = this.camera;
    // The ground goes along by whole lines, so that it seems to stand.
    this.ground.position.set(this.groundAt.x + Math.round(x / this.line) * this.line, this.groundAt.y + Math.round(y / this.line) * this.line, this.groundAt.z);
    position.set(position.x + x, position.y + y, position.z);
    this.camera.updateMatrixWorld();
    this.renderer.render(this.scene, this.camera);
    position.set(position.x - x, position.y - y, position.z);
    this.camera.updateMatrixWorld();
  }

  columns(count: number, width: number, height: number): number {
    return gridColumns(count, width, height, Math.min(3, Math.max(1 / 3, this.half.across / this.half.up)));
  }

  // Where the shapes of a run that is shown were drawn last, for tests.
  places(index: number): [number, number, number][] {
    const shown = this.shown.includes(index) || index === this.reference;
    return (shown && this.figures.get(index)?.places()) || [];
  }

  get milliseconds(): number {
    return this.slow;
  }
}
