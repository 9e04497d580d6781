// The questions: which solids they take, the request they send, the figures and the picture of its answer.

import { outlines, posed, ring3d, solid2d, solid3d } from "./drawing.js";
import { next as nextDouble } from "./exact.js";
import { fromView, poseAt, toView } from "./frame.js";

const random = (seed) => () => {  // mulberry32: the same items every time, so that a picture can be shown to others
  seed = (seed + 0x6d2b79f5) | 0;
  let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
  t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
  return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
};

const snapped = (state, position) => (state.snap ? position.map((v) => Math.round(v * 4) / 4) : position);
const moved = (state, position) => fromView(state.frame, snapped(state, position.map((v, k) => v + state.offset[k])));
const shifted = (state, position) => moved(state, toView(state.frame, position));

function randomPosition(next, dimension, size) {
  return Array.from({ length: dimension }, () => (2 * next() - 1) * size);
}

function points(state) {
  if (state.items?.points) return state.own.points;
  const next = random(1);
  return Array.from({ length: state.n }, () => moved(state, randomPosition(next, state.dimension, 1.8)));
}

function segments(state) {
  if (state.items?.segments) return state.own.segments;
  const next = random(2);
  return Array.from({ length: state.n }, () => {
    const middle = randomPosition(next, state.dimension, 1), half = randomPosition(next, state.dimension, 1.6);
    return [-1, 1].map((sign) => moved(state, middle.map((v, k) => v + sign * half[k])));
  });
}

function stars(state) {
  if (state.items?.polygons) return state.own.polygons;
  const next = random(3);
  return Array.from({ length: state.n }, () => {
    const middle = randomPosition(next, state.dimension, 0.9), n = 5 + Math.floor(next() * 6), phase = 6.3 * next();
    const u = unit(randomPosition(next, state.dimension, 1)), v = state.dimension === 2 ? [-u[1], u[0]] : unit(across(u, randomPosition(next, 3, 1)));
    return [Array.from({ length: 2 * n }, (_, i) => {
      const radius = i % 2 ? 0.45 : 1, [c, s] = [Math.cos(phase + (Math.PI * i) / n), Math.sin(phase + (Math.PI * i) / n)];
      return moved(state, middle.map((m, k) => m + radius * (c * u[k] + s * v[k])));
    })];
  });
}

