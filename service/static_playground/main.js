// The page: reads the controls, asks the service, shows the answer. One request is under way at a time; while it is, only
// the newest state waits.

import { prepared2d, prepared3d, styleColors } from "./drawing.js";
import { readMesh } from "./mesh_files.js";
import { QUESTIONS } from "./questions.js";
import { SOLIDS } from "./solids.js";
import { View2D } from "./view2d.js";
import { View3D } from "./view3d.js";

const $ = (id) => document.getElementById(id);
const state = { question: "contains", dimension: 3, offset: [0, 0, 0], operation: "intersection", n: 1 };
const loaded = { 2: {}, 3: {} }; // solids made or opened, by key
const LARGE = 20000; // characters of a solid's JSON from which it is stored once and named by its id

const view2d = new View2D($("view2d"), move, moveCorner);
let view3d = null;
try { view3d = new View3D($("view3d"), move); } catch (error) { complain(error.message); }

function move(step) {
  state.offset = state.offset.map((v, k) => v + (step[k] ?? 0));
  refresh();
}

function moveCorner(corner, position) {
  for (const ring of state.first.rings) {
    if (corner < ring.length) { ring[corner] = position; break; }
    corner -= ring.length;
  }
  state.first.asked = state.first.json;
  refresh();
}

// --- solids -----------------------------------------------------------------------------------------------------------

function solidOf(key, dimension) {
  loaded[dimension][key] ??= completed({ ...SOLIDS[dimension][key], ...SOLIDS[dimension][key].make() });
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
  SOLIDS[3][key] = { name: loaded[3][key].name, convex: true, make: () => loaded[3][key] };
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
    const keys = Object.keys(SOLIDS[state.dimension]).filter((key) => allowed(SOLIDS[state.dimension][key]));
    const kept = id === "first" && keys.includes(wanted) ? wanted : keys.includes($(id).value) ? $(id).value : keys[id === "second" ? 1 : 0];
    $(id).replaceChildren(...keys.map((key) => new Option(SOLIDS[state.dimension][key].name, key, false, key === kept)));
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
  $("turn-label").hidden = !question.seconds;
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
  state.n = Math.round(10 ** Number($("count").value));
  $("count-shown").textContent = state.n.toLocaleString("en");
  state.snap = $("snap").checked;
  state.operation = $("operation").value;
  state.first = solidOf($("first").value, state.dimension);
  state.second = QUESTIONS[state.question].seconds ? solidOf($("second").value, state.dimension) : null;
}

// --- asking -----------------------------------------------------------------------------------------------------------

let isAsking = false, isStale = false;

async function refresh() {
  isStale = true;
  if (isAsking) return;
  isAsking = true;
  while (isStale) {
    isStale = false;
    try { await once(); } catch (error) { complain(error.message); }
  }
  isAsking = false;
}

async function once() {
  readControls();
  const now = { ...state, offset: [...state.offset] }, question = QUESTIONS[now.question];
  for (const solid of [now.first, now.second]) if (solid) await store(solid);
  const { path, body, items } = question.ask(now), text = JSON.stringify(body);
  showRequest(path, text);
  const { answer, timing, seconds } = await ask(path, text);
  $("problem").hidden = true;
  const figures = question.figures(now, answer);
  $("verdict").textContent = question.verdict(now, answer, figures);
  showFigures(figures, answer.accuracy, timing, seconds, items);
  showPicture(now, question.draw(now, answer, body));
}

async function ask(path, text) {
  const headers = { "Content-Type": "application/json" };
  if ($("key").value) headers.Authorization = `Bearer ${$("key").value}`;
  const before = performance.now();
  const response = await fetch(path.slice(1), { method: "POST", headers, body: text });
  const answer = await response.json(), seconds = (performance.now() - before) / 1000;
  if (!response.ok) throw new Error(`${response.status} ${answer.code}: ${answer.detail}`);
  return { answer, seconds, timing: timings(response.headers.get("Server-Timing") ?? "") };
}

function timings(header) {
  return Object.fromEntries([...header.matchAll(/(\w+);dur=([\d.]+)/g)].map(([, name, value]) => [name, Number(value)]));
}

function complain(message) {
  $("problem").textContent = message;
  $("problem").hidden = false;
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

let request = { path: "", text: "" };

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

function showPicture(now, items) {
  const colors = styleColors();
  if (now.dimension === 2) {
    const corners = now.first.json.type === "polygon" && now.first.rings.flat().length <= 100 ? now.first.rings.flat() : [];
    view2d.show(prepared2d(items, colors), 2.1, corners);
  } else if (view3d) view3d.show(prepared3d(items, [0, 0, 0], colors), 2.1);
}

// --- start ------------------------------------------------------------------------------------------------------------

$("questions").addEventListener("change", () => { chooseQuestion(); refresh(); });
$("controls").addEventListener("input", refresh);
$("centre").addEventListener("click", () => { state.offset = [0, 0, 0]; refresh(); });
$("open").addEventListener("click", () => $("file").click());
$("file").addEventListener("change", ({ target }) => { if (target.files[0]) open(target.files[0]).catch((error) => complain(error.message)); });
for (const [id, text] of [["copy-request", () => request.text], ["copy-curl", () => curl(request.text)]]) {
  $(id).addEventListener("click", async () => {
    await navigator.clipboard.writeText(text());
    $(id).textContent = "Copied";
    setTimeout(() => { $(id).textContent = id === "copy-curl" ? "Copy curl" : "Copy JSON"; }, 1500);
  });
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", refresh);
for (const form of document.forms) form.addEventListener("submit", (event) => event.preventDefault());
chooseQuestion();
refresh();
