// The frame: how the picture's coordinates (a body is some two units across) belong to those of the solids that are asked about,
// which stay as they were given. The scale is a power of two and the middle a whole step, so that snapped positions are exact.

export const UNIT = { middle: [0, 0, 0], scale: 1 };

export function frameOf(all) {
  const [low, high] = [Math.min, Math.max].map((f) => all[0].map((_, k) => all.reduce((m, p) => f(m, p[k]), all[0][k])));
  const size = Math.max(...low.map((v, k) => high[k] - v)), scale = size > 0 && Number.isFinite(size) ? 2 ** Math.round(1.2 - Math.log2(size)) : 1, step = 0.25 / scale;
  return { middle: low.map((v, k) => Math.round((v / 2 + high[k] / 2) / step) * step), scale };
}

export const toView = ({ middle, scale }, p) => p.map((v, k) => (v - middle[k]) * scale);
export const fromView = ({ middle, scale }, p) => p.map((v, k) => middle[k] + v / scale);
export const turned = (rotation, p) => rotation.map((row) => row.reduce((sum, r, k) => sum + r * p[k], 0));

// The pose that turns about the frame's middle and moves by so much of the picture.
export function poseAt({ middle, scale }, rotation, move) {
  const origin = middle.slice(0, rotation.length), at = turned(rotation, origin);
  return { rotation, translation: origin.map((v, k) => v - at[k] + move[k] / scale) };
}

// An example where the frame is not its own: the same solid in the coordinates of what was brought.
export function placed(solid, frame) {
  if (frame === UNIT || solid.isOwn) return solid;
  if (solid.placed?.frame === frame) return solid.placed;
  const to = (p) => fromView(frame, p), { json } = solid, result = { ...solid, frame, base: solid, isOwn: true };
  if (solid.mesh) result.mesh = { ...solid.mesh, vertices: solid.mesh.vertices.map(to) };
  if (solid.rings) result.rings = solid.rings.map((ring) => ring.map(to));
  const origin = frame.middle.slice(0, json.center?.length ?? json.normal?.length ?? json.planes?.[0].length - 1);
  const offset = (n, d) => d / frame.scale - n.reduce((sum, v, k) => sum + v * origin[k], 0);
  if (json.type === "sphere") Object.assign(result, { center: to(json.center), radius: json.radius / frame.scale });
  if (json.type === "half_space") result.offset = offset(json.normal, json.offset);
  result.json = {
    polygon: () => ({ ...json, rings: result.rings }), polyhedron: () => ({ ...json, vertices: result.mesh.vertices }), aabb: () => ({ ...json, min: to(json.min), max: to(json.max) }),
    sphere: () => ({ ...json, center: result.center, radius: result.radius }), half_space: () => ({ ...json, offset: result.offset }),
    convex: () => ({ ...json, planes: json.planes.map((plane) => [...plane.slice(0, -1), offset(plane.slice(0, -1), plane.at(-1))]) }),
  }[json.type]();
  result.asked = result.json;
  solid.placed = result;
  return result;
}

// Items of a picture as they look in the frame.
export function framed(drawn, frame) {
  if (frame === UNIT) return drawn;
  const place = (p) => toView(frame, p);
  return drawn.map((item) => ({
    ...item, ...(item.points && { points: item.points.map(place) }), ...(item.lines && { lines: item.lines.map((line) => line.map(place)) }),
    ...(item.rings && { rings: item.rings.map((ring) => ring.map(place)) }), ...(item.center && { center: place(item.center), radius: item.radius * frame.scale }),
    ...(item.normal && { offset: frame.scale * (item.offset + item.normal.reduce((sum, n, k) => sum + n * frame.middle[k], 0)) }),
  }));
}
