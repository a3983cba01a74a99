// A system as it starts: its shapes in parallel projection, the far ones first.
import type { Picture, PictureShape, Point3 } from "../data";
import { svg } from "../dom";

const kElevation = -15; // degrees: the camera looks down

interface Stroke {
  depth: number;
  a: [number, number];
  b: [number, number];
  r: number;
  color: string;
}

function strokes(shapes: PictureShape[], azimuthDegrees: number): Stroke[] {
  const azimuth = (azimuthDegrees * Math.PI) / 180;
  const elevation = (kElevation * Math.PI) / 180;
  const [ca, sa, ce, se] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(elevation), Math.sin(elevation)];
  const dot = (axis: Point3, p: Point3) => axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2];
  const right: Point3 = [sa, -ca, 0];
  const up: Point3 = [-ca * se, -sa * se, ce];
  const back: Point3 = [-ca * ce, -sa * ce, -se];
  return shapes
    .map((shape) => ({
      depth: dot(back, shape.a) + dot(back, shape.b),
      a: [dot(right, shape.a), -dot(up, shape.a)] as [number, number],
      b: [dot(right, shape.b), -dot(up, shape.b)] as [number, number],
      r: shape.r,
      color: shape.c,
    }))
    .sort((first, second) => first.depth - second.depth);
}

// Null where there is nothing to draw.
export function picture(of: Picture, width: number, height: number): SVGSVGElement | null {
  if (of.image) {
    const drawing = svg("svg", { class: "picture", width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${of.system} at its start` });
    drawing.append(svg("image", { href: of.image, width, height }));
    return drawing;
  }
  const list = strokes(of.start, of.azimuth);
  if (list.length === 0) return null;
  const ends = list.flatMap((stroke) => [
    [stroke.a[0], stroke.a[1], stroke.r],
    [stroke.b[0], stroke.b[1], stroke.r],
  ]) as [number, number, number][];
  const left = Math.min(...ends.map(([x, , r]) => x - r));
  const right = Math.max(...ends.map(([x, , r]) => x + r));
  const top = Math.min(...ends.map(([, y, r]) => y - r));
  const bottom = Math.max(...ends.map(([, y, r]) => y + r));
  const scale = Math.min(width / (right - left), height / (bottom - top));
  const place = ([x, y]: [number, number]) => [
    width / 2 + scale * (x - (left + right) / 2),
    height / 2 + scale * (y - (top + bottom) / 2),
  ];
  const drawing = svg("svg", {
    class: "picture", width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${of.system} at its start`,
  }); // prettier-ignore
  for (const stroke of list) {
    const [x1, y1] = place(stroke.a);
    const [x2, y2] = place(stroke.b);
    const d = `M${x1!.toFixed(2)},${y1!.toFixed(2)}L${(x2! + (x1 === x2 && y1 === y2 ? 0.01 : 0)).toFixed(2)},${y2!.toFixed(2)}`;
    const thick = 2 * scale * stroke.r;
    drawing.append(
      svg("path", { class: "outline", d, "stroke-width": thick.toFixed(2), style: `--shape:${stroke.color}` }),
      svg("path", { d, "stroke-width": Math.max(0.7 * thick, thick - 1.6).toFixed(2), stroke: stroke.color }),
    );
  }
  return drawing;
}
