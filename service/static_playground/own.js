// Geometry as people have it: WKT, GeoJSON, CSV of points, or JSON of the HTTP interface. A text becomes
// {solid | points | segments}; a solid of the plane can be written as WKT again. Numbers are taken as they stand.

const fault = (message) => { throw new Error(message); };

export function readText(text, name = "the text") {
  const trimmed = text.trim();
  if (!trimmed) fault(`${name} is empty; give WKT, GeoJSON, a CSV of points, or a solid as JSON`);
  const found = /^[[{]/.test(trimmed) ? fromJson(parsed(trimmed, name), name) : /^(SRID=\d+;)?\s*[A-Za-z]+\s*(Z\s*)?(\(|EMPTY)/i.test(trimmed) ? fromWkt(trimmed, name) : fromCsv(trimmed, name);
  const all = positions(found.points ?? found.segments ?? found.solid?.rings ?? found.solid?.vertices ?? []).filter((p) => p.length || !found.solid);
  for (const [i, p] of all.entries()) if (![2, 3].includes(p.length) || !p.every(Number.isFinite)) fault(`${name}: position ${i} is [${p}]; give two or three finite numbers`);
  if (all.some((p) => p.length !== all[0].length)) fault(`${name}: some positions have two numbers, some three; give all of them the same`);
  return found;
}

export const positions = (value) => (Array.isArray(value) ? (typeof value[0] === "number" || value.length === 0 ? [value] : value.flatMap(positions)) : []);

function parsed(text, name) {
  try { return JSON.parse(text); } catch (error) { return fault(`${name} is no JSON: ${error.message}`); }
}

const open = (ring) => (ring.length > 1 && ring[0].every((v, k) => v === ring.at(-1)[k]) ? ring.slice(0, -1) : ring);
const polygon = (rings) => ({ solid: { type: "polygon", rings: rings.map(open) } });
const line = (list) => list.slice(1).map((end, i) => [list[i], end]);

// One geometry by its type and coordinates as GeoJSON has them; the areas of several are one body under even-odd.
function geometry(type, value, name) {
  switch (type.toLowerCase()) {
    case "point": return { points: [value] };
    case "multipoint": return { points: value };
    case "linestring": return { segments: line(value) };
    case "multilinestring": return { segments: value.flatMap(line) };
    case "polygon": return polygon(value);
    case "multipolygon": return polygon(value.flat());
    default: return fault(`${name}: a ${type} cannot be drawn; give points, lines or polygons`);
  }
}

function merged(list, name) {
  const of = (key) => list.flatMap((each) => each[key] ?? []), rings = list.flatMap(({ solid }) => solid?.rings ?? []);
  if (rings.length) return polygon(rings);
  if (of("segments").length) return { segments: of("segments") };
  return of("points").length ? { points: of("points") } : fault(`${name} holds no geometry`);
}

function fromJson(value, name) {
  if (Array.isArray(value)) return typeof value[0]?.[0] === "number" ? { points: value } : fault(`${name}: give a list of positions, GeoJSON or a solid`);
  if (value.type === "FeatureCollection") return merged(value.features.map((feature) => fromJson(feature, name)), name);
  if (value.type === "Feature") return value.geometry ? fromJson(value.geometry, name) : {};
  if (value.type === "GeometryCollection") return merged(value.geometries.map((each) => fromJson(each, name)), name);
  if (value.coordinates) return geometry(value.type, value.coordinates, name);
  return value.type ? { solid: value } : fault(`${name}: a solid needs its type, such as "polygon" or "polyhedron"`);
}

function fromWkt(text, name) {
  const [, kind, body] = /^(?:SRID=\d+;)?\s*([A-Za-z]+)\s*(?:Z\s*)?([^]*)$/i.exec(text), type = kind.toLowerCase();
  if (/^EMPTY/i.test(body)) fault(`${name} is empty`);
  if (type === "geometrycollection") {
    return merged(body.trim().slice(1, -1).split(/,\s*(?=[A-Za-z])/).map((part) => fromWkt(part.trim(), name)), name);
  }
  const json = body.replace(/[-+]?[\d.]+(?:e[-+]?\d+)?(?:\s+[-+]?[\d.]+(?:e[-+]?\d+)?)+/gi, (words) => `[${words.split(/\s+/).map(Number).join(",")}]`);
  let value;
  try { value = JSON.parse(json.replaceAll("(", "[").replaceAll(")", "]").replace(/\]\s*;?\s*$/, "]")); } catch { fault(`${name} is no WKT: ${text.slice(0, 60)}`); }
  return geometry(type, type === "point" ? value[0] : type === "multipoint" ? value.map((p) => (Array.isArray(p[0]) ? p[0] : p)) : value, name);
}

function fromCsv(text, name) {
  const rows = text.split(/\r?\n/).map((row) => row.trim()).filter((row) => row && !row.startsWith("#")).map((row) => row.split(/[\s,;]+/).filter(Boolean));
  if (rows.length && rows[0].every((word) => Number.isNaN(Number(word)))) rows.shift(); // names of columns
  const points = rows.map((row, i) => {
    const numbers = row.slice(0, 3).map(Number);
    return numbers.length > 1 && numbers.every(Number.isFinite) ? numbers : fault(`${name}: row ${i + 1} is "${row.join(" ")}"; a point has two or three numbers`);
  });
  return points.length ? { points } : fault(`${name} holds no point`);
}

export function toWkt({ rings }) {
  return `POLYGON (${rings.map((ring) => `(${[...ring, ring[0]].map((p) => p.join(" ")).join(", ")})`).join(", ")})`;
}
