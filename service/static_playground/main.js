// The page: reads the controls, asks the service, shows the answer. One request is under way at a time; while it is, only
// the newest state waits.

import { ballAround, halfAround, prepared2d, prepared3d, styleColors } from "./drawing.js";
import { UNIT, frameOf, framed, fromView, placed, toView, turned } from "./frame.js";
import { example, readRequest } from "./given.js";
import { Lens, boundaryNear, lattice } from "./lens.js";
import { History, fragment, readFragment, restore, snapshot } from "./links.js";
import { isMesh, readMesh } from "./mesh_files.js";
import { positions, readText, toWkt } from "./own.js";
import { QUESTIONS, firstItems, named, secondPose } from "./questions.js";
import { curl, showFigures, showRequest, shownRequest } from "./showing.js";
import { solid_types } from "./solids.js";
import { View2D } from "./view2d.js";
import { View3D } from "./view3d.js";

const $ = (id) => document.getElementById(id);
const state = { question: "proof", dimension: 3, offset: [0, 0, 0], operation: "intersection", n: 1, own: null, attitude: null, lens: null };
const loaded = { 2: {}, 3: {} }; // solids made or opened, by key
const LARGE = 20000; // characters of a solid's JSON from which it is stored once and named by its id
const past = new History();
let brought = []; // what was opened, pasted or came with the link: {key, json} of solids, {items}

const views = { plane: new View2D($("view2d"), { onMove: move, onCorner: moveCorner, onCornerEnd: saveState, onAdd: addCorner, onDelete: deleteCorner, onView: saveState }), space: null };
try { views.space = new View3D($("view3d"), { onMove: move, onTurn: turnBy, onTurnEnd: saveState }); } catch (error) { complain(error.message); }
const lens = new Lens($("lens"), (depth, times) => {
  $("depth").value = depth;
  $("zoomed").textContent = `${times < 1e4 ? Math.round(times).toLocaleString("en") : times.toExponential(1).replace(/e\+(\d+)/, (_, power) => ` · 10${[...power].map((digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit]).join("")}`)} times as large`;
});

function move(step) {
  state.offset = state.offset.map((v, k) => v + (step[k] ?? 0));
  refresh();
}

function turnBy(axis, angle) {  // about an axis of space, after all turns before
  const [w, x, y, z] = attitude(), [c, s] = [Math.cos(angle / 2), Math.sin(angle / 2)], u = [0, 0, 0];
  u[axis] = s;
  const q = [c * w - u[0] * x - u[1] * y - u[2] * z, c * x + u[0] * w + u[1] * z - u[2] * y, c * y - u[0] * z + u[1] * w + u[2] * x, c * z + u[0] * y - u[1] * x + u[2] * w];
  state.attitude = q.map((v) => v / Math.hypot(...q));
  refresh();
}

function attitude() {
  const half = (Number($("turn").value) * Math.PI) / 360;
  return state.attitude ?? [Math.cos(half), 0, Math.sin(half), 0];
}

// --- corners that can be dragged, of polygons of at most 100 vertices, where the picture has them ---------------------------

// By body and ring: the positions in the picture, and how a place there becomes one of the solid.
function editable(now) {
  const bodies = QUESTIONS[now.question].placed?.(now) ?? [[now.first, null], ...(now.second ? [[now.second, secondPose(now)]] : [])];
  return bodies.filter(([solid]) => solid.json.type === "polygon" && solid.rings.flat().length <= 100).flatMap(([solid, pose]) => {
    const to = (p) => toView(now.frame, pose ? turned(pose.rotation, p).map((v, k) => v + pose.translation[k]) : p);
    const from = (place) => { const p = fromView(now.frame, place); return pose ? turned(pose.rotation[0].map((_, k) => pose.rotation.map((row) => row[k])), p.map((v, k) => v - pose.translation[k])) : p; };
    return solid.rings.map((ring, index) => ({ solid, ring, index, at: ring.map(to), from }));
  });
}

const corners = (now) => editable(now).flatMap((each) => each.at.map((at, i) => ({ ...each, i, at })));

