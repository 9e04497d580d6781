// A small WebGL 2 view: translucent flat-shaded triangles, wide lines, round points, in one or two panes; turned by drag, moved
// by Shift-drag, zoomed by the wheel or two fingers. Rings around the second body turn it.

import { Fingers, calm, panes } from "./view2d.js";

const MESH = [`#version 300 es
uniform mat4 camera; in vec3 position; out vec3 eye;
void main() { gl_Position = camera * vec4(position, 1.0); eye = gl_Position.xyw; }`, `#version 300 es
precision highp float;
uniform vec4 color; in vec3 eye; out vec4 shade;
void main() {
  vec3 normal = normalize(cross(dFdx(eye), dFdy(eye)));
  shade = vec4(color.rgb * (0.45 + 0.55 * abs(normal.z)), 1.0) * color.a;
}`];
const LINES = [`#version 300 es
uniform mat4 camera; uniform vec2 size; uniform float width; in vec3 from; in vec3 to;
void main() {  // two triangles around the line, of so many pixels
  vec4 a = camera * vec4(from, 1.0), b = camera * vec4(to, 1.0);
  vec2 along = normalize((b.xy / b.w - a.xy / a.w) * size + vec2(1e-6, 0.0));
  int corner = gl_VertexID;
  vec4 end = corner == 1 || corner == 4 || corner == 5 ? b : a;
  float side = corner == 2 || corner == 3 || corner == 5 ? 1.0 : -1.0;
  gl_Position = end + vec4(vec2(-along.y, along.x) * side * width / size * end.w, 0.0, 0.0);
}`, `#version 300 es
precision highp float; uniform vec4 color; out vec4 shade;
void main() { shade = vec4(color.rgb, 1.0) * color.a; }`];
const POINTS = [`#version 300 es
uniform mat4 camera; uniform float width; in vec3 position;
void main() { gl_Position = camera * vec4(position, 1.0); gl_PointSize = width; }`, `#version 300 es
precision highp float; uniform vec4 color; out vec4 shade;
void main() { if (length(gl_PointCoord - 0.5) > 0.5) discard; shade = vec4(color.rgb, 1.0) * color.a; }`];

const HALF_ANGLE = 0.35; // of the view, along the shorter side of a pane
const GRIP = 10; // pixels within which a ring is taken
const LATE = 40; // milliseconds from asking for a frame to drawing it: three such in turn, and the machine is slow
const CIRCLE = Array.from({ length: 65 }, (_, i) => [Math.cos((Math.PI * i) / 32), Math.sin((Math.PI * i) / 32)]);
const AXES = [[0, 1, 2], [1, 2, 0], [2, 0, 1]];

export class View3D {
  constructor(canvas, { onMove, onTurn, onTurnEnd }) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", { antialias: false, alpha: false });
    Object.assign(this, { yaw: 0.6, pitch: 0.35, zoom: 1, ball: { middle: [0, 0, 0], radius: 2.1 }, items: [], panes: 1, rings: null, buffers: new Map(), back: backOf(canvas), late: 0 });
    if (!this.gl) throw new Error("this browser has no WebGL 2; the 2D pictures work without it");
    [this.mesh, this.lines, this.points] = [MESH, LINES, POINTS].map((source) => program(this.gl, ...source));
    const fingers = new Fingers(canvas);
    let held = null;
    canvas.addEventListener("pointerdown", (event) => { this.spins = false; held = this.ringAt(event); });
    canvas.addEventListener("pointermove", (event) => {
      const motion = fingers.moved(event);
      if (!motion) { canvas.style.cursor = this.ringAt(event) ? "move" : ""; return; }
      if (held && motion.count === 1) {
        const along = (motion.dx * held.along[0] + motion.dy * held.along[1]) / (held.along[0] ** 2 + held.along[1] ** 2);
        return onTurn(held.axis, along);
      }
      if (motion.count > 1) { this.move(motion.dx / 2, motion.dy / 2, onMove); this.zoomBy(motion.spread); }
      else if (event.shiftKey || event.buttons === 2) this.move(motion.dx, motion.dy, onMove);
      else this.turn(motion.dx * 0.008, motion.dy * 0.008);
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { if (held) onTurnEnd(); held = null; });
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.spins = false; this.zoomBy(Math.exp(-event.deltaY / 500)); }, { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("keydown", (event) => this.key(event, onMove));
    new ResizeObserver(() => this.paint(!this.isSlow)).observe(canvas);
  }

