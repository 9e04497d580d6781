// STL, OBJ, OFF and PLY files as {vertices, faces}; the service checks them, nothing is repaired here.

export async function readMesh(file) {
  const bytes = await file.arrayBuffer(), kind = file.name.split(".").pop().toLowerCase();
  const text = () => new TextDecoder().decode(bytes);
  if (kind === "stl") return isTextStl(bytes) ? stlText(text()) : stlBinary(bytes);
  if (kind === "obj") return obj(text());
  if (kind === "off") return off(text());
  if (kind === "ply") return ply(bytes);
  throw new Error(`${file.name} cannot be drawn: the playground reads .stl, .obj, .off and .ply; ${kind === "glb" ? "POST /v1/solids/import takes .glb" : "convert it to one of these"}`);
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