function changeRing(corner, change) {
  if (!corner) return;
  const { solid } = corner, base = solid.base ?? solid;
  change(corner);
  if (solid.base) base.rings.splice(0, base.rings.length, ...solid.rings.map((ring) => ring.map((p) => toView(state.frame, p))));
  Object.assign(base, { isEdited: true, asked: base.json, placed: null });
  refresh();
}

function moveCorner(number, place) { changeRing(corners(state)[number], ({ ring, i, from }) => { ring[i] = from(place); }); }
function addCorner(number, place) { changeRing(corners(state)[number], ({ ring, i, from }) => { ring.splice(i + 1, 0, from(place)); }); }
function deleteCorner(number) {
  changeRing(corners(state)[number], ({ solid, ring, index, i }) => { if (ring.length > 3) ring.splice(i, 1); else if (solid.rings.length > 1) solid.rings.splice(index, 1); });
}

// --- solids -----------------------------------------------------------------------------------------------------------

function solidOf(key, dimension = state.dimension) {
  loaded[dimension][key] ??= completed({ ...solid_types[dimension][key], ...solid_types[dimension][key].make() });
  return loaded[dimension][key];
}

function completed(solid) {
  const { json } = solid;
  if (json.type === "polygon") solid.rings = json.rings;
  else if (solid.drawn) solid.rings = solid.drawn;
  if (json.type === "sphere") Object.assign(solid, { center: json.center, radius: json.radius });
  if (json.type === "half_space") Object.assign(solid, { normal: json.normal, offset: json.offset });
  Object.assign(solid, { asked: json, original: structuredClone(solid.rings) });
  return solid;
}

async function store(solid) {
  if (solid.asked !== solid.json || solid.rings || JSON.stringify(solid.json).length < LARGE) return;
  const { answer } = await ask("/v1/solids", JSON.stringify(solid.json));
  solid.asked = { type: "stored", id: answer.id };
}

// Take a solid among the examples, as it is given.
function keep(key, json, name) {
  const { dimension, flags, solid } = example(json, name);
  loaded[dimension][key] = completed({ ...flags, ...solid });
  solid_types[dimension][key] = { ...flags, make: () => loaded[dimension][key] };
  brought = [...brought.filter((each) => each.key !== key || each.dimension !== dimension), { key, json, name, dimension }];
  return dimension;
}

// Show what a file or a text holds: a solid, points or segments.
function bring(found, wanted, name) {
  const count = brought.filter(({ key }) => key?.startsWith(wanted)).length, key = count ? `${wanted} ${count + 1}` : wanted; // what was stays, for undo
  let dimension = positions(Object.values(found)[0])[0]?.length;
  if (found.solid) dimension = keep(key, found.solid, count ? `${name} ${count + 1}` : name);
  else { state.own = found; brought = [...brought.filter((each) => !each.items), { items: found }]; }
  const asks = found.segments ? ["segments", "scene"] : found.points ? ["contains", "distances", "proof"] : [], now = QUESTIONS[state.question];
  const takesIt = found.solid ? state.question !== "proof" && now.firsts(solid_types[dimension][key]) : asks.includes(state.question);
  if (!takesIt || (now.dimensions && !now.dimensions.includes(dimension))) document.querySelector(`[name=question][value=${asks[0] ?? "contains"}]`).checked = true;
  document.querySelector(`[name=dimension][value="${dimension}"]`).checked = true;
  chooseQuestion();
  if (found.solid) fillSelects(key);
  views.plane.look([0, 0], 1);
  refresh();
}

async function open(file) {
  const name = file.name, key = `file ${name}`;
  if (!isMesh(name)) return bring(readText(await file.text(), name), key, name);
  const mesh = await readMesh(file);
  bring({ solid: { type: "polyhedron", ...mesh } }, key, `${name} (${mesh.faces.length.toLocaleString("en")} faces)`);
}

// --- controls ---------------------------------------------------------------------------------------------------------

