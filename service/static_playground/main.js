// The page: reads the controls, asks the service, shows the answer. One request is under way at a time; while it is, only
// the newest state waits.

import { prepared2d, prepared3d, styleColors } from "./drawing.js";
import { KEYS, framed, readRequest } from "./given.js";
import { readMesh } from "./mesh_files.js";
import { QUESTIONS } from "./questions.js";
import { solid_types } from "./solids.js";
import { View2D } from "./view2d.js";
import { View3D } from "./view3d.js";

const $ = (id) => document.getElementById(id);
const state = { question: "proof", dimension: 2, offset: [0, 0, 0], operation: "intersection", n: 1 };
const loaded = { 2: {}, 3: {} }; // solids made or opened, by key
const LARGE = 20000; // characters of a solid's JSON from which it is stored once and named by its id

const view2d = new View2D($("view2d"), move, moveCorner);
let view3d = null;
try { view3d = new View3D($("view3d"), move); } catch (error) { complain(error.message); }

function move(step) {
  if (state.given) return;  // what a link gives stays as it is
  state.offset = state.offset.map((v, k) => v + (step[k] ?? 0));
  refresh();
}

// Corners that can be dragged, in the order of the view: those of the first solid, then those of the second under its pose.
function corners(now) {
  const shift = now.layout?.shifts[0] ?? [0, 0], offset = now.layout ? now.offset : [0, 0];
  const place = { rotation: now.rotation, translation: now.offset.slice(0, 2) };
  const found = [[now.first, (p) => p.map((v, k) => v + offset[k] + shift[k]), (p) => p.map((v, k) => v - offset[k] - shift[k])]];
  if (now.second) found.push([now.second, (p) => turned(now.rotation, p).map((v, k) => v + place.translation[k]),
    (p) => turned(now.rotation[0].map((_, k) => now.rotation.map((row) => row[k])), p.map((v, k) => v - place.translation[k]))]);
  return found.filter(([solid]) => solid.json.type === "polygon" && solid.rings.flat().length <= 100)
    .flatMap(([solid, to, from]) => solid.rings.flatMap((ring) => ring.map((p, i) => ({ at: to(p), set(q) { ring[i] = from(q); solid.isEdited = true; solid.asked = solid.json; } }))));
}

const turned = (rotation, p) => rotation.map((row) => row.reduce((sum, r, k) => sum + r * p[k], 0));

function moveCorner(corner, position) {
  corners(state)[corner]?.set(position);
  refresh();
}

// --- solids -----------------------------------------------------------------------------------------------------------

function solidOf(key, dimension) {
  loaded[dimension][key] ??= completed({ ...solid_types[dimension][key], ...solid_types[dimension][key].make() });
  return loaded[dimension][key];
}

function completed(solid) {
  const { json } = solid;
  if (json.type === "polygon") solid.rings = json.rings;
  else if (solid.drawn) solid.rings = solid.drawn;
  if (json.type === "sphere") Object.assign(solid, { center: json.center, radius: json.radius });
  if (json.type === "half_space") Object.assign(solid, { normal: json.normal, offset: json.offset });
  solid.asked = json;
  return solid;
}

async function store(solid) {
  if (solid.asked !== solid.json || solid.rings || JSON.stringify(solid.json).length < LARGE) return;
  const { answer } = await ask("/v1/solids", JSON.stringify(solid.json));
  solid.asked = { type: "stored", id: answer.id };
}

async function open(file) {
  const { vertices, faces } = await readMesh(file), low = [0, 1, 2].map((k) => vertices.reduce((m, v) => Math.min(m, v[k]), Infinity));
  const size = Math.max(...[0, 1, 2].map((k) => vertices.reduce((m, v) => Math.max(m, v[k]), -Infinity) - low[k])) || 1;
  // shown in the playground's size: a power of two and whole steps, so that a mesh keeps its flush faces where they fit
  const scale = 2 ** Math.round(1 - Math.log2(size)), middle = low.map((v) => v + size / 2);
  const placed = vertices.map((v) => v.map((x, k) => (x - middle[k]) * scale));
  const key = `file ${file.name}`, json = { type: "polyhedron", vertices: placed, faces };
  loaded[3][key] = completed({ name: `${file.name} (${faces.length.toLocaleString("en")} faces)`, json, mesh: { vertices: placed, faces } });
  solid_types[3][key] = { name: loaded[3][key].name, convex: true, make: () => loaded[3][key] };
  if (state.question === "overlay" || state.question === "proof") document.querySelector("[name=question][value=contains]").click();
  document.querySelector("[name=dimension][value='3']").click();
  fillSelects(key);
  refresh();
}

