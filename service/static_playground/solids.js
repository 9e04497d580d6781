// Example solids: what the service is asked with (`json`) and what is drawn (`mesh`, or the 2D fields themselves).

const mesh = (vertices, faces) => ({ json: { type: "polyhedron", vertices, faces }, mesh: { vertices, faces } });
const at = (u, n) => (2 * Math.PI * u) / n;

function box(low, high) {
  const vertices = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [i & 1, (i >> 1) & 1, i >> 2].map((bit, k) => (bit ? high : low)[k]));
  // in the order in which the service numbers the faces of a box: xmin, xmax, ymin, ymax, zmin, zmax
  return { vertices, faces: [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] };
}

// A closed grid of n times m quads, the position of (u, v) given; triangles, since the quads are not planar.
function closedGrid(n, m, position) {
  const vertices = [], faces = [], index = (u, v) => (u % n) * m + (v % m);
  for (let u = 0; u < n; u++) for (let v = 0; v < m; v++) vertices.push(position(u, v));
  for (let u = 0; u < n; u++) for (let v = 0; v < m; v++) {
    faces.push([index(u, v), index(u + 1, v), index(u + 1, v + 1)], [index(u, v), index(u + 1, v + 1), index(u, v + 1)]);
  }
  return mesh(vertices, faces);
}

const torus = () => closedGrid(48, 24, (u, v) => {
  const ring = 1 + 0.4 * Math.cos(at(v, 24));
  return [ring * Math.cos(at(u, 48)), 0.4 * Math.sin(at(v, 24)), -ring * Math.sin(at(u, 48))];
});

function knot(n = 200, m = 16) {  // a tube along a trefoil, its frame held upright by the direction to the axis
  const curve = (t) => [(2 + Math.cos(3 * t)) * Math.cos(2 * t) / 2.4, (2 + Math.cos(3 * t)) * Math.sin(2 * t) / 2.4, Math.sin(3 * t) / 1.6];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => a.map((v) => v / Math.hypot(...a));
  return closedGrid(n, m, (u, v) => {
    const t = at(u, n), p = curve(t), q = curve(t + 1e-4), along = unit(q.map((x, k) => x - p[k]));
    const side = unit(cross(along, [p[0], p[1], 0.3])), up = cross(along, side);
    return p.map((x, k) => x + 0.26 * (side[k] * Math.cos(at(v, m)) + up[k] * Math.sin(at(v, m))));
  });
}

function ball() {
  const { mesh: drawn } = closedGrid(24, 25, (u, v) => {
    const [a, b] = [at(u, 24), Math.PI * Math.min(v / 24, 1)];
    return [Math.sin(b) * Math.cos(a), Math.cos(b), Math.sin(b) * Math.sin(a)];
  });
  return { json: { type: "sphere", center: [0, 0, 0], radius: 1 }, mesh: drawn };
}

function octahedron(scale = 1.2) {
  const vertices = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]].map((p) => p.map((v) => v * scale));
  const faces = [];
  for (const x of [0, 1]) for (const y of [2, 3]) for (const z of [4, 5]) {
    faces.push((x + y + z) % 2 ? [x, z, y] : [x, y, z]);
  }
  return mesh(vertices, faces);
}

function crossing() {  // two cubes in one body: what both cover cancels under even-odd
  const [a, b] = [box([-1, -1, -1], [0.5, 0.5, 0.5]), box([-0.5, -0.5, -0.5], [1, 1, 1])];
  return mesh([...a.vertices, ...b.vertices], [...a.faces, ...b.faces.map((face) => face.map((i) => i + 8))]);
}

const cube = () => ({ json: { type: "aabb", min: [-0.75, -0.75, -0.75], max: [0.75, 0.75, 0.75] }, mesh: box([-0.75, -0.75, -0.75], [0.75, 0.75, 0.75]) });
const floor = () => ({
  json: { type: "half_space", normal: [0, 1, 0], offset: 0.25 },
  mesh: { vertices: [[-2, -0.25, -2], [2, -0.25, -2], [2, -0.25, 2], [-2, -0.25, 2]], faces: [[0, 1, 2, 3]] },
});

const rings = (...list) => ({ json: { type: "polygon", rings: list } });
const round = (n, radius, phase = 0, squeeze = 1) => Array.from({ length: n }, (_, i) => [radius(i) * Math.cos(at(i, n) + phase), squeeze * radius(i) * Math.sin(at(i, n) + phase)]);

export const solid_types = {
  3: {
    torus: { name: "torus (2,304 faces)", mesh: true, make: torus },
    knot: { name: "trefoil knot (6,400 faces)", mesh: true, make: knot },
    octahedron: { name: "octahedron", mesh: true, make: octahedron, convex: true },
    crossing: { name: "two crossing cubes (even-odd)", mesh: true, crosses: true, make: crossing },
    cube: { name: "box", make: cube, convex: true },
    ball: { name: "sphere", make: ball, round: true },
    floor: { name: "half-space", make: floor, convex: true, unbounded: true },
  },
  2: {
    gear: { name: "gear with a hole", polygon: true, make: () => rings(round(48, (i) => (i % 4 < 2 ? 1.5 : 1.2)), round(24, () => 0.5).reverse()) },
    pentagram: { name: "pentagram (even-odd)", polygon: true, make: () => rings([0, 2, 4, 1, 3].map((i) => round(5, () => 1.5, Math.PI / 2)[i])) },
    comb: { name: "comb", polygon: true, make: () => rings([[-1.5, -1], ...Array.from({ length: 21 }, (_, i) => [-1.5 + 0.15 * i, i % 2 ? -0.6 : 1]), [1.5, -1]]) },
    star: { name: "star", polygon: true, make: () => rings(round(10, (i) => (i % 2 ? 1.5 : 0.65), 0.1)) },
    blob: { name: "blob (400 vertices)", polygon: true, make: () => rings(round(400, (i) => 1 + 0.25 * Math.sin(at(5 * i, 400)) + 0.05 * Math.sin(at(37 * i, 400)))) },
    hexagon: { name: "hexagon by planes", planes: true, convex: true, make: () => ({ json: { type: "convex", planes: round(6, () => 1).map(([x, y]) => [x, y, 1]) }, drawn: [round(6, () => 2 / Math.sqrt(3), Math.PI / 6)] }) },
    square: { name: "box", convex: true, make: () => ({ json: { type: "aabb", min: [-1, -1], max: [1, 1] }, drawn: [[[-1, -1], [1, -1], [1, 1], [-1, 1]]] }) },
    disc: { name: "disc", round: true, make: () => ({ json: { type: "sphere", center: [0, 0], radius: 1 } }) },
    plane: { name: "half-plane", convex: true, unbounded: true, make: () => ({ json: { type: "half_space", normal: [1, 2], offset: 0.5 } }) },
  },
};
