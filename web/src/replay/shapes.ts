// Shapes as pieces of few geometries, each drawn in one call however many there are.
import { BoxGeometry, BufferAttribute, BufferGeometry, CylinderGeometry, Matrix4, Quaternion, SphereGeometry, Vector3 } from "three";
import { ConvexGeometry } from "three/examples/jsm/geometries/ConvexGeometry.js";
import { toCreasedNormals } from "three/examples/jsm/utils/BufferGeometryUtils.js";

import type { ReplayHeightField, ReplayHull, ReplayMesh, ReplayScene, ReplayShape } from "./decode";

// A geometry by its key and where it stands in the frame that its shape is given in.
export interface Piece {
  geometry: string;
  local: Matrix4;
}

const kTurned = new Quaternion(1, 0, 0, 0); // half a turn about x

function hullGeometry(hull: ReplayHull): BufferGeometry {
  const corners: Vector3[] = [];
  for (let i = 0; i + 2 < hull.v.length; i += 3) {
    corners.push(new Vector3(hull.v[i], hull.v[i + 1], hull.v[i + 2]).multiplyScalar(hull.step));
  }
  return corners.length < 4 ? new BufferGeometry() : new ConvexGeometry(corners);
}

const kCrease = 0.6; // rad between faces, above which an edge is sharp

function meshGeometry(mesh: ReplayMesh): BufferGeometry {
  const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(Float32Array.from(mesh.v, (value) => value * mesh.step), 3));
  geometry.setIndex(mesh.f);
  return toCreasedNormals(geometry, kCrease);
}

// The surface; the solid below it is not drawn.
function fieldGeometry(field: ReplayHeightField): BufferGeometry {
  const { rows, columns } = field;
  const points = new Float32Array(3 * rows * columns);
  const triangles: number[] = [];
  for (let row = 0; row < rows; row += 1) {
    for (let column = 0; column < columns; column += 1) {
      const at = row * columns + column;
      points[3 * at] = -field.half_x + (2 * field.half_x * column) / (columns - 1);
      points[3 * at + 1] = -field.half_y + (2 * field.half_y * row) / (rows - 1);
      points[3 * at + 2] = field.step * (field.h[at] ?? 0);
      if (row + 1 === rows || column + 1 === columns) continue;
      const up = at + columns;
      triangles.push(at, at + 1, up, at + 1, up + 1, up);
    }
  }
  const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(points, 3));
  geometry.setIndex(triangles);
  geometry.computeVertexNormals();
  return geometry;
}

// Geometries of size 1, made when they are first asked for. A capsule is a tube of half length 1 and two caps, a sphere
// or ellipsoid two caps.
export class Geometries {
  private readonly made = new Map<string, BufferGeometry>();

  constructor(
    private readonly scene: ReplayScene,
    private readonly coarse: boolean,
  ) {}

  get(key: string): BufferGeometry {
    let geometry = this.made.get(key);
    if (!geometry) {
      geometry = this.make(key);
      this.made.set(key, geometry);
    }
    return geometry;
  }

  private make(key: string): BufferGeometry {
    // A multiple of four around, so that the edges of caps and tubes meet.
    const [around, along] = this.coarse ? [12, 3] : [20, 6];
    // Three's poles and axes lie along y, those of the model along z.
    if (key === "cap") return new SphereGeometry(1, around, along, 0, 2 * Math.PI, 0, Math.PI / 2).rotateX(Math.PI / 2);
    if (key === "tube") return new CylinderGeometry(1, 1, 2, around, 1, true).rotateX(Math.PI / 2);
    if (key === "cylinder") return new CylinderGeometry(1, 1, 2, around).rotateX(Math.PI / 2);
    if (key === "box") return new BoxGeometry(2, 2, 2);
    const [list, number] = key.split(" ");
    const hull = list === "hull" ? this.scene.hulls?.[Number(number)] : undefined;
    if (hull) return hullGeometry(hull);
    const mesh = list === "mesh" ? this.scene.meshes?.[Number(number)] : undefined;
    if (mesh) return meshGeometry(mesh);
    const field = list === "height_field" ? this.scene.height_fields?.[Number(number)] : undefined;
    return field ? fieldGeometry(field) : new BufferGeometry();
  }
}

// The pieces of a shape whose frame's origin lies `from` that in which it is given.
export function piecesOf(shape: ReplayShape, from: readonly [number, number, number]): Piece[] {
  const [w, x, y, z] = shape.q;
  const rotation = new Quaternion(x, y, z, w);
  const centre = new Vector3(shape.p[0] - from[0], shape.p[1] - from[1], shape.p[2] - from[2]);
  const piece = (geometry: string, size: Vector3, at = centre, turn = rotation): Piece => ({
    geometry,
    local: new Matrix4().compose(at, turn, size),
  });
  const half = new Vector3(...(shape.half_size ?? [1, 1, 1]));
  const caps = (size: Vector3, apart: number): Piece[] => {
    const end = (sign: number) => new Vector3(0, 0, sign * apart).applyQuaternion(rotation).add(centre);
    return [piece("cap", size, end(1)), piece("cap", size, end(-1), rotation.clone().multiply(kTurned))];
  };
  const ball = new Vector3(shape.radius, shape.radius, shape.radius);
  const long = new Vector3(shape.radius, shape.radius, shape.half_length);
  switch (shape.type) {
    case "sphere":
      return caps(ball, 0);
    case "capsule":
      return [...caps(ball, shape.half_length), piece("tube", long)];
    case "ellipsoid":
      return caps(half, 0);
    case "cylinder":
      return [piece("cylinder", long)];
    case "box":
      return [piece("box", half)];
    case "hull":
    case "mesh":
    case "height_field":
      return [piece(`${shape.type} ${shape.data ?? -1}`, new Vector3(1, 1, 1))];
    case "plane":
      return []; // the floor
  }
}

// The largest distance of a shape's points from the origin of its frame.
export function reachOf(shape: ReplayShape, scene: ReplayScene): number {
  if (shape.type === "box") return Math.hypot(...(shape.half_size ?? [0]));
  if (shape.type === "ellipsoid") return Math.max(...(shape.half_size ?? [0]));
  if (shape.type === "cylinder") return Math.hypot(shape.radius, shape.half_length);
  if (shape.type === "hull" || shape.type === "mesh") {
    const hull = (shape.type === "hull" ? scene.hulls : scene.meshes)?.[shape.data ?? -1];
    let most = 0;
    for (let i = 0; hull && i < hull.v.length; i += 3) {
      most = Math.max(most, hull.step * Math.hypot(hull.v[i]!, hull.v[i + 1]!, hull.v[i + 2]!));
    }
    return most;
  }
  return shape.radius + shape.half_length;
}
