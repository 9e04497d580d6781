// A look at one point down to the last place: the doubles around it as a lattice, coloured by the exact answer on the left and
// by the plain float64 method on the right, and the boundary where it truly passes between them.

import { next, planeFrom, ratio, ulp } from "./exact.js";
import { calm, panes } from "./view2d.js";

const REACH = 8; // doubles each way

// The lattice of doubles around p in the plane of two axes. Along the axis with the finer doubles only every 2^k-th is taken,
// so that the cells are square.
export function lattice(p, axes) {
  const step = Math.max(...axes.map((k) => ulp(p[k]))), places = axes.map((k) => {
    const list = [p[k]];
    for (let i = 0; i < REACH; i++) {
      list.push(Math.max(list.at(-1) + step, next(list.at(-1), 1)));
      list.unshift(Math.min(list[0] - step, next(list[0], -1)));
    }
    return list;
  });
  const points = places[0].flatMap((x) => places[1].map((y) => p.map((v, k) => (k === axes[0] ? x : k === axes[1] ? y : v))));
  return { points, step };
}

// Where the boundary passes p in the plane of the two axes, the other coordinate as in p. A line {off, slope, isSteep, ends}
// is u = off + slope v (v = ... of u where it is not steep) in coordinates from p, `off` exact to 60 bits.
export function boundaryNear(solid, p) {
  const isFlat = p.length === 2, polygons = isFlat ? solid.rings.flatMap((ring) => ring.map((a, i) => [a, ring[(i + 1) % ring.length]]))
    : solid.mesh.faces.map((face) => face.map((i) => solid.mesh.vertices[i]));
  const away = (corner) => corner.map((v, k) => v - p[k]);
  let axes = [0, 1];
  if (!isFlat) {
    const nearest = polygons.reduce((best, corners) => { const d = distance(p, corners); return d < best.d ? { d, corners } : best; }, { d: Infinity });
    const { n } = planeFrom(p, nearest.corners.slice(0, 3)), size = n.map((v) => (v < 0n ? -v : v)), least = size.reduce((k, v, i) => (v < size[k] ? i : k), 0);
    axes = [0, 1, 2].filter((k) => k !== least);
  }
  const third = 3 - axes[0] - axes[1];
  const lines = polygons.flatMap((corners) => {
    const ends = isFlat ? corners.map(away) : sliced(corners.map(away), third);
    if (ends.length < 2) return [];
    const { n, d, unit } = planeFrom(p, isFlat ? corners : corners.slice(0, 3)), [a, b] = axes.map((k) => n[k]);
    const isSteep = (a < 0n ? -a : a) >= (b < 0n ? -b : b), [main, other] = isSteep ? [a, b] : [b, a];
    return main === 0n ? [] : [{ off: -ratio(d, main) * 2 ** unit, slope: -ratio(other, main), isSteep, ends: ends.map((end) => axes.map((k) => end[k])) }];
  });
  return { axes, lines };
}

// Where the outline of a convex face crosses the plane in which one coordinate is 0.
function sliced(corners, k) {
  const ends = corners.flatMap((a, i) => {
    const b = corners[(i + 1) % corners.length];
    return (a[k] < 0) === (b[k] < 0) ? [] : [a.map((v, j) => v + ((b[j] - v) * a[k]) / (a[k] - b[k]))];
  });
  return ends.slice(0, 2);
}

// A measure of how far a face is: to its plane, in rounded numbers, far when p is beside its box.
function distance(p, corners) {
  const size = Math.max(...corners.flatMap((c) => c.map((v, k) => Math.abs(v - corners[0][k]))));
  if (p.some((v, k) => v < Math.min(...corners.map((c) => c[k])) - 1e-9 * size || v > Math.max(...corners.map((c) => c[k])) + 1e-9 * size)) return Infinity;
  const [u, v] = [1, 2].map((i) => corners[i].map((x, k) => x - corners[0][k])), n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  return Math.abs(n.reduce((sum, x, k) => sum + x * (p[k] - corners[0][k]), 0)) / (Math.hypot(...n) || 1);
}

