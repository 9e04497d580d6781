// Solids that are brought: by a file, a text, or a request in the address, as the report of speed against error links it. They
// are asked about as they are given; only the picture is scaled to its size.

import { positions } from "./own.js";

const QUESTION = {
  "/v1/contains": "contains", "/v1/distances": "distances", "/v1/clip/segments": "segments", "/v1/clip/polygons": "polygons", "/v1/overlay": "overlay",
  "/v1/collide": "collide", "/v1/clearance": "collide",
};

const corners = ([a, b]) => [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [i & 1, (i >> 1) & 1, i >> 2].map((bit, k) => (bit ? b : a)[k]));
const QUADS = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

// Positions between which a solid lies, as far as it says.
export function extent(json) {
  const ends = json.radius === undefined ? [] : [-1, 1].map((sign) => json.center.map((v) => v + sign * json.radius));
  return [...positions(json.rings ?? json.vertices ?? (json.min ? [json.min, json.max] : [])).filter((p) => p.length), ...ends];
}

// A solid of the HTTP interface as the playground keeps its examples; one that it cannot draw is asked about all the same.
export function example(json, name) {
  const found = extent(json), dimension = found[0]?.length ?? (json.normal?.length || json.planes?.[0].length - 1);
  if (![2, 3].includes(dimension)) throw new Error(`${name} holds a solid that cannot be shown: type ${JSON.stringify(json.type)}`);
  const flags = { name, isOwn: true, polygon: json.type === "polygon", mesh: json.type === "polyhedron", convex: json.type !== "polygon" || dimension === 2 };
  const drawn = { polyhedron: () => ({ vertices: json.vertices, faces: json.faces }), aabb: () => ({ vertices: corners([json.min, json.max]), faces: QUADS }),
    triangle: () => ({ vertices: json.vertices, faces: [[0, 1, 2]] }) };
  drawn.surface = drawn.polyhedron;
  const known = ["polygon", "sphere", "half_space"].includes(json.type);
  const parts = dimension === 3 ? { mesh: (drawn[json.type] ?? (() => ({ vertices: [], faces: [] })))() }
    : json.type === "aabb" ? { drawn: [[json.min, [json.max[0], json.min[1]], json.max, [json.min[0], json.max[1]]]] }
      : known ? {} : { drawn: json.type === "triangle" ? [json.vertices] : [] };
  return { dimension, flags, solid: { json, ...parts, isOwn: true, extent: found } };
}

// What the link asks: the question, the dimension, the solids and the items.
export function readRequest(text) {
  const [path, body] = JSON.parse(text), question = QUESTION[path];
  const solids = [body.solid ?? body.region ?? body.first ?? body.subject, body.second ?? body.clip].filter(Boolean);
  const items = Object.fromEntries(["points", "segments", "polygons"].filter((name) => body[name]).map((name) => [name, body[name]]));
  const dimension = [...solids.flatMap(extent), ...positions(Object.values(items)[0] ?? [])][0]?.length;
  if (!question || ![2, 3].includes(dimension) || body.poses) throw new Error("the link holds a request that cannot be shown");
  return { question, dimension, solids, items, operation: body.operation };
}
