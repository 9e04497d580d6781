// The whole state as one object: in the address, and for undo. What was brought is compressed into the address, as far as it
// fits.

export const FIELDS = ["first", "second", "operation", "method", "count", "turn"];
const CHECKS = ["snap", "plain"], LARGEST = 100_000; // characters of an address

const $ = (id) => document.getElementById(id);

// The controls and what was moved, drawn or turned by hand, as strings.
export function snapshot(state, views) {
  const said = { question: state.question, dimension: String(state.dimension), offset: state.offset.join(",") };
  for (const id of FIELDS) if (!$(`${id}-label`).hidden) said[id] = $(id).value;
  for (const id of CHECKS) if ($(id).checked) said[id] = "1";
  for (const name of ["first", "second"]) {
    const solid = state[name]?.base ?? state[name];
    if (solid?.isEdited) said[`${name}-rings`] = JSON.stringify(solid.rings);
  }
  if (state.attitude) said.attitude = state.attitude.join(",");
  if (state.lens !== null) said.lens = String(state.lens);
  if (state.dimension === 3 && views.space) said.camera = [views.space.yaw, views.space.pitch, views.space.zoom].map((v) => v.toFixed(3)).join(",");
  if (state.dimension === 2 && (views.plane.zoom !== 1 || views.plane.middle.some(Boolean))) said.view = [...views.plane.middle, views.plane.zoom].join(",");
  return said;
}

// Put the controls as the snapshot has them; what it does not say is left. Returns what could not be read.
export function restore(said, state, views, solidOf) {
  const numbers = (name, count) => { const list = String(said[name]).split(",").map(Number); return list.length === count && list.every(Number.isFinite) ? list : null; };
  if (said.method) $("method").replaceChildren(new Option(said.method));
  for (const id of FIELDS) {
    const has = $(id).options ? [...$(id).options].some((option) => option.value === said[id]) : id in said;
    if (has) $(id).value = said[id];
  }
  for (const id of CHECKS) $(id).checked = id in said;
  state.offset = numbers("offset", 3) ?? state.offset;
  state.attitude = numbers("attitude", 4);
  state.lens = numbers("lens", 1)?.[0] ?? null;
  const camera = numbers("camera", 3), view = numbers("view", 3);
  if (camera && views.space) { [views.space.yaw, views.space.pitch, views.space.zoom] = camera; views.space.spins = false; }
  Object.assign(views.plane, { middle: view?.slice(0, 2) ?? [0, 0], zoom: view?.[2] ?? 1 });
  let fault = "";
  for (const name of ["first", "second"]) {
    if ($(`${name}-label`).hidden) continue;
    const solid = solidOf($(name).value), text = said[`${name}-rings`];
    if (!text && !solid.isEdited) continue;
    try {
      const rings = text ? JSON.parse(text) : solid.original;
      solid.rings.splice(0, solid.rings.length, ...rings.map((ring) => ring.map((p) => p.slice(0, 2).map(Number))));
      Object.assign(solid, { isEdited: Boolean(text), placed: null, asked: solid.json });
    } catch { fault = "the link holds rings that cannot be read; the example is shown"; }
  }
  return fault;
}

const transformed = async (bytes, stream) => new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());

// The fragment of an address; `isWhole` is false where what was brought is too large for it.
export async function fragment(said, brought) {
  const all = new URLSearchParams(said);
  if (!brought.length) return { text: `#${all}`, isWhole: true };
  const packed = await transformed(new TextEncoder().encode(JSON.stringify(brought)), new CompressionStream("deflate-raw"));
  let binary = "";
  for (let i = 0; i < packed.length; i += 8192) binary += String.fromCharCode(...packed.subarray(i, i + 8192));
  const text = btoa(binary).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
  const isWhole = text.length <= LARGEST;
  if (isWhole) all.set("own", text);
  return { text: `#${all}`, isWhole };
}

export async function readFragment(text) {
  const said = Object.fromEntries(new URLSearchParams(text.slice(1)));
  if (!said.own) return { said, brought: [] };
  const packed = Uint8Array.from(atob(said.own.replaceAll("-", "+").replaceAll("_", "/")), (c) => c.charCodeAt(0));
  const brought = JSON.parse(new TextDecoder().decode(await transformed(packed, new DecompressionStream("deflate-raw"))));
  return { said, brought };
}

// What was, most recent last; `back` and `forth` return the snapshot to restore.
export class History {
  constructor() { this.past = []; this.future = []; }

  push(said) {
    if (JSON.stringify(said) === JSON.stringify(this.past.at(-1))) return;
    this.past.push(said);
    if (this.past.length > 200) this.past.shift();
    this.future = [];
  }

  back() {
    if (this.past.length < 2) return null;
    this.future.push(this.past.pop());
    return this.past.at(-1);
  }

  forth() {
    const said = this.future.pop();
    if (said) this.past.push(said);
    return said ?? null;
  }
}