  key(event, onMove) {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (step && event.shiftKey) this.move(step[0] * 12, step[1] * 12, onMove);
    else if (step) this.turn(step[0] * 0.1, step[1] * 0.1);
    else if (event.key === "+" || event.key === "=") this.zoomBy(1.1);
    else if (event.key === "-") this.zoomBy(1 / 1.1);
    else return;
    this.spins = false;
    event.preventDefault();
  }

  // Turn slowly until somebody takes it in hand; not for those who asked for less motion.
  spin() {
    if (this.spins || calm()) return;
    this.spins = true;
    let before = performance.now();
    const tick = (now) => {
      if (!this.spins) return;
      if (!this.canvas.hidden) this.turn(-0.00025 * Math.min(100, now - before), 0);
      before = now;
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  turn(yaw, pitch) {
    this.yaw -= yaw;
    this.pitch = Math.max(-1.5, Math.min(1.5, this.pitch + pitch));
    this.draw();
  }

  move(dx, dy, onMove) {
    const [right, up] = this.axes(), scale = (2 * this.distance() * Math.tan(HALF_ANGLE)) / panes(this.canvas, this.panes)[0].height;
    onMove(right.map((r, k) => (r * dx - up[k] * dy) * scale));
  }

  zoomBy(factor) { this.zoom = Math.max(0.1, Math.min(20, this.zoom * factor)); this.draw(); }
  distance() { return (1.03 * this.ball.radius) / Math.sin(HALF_ANGLE) / this.zoom; } // the ball touches the edges but for 3%

  axes() {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    return [[cy, 0, -sy], [-sy * sp, cp, -cy * sp], [sy * cp, sp, cy * cp]];
  }

  camera(aspect) {
    const [right, up, back] = this.axes();
    const distance = this.distance(), near = distance / 50, far = distance + 20 * this.ball.radius;
    const f = 1 / Math.tan(HALF_ANGLE), zoom = Math.min(1, aspect) * f, depth = (near + far) / (near - far);
    const rows = [right.map((v) => (v * zoom) / aspect), up.map((v) => v * zoom), back.map((v) => v * depth), back.map((v) => -v)];
    const behind = [0, 0, -distance * depth + (2 * near * far) / (near - far), distance];
    const last = rows.map((row, i) => behind[i] - row.reduce((sum, v, k) => sum + v * this.ball.middle[k], 0));
    return new Float32Array([0, 1, 2].flatMap((k) => rows.map((row) => row[k])).concat(last));
  }

  // Pixels of the first pane at which a place of the picture is seen.
  seen(place) {
    const pane = panes(this.canvas, this.panes)[0], m = this.camera(pane.width / pane.height), [x, y, , w] = [0, 1, 2, 3].map((k) => place.reduce((sum, v, j) => sum + v * m[4 * j + k], m[12 + k]));
    return [pane.left + ((x / w + 1) * pane.width) / 2, pane.top + ((1 - y / w) * pane.height) / 2];
  }

  // The ring around the second body that lies below the pointer: its axis, and the pixels of a radian along it there.
  ringAt(event) {
    if (!this.rings) return null;
    const box = this.canvas.getBoundingClientRect(), at = [event.clientX - box.left, event.clientY - box.top];
    let best = { d: GRIP };
    for (const [axis, ring] of ringsAround(this.rings).entries()) {
      const pixels = ring.map((p) => this.seen(p));
      pixels.slice(1).forEach((p, i) => {
        const d = Math.hypot(p[0] - at[0], p[1] - at[1]);
        if (d < best.d) best = { d, axis, along: p.map((v, k) => ((v - pixels[i][k]) * 32) / Math.PI) };
      });
    }
    return best.along ? best : null;
  }

  // items: {kind: "triangles" | "lines" | "points", positions: Float32Array, color: [r, g, b, a], width?, onTop?, pose?, pane?};
  // rings: {middle, radius} of the body that can be turned by them; ball: {middle, radius} of what is to be seen
  show(items, { count = 1, rings = null, ball = this.ball }) {
    const used = new Set(items.flatMap(({ positions, indices }) => [positions, indices]));
    for (const [array, buffer] of this.buffers) if (!used.has(array)) { this.gl.deleteBuffer(buffer); this.buffers.delete(array); }
    const circles = rings ? ringsAround(rings).map((ring, k) => ({
      kind: "lines", positions: new Float32Array(ring.slice(1).flatMap((p, i) => [...ring[i], ...p])), color: [0, 1, 2].map((j) => (j === k ? 0.85 : 0.3)).concat(0.9), width: 2, pane: 0,
    })) : [];
    Object.assign(this, { items: [...items, ...circles], panes: count, rings, ball, back: backOf(this.canvas) });
    this.draw();
  }

  // Once a frame, however often it is asked for. A slow machine draws the edges smooth only when the picture rests.
  draw() {
    if (this.asked) return;
    this.asked = performance.now();
    requestAnimationFrame(() => {
      this.late = performance.now() - this.asked > LATE ? this.late + 1 : 0;
      this.asked = 0;
      if (this.late >= 3) this.isSlow = true;
      clearTimeout(this.rest);
      if (this.isSlow) this.rest = setTimeout(() => this.paint(true), 150);
      this.paint(!this.isSlow);
    });
  }

  // isSmooth: with at least two pixels for one of the screen along each axis, which the browser averages.
  paint(isSmooth) {
    const screen = window.devicePixelRatio || 1, ratio = isSmooth ? Math.max(2, screen) : Math.max(1, screen / 2);
    const { gl, canvas } = this, [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio].map(Math.round);
    if (!canvas.clientWidth) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.clearColor(...this.back, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.BLEND); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const order = (item) => (item.onTop ? 2 : item.kind === "triangles" && item.color[3] < 1 ? 1 : 0);
    const sorted = [...this.items].sort((a, b) => order(a) - order(b));
    panes(canvas, this.panes).forEach((pane, i) => {
      gl.viewport(pane.left * ratio, (canvas.clientHeight - pane.top - pane.height) * ratio, pane.width * ratio, pane.height * ratio);
      const camera = this.camera(pane.width / pane.height);
      for (const item of sorted) {
        if (!item.positions.length || (item.pane ?? i) !== i) continue;
        (item.onTop ? gl.disable : gl.enable).call(gl, gl.DEPTH_TEST);
        gl.depthMask(order(item) === 0);
        this.drawItem(item, item.pose ? times(camera, item.pose) : camera, [pane.width * ratio, pane.height * ratio], ratio);
      }
    });
    gl.depthMask(true);
  }

  drawItem(item, camera, size, ratio) {
    const gl = this.gl, unit = this[item.kind === "triangles" ? "mesh" : item.kind];
    gl.useProgram(unit);
    gl.uniformMatrix4fv(gl.getUniformLocation(unit, "camera"), false, camera);
    gl.uniform4fv(gl.getUniformLocation(unit, "color"), item.color);
    gl.uniform1f(gl.getUniformLocation(unit, "width"), (item.width ?? 2) * ratio);
    gl.uniform2f(gl.getUniformLocation(unit, "size"), ...size);
    gl.bindVertexArray(null);
    this.bind(gl.ARRAY_BUFFER, item.positions);
    const isLines = item.kind === "lines";
    const names = isLines ? ["from", "to"] : ["position"];
    names.forEach((name, i) => {
      const place = gl.getAttribLocation(unit, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, isLines ? 24 : 12, 12 * i);
      gl.vertexAttribDivisor(place, isLines ? 1 : 0);
    });
    const n = item.positions.length / 3;
    if (isLines) gl.drawArraysInstanced(gl.TRIANGLES, 0, 6, n / 2);
    else if (item.indices) { this.bind(gl.ELEMENT_ARRAY_BUFFER, item.indices); gl.drawElements(gl.TRIANGLES, item.indices.length, gl.UNSIGNED_INT, 0); }
    else gl.drawArrays(item.kind === "points" ? gl.POINTS : gl.TRIANGLES, 0, n);
    names.forEach((name) => gl.disableVertexAttribArray(gl.getAttribLocation(unit, name)));
  }

  bind(target, array) {
    const gl = this.gl, isNew = !this.buffers.has(array);
    if (isNew) this.buffers.set(array, gl.createBuffer());
    gl.bindBuffer(target, this.buffers.get(array));
    if (isNew) gl.bufferData(target, array, gl.STATIC_DRAW);
  }
}

function backOf(canvas) {
  return getComputedStyle(canvas.parentElement).backgroundColor.match(/[\d.]+/g).slice(0, 3).map((v) => v / 255);
}

function ringsAround({ middle, radius }) {
  return AXES.map(([, u, v]) => CIRCLE.map(([c, s]) => { const p = [...middle]; p[u] += radius * c; p[v] += radius * s; return p; }));
}

// The camera's matrix after a pose.
function times(camera, { rotation, translation }) {
  const columns = [0, 1, 2].map((k) => [...rotation.map((row) => row[k]), 0]).concat([[...translation, 1]]);
  return new Float32Array(columns.flatMap((column) => [0, 1, 2, 3].map((row) => column.reduce((sum, v, k) => sum + v * camera[4 * k + row], 0))));
}

function program(gl, vertex, fragment) {
  const unit = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source); gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(unit, shader);
  }
  gl.linkProgram(unit);
  return unit;
}