// --- controls ---------------------------------------------------------------------------------------------------------

function fillSelects(wanted) {
  const question = QUESTIONS[state.question];
  for (const [id, allowed] of [["first", question.firsts], ["second", question.seconds]]) {
    $(`${id}-label`).hidden = !allowed;
    if (!allowed) continue;
    const keys = Object.keys(solid_types[state.dimension]).filter((key) => allowed(solid_types[state.dimension][key]));
    const kept = id === "first" && keys.includes(wanted) ? wanted : question.preferred && id === "first" ? question.preferred : keys.includes($(id).value) ? $(id).value : keys[id === "second" ? 1 : 0];
    $(id).replaceChildren(...keys.map((key) => new Option(solid_types[state.dimension][key].name, key, false, key === kept)));
  }
}

function chooseQuestion() {
  state.question = document.querySelector("[name=question]:checked").value;
  const question = QUESTIONS[state.question], only = question.dimensions;
  for (const input of document.querySelectorAll("[name=dimension]")) {
    input.disabled = only ? !only.includes(Number(input.value)) : false;
    if (only && !input.disabled) input.checked = true;
  }
  state.dimension = Number(document.querySelector("[name=dimension]:checked").value);
  $("hint").textContent = `${question.hint} ${state.dimension === 3 ? "Drag turns, Shift-drag or two fingers move, the wheel zooms." : "Drag moves."}`;
  $("operation-label").hidden = !question.operations;
  $("count-label").hidden = !question.counts;
  $("method-label").hidden = !question.methods;
  $("turn-label").hidden = !question.seconds;
  $("plain-label").hidden = !question.plain;
  if (question.counts) [$("count").min, $("count").max, $("count").value] = question.counts;
  $("view3d").hidden = state.dimension !== 3;
  $("view2d").hidden = state.dimension !== 2;
  state.offset = state.question === "collide" || state.question === "overlay" ? [0.9, 0.4, 0] : [0, 0, 0];
  fillSelects();
}

function readControls() {
  const angle = (Number($("turn").value) * Math.PI) / 180, [c, s] = [Math.cos(angle), Math.sin(angle)];
  state.rotation = state.dimension === 3 ? [[c, 0, s], [0, 1, 0], [-s, 0, c]] : [[c, -s], [s, c]];
  $("turn-shown").textContent = `${$("turn").value}°`;
  state.n = state.given?.n ?? Math.round(10 ** Number($("count").value));
  $("count-shown").textContent = state.n.toLocaleString("en");
  state.snap = $("snap").checked;
  state.plain = $("plain").checked;
  state.operation = $("operation").value;
  state.method = $("method").value;
  state.layout = QUESTIONS[state.question].layout?.($("view2d"));
  state.first = solidOf($("first").value, state.dimension);
  state.second = QUESTIONS[state.question].seconds ? solidOf($("second").value, state.dimension) : null;
}

// --- asking -----------------------------------------------------------------------------------------------------------

let isAsking = false, isStale = false;

async function refresh() {
  isStale = true;
  if (isAsking) return;
  isAsking = true;
  $("stage").ariaBusy = "true";
  while (isStale) {
    isStale = false;
    try { await once(); } catch (error) { complain(error.message); }
  }
  isAsking = false;
  $("stage").ariaBusy = "false";
}

async function once() {
  readControls();
  const now = { ...state, offset: [...state.offset] }, question = QUESTIONS[now.question];
  for (const solid of [now.first, now.second]) if (solid) await store(solid);
  const { path, body, items } = question.ask(now), text = JSON.stringify(body);
  showRequest(path, text);
  const { answer, timing, seconds } = await ask(path, text);
  const next = question.beside?.(now, body), other = next && (await ask(next.path, JSON.stringify(next.body))).answer;
  const more = question.further?.(now, body, answer), also = more ? await asked(more) : null;
  $("problem").hidden = true;
  $("stage").classList.remove("old");
  shown = other ? { [path]: answer, [next.path]: other } : answer;
  if (other?.methods && $("method").options.length !== other.methods.length) {
    $("method").replaceChildren(...other.methods.map((name) => new Option(name, name, false, name === other.method)));
  }
  const figures = { ...question.figures(now, answer, other), ...also?.figures };
  $("verdict").textContent = question.verdict(now, answer, figures, other);
  showFigures(figures, answer.accuracy, timing, seconds, items);
  showPicture(now, [...question.draw(now, answer, body, other), ...(also?.items ?? [])]);
  saveLink();
}