function fillSelects(wanted) {
  const question = QUESTIONS[state.question];
  for (const [id, allowed] of [["first", question.firsts], ["second", question.seconds]]) {
    $(`${id}-label`).hidden = !allowed;
    if (!allowed) continue;
    const keys = Object.keys(solid_types[state.dimension]).filter((key) => allowed(solid_types[state.dimension][key]));
    const preferred = id === "first" ? question.preferred?.[state.dimension] : undefined, before = $(id).value;
    const kept = id === "first" && keys.includes(wanted) ? wanted : keys.includes(before) && !(preferred && before in solid_types[state.dimension] && !solid_types[state.dimension][before].isOwn) ? before : preferred ?? keys[id === "second" ? 1 : 0];
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
  const hint = typeof question.hint === "function" ? question.hint(state.dimension) : question.hint;
  $("hint").textContent = `${hint} ${state.dimension === 3 ? "Drag turns, Shift-drag or two fingers move, the wheel zooms." : "Drag moves, Shift-drag or two fingers pan, the wheel zooms; double-click a side to add a vertex, a vertex to delete it."}`;
  $("operation-label").hidden = !question.operations;
  $("count-label").hidden = !question.counts;
  $("method-label").hidden = !question.methods;
  $("turn-label").hidden = !question.seconds && !question.turns;
  $("plain-label").hidden = !question.plain;
  if (question.counts) [$("count").min, $("count").max, $("count").value] = typeof question.counts === "function" ? question.counts(state.dimension) : question.counts;
  $("view3d").hidden = state.dimension !== 3;
  $("view2d").hidden = state.dimension !== 2;
  Object.assign(state, { offset: state.question === "collide" || state.question === "overlay" ? [0.9, 0.4, 0] : [0, 0, 0], attitude: null, lens: null });
  if (views.space) views.space.spins = false;
  $("method").replaceChildren();
  fillSelects();
}

const ITEMS = { hits: "segments", proof: "points", contains: "points", distances: "points", segments: "segments", scene: "segments", polygons: "polygons" };

function readControls() {
  const angle = (Number($("turn").value) * Math.PI) / 180, [c, s] = [Math.cos(angle), Math.sin(angle)];
  state.rotation = state.dimension === 2 ? [[c, -s], [s, c]] : state.attitude ? matrix(state.attitude) : [[c, 0, s], [0, 1, 0], [-s, 0, c]];
  $("turn-shown").textContent = state.attitude ? "by hand" : `${$("turn").value}°`;
  const items = state.own?.[ITEMS[state.question]], fits = items && positions(items[0])[0].length === state.dimension;
  state.n = fits ? items.length : Math.round(10 ** Number($("count").value));
  $("count-shown").textContent = `${state.n.toLocaleString("en")}${fits ? ", as brought" : ""}`;
  state.items = fits ? state.own : null;
  for (const id of ["snap", "plain"]) state[id] = $(id).checked;
  for (const id of ["operation", "method"]) state[id] = $(id).value;
  const [first, second] = [solidOf($("first").value), QUESTIONS[state.question].seconds ? solidOf($("second").value) : null];
  state.frame = frameFor([first, second].filter((solid) => solid?.isOwn), fits ? items : null);
  [state.first, state.second] = [first, second].map((solid) => solid && placed(solid, state.frame));
}

let lastFrame = { of: [], frame: UNIT };

// Where the picture is: around what was brought, or where the examples are.
function frameFor(solids, items) {
  const of = solids.length ? solids.map(({ json }) => json) : [items];
  if (of.length !== lastFrame.of.length || of.some((each, i) => each !== lastFrame.of[i])) {
    const all = solids.length ? solids.flatMap(({ rings, extent }) => rings?.flat() ?? extent) : items ? positions(items) : [];
    lastFrame = { of, frame: all.length ? frameOf(all) : UNIT };
  }
  return lastFrame.frame;
}

function matrix([w, x, y, z]) {
  return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]];
}

// --- asking -----------------------------------------------------------------------------------------------------------