// The first solid, the second beside it, and the first again, turned: each with its pose.
function sceneBodies(state) {
  const turns = state.dimension === 3 ? [[[1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]] : [[[1, 0], [0, 1]], [[0, -1], [1, 0]]];
  return [[state.first, [-1, 0, 0], 0], [state.second, [0.75, 0.5, 0], 0], [state.first, [1, -0.75, 0], 1]].map(([solid, place, turn]) => [
    solid, poseAt(state.frame, turns[turn], place.slice(0, state.dimension)),
  ]);
}

// The pose of the second body, where it is moved and turned by hand.
export const secondPose = (state) => poseAt(state.frame, state.rotation, snapped(state, state.offset.slice(0, state.dimension)));

// The plane that is moved along its normal and turned by hand: its middle in the picture, and where it is among the solids.
function cuttingPlane(state) {
  const normal = state.rotation.map((row) => row[0]), [along] = snapped(state, [normal.reduce((sum, n, k) => sum + n * state.offset[k], 0)]);
  const middle = normal.map((n) => n * along);
  return { normal, middle, offset: -fromView(state.frame, middle).reduce((sum, v, k) => sum + v * normal[k], 0) };
}

const IDENTITY = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
const unit = (a) => a.map((v) => v / Math.hypot(...a));
const across = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const counted = (n, thing) => `${n.toLocaleString("en")} ${thing}${n === 1 ? "" : "s"}`;
// The textbook's plain float64 method beside the exact answer: what it gets wrong is painted over the picture.
const compared = (state, operation, body, painted) => state.plain ? {
  path: "/v1/compare", body: { operation, ...body },
  figures: ({ method, differing, seconds_exact, seconds_plain }) => ({
    "float64 wrong": differing.length, "float64 method": method, "exact beside float64": times(seconds_exact / seconds_plain),
  }),
  draw: ({ differing }) => [painted(differing)],
} : null;

// A ratio of times in words; within a tenth they are the same.
export function times(ratio) {
  const factor = Number((ratio < 1 ? 1 / ratio : ratio).toPrecision(2)).toLocaleString("en");
  return Math.abs(Math.log(ratio)) < 0.1 ? "takes the same time" : ratio < 1 ? `${factor} times as fast` : `takes ${factor} times as long`;
}

export const firstItems = (state) => (state.dimension === 3 ? solid3d(state.first, "first", 0.3) : solid2d(state.first, "first"));

// The doubles nearest to points on the edges of rings: as near to the boundary as data that was snapped to it.
function onEdges(list, n) {
  return list.flatMap((ring) => ring.flatMap((a, i) => {
    const b = ring[(i + 1) % ring.length];
    return Array.from({ length: n }, (_, k) => a.map((v, axis) => v + ((b[axis] - v) * (k + 0.5)) / n));
  }));
}

// Points beside the faces of a mesh: the double nearest to a point of a face, or its neighbour across the face.
function besideFaces({ vertices, faces }, n) {
  const random01 = random(4);
  return Array.from({ length: n }, (_, i) => {
    const face = faces[Math.floor(random01() * faces.length)], [a, b, c] = face.slice(0, 3).map((k) => vertices[k]);
    let [s, t] = [random01(), random01()];
    if (s + t > 1) [s, t] = [1 - s, 1 - t];
    const point = a.map((v, k) => v + s * (b[k] - v) + t * (c[k] - v)), normal = across(...[b, c].map((p) => p.map((v, k) => v - a[k])));
    const axis = normal.reduce((best, v, k) => (Math.abs(v) > Math.abs(normal[best]) ? k : best), 0), step = (i % 3) - 1;
    if (step) point[axis] = nextDouble(point[axis], step);
    return point;
  });
}

// What everybody calls a method of the textbook.
export const named = (method) => (method === "half-line" ? "ray casting" : method);

export const QUESTIONS = {
  proof: {
    hint: (dimension) => (dimension === 3
      ? "Points on the faces of a body, or one unit in the last place beside them, as measured and computed data has them. Each is truly inside, outside or on the surface, by less than can be drawn: zoom to a wrong one and see the doubles around it."
      : "Points snapped to the edges of a polygon, as drawn data is: each is the nearest double, so it lies inside, outside or exactly on the edge, by less than can be drawn. Drag the polygon or its corners; zoom to a wrong point and see the doubles around it."),
    firsts: (solid) => solid.polygon || solid.mesh,
    counts: (dimension) => (dimension === 3 ? [1, 3.5, 2.5] : [0, 2, 0.8]),
    methods: true,
    panes: 2,
    preferred: { 2: "star", 3: "octahedron" },
    placed: (state) => [[state.first, poseAt(state.frame, state.dimension === 2 ? [[1, 0], [0, 1]] : IDENTITY, state.dimension === 2 ? state.offset.slice(0, 2) : [0, 0, 0])]],
    ask(state) {
      const solid = state.dimension === 3 ? state.first.asked : { type: "polygon", rings: state.first.rings.map((ring) => ring.map((position) => shifted(state, position))) };
      const list = state.items?.points ?? (state.dimension === 3 ? besideFaces(state.first.mesh, state.n) : onEdges(solid.rings, state.n));
      return { path: "/v1/contains", body: { solid, points: list }, items: list.length };
    },
    beside: (state, body) => ({ path: "/v1/compare", body: { operation: "contains", ...(state.method ? { method: state.method } : {}), ...body } }),
    figures(state, { contained, boundary }, { differing, seconds_exact, seconds_plain, method }) {
      const inside = contained.filter(Boolean).length - boundary.length;
      return {
        inside, boundary: boundary.length, outside: contained.length - inside - boundary.length,
        "plain float64, wrong": `${differing.length.toLocaleString("en")} of ${contained.length.toLocaleString("en")} (${named(method)})`,
        "exact beside float64": times(seconds_exact / seconds_plain),
      };
    },
    verdict: (state, { contained }, figures, { differing, method }) => `Plain float64 (${named(method)}): ${differing.length.toLocaleString("en")} of ${contained.length.toLocaleString("en")} points wrong`,
    labels: ({ contained }, { differing, method }) => [`exact: ${contained.length.toLocaleString("en")} right`, `plain float64 (${named(method)}): ${differing.length.toLocaleString("en")} wrong`],
    draw(state, { contained, boundary }, { solid, points: list }, { differing }) {
      const on = new Set(boundary), wrong = new Set(differing), isFlat = state.dimension === 2;
      const items = isFlat ? [{ kind: "rings", rings: solid.rings, color: "first", fill: 0.2 }] : solid3d(state.first, "first", 0.35);
      for (const pane of [0, 1]) {
        const groups = { outside: [], inside: [], boundary: [] };
        list.forEach((point, i) => {
          if (pane && !isFlat && wrong.has(i)) return;
          const isIn = contained[i] !== (pane === 1 && wrong.has(i));
          groups[!pane && on.has(i) ? "boundary" : isIn ? "inside" : "outside"].push(point);
        });
        for (const [color, group] of Object.entries(groups)) items.push({ kind: "points", points: group, color, width: isFlat ? 6 : 5, pane });
      }
      const points = differing.map((i) => list[i]);
      return [...items, isFlat ? { kind: "crosses", points, color: "wrong", size: 12, width: 2.5, pane: 1 } : { kind: "points", points, color: "wrong", width: 9, pane: 1 }];
    },
  },

  contains: {
    hint: "Blue points are inside, orange ones exactly on the boundary, grey ones outside. The cloud is what you move; snapped to quarters, points meet faces, edges and corners; float64 paints in red what the plain method gets wrong.",
    firsts: () => true,
    counts: [1, 5, 3.5],
    ask(state) {
      const list = points(state);
      return { path: "/v1/contains", body: { solid: state.first.asked, points: list }, items: list.length };
    },
    figures(state, { contained, boundary }) {
      const inside = contained.filter(Boolean).length - boundary.length;
      return { inside, boundary: boundary.length, outside: contained.length - inside - boundary.length };
    },
    plain: true,
    further: (state, body) => compared(state, "contains", body, (wrong) => ({ kind: "points", points: wrong.map((i) => body.points[i]), color: "wrong", width: 9 })),
    verdict: (state, answer, { inside, boundary }) => `${inside.toLocaleString("en")} inside, ${boundary.toLocaleString("en")} on the boundary`,
    draw(state, { contained, boundary }, { points: list }) {
      const groups = { outside: [], inside: [], boundary: [] }, on = new Set(boundary);
      list.forEach((point, i) => groups[on.has(i) ? "boundary" : contained[i] ? "inside" : "outside"].push(point));
      const size = state.n > 20000 ? 0.6 : 1;
      return [...firstItems(state), ...Object.entries(groups).map(([color, group]) => ({
        kind: "points", points: group, color, width: { outside: 3, inside: 5, boundary: 7 }[color] * size, alpha: color === "outside" ? 0.85 : 1,
      }))];
    },
  },

  distances: {
    hint: "A line leads from each point to the nearest point of the boundary: green to a face or an edge of the plane, orange to an edge or a corner. Each distance is the nearest double; snapped points have exact ties.",
    firsts: () => true,
    counts: [0, 3, 1.5],
    ask(state) {
      const list = points(state);
      return { path: "/v1/distances", body: { solid: state.first.asked, points: list, to: "boundary", nearest: true }, items: list.length };
    },
    figures: (state, { distances }) => ({ least: Math.min(...distances), largest: Math.max(...distances), "on the boundary": distances.filter((d) => d === 0).length }),
    verdict: (state, answer, { least, largest }) => `${least.toPrecision(6)} to ${largest.toPrecision(6)} away`,
    draw(state, { nearest, features }, { points: list }) {
      const flat = state.dimension === 3 ? "face" : "edge", lines = { kept: [], boundary: [] };
      list.forEach((point, i) => lines[[flat, "ball", "plane"].includes(features[i].kind) ? "kept" : "boundary"].push([point, nearest[i]]));
      return [
        ...firstItems(state),
        ...Object.entries(lines).map(([color, group]) => ({ kind: "lines", lines: group, color, width: state.n > 200 ? 1 : 2 })),
        { kind: "points", points: list, color: "outside", width: 4 },
      ];
    },
  },

  hits: {
    hint: "A lamp and its rays: green up to the first hit, with the normal there; orange where a ray meets an edge, a corner or a rim, or runs along a face. Move the lamp; snapped, rays meet edges and corners of cubes exactly.",
    dimensions: [3],
    firsts: (solid) => solid.mesh,
    counts: [0, 3.5, 2],
    ask(state) {
      const lamp = fromView(state.frame, snapped(state, [0, 1.6, 1.2].map((v, k) => v + state.offset[k]))), next = random(5);
      const rays = state.items?.segments?.map(([a, b]) => [a, b.map((v, k) => v - a[k])])
        ?? Array.from({ length: state.n }, () => [lamp, fromView(state.frame, snapped(state, randomPosition(next, 3, 1.2))).map((v, k) => v - lamp[k])]);
      return { path: "/v1/hits", body: { surface: state.first.asked, segments: rays, rays: true, keep: "first" }, items: rays.length };
    },
    figures(state, { hits }) {
      const kinds = {};
      for (const { kind } of hits) kinds[kind] = (kinds[kind] ?? 0) + 1;
      return { "rays that meet it": hits.length, ...kinds };
    },
    verdict: (state, { hits }) => `${counted(hits.length, "ray")} of ${state.n.toLocaleString("en")} ${hits.length === 1 ? "meets" : "meet"} it`,
    draw(state, { hits }, { segments: rays }) {
      const at = ({ segment, t }) => rays[segment][0].map((v, k) => v + t * rays[segment][1][k]), lines = { kept: [], boundary: [] }, met = new Set(hits.map(({ segment }) => segment));
      const size = 0.15 / state.frame.scale, tips = hits.map((hit) => [at(hit), unit(hit.normal)].reduce((p, n) => [p, p.map((v, k) => v + size * n[k])]));
      for (const hit of hits) lines[hit.kind === "across" ? "kept" : "boundary"].push([rays[hit.segment][0], at(hit)]);
      return [
        ...firstItems(state), { kind: "lines", lines: rays.filter((_, i) => !met.has(i)).map(([a, d]) => [a, a.map((v, k) => v + 2 * d[k])]), color: "outside", width: 0.7 },
        ...Object.entries(lines).map(([color, list]) => ({ kind: "lines", lines: list, color, width: state.n > 300 ? 0.7 : 1.5 })),
        { kind: "lines", lines: tips, color: "second", width: 1.5 }, { kind: "points", points: rays.slice(0, 1).map(([a]) => a), color: "boundary", width: 12 },
      ];
    },
  },

  collide: {
    hint: "Move the second body; the faces of the witness are orange, and the shortest line between bodies that are apart. Try the same solid twice, snapped: touching and overlapping are distinguished exactly.",
    firsts: () => true,
    seconds: () => true,
    ask(state) {
      const pose = secondPose(state);
      return { path: "/v1/collide", body: { first: state.first.asked, second: state.second.asked, poses: [pose] }, items: 1 };
    },
    figures(state, { collisions: [{ relation, witness }] }) {
      const faces = ["first_face", "second_face"].filter((name) => name in (witness ?? {})).map((name) => witness[name]);
      return { relation: relation.replaceAll("_", " "), witness: witness ? `${witness.kind.replace("_", "-")}${faces.length ? ` (faces ${faces.join(", ")})` : ""}` : "none" };
    },
    further: (state, body, { collisions: [{ relation }] }) => relation === "disjoint" ? {
      path: "/v1/clearance", body,
      figures: ({ clearances: [{ distance, features }] }) => ({ distance, "nearest features": features.map(({ kind }) => kind).join(", ") }),
      draw: ({ clearances: [{ points }] }) => [{ kind: "lines", lines: [points], color: "boundary", width: 3 }, { kind: "points", points, color: "boundary", width: 7 }],
    } : null,
    verdict: (state, answer, { relation, distance }) => (distance === undefined ? relation : `${relation}, ${distance.toPrecision(6)} apart`),
    draw(state, { collisions: [{ witness }] }, { poses: [pose] }) {
      const second = posed(state.second, pose), isFlat = state.dimension === 2;
      const items = isFlat ? [...solid2d(state.first, "first"), ...solid2d(second, "second")] : [...solid3d(state.first, "first", 0.45), ...solid3d(state.second, "second", 0.45, pose)];
      for (const [solid, name] of [[state.first, "first_face"], [second, "second_face"]]) {
        const face = solid.mesh?.faces[witness?.[name]];
        if (face) items.push(...ring3d(face.map((i) => solid.mesh.vertices[i]), "boundary"));
        else if (witness?.[name] >= 0 && solid.rings) items.push({ kind: "lines", lines: [edge(solid.rings, witness[name])], color: "boundary", width: 4 });
      }
      return items;
    },
  },

  segments: {
    hint: "What remains of each segment is green. In a concave solid a segment may fall into several pieces; all their ends are correctly rounded.",
    firsts: () => true,
    counts: [0, 4, 1.75],
    ask(state) {
      const list = segments(state);
      return { path: "/v1/clip/segments", body: { region: state.first.asked, segments: list }, items: list.length };
    },
    figures: (state, { pieces }) => ({ pieces: pieces.length, "of segments": state.n }),
    plain: true,
    further: (state, body) => compared(state, "clip_segments", body, (wrong) => ({ kind: "lines", lines: wrong.map((i) => body.segments[i]), color: "wrong", width: 4 })),
    verdict: (state, { pieces }) => `${counted(pieces.length, "piece")} of ${counted(state.n, "segment")}`,
    draw(state, { pieces }, { segments: list }) {
      const width = state.n > 1000 ? 1 : 2.5;
      return [
        ...firstItems(state),
        { kind: "lines", lines: list, color: "outside", width: width / 2 },
        { kind: "lines", lines: pieces.map(({ start, end }) => [start, end]), color: "kept", width },
        { kind: "points", points: state.n > 1000 ? [] : pieces.flatMap(({ start, end }) => [start, end]), color: "kept", width: 5 },
      ];
    },
  },

  scene: {
    placed: sceneBodies,
    hint: "Drag the ray, turn it: what of it lies within which of three bodies, in the exact order of all ends. Green pieces and orange ones take turns along it; the first is the thickest.",
    firsts: () => true,
    seconds: () => true,
    ask(state) {
      const bodies = sceneBodies(state).map(([solid, pose]) => ({ solid: solid.asked, pose }));
      const ends = state.items?.segments?.[0] ?? [-2, 2].map((x) => moved(state, state.rotation.map((row) => x * row[0])));
      return { path: "/v1/clip/segments/scene", body: { bodies, segments: [ends] }, items: 1 };
    },
    figures(state, { pieces }) {
      const told = pieces.map(({ body, t, ranks }, i) => [`${i + 1}. in body ${body}`, `t ${t[0].toPrecision(6)} to ${t[1].toPrecision(6)} (ends ${ranks.join(", ")})`]);
      return { pieces: pieces.length, ...Object.fromEntries(told) };
    },
    verdict: (state, { pieces }) => (pieces.length ? `first met: body ${pieces[0].body}, ${counted(pieces.length, "piece")}` : "nothing is met"),
    draw(state, { pieces }, { segments: list }) {
      const items = sceneBodies(state).flatMap(([solid, pose], i) => (state.dimension === 2 ? solid2d(posed(solid, pose), i % 2 ? "second" : "first") : solid3d(solid, i % 2 ? "second" : "first", 0.3, pose)));
      items.push({ kind: "lines", lines: list, color: "outside", width: 1.5 });
      pieces.forEach(({ start, end }, i) => {
        const color = i % 2 ? "boundary" : "kept";
        items.push({ kind: "lines", lines: [[start, end]], color, width: Math.max(2, 6 - i) }, { kind: "points", points: [start, end], color, width: 7 });
      });
      return items;
    },
  },

  cut: {
    hint: "What a plane leaves of the body on the side of its normal, closed: grey, its cap green; next to it the section. Move the plane, turn it; snapped to quarters it passes through corners and along faces.",
    dimensions: [3],
    firsts: (solid) => solid.mesh && !solid.crosses,
    preferred: { 3: "knot" },
    panes: 2,
    turns: true,
    middle: (state) => cuttingPlane(state).middle,
    ask(state) {
      const { normal, offset } = cuttingPlane(state);
      return { path: "/v1/cut", body: { solid: state.first.asked, region: { type: "half_space", normal, offset } }, items: state.first.mesh.faces.length };
    },
    figures: (state, { parts: [{ volume, area, faces, collapsed, folded }] }) => ({
      "volume inside": volume, "area of its surface": area, faces: faces.length, "flat after rounding": collapsed.length, "turned over by rounding": folded.length,
    }),
    further: (state, { solid, region: { normal, offset } }) => ({
      path: "/v1/section", body: { solid, planes: [[...normal, offset]] },
      figures({ sections: [{ pieces }] }) {
        const rings = pieces.flatMap(({ shell, holes }) => [shell, ...holes]), total = (values) => values.reduce((sum, v) => sum + v, 0);
        const perimeter = total(rings.flatMap((ring) => ring.map((p, i) => Math.hypot(...p.map((v, k) => v - ring.at(i - 1)[k])))));
        return { "area of the section": total(pieces.map(({ area }) => area)), "its perimeter": perimeter, "its pieces": pieces.length, "its holes": rings.length - pieces.length };
      },
      draw: ({ sections: [{ pieces }] }) => outlines(pieces.flatMap(({ shell, holes }) => [shell, ...holes]), "kept", 2.5).map((item) => ({ ...item, pane: 1 })),
    }),
    labels: (answer, other, figures) => [`what remains, volume ${figures["volume inside"].toPrecision(6)}`, `section, area ${figures["area of the section"]?.toPrecision(6) ?? "refused"}`],
    verdict: (state, answer, figures) => `section ${figures["area of the section"]?.toPrecision(6) ?? "refused"}, volume ${figures["volume inside"].toPrecision(6)}`,
    draw(state, { parts: [{ vertices, faces, origins }] }) {
      const part = (isCap) => ({ kind: "triangles", mesh: { vertices, faces: faces.filter((face, i) => origins[i] < 0 === isCap) } });
      return [...solid3d(state.first, "outside", 0.1).map((item) => ({ ...item, pane: 0 })), { ...part(false), color: "first", alpha: 0.6, pane: 0 }, { ...part(true), color: "kept", alpha: 0.7 }];
    },
  },

  polygons: {
    hint: "Sutherland-Hodgman on a convex region, in the plane and in space: green is what remains of the grey stars.",
    firsts: (solid) => solid.convex,
    counts: [0, 2.5, 0.75],
    ask(state) {
      const list = stars(state);
      return { path: "/v1/clip/polygons", body: { region: state.first.asked, polygons: list }, items: list.length };
    },
    figures: (state, { polygons }) => ({
      "rings left": polygons.reduce((sum, { rings }) => sum + rings.length, 0), "of polygons": polygons.length,
      "with bridges possible": polygons.filter((polygon) => polygon.may_have_bridges).length,
    }),
    verdict: (state, answer, figures) => `${counted(figures["rings left"], "ring")} left of ${counted(state.n, "polygon")}`,
    draw(state, { polygons }, { polygons: list }) {
      return [...firstItems(state), ...outlines(list.flat(), "outside", 1, 0), ...outlines(polygons.flatMap(({ rings }) => rings), "kept", 2.5, 0.25)];
    },
  },

  overlay: {
    hint: "Move the second polygon, or drag a corner of the first. Separate pieces with holes, valid after rounding, the exact area beside them.",
    dimensions: [2],
    firsts: (solid) => solid.polygon,
    seconds: (solid) => solid.polygon,
    operations: true,
    ask(state) {
      const rings = posed(state.second, poseAt(state.frame, state.rotation, state.offset.slice(0, 2))).rings.map((ring) => ring.map((position) => fromView(state.frame, snapped(state, toView(state.frame, position)))));
      return { path: "/v1/overlay", body: { subject: state.first.json, clip: { type: "polygon", rings }, operation: state.operation, area: true }, items: 1 };
    },
    figures: (state, { pieces, area, rounding, collapsed }) => ({
      pieces: pieces.length, holes: pieces.reduce((sum, { holes }) => sum + holes.length, 0), "exact area": area,
      "vertices moved for validity": rounding.vertices_moved, "lost to rounding": collapsed.length,
    }),
    verdict: (state, { pieces, area }) => `${counted(pieces.length, "piece")}, area ${area?.toPrecision(9)}`,
    draw(state, { pieces }, { clip }) {
      return [
        ...solid2d(state.first, "first"), { kind: "rings", rings: clip.rings, color: "second", fill: 0.12 },
        ...pieces.map(({ shell, holes }) => ({ kind: "rings", rings: [shell, ...holes], color: "kept", fill: 0.45, width: 2.5 })),
      ];
    },
  },
};

function edge(rings, first) {
  for (const ring of rings) {
    if (first < ring.length) return [ring[first], ring[(first + 1) % ring.length]];
    first -= ring.length;
  }
  return [];
}
