// From solids, rings and lines to the items of a view. Colours are names of the style sheet's variables.

import { toView, turned as times } from "./frame.js";

// The solid under a pose, as far as it is drawn.
export function posed(solid, { rotation, translation }) {
  const place = (p) => times(rotation, p).map((v, k) => v + translation[k]), result = { ...solid };
  if (solid.mesh) result.mesh = { ...solid.mesh, vertices: solid.mesh.vertices.map(place) };
  if (solid.rings) result.rings = solid.rings.map((ring) => ring.map(place));
  if (solid.center) result.center = place(solid.center);
  if (solid.normal) {
    result.normal = times(rotation, solid.normal);
    result.offset = solid.offset - result.normal.reduce((sum, n, k) => sum + n * translation[k], 0);
  }
  return result;
}

export function solid2d(solid, color) {
  if (solid.rings) return [{ kind: "rings", rings: solid.rings, color, fill: 0.2 }];
  if (solid.center) return [{ kind: "disc", center: solid.center, radius: solid.radius, color, fill: 0.2 }];
  return [{ kind: "half_plane", normal: solid.normal, offset: solid.offset, color, fill: 0.2 }];
}

// A body in space, under a pose; its triangles are put into one array once, the pose is applied when it is drawn.
export function solid3d(solid, color, alpha, pose) {
  const { vertices, faces } = solid.mesh, edges = [], place = pose ? (p) => times(pose.rotation, p).map((v, k) => v + pose.translation[k]) : (p) => p;
  if (faces.length <= 20) for (const face of faces) face.forEach((i, k) => edges.push([vertices[i], vertices[face[(k + 1) % face.length]]].map(place)));
  return [{ kind: "triangles", mesh: solid.mesh, pose, color, alpha }, { kind: "lines", lines: edges, color, width: 1.5 }];
}

const arrays = new WeakMap(); // of triangles in a frame, by mesh

function triangles(mesh, frame) {
  const kept = arrays.get(mesh);
  if (kept?.frame === frame) return kept;
  const positions = new Float32Array(mesh.vertices.flatMap((p) => toView(frame, p)));
  const indices = new Uint32Array(mesh.faces.flatMap((face) => face.slice(2).flatMap((corner, i) => [face[0], face[i + 1], corner])));
  const made = { frame, positions, indices };
  arrays.set(mesh, made);
  return made;
}

// A closed ring in space, filled as a fan and outlined, before everything else.
export function ring3d(ring, color) {
  const fan = [];
  for (let i = 2; i < ring.length; i++) fan.push(ring[0], ring[i - 1], ring[i]);
  return [{ kind: "triangles", points: fan, color, alpha: 0.6, onTop: true }, { ...sides(ring, color, 3), onTop: true }];
}

function sides(ring, color, width) {
  return { kind: "lines", lines: ring.map((a, i) => [a, ring[(i + 1) % ring.length]]), color, width };
}

// Rings of the plane are filled, rings in space (planar or not) outlined.
export function outlines(rings, color, width, fill) {
  if (rings[0]?.[0]?.length === 2) return rings.map((ring) => ({ kind: "rings", rings: [ring], color, width, fill }));
  return rings.map((ring) => sides(ring, color, width));
}

// What the views want: numbers in one array, in the frame; colours and poses resolved.
export function prepared3d(items, frame, colors) {
  return items.map(({ kind, points, lines, mesh, pose, color, alpha = 1, width, onTop, pane }) => ({
    kind, width, onTop, pane, color: [...colors[color].map((v) => v / 255), alpha],
    ...(mesh ? triangles(mesh, frame) : { positions: new Float32Array((points ?? lines.flat()).flatMap((p) => toView(frame, p))) }),
    pose: pose && { rotation: pose.rotation, translation: toView(frame, times(pose.rotation, frame.middle).map((v, k) => v + pose.translation[k])) },
  }));
}

const bounds = (all) => [Math.min, Math.max].map((f) => all[0].map((_, k) => all.reduce((m, p) => f(m, p[k]), all[0][k])));

// The ball about bodies that were prepared, and about the rings that turn one of them.
export function ballAround(items, rings) {
  const all = items.filter(({ kind }) => kind === "triangles").flatMap(({ positions, pose }) => Array.from({ length: positions.length / 3 }, (_, i) => {
    const p = [...positions.subarray(3 * i, 3 * i + 3)];
    return pose ? times(pose.rotation, p).map((v, k) => v + pose.translation[k]) : p;
  }));
  if (rings) for (const k of [0, 1, 2]) for (const sign of [-1, 1]) all.push(rings.middle.map((v, j) => (j === k ? v + sign * rings.radius : v)));
  const [low, high] = bounds(all), middle = low.map((v, k) => (v + high[k]) / 2);
  const reach = rings ? Math.hypot(...rings.middle.map((v, k) => v - middle[k])) + rings.radius : 0;
  return { middle, radius: all.reduce((far, p) => Math.max(far, Math.hypot(...p.map((v, k) => v - middle[k]))), reach) };
}

// How far rings and discs of the plane reach from the origin along each axis, with a margin.
export function halfAround(items, least) {
  const all = items.flatMap(({ rings, center, radius }) => rings?.flat() ?? (center ? [-1, 1].map((sign) => center.map((v) => v + sign * radius)) : []));
  return [0, 1].map((k) => all.reduce((far, p) => Math.max(far, Math.abs(p[k]) / 1.1), least));
}

export function prepared2d(items, colors) {
  return items.map((item) => ({ ...item, color: `rgb(${colors[item.color].join(" ")} / ${item.alpha ?? 1})` }));
}

export function styleColors() {
  const probe = document.body.appendChild(document.createElement("span")), colors = {};
  for (const name of ["first", "second", "inside", "boundary", "outside", "kept", "wrong"]) {
    probe.style.color = `var(--${name})`;
    colors[name] = getComputedStyle(probe).color.match(/[\d.]+/g).slice(0, 3).map(Number);
  }
  probe.remove();
  return colors;
}
