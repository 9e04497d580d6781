// A request in the address, as the report of speed against error links it: its solids and items in place of the examples,
// every number as given. The picture is scaled to its size; what is asked is not.

const QUESTION = {
  "/v1/contains": "contains", "/v1/distances": "distances", "/v1/clip/segments": "segments", "/v1/clip/polygons": "polygons", "/v1/overlay": "overlay",
  "/v1/collide": "collide", "/v1/clearance": "collide",
};
export const KEYS = ["given first", "given second"];

const corners = ([a, b]) => [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [i & 1, (i >> 1) & 1, i >> 2].map((bit, k) => (bit ? b : a)[k]));
const QUADS = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

// A solid of the HTTP interface as the playground keeps its examples; one that it cannot draw is asked about all the same.
function example(json, dimension) {
  const flags = { name: `${json.type.replace("_", " ")} of the link`, polygon: json.type === "polygon", convex: true };
  const drawn = { polyhedron: () => ({ vertices: json.vertices, faces: json.faces }), aabb: () => ({ vertices: corners([json.min, json.max]), faces: QUADS }),
    triangle: () => ({ vertices: json.vertices, faces: [[0, 1, 2]] }) };
  drawn.surface = drawn.polyhedron;
  if (dimension === 3) return { ...flags, make: () => ({ json, mesh: (drawn[json.type] ?? (() => ({ vertices: [], faces: [] })))() }) };
  if (json.type === "aabb") return { ...flags, make: () => ({ json, drawn: [[json.min, [json.max[0], json.min[1]], json.max, [json.min[0], json.max[1]]]] }) };
  const known = ["polygon", "sphere", "half_space"].includes(json.type);
  return { ...flags, make: () => ({ json, ...(known ? {} : { drawn: json.type === "triangle" ? [json.vertices] : [] }) }) };
}

const positions = (value) => (Array.isArray(value) ? (typeof value[0] === "number" ? [value] : value.flatMap(positions)) : []);

// What the link asks: the question, the dimension, the solids by key, the items, and where the picture is.
export function readRequest(text) {
  const [path, body] = JSON.parse(text), question = QUESTION[path];
  const solids = [body.solid ?? body.region ?? body.first ?? body.subject, body.second ?? body.clip].filter(Boolean);
  const items = body.points ?? body.segments ?? body.polygons, all = positions(items);
  for (const solid of solids) {
    all.push(...positions(solid.rings ?? solid.vertices ?? (solid.min ? [solid.min, solid.max] : [])));
    if (solid.radius !== undefined) for (const sign of [-1, 1]) all.push(solid.center.map((v) => v + sign * solid.radius));
  }
  const dimension = all[0]?.length;
  if (!question || ![2, 3].includes(dimension) || body.poses) throw new Error("the link holds a request that cannot be shown");
  const ends = [Math.min, Math.max].map((f) => all[0].map((_, k) => all.reduce((m, p) => f(m, p[k]), all[0][k])));
  const size = Math.max(...ends[0].map((low, k) => ends[1][k] - low)) || 1;
  return {
    text, question, dimension, operation: body.operation, items, n: items?.length ?? 1,
    examples: Object.fromEntries(solids.map((solid, i) => [KEYS[i], example(solid, dimension)])),
    frame: { middle: ends[0].map((low, k) => low + (ends[1][k] - low) / 2), scale: 3 / size },
  };
}

// Items of a view as they look in the frame.
export function framed(drawn, { middle, scale }) {
  const place = (p) => p.map((v, k) => (v - middle[k]) * scale);
  return drawn.map((item) => ({
    ...item, ...(item.points && { points: item.points.map(place) }), ...(item.lines && { lines: item.lines.map((line) => line.map(place)) }),
    ...(item.rings && { rings: item.rings.map((ring) => ring.map(place)) }), ...(item.center && { center: place(item.center), radius: item.radius * scale }),
    ...(item.normal && { offset: scale * (item.offset + item.normal.reduce((sum, n, k) => sum + n * middle[k], 0)) }),
  }));
}
