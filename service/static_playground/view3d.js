// A small WebGL 2 view: translucent flat-shaded triangles, wide lines, round points; turned by drag, moved by Shift-drag.

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

export class View3D {
  constructor(canvas, onMove) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", { antialias: true, premultipliedAlpha: true });
    this.yaw = 0.6; this.pitch = 0.35; this.zoom = 1; this.radius = 2;
    this.items = [];
    if (!this.gl) throw new Error("this browser has no WebGL 2; the 2D pictures work without it");
    [this.mesh, this.lines, this.points] = [MESH, LINES, POINTS].map((source) => program(this.gl, ...source));
    this.pointers = new Map();
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, event);
    });
    canvas.addEventListener("pointermove", (event) => this.drag(event, onMove));
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
    }
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.zoomBy(Math.exp(-event.deltaY / 500)); }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event, onMove));
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  drag(event, onMove) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
    this.pointers.set(event.pointerId, event);
    if (this.pointers.size > 1 || event.shiftKey || event.buttons === 2) this.move(dx, dy, onMove);
    else this.turn(dx * 0.008, dy * 0.008);
  }

  key(event, onMove) {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (step && event.shiftKey) this.move(step[0] * 12, step[1] * 12, onMove);
    else if (step) this.turn(step[0] * 0.1, step[1] * 0.1);
    else if (event.key === "+" || event.key === "=") this.zoomBy(1.1);
    else if (event.key === "-") this.zoomBy(1 / 1.1);
    else return;
    event.preventDefault();
  }

  turn(yaw, pitch) {
    this.yaw -= yaw;
    this.pitch = Math.max(-1.5, Math.min(1.5, this.pitch + pitch));
    this.draw();
  }

  move(dx, dy, onMove) {
    const [right, up] = this.axes();
    const scale = (2 * this.distance() * Math.tan(0.35)) / this.canvas.clientHeight;
    onMove(right.map((r, k) => (r * dx - up[k] * dy) * scale));
  }

  zoomBy(factor) { this.zoom = Math.max(0.1, Math.min(20, this.zoom * factor)); this.draw(); }
  distance() { return (this.radius * 2.7) / this.zoom; }

  axes() {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    return [[cy, 0, -sy], [-sy * sp, cp, -cy * sp], [sy * cp, sp, cy * cp]];
  }

  camera() {
    const [right, up, back] = this.axes();
    const distance = this.distance(), near = distance / 50, far = distance + 20 * this.radius;
    const f = 1 / Math.tan(0.35), aspect = this.canvas.width / this.canvas.height;
    const zoom = Math.min(1, aspect) * f, depth = (near + far) / (near - far);
    const rows = [right.map((v) => (v * zoom) / aspect), up.map((v) => v * zoom), back.map((v) => v * depth), back.map((v) => -v)];
    const last = [0, 0, -distance * depth + (2 * near * far) / (near - far), distance];
    return new Float32Array([0, 1, 2].flatMap((k) => rows.map((row) => row[k])).concat(last));
  }

  // items: {kind: "triangles" | "lines" | "points", positions: Float32Array, color: [r, g, b, a], width?, onTop?}
  show(items, radius) {
    for (const old of this.items) if (!items.includes(old)) this.gl.deleteBuffer(old.buffer);
    this.items = items; this.radius = radius;
    this.draw();
  }

  draw() {
    const { gl, canvas } = this, ratio = window.devicePixelRatio || 1;
    if (!canvas.clientWidth) return;
    canvas.width = canvas.clientWidth * ratio; canvas.height = canvas.clientHeight * ratio;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.BLEND); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const camera = this.camera();
    const order = (item) => (item.onTop ? 2 : item.kind === "triangles" && item.color[3] < 1 ? 1 : 0);
    for (const item of [...this.items].sort((a, b) => order(a) - order(b))) {
      if (!item.positions.length) continue;
      (item.onTop ? gl.disable : gl.enable).call(gl, gl.DEPTH_TEST);
      gl.depthMask(order(item) === 0);
      this.drawItem(item, camera, ratio);
    }
    gl.depthMask(true);
  }

  drawItem(item, camera, ratio) {
    const gl = this.gl, unit = this[item.kind === "triangles" ? "mesh" : item.kind];
    gl.useProgram(unit);
    gl.uniformMatrix4fv(gl.getUniformLocation(unit, "camera"), false, camera);
    gl.uniform4fv(gl.getUniformLocation(unit, "color"), item.color);
    gl.uniform1f(gl.getUniformLocation(unit, "width"), (item.width ?? 2) * ratio);
    gl.uniform2f(gl.getUniformLocation(unit, "size"), this.canvas.width, this.canvas.height);
    item.buffer ??= fill(gl, item.positions);
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ARRAY_BUFFER, item.buffer);
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
    else gl.drawArrays(item.kind === "points" ? gl.POINTS : gl.TRIANGLES, 0, n);
    names.forEach((name) => gl.disableVertexAttribArray(gl.getAttribLocation(unit, name)));
  }
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

function fill(gl, positions) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, positions, gl.STATIC_DRAW);
  return buffer;
}
