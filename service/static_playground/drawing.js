// From solids, rings and lines to the items of a view. Colours are names of the style sheet's variables.

const times = (rotation, p) => rotation.map((row) => row.reduce((sum, r, k) => sum + r * p[k], 0));

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

export function solid3d(solid, color, alpha) {
  const { vertices, faces } = solid.mesh, triangles = [], edges = [];
  for (const face of faces) {
    for (let i = 2; i < face.length; i++) triangles.push(vertices[face[0]], vertices[face[i - 1]], vertices[face[i]]);
    if (faces.length <= 20) face.forEach((i, k) => edges.push([vertices[i], vertices[face[(k + 1) % face.length]]]));
  }
  return [{ kind: "triangles", points: triangles, color, alpha }, { kind: "lines", lines: edges, color, width: 1.5 }];
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

// What the views want: numbers in one array about the centre, colours resolved.
export function prepared3d(items, centre, colors) {
  return items.map(({ kind, points, lines, color, alpha = 1, width, onTop }) => {
    const positions = new Float32Array((points ?? lines.flat()).flatMap((p) => p.map((v, k) => v - centre[k])));
    return { kind, positions, color: [...colors[color].map((v) => v / 255), alpha], width, onTop };
  });
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
