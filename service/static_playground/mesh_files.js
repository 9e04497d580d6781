// STL, OBJ, OFF, PLY and GLB files as {vertices, faces}; the service checks them, nothing is repaired here.

export const isMesh = (name) => /\.(stl|obj|off|ply|glb)$/i.test(name);

export async function readMesh(file) {
  const bytes = await file.arrayBuffer(), kind = file.name.split(".").pop().toLowerCase();
  const text = () => new TextDecoder().decode(bytes);
  if (kind === "stl") return isTextStl(bytes) ? stlText(text()) : stlBinary(bytes);
  if (kind === "obj") return obj(text());
  if (kind === "off") return off(text());
  if (kind === "ply") return ply(bytes);
  if (kind === "glb") return glb(bytes, file.name);
  throw new Error(`${file.name} cannot be drawn: meshes are read from .stl, .obj, .off, .ply and .glb`);
}

const soup = (vertices) => ({ vertices, faces: Array.from({ length: vertices.length / 3 }, (_, i) => [3 * i, 3 * i + 1, 3 * i + 2]) });
const isTextStl = (bytes) => bytes.byteLength < 84 || new DataView(bytes).getUint32(80, true) * 50 + 84 !== bytes.byteLength;
const words = (text) => text.replace(/#.*/g, "").split(/\s+/).filter(Boolean);

function stlText(text) {
  return soup([...text.matchAll(/vertex\s+(\S+)\s+(\S+)\s+(\S+)/g)].map((found) => found.slice(1).map(Number)));
}

function stlBinary(bytes) {
  const view = new DataView(bytes), vertices = [];
  for (let start = 84; start + 50 <= bytes.byteLength; start += 50) {
    for (let corner = 0; corner < 3; corner++) {
      vertices.push([0, 4, 8].map((k) => view.getFloat32(start + 12 + 12 * corner + k, true)));
    }
  }
  return soup(vertices);
}

function obj(text) {
  const vertices = [], faces = [];
  for (const line of text.split("\n")) {
    const [kind, ...rest] = line.trim().split(/\s+/);
    if (kind === "v") vertices.push(rest.slice(0, 3).map(Number));
    if (kind === "f") faces.push(rest.map((word) => parseInt(word)).map((i) => (i < 0 ? vertices.length + i : i - 1)));
  }
  return { vertices, faces };
}

function off(text) {
  const list = words(text.replace(/^\s*OFF/, "")).map(Number), [n, m] = list;
  const vertices = Array.from({ length: n }, (_, i) => list.slice(3 + 3 * i, 6 + 3 * i)), faces = [];
  for (let face = 0, place = 3 + 3 * n; face < m; face++, place += list[place] + 1) {
    faces.push(list.slice(place + 1, place + 1 + list[place]));
  }
  return { vertices, faces };
}

const SIZES = { char: 1, uchar: 1, int8: 1, uint8: 1, short: 2, ushort: 2, int16: 2, uint16: 2, int: 4, uint: 4, int32: 4, uint32: 4, float: 4, float32: 4, double: 8, float64: 8 };

function reader(bytes, start, format) {  // a function that returns the next number of a type
  if (format === "ascii") {
    const list = words(new TextDecoder().decode(bytes.slice(start)))[Symbol.iterator]();
    return () => Number(list.next().value);
  }
  const view = new DataView(bytes), little = format === "binary_little_endian";
  const calls = { 1: "Int8", 2: "Int16", 4: "Int32" };
  return (type) => {
    const size = SIZES[type], isFloat = /^(float|double)/.test(type), isUnsigned = type[0] === "u";
    const name = isFloat ? (size === 4 ? "Float32" : "Float64") : (isUnsigned ? "Uint" + 8 * size : calls[size]);
    start += size;
    return view["get" + name](start - size, little);
  };
}

function ply(bytes) {
  const head = new TextDecoder("latin1").decode(bytes.slice(0, 65536)), end = /end_header\r?\n/.exec(head);
  if (!end) throw new Error("the PLY header has no end");
  const format = /format (\S+)/.exec(head)[1], next = reader(bytes, end.index + end[0].length, format), result = { vertices: [], faces: [] };
  for (const part of head.slice(0, end.index).split(/^element /m).slice(1)) {
    const [name, count] = part.split(/\s+/), rows = [...part.matchAll(/property (?:list (\S+) (\S+)|(\S+)) (\S+)/g)];
    for (let row = 0; row < Number(count); row++) {
      const values = {};
      for (const [, length, item, type, field] of rows) {
        values[field] = length ? Array.from({ length: next(length) }, () => next(item)) : next(type);
      }
      if (name === "vertex") result.vertices.push([values.x, values.y, values.z]);
      if (name === "face") result.faces.push(values.vertex_indices ?? values.vertex_index);
    }
  }
  return result;
}

const COMPONENTS = { 5120: ["Int8", 1], 5121: ["Uint8", 1], 5122: ["Int16", 2], 5123: ["Uint16", 2], 5125: ["Uint32", 4], 5126: ["Float32", 4] };

function glb(bytes, name) {
  const fault = (what) => { throw new Error(`${name} cannot be drawn: ${what}`); }, view = new DataView(bytes), chunks = {};
  if (bytes.byteLength < 20 || view.getUint32(0, true) !== 0x46546c67) fault("it does not begin as a GLB file");
  for (let start = 12; start + 8 <= bytes.byteLength; start += 8 + view.getUint32(start, true)) chunks[view.getUint32(start + 4, true)] ??= start + 8;
  const begin = chunks[0x4e4f534a], scene = JSON.parse(new TextDecoder().decode(bytes.slice(begin, begin + view.getUint32(begin - 8, true))));
  if ((scene.extensionsRequired ?? []).length) fault(`it needs ${scene.extensionsRequired.join(", ")}; export it without`);
  const accessor = (index, width) => {
    const { bufferView, byteOffset = 0, componentType, count } = scene.accessors[index], { byteOffset: from = 0, byteStride } = scene.bufferViews[bufferView];
    const [type, size] = COMPONENTS[componentType], start = chunks[0x004e4942] + from + byteOffset;
    return Array.from({ length: count }, (_, i) => Array.from({ length: width }, (__, k) => view["get" + type](start + i * (byteStride ?? size * width) + k * size, true)));
  };
  const result = { vertices: [], faces: [] }, visit = (index, above) => {
    const node = scene.nodes[index], matrix = product(above, node.matrix ?? matrixOf(node));
    for (const { attributes, indices, mode = 4 } of node.mesh === undefined ? [] : scene.meshes[node.mesh].primitives) {
      if (mode !== 4) fault("its surfaces are strips, fans or lines; export triangles");
      const first = result.vertices.length, corners = accessor(attributes.POSITION, 3);
      for (const p of corners) result.vertices.push([0, 1, 2].map((k) => matrix[k] * p[0] + matrix[4 + k] * p[1] + matrix[8 + k] * p[2] + matrix[12 + k]));
      const order = indices === undefined ? corners.map((_, i) => i) : accessor(indices, 1).flat();
      for (let i = 0; i + 2 < order.length; i += 3) result.faces.push([0, 1, 2].map((k) => first + order[i + k]));
    }
    for (const child of node.children ?? []) visit(child, matrix);
  };
  for (const root of scene.scenes?.[scene.scene ?? 0]?.nodes ?? scene.nodes.map((_, i) => i)) visit(root, matrixOf({}));
  return result;
}

// Columns first, as glTF has them.
function matrixOf({ translation = [0, 0, 0], rotation: [x, y, z, w] = [0, 0, 0, 1], scale = [1, 1, 1] }) {
  const columns = [[1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)], [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)], [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)]];
  return [...columns.flatMap((column, k) => [...column.map((v) => v * scale[k]), 0]), ...translation, 1];
}

const product = (a, b) => Array.from({ length: 16 }, (_, i) => [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + (i % 4)] * b[4 * Math.floor(i / 4) + k], 0));