export class Lens {
  constructor(canvas, onZoom) {
    this.canvas = canvas; this.context = canvas.getContext("2d"); this.onZoom = onZoom;
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom(this.depth - event.deltaY / 3000); }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const step = { "+": 0.03, "=": 0.03, "-": -0.03 }[event.key];
      if (step) { event.preventDefault(); this.zoom(this.depth + step); }
    });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  // seen: {p, axes, lines, places: [[u, v, exact colour, plain colour, is wrong]], step, size of the body}, colors by name
  open(seen, colors) {
    const isSame = this.seen && String(this.seen.p) === String(seen.p);
    Object.assign(this, { seen, colors });
    if (isSame) return this.draw();
    cancelAnimationFrame(this.frame);
    if (calm()) return this.zoom(1);
    const begin = performance.now(), tick = (now) => {
      const t = Math.min(1, (now - begin) / 3500);
      this.zoom(t * t * (3 - 2 * t), true);
      if (t < 1) this.frame = requestAnimationFrame(tick);
    };
    this.frame = requestAnimationFrame(tick);
  }

  close() { cancelAnimationFrame(this.frame); this.seen = null; }

  zoom(depth, isMotion = false) {
    if (!isMotion) cancelAnimationFrame(this.frame);
    this.depth = Math.max(0, Math.min(1, depth));
    this.draw();
    this.onZoom(this.depth, this.times());
  }

  // Pixels a unit: from the whole body at depth 0 to the lattice of doubles at depth 1, in equal ratios.
  scale() {
    const { size, step } = this.seen, side = this.side(), first = this.widest(), last = (0.72 * side) / ((2 * REACH + 1) * step);
    return first * (last / first) ** this.depth;
  }

  side() { const { width, height } = panes(this.canvas, 2)[0]; return Math.min(width, height); }
  widest() { return this.side() / (1.2 * this.seen.size); }
  times() { return this.seen ? this.scale() / this.widest() : 1; }

  draw() {
    const { canvas, context, seen } = this, ratio = window.devicePixelRatio || 1;
    if (!canvas.clientWidth || !seen) return;
    canvas.width = canvas.clientWidth * ratio; canvas.height = canvas.clientHeight * ratio;
    const s = this.scale();
    panes(canvas, 2).forEach((pane, i) => {
      const [x, y] = [pane.left + pane.width / 2, pane.top + pane.height / 2], half = [pane.width / 2 / s, pane.height / 2 / s];
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.save();
      context.beginPath(); context.rect(pane.left, pane.top, pane.width, pane.height); context.clip();
      this.drawPlaces(x, y, s, i);
      context.beginPath();
      for (const line of seen.lines) for (const [k, end] of clipped(line, half).entries()) context[k ? "lineTo" : "moveTo"](x + end[0] * s, y - end[1] * s);
      context.strokeStyle = this.colors.first; context.lineWidth = 2; context.stroke();
      context.beginPath(); context.arc(x, y, 9, 0, 7);
      context.strokeStyle = this.colors.wrong; context.stroke();
      context.restore();
    });
  }

  drawPlaces(x, y, s, pane) {
    const { context, seen } = this, cell = seen.step * s, radius = Math.min(5, cell / 4);
    if (cell < 3) return;
    for (const place of seen.places) {
      const [px, py] = [x + place[0] * s, y - place[1] * s];
      context.beginPath(); context.arc(px, py, radius, 0, 7);
      context.fillStyle = this.colors[place[2 + pane]]; context.fill();
      if (!pane || !place[4] || cell < 8) continue;
      context.beginPath();
      for (const sign of [-1, 1]) { context.moveTo(px - 5, py - 5 * sign); context.lineTo(px + 5, py + 5 * sign); }
      context.strokeStyle = this.colors.wrong; context.lineWidth = 2; context.stroke();
    }
  }
}

// The part of a line that a window of this half width and height shows, in coordinates from p.
function clipped({ off, slope, isSteep, ends }, half) {
  const run = isSteep ? 1 : 0, across = 1 - run, far = [0, 1].map((i) => ends[i][run]).sort((a, b) => a - b);
  const low = Math.max(far[0], -2 * half[run]), high = Math.min(far[1], 2 * half[run]);
  if (low > high) return [];
  return [low, high].map((t) => { const end = []; end[run] = t; end[across] = off + slope * t; return end; });
}