let isAsking = false, isStale = false, isDrawn = false;

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
  if (now.first && !isDrawn) showPicture(now, firstItems(now), false); // the answer takes a while where kernels are compiled
  isDrawn = true;
  const { path, body, items } = question.ask(now), text = JSON.stringify(body);
  showRequest(path, text);
  const next = question.beside?.(now, body), both = [ask(path, text), next && ask(next.path, JSON.stringify(next.body))];
  const [{ answer, timing, seconds }, other] = (await Promise.all(both)).map((got, i) => (i ? got?.answer : got));
  const more = question.further?.(now, body, answer), also = more ? await asked(more) : null;
  $("problem").hidden = true;
  $("stage").classList.remove("old");
  shown = other ? { [path]: answer, [next.path]: other } : answer;
  if (other?.methods && $("method").options.length !== other.methods.length) {
    $("method").replaceChildren(...other.methods.map((name) => new Option(named(name), name, false, name === other.method)));
  }
  const figures = { ...question.figures(now, answer, other), ...also?.figures };
  showFigures(figures, answer.accuracy, timing, seconds, items);
  showPicture(now, [...question.draw(now, answer, body, other), ...(also?.items ?? [])]);
  showLabels(question.labels?.(answer, other, figures) ?? []);
  await look(now, body, next?.body, other?.differing ?? [], question.verdict(now, answer, figures, other));
  fillText();
  saveState();
}