// The question that an answer raises: its figures and what it adds to the picture; a refusal is a figure.
async function asked({ path, body, figures, draw }) {
  try {
    const { answer } = await ask(path, JSON.stringify(body));
    return { figures: figures(answer), items: draw(answer) };
  } catch (error) {
    return { figures: { [path]: error.message }, items: [] };
  }
}

async function ask(path, text) {
  const headers = { "Content-Type": "application/json" };
  if ($("key").value) headers.Authorization = `Bearer ${$("key").value}`;
  const before = performance.now();
  const response = await fetch(path.slice(1), { method: "POST", headers, body: text });
  const answer = await response.json(), seconds = (performance.now() - before) / 1000;
  const isKeyAsked = response.status === 401 || response.status === 403;
  $("key").classList.toggle("asked", isKeyAsked);
  if (isKeyAsked) $("key").focus();
  if (!response.ok) throw new Error(`${response.status} ${answer.code}: ${answer.detail}`);
  return { answer, seconds, timing: timings(response.headers.get("Server-Timing") ?? "") };
}

function timings(header) {
  return Object.fromEntries([...header.matchAll(/(\w+);dur=([\d.]+)/g)].map(([, name, value]) => [name, Number(value)]));
}

function complain(message) {
  $("problem").textContent = message;
  $("problem").hidden = false;
  $("stage").classList.add("old");
  $("verdict").textContent = "";
}

// --- showing ----------------------------------------------------------------------------------------------------------

function showFigures(figures, accuracy, timing, seconds, items) {
  const rows = Object.entries(figures);
  const rate = timing.compute ? `, ${Math.round((1000 * items) / timing.compute).toLocaleString("en")} items a second` : "";
  rows.push(["compute", `${timing.compute ?? "?"} ms${rate}`]);
  rows.push(["decode, prepare, encode", ["decode", "prepare", "encode"].map((name) => `${timing[name] ?? "?"}`).join(", ") + " ms"]);
  rows.push(["round trip", `${(1000 * seconds).toFixed(1)} ms`], ["decisions", accuracy.decisions]);
  if (accuracy.coordinates_ulp !== undefined) rows.push(["coordinates within", `${accuracy.coordinates_ulp} ulp`]);
  rows.push(["beyond the float filter", accuracy.beyond_filter], ["in rational arithmetic", accuracy.rational], ["method", accuracy.method]);
  $("figures").tBodies[0].replaceChildren(...rows.map(([name, value]) => {
    const row = document.createElement("tr");
    for (const text of [name, typeof value === "number" ? value.toLocaleString("en", { maximumFractionDigits: 17 }) : String(value)]) {
      row.insertCell().textContent = text;
    }
    if (["inside", "boundary", "outside"].includes(name)) {
      const mark = document.createElement("i");
      mark.style.background = `var(--${name})`;
      row.cells[0].prepend(mark);
    }
    return row;
  }));
}

let request = { path: "", text: "" }, shown = {};

function showRequest(path, text) {
  request = { path, text };
  const short = text.length > 1200 ? `${text.slice(0, 1150)} … (${text.length.toLocaleString("en")} characters, Copy takes all)` : text;
  $("request").textContent = `POST ${path}\n${short}`;
  $("curl").textContent = curl(short);
}

function curl(text) {
  const address = new URL(request.path.slice(1), document.baseURI);
  return `curl -s ${address} -H 'content-type: application/json' -d '${text}'`;
}

function showPicture(now, drawn) {
  const colors = styleColors(), items = now.given ? framed(drawn, now.given.frame) : drawn;
  if (now.dimension === 2) {
    view2d.show(prepared2d(items, colors), now.layout?.radius ?? 2.1, now.given ? [] : corners(now).map(({ at }) => at));
  } else if (view3d) view3d.show(prepared3d(items, [0, 0, 0], colors), 2.1);
}

// --- links: the whole state in the address, but for files that were opened ----------------------------------------------

const FIELDS = ["first", "second", "operation", "method", "count", "turn"];
let timer = 0;

function link() {
  if (state.given) return `#${new URLSearchParams({ request: state.given.text })}`;
  const said = new URLSearchParams({ question: state.question, dimension: state.dimension, offset: state.offset.join(",") });
  for (const id of FIELDS) if (!$(`${id}-label`).hidden) said.set(id, $(id).value);
  for (const id of ["snap", "plain"]) if ($(id).checked) said.set(id, "1");
  for (const name of ["first", "second"]) if (state[name]?.isEdited) said.set(`${name}-rings`, JSON.stringify(state[name].rings));
  if (state.dimension === 3 && view3d) said.set("camera", [view3d.yaw, view3d.pitch, view3d.zoom].map((v) => v.toFixed(3)).join(","));
  return `#${said}`;
}