// The verdict; or the lens and its own: the doubles around one of the points that the plain method gets wrong.
async function look(now, body, compared, differing, words) {
  $("to-lens").hidden = !differing.length || now.lens !== null;
  const isOpen = now.lens !== null && differing.length > 0;
  $("stage").classList.toggle("headed", Boolean(QUESTIONS[now.question].labels) && !isOpen); // the headings say what the verdict does
  for (const id of ["lens", "lens-bar"]) $(id).hidden = !isOpen;
  $("view3d").hidden = now.dimension !== 3 || isOpen;
  $("view2d").hidden = now.dimension !== 2 || isOpen;
  if (!isOpen) { lens.close(); $("verdict").textContent = words; return; }
  const p = body.points[differing[now.lens % differing.length]], solid = now.dimension === 2 ? { rings: body.solid.rings } : now.first;
  const { axes, lines } = boundaryNear(solid, p), { points, step } = lattice(p, axes);
  const [exact, plain] = await Promise.all([ask("/v1/contains", JSON.stringify({ ...body, points })), ask("/v1/compare", JSON.stringify({ ...compared, points }))]);
  const on = new Set(exact.answer.boundary), wrong = new Set(plain.answer.differing), size = 2.6 / now.frame.scale;
  const places = points.map((point, i) => {
    const isIn = exact.answer.contained[i], plainly = isIn !== wrong.has(i) ? "inside" : "outside";
    return [...axes.map((k) => point[k] - p[k]), on.has(i) ? "boundary" : isIn ? "inside" : "outside", plainly, wrong.has(i)];
  });
  lens.open({ p, axes, lines, places, step, size }, cssColors());
  $("verdict").textContent = `Plain float64 is wrong at ${wrong.size} of the ${points.length} doubles around this point`;
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

let shown = {};

const cssColors = () => Object.fromEntries(Object.entries(styleColors()).map(([name, rgb]) => [name, `rgb(${rgb.join(" ")})`]));

let fitted = {}; // to which question and solids the views are fitted: they stay so while bodies are moved and turned

function showPicture(now, drawn, isWhole = true) {
  const colors = styleColors(), count = QUESTIONS[now.question].panes ?? 1, least = count > 1 ? 1.3 : 2.1;
  const fit = { question: now.question, dimension: now.dimension, first: now.first?.base ?? now.first, second: now.second?.base ?? now.second, frame: now.frame };
  const isNew = !isWhole || Object.keys(fit).some((key) => fit[key] !== fitted[key]);
  if (isWhole) fitted = fit;
  if (now.dimension === 2) {
    const rings = editable(now), edges = rings.flatMap(({ at }) => at.map((p, i) => [p, at[(i + 1) % at.length]]));
    const items = prepared2d(framed(drawn, now.frame), colors), half = isNew ? halfAround(items, least) : undefined;
    views.plane.show(items, { corners: rings.flatMap(({ at }) => at), edges, count, half, grid: now.snap ? 0.25 : 0 });
  } else if (views.space) {
    const { turns, middle } = QUESTIONS[now.question], canTurn = turns || now.question === "collide";
    const items = prepared3d(drawn, now.frame, colors), rings = canTurn ? { middle: middle?.(now) ?? now.offset, radius: 1.5 } : null;
    views.space.show(items, { count, rings, ball: isNew ? fittedBall(items, rings, now) : undefined });
    if (now.question === "proof" && !past.past.length) views.space.spin();
  }
}

// Around the bodies; where points, rays or segments are asked about, with room for them.
function fittedBall(items, rings, now) {
  const ball = ballAround(items, rings);
  return QUESTIONS[now.question].counts && now.question !== "proof" ? { ...ball, radius: Math.max(ball.radius, 1.9) } : ball;
}

function showLabels(labels) {
  $("labels").hidden = !labels.length;
  $("labels").replaceChildren(...labels.map((text) => { const label = document.createElement("span"); label.textContent = text; return label; }));
}

// --- the solid as a text ------------------------------------------------------------------------------------------------

function fillText() {
  if (!$("edit").open || document.activeElement === $("text")) return;
  const { json } = state.first, isPolygon = json.type === "polygon", text = isPolygon && $("as-wkt").checked ? toWkt(json) : JSON.stringify(json);
  $("as-wkt").disabled = !isPolygon;
  $("text").value = text.length < 200000 ? text : "";
  $("text").placeholder = text.length < 200000 ? "" : `${json.type} of ${text.length.toLocaleString("en")} characters: too long to edit here; paste or open another`;
}

function takeText(text, name) {
  try { bring(readText(text, name), `own ${name}`, name); } catch (error) { complain(error.message); }
}

// --- links and undo: the whole state ------------------------------------------------------------------------------------

let timer = 0, isRestored = false;

function saveState() {  // browsers take some hundred addresses in half a minute
  clearTimeout(timer);
  timer = setTimeout(async () => {
    const said = snapshot(state, views);
    if (!isRestored) past.push(said);
    isRestored = false;
    $("undo").disabled = past.past.length < 2;
    const { text } = await fragment(said, used());
    address = text;
    history.replaceState(null, "", text);
  }, 300);
}

let address = "";

// Of what was brought, that which the picture shows.
const used = () => brought.filter(({ key, items, dimension }) => (items ? state.own === items : dimension === state.dimension && [$("first").value, $("second").value].includes(key)));

function put(said) {
  const choose = (name) => [...document.querySelectorAll(`[name=${name}]`)].find((input) => input.value === said[name]);
  for (const name of ["question", "dimension"]) if (choose(name)) choose(name).checked = true;
  chooseQuestion();
  const fault = restore(said, state, views, solidOf);
  if (fault) complain(fault);
  isRestored = true;
}

// A request that the link holds: its solids stand among the examples, its items are asked about as they are.
function takeRequest(text) {
  const given = readRequest(text), keys = ["given first", "given second"];
  for (const [i, json] of given.solids.entries()) keep(keys[i], json, `${json.type.replace("_", " ")} of the link`);
  state.own = Object.keys(given.items).length ? given.items : null;
  if (state.own) brought = [...brought.filter((each) => !each.items), { items: given.items }];
  put({ question: given.question, dimension: String(given.dimension) });
  for (const i of given.solids.keys()) $(["first", "second"][i]).value = keys[i];
  if (given.operation) $("operation").value = given.operation;
  $("turn").value = 0;
  $("snap").checked = false;
  $("plain").checked = Boolean(QUESTIONS[given.question].plain);
  state.offset = [0, 0, 0];
}

async function readLink() {
  try {
    const { said, brought: own } = await readFragment(location.hash);
    if (said.request) return takeRequest(said.request);
    for (const each of own) {
      if (each.items) { state.own = each.items; brought = [...brought.filter((other) => !other.items), each]; } else keep(String(each.key), each.json, String(each.name));
    }
    put(said);
  } catch (error) {
    put({});
    complain(`the link cannot be read: ${error.message}`);
  }
}

// --- start ------------------------------------------------------------------------------------------------------------

$("questions").addEventListener("change", () => { chooseQuestion(); refresh(); });
$("controls").addEventListener("input", ({ target }) => {
  if (target.id === "file" || target.closest("#edit")) return;
  if (target.id === "count") state.own = null;
  if (target.id === "turn") state.attitude = null;
  if (["first", "method", "count"].includes(target.id)) state.lens = state.lens === null ? null : 0;
  refresh();
});
$("key").value = sessionStorage.getItem("key") ?? "";
$("key").addEventListener("change", () => { sessionStorage.setItem("key", $("key").value); refresh(); });
for (const kind of ["pointerup", "keyup", "wheel"]) $("view3d").addEventListener(kind, saveState, { passive: true });
addEventListener("resize", refresh);
addEventListener("hashchange", async () => { if (location.hash === address) return; await readLink(); refresh(); });
$("centre").addEventListener("click", () => {
  const at = state.dimension;
  for (const key of Object.keys(loaded[at])) if (!loaded[at][key].isOwn) delete loaded[at][key];
  Object.assign(state, { offset: [0, 0, 0], attitude: null, own: null, lens: null });
  $("turn").value = 0;
  views.plane.look([0, 0], 1);
  views.space?.zoomBy(1 / views.space.zoom);
  refresh();
});
$("to-lens").addEventListener("click", () => { state.lens = 0; refresh(); });
$("next-wrong").addEventListener("click", () => { state.lens += 1; refresh(); });
$("from-lens").addEventListener("click", () => { state.lens = null; refresh(); });
$("depth").addEventListener("input", () => lens.zoom(Number($("depth").value)));
for (const [id, step] of [["zoom-in", 0.05], ["zoom-out", -0.05]]) $(id).addEventListener("click", () => lens.zoom(lens.depth + step));

function undo(said) {
  if (!said) return;
  put(said);
  refresh();
}
$("undo").addEventListener("click", () => undo(past.back()));
const isWriting = ({ tagName, type }) => /^(TEXTAREA|INPUT)$/.test(tagName) && type !== "range" && type !== "radio";
addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || isWriting(event.target)) return;
  const key = event.key.toLowerCase();
  if (key !== "z" && key !== "y") return;
  event.preventDefault();
  undo(key === "y" || event.shiftKey ? past.forth() : past.back());
});