function saveLink() {  // browsers take some hundred of these in half a minute
  clearTimeout(timer);
  timer = setTimeout(() => history.replaceState(null, "", link()), 300);
}

// A request that the link holds: its solids stand among the examples, its items are asked about until a control is moved.
function takeRequest(text) {
  const given = readRequest(text);
  for (const key of KEYS) delete loaded[given.dimension][key];
  Object.assign(solid_types[given.dimension], given.examples);
  for (const [name, value] of [["question", given.question], ["dimension", given.dimension]]) document.querySelector(`[name=${name}][value="${value}"]`).checked = true;
  chooseQuestion();
  for (const [i, key] of Object.keys(given.examples).entries()) $(["first", "second"][i]).value = key;
  if (given.operation) $("operation").value = given.operation;
  $("turn").value = 0;
  $("snap").checked = false;
  $("plain").checked = Boolean(QUESTIONS[given.question].plain);
  Object.assign(state, { given, offset: [0, 0, 0] });
}

function readLink() {
  const said = new URLSearchParams(location.hash.slice(1)), choose = (name) => document.querySelector(`[name=${name}][value="${CSS.escape(said.get(name) ?? "")}"]`);
  state.given = null;
  if (said.has("request")) {
    try { return takeRequest(said.get("request")); } catch (error) { complain(error.message); }
  }
  for (const name of ["question", "dimension"]) if (choose(name)) choose(name).checked = true;
  chooseQuestion();
  if (said.get("method")) $("method").replaceChildren(new Option(said.get("method")));
  for (const id of FIELDS) {
    const has = $(id).options ? [...$(id).options].some((option) => option.value === said.get(id)) : said.has(id);
    if (has) $(id).value = said.get(id);
  }
  for (const id of ["snap", "plain"]) $(id).checked = said.has(id);
  const numbers = (name) => (said.get(name) ?? "").split(",").map(Number);
  if (said.has("offset") && numbers("offset").length === 3 && numbers("offset").every(Number.isFinite)) state.offset = numbers("offset");
  if (said.has("camera") && view3d && numbers("camera").every(Number.isFinite)) [view3d.yaw, view3d.pitch, view3d.zoom] = numbers("camera");
  for (const name of ["first", "second"]) {
    if (!said.has(`${name}-rings`) || $(`${name}-label`).hidden) continue;
    try {
      const solid = solidOf($(name).value, state.dimension), given = JSON.parse(said.get(`${name}-rings`));
      solid.rings.splice(0, solid.rings.length, ...given.map((ring) => ring.map((p) => p.slice(0, 2).map(Number))));
      solid.isEdited = true;
    } catch { complain("the link holds rings that cannot be read; the example is shown"); }
  }
}

// --- start ------------------------------------------------------------------------------------------------------------

$("questions").addEventListener("change", () => { state.given = null; chooseQuestion(); refresh(); });
$("controls").addEventListener("input", ({ target }) => {
  if (!["plain", "file"].includes(target.id)) state.given = null;
  if (target.id !== "file") refresh();
});
$("key").value = sessionStorage.getItem("key") ?? "";
$("key").addEventListener("change", () => { sessionStorage.setItem("key", $("key").value); refresh(); });
for (const kind of ["pointerup", "keyup", "wheel"]) $("view3d").addEventListener(kind, saveLink, { passive: true });
addEventListener("resize", refresh);
addEventListener("hashchange", () => { readLink(); refresh(); });
$("centre").addEventListener("click", () => { state.offset = [0, 0, 0]; refresh(); });
$("open").addEventListener("click", () => $("file").click());
$("file").addEventListener("change", ({ target }) => { if (target.files[0]) open(target.files[0]).catch((error) => complain(error.message)); target.value = ""; });
const copied = [["request", () => request.text], ["curl", () => curl(request.text)], ["answer", () => JSON.stringify(shown)], ["link", () => new URL(link(), location).href]];
for (const [id, text] of copied.map(([name, text]) => [`copy-${name}`, text])) {
  const label = $(id).textContent;
  $(id).addEventListener("click", async () => {
    await navigator.clipboard.writeText(text());
    $(id).textContent = "Copied";
    setTimeout(() => { $(id).textContent = label; }, 1500);
  });
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", refresh);
for (const form of document.forms) form.addEventListener("submit", (event) => event.preventDefault());
readLink();
refresh();