const openAll = (files) => { for (const file of files) open(file).catch((error) => complain(error.message)); };
$("open").addEventListener("click", () => $("file").click());
$("file").addEventListener("change", ({ target }) => { openAll([...target.files]); target.value = ""; });
$("stage").addEventListener("dragover", (event) => event.preventDefault());
$("stage").addEventListener("drop", (event) => {
  event.preventDefault();
  if (event.dataTransfer.files.length) openAll([...event.dataTransfer.files]);
  else takeText(event.dataTransfer.getData("text"), "what was dropped");
});
addEventListener("paste", (event) => {
  if (isWriting(event.target)) return;
  if (event.clipboardData.files.length) openAll([...event.clipboardData.files]);
  else takeText(event.clipboardData.getData("text"), "what was pasted");
});
$("edit").addEventListener("toggle", fillText);
$("as-wkt").addEventListener("change", fillText);
$("apply").addEventListener("click", () => takeText($("text").value, "the edited solid"));

async function linkText() {
  const { text, isWhole } = await fragment(snapshot(state, views), used());
  return { text: new URL(text, location).href, note: isWhole ? "Copied" : "Copied, without what you brought: too large for a link" };
}
const copied = [["request", () => shownRequest().text], ["curl", () => curl(shownRequest().text)], ["answer", () => JSON.stringify(shown)], ["link", linkText]];
for (const [id, make] of copied.map(([name, make]) => [`copy-${name}`, make])) {
  const label = $(id).textContent;
  $(id).addEventListener("click", async () => {
    const made = await make(), { text, note } = typeof made === "string" ? { text: made, note: "Copied" } : made;
    await navigator.clipboard.writeText(text);
    $(id).textContent = note;
    setTimeout(() => { $(id).textContent = label; }, note === "Copied" ? 1500 : 5000);
  });
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", refresh);
for (const form of document.forms) form.addEventListener("submit", (event) => event.preventDefault());
await readLink();
refresh();
