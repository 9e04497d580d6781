// The plane on a 2D canvas: filled rings under even-odd, discs, half-planes, lines and points, in one or two panes. Drag moves
// the second thing, drag on a corner moves that corner, Shift-drag or two fingers pan, the wheel zooms.

const GRIP = 14; // pixels within which a corner or an edge is taken

export const calm = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

const HEADING = 36; // pixels above each of several pictures

// The rectangles of n pictures on a canvas, next to each other or, where it is high, one below the other, each below its heading.
export function panes({ clientWidth: width, clientHeight: height }, n) {
  const [across, down] = width >= height ? [n, 1] : [1, n], heading = n > 1 ? HEADING : 0;
  return Array.from({ length: n }, (_, i) => ({
    left: across > 1 ? (i * width) / n : 0, top: (down > 1 ? (i * height) / n : 0) + heading, width: width / across, height: Math.max(1, height / down - heading),
  }));
}

// Positions of the pointers that are down, how they moved together, and how they spread.
export class Fingers {
  constructor(canvas) {
    this.down = new Map();
    canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); this.down.set(event.pointerId, event); });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => this.down.delete(event.pointerId));
  }

  moved(event) {
    const before = this.down.get(event.pointerId);
    if (!before) return null;
    const others = [...this.down.values()].filter((each) => each.pointerId !== event.pointerId), other = others[0];
    this.down.set(event.pointerId, event);
    const far = (each) => (other ? Math.hypot(each.clientX - other.clientX, each.clientY - other.clientY) : 1);
    return { dx: event.clientX - before.clientX, dy: event.clientY - before.clientY, count: this.down.size, spread: far(event) / (far(before) || 1) };
  }
}

export class View2D {
  constructor(canvas, { onMove, onCorner, onCornerEnd, onAdd, onDelete, onView }) {
    this.canvas = canvas; this.context = canvas.getContext("2d"); this.onView = onView;
    Object.assign(this, { items: [], corners: [], edges: [], half: [2.1, 2.1], middle: [0, 0], zoom: 1, panes: 1, grid: 0 });
    const fingers = new Fingers(canvas);
    let held = -1, last = null;
    canvas.addEventListener("pointerdown", (event) => { last = this.at(event); held = this.cornerAt(last); });
    canvas.addEventListener("pointermove", (event) => {
      const motion = fingers.moved(event);
      if (!motion) { canvas.style.cursor = this.cornerAt(this.at(event)) >= 0 ? "move" : ""; return; }
      if (motion.count > 1 || event.shiftKey || event.buttons === 4) {
        this.pan(motion.dx / motion.count, motion.dy / motion.count);
        if (motion.count > 1) this.zoomAt(motion.spread, this.at(event));
        last = this.at(event);
        return;
      }
      const now = this.at(event);
      if (held >= 0) onCorner(held, now);
      else onMove([now[0] - last[0], now[1] - last[1], 0]);
      last = now;
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { if (held >= 0) onCornerEnd(); held = -1; });
    canvas.addEventListener("dblclick", (event) => {
      const place = this.at(event), corner = this.cornerAt(place);
      if (corner >= 0) return onDelete(corner);
      const near = this.edges.map(([a, b]) => beside(a, b, place) * this.scale()), best = near.indexOf(Math.min(...near));
      if (near[best] < GRIP) onAdd(best, place);
    });
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.zoomAt(Math.exp(-event.deltaY / 500), this.at(event)); }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (step && event.shiftKey) this.pan(-12 * step[0], 12 * step[1]);
      else if (step) onMove([...step.map((v) => (v * this.half[1]) / 40 / this.zoom), 0]);
      else if (event.key === "+" || event.key === "=") this.zoomAt(1.1, this.middle);
      else if (event.key === "-") this.zoomAt(1 / 1.1, this.middle);
      else return;
      event.preventDefault();
    });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  scale() {
    const { width, height } = panes(this.canvas, this.panes)[0];
    return (Math.min(width / this.half[0], height / this.half[1]) * this.zoom) / 2.3;
  }

  at(event) {
    const box = this.canvas.getBoundingClientRect(), s = this.scale(), [x, y] = [event.clientX - box.left, event.clientY - box.top];
    const pane = panes(this.canvas, this.panes).find((each) => x < each.left + each.width && y < each.top + each.height) ?? panes(this.canvas, 1)[0];
    return [this.middle[0] + (x - pane.left - pane.width / 2) / s, this.middle[1] - (y - pane.top - pane.height / 2) / s];
  }

  cornerAt(place) {
    const near = this.corners.map((corner) => Math.hypot(...corner.map((v, k) => v - place[k])) * this.scale()), best = near.indexOf(Math.min(...near));
    return near[best] < GRIP ? best : -1;
  }

  pan(dx, dy) { this.look([this.middle[0] - dx / this.scale(), this.middle[1] + dy / this.scale()], this.zoom); }

  zoomAt(factor, place) {
    const zoom = Math.max(0.2, Math.min(1e9, this.zoom * factor));
    this.look(this.middle.map((v, k) => place[k] + ((v - place[k]) * this.zoom) / zoom), zoom);
  }

  look(middle, zoom) { Object.assign(this, { middle, zoom }); this.draw(); this.onView(); }

  // items: {kind: "rings" | "disc" | "half_plane" | "lines" | "points" | "crosses", ..., color: css, fill?: alpha, width?, pane?};
  // corners and edges that can be taken; the step of the grid that is shown, 0 for none; half the extents to be seen, from the origin
  show(items, { corners = [], edges = [], count = 1, grid = 0, half = this.half }) { Object.assign(this, { items, corners, edges, panes: count, grid, half }); this.draw(); }

  draw() {
    const { canvas, context } = this, ratio = window.devicePixelRatio || 1;
    if (!canvas.clientWidth) return;
    canvas.width = canvas.clientWidth * ratio; canvas.height = canvas.clientHeight * ratio;
    const s = this.scale() * ratio;
    panes(canvas, this.panes).forEach((pane, i) => {
      context.save();
      context.beginPath();
      context.rect(pane.left * ratio, pane.top * ratio, pane.width * ratio, pane.height * ratio);
      context.clip();
      context.setTransform(s, 0, 0, -s, (pane.left + pane.width / 2) * ratio - this.middle[0] * s, (pane.top + pane.height / 2) * ratio + this.middle[1] * s);
      this.drawGrid(pane, ratio, s);
      for (const item of this.items) if ((item.pane ?? i) === i) this.drawItem(item, ratio, s);
      context.fillStyle = getComputedStyle(canvas).color;
      for (const [x, y] of this.corners) context.fillRect(x - (3 * ratio) / s, y - (3 * ratio) / s, (6 * ratio) / s, (6 * ratio) / s);
      context.restore();
    });
  }

  drawItem(item, ratio, s) {
    const { context } = this;
    context.beginPath();
    PATHS[item.kind](context, item, s / ratio);
    context.fillStyle = context.strokeStyle = item.color;
    context.lineWidth = ((item.width ?? 1.5) * ratio) / s;
    context.lineJoin = "round";
    if (item.kind === "points") return context.fill();
    if (item.fill) { context.globalAlpha = item.fill; context.fill("evenodd"); context.globalAlpha = 1; }
    context.stroke();
  }

  drawGrid({ width, height }, ratio, s) {
    const { context, grid } = this;
    if (!grid || (grid * s) / ratio < 6) return;
    const half = [width, height].map((v) => (v * ratio) / s / 2);
    context.beginPath();
    for (const k of [0, 1]) for (let i = Math.ceil((this.middle[k] - half[k]) / grid); i * grid <= this.middle[k] + half[k]; i++) {
      for (const sign of [-1, 1]) { const p = []; p[k] = i * grid; p[1 - k] = this.middle[1 - k] + sign * half[1 - k]; context[sign < 0 ? "moveTo" : "lineTo"](...p); }
    }
    context.strokeStyle = getComputedStyle(this.canvas).color;
    context.globalAlpha = 0.12; context.lineWidth = ratio / s; context.stroke(); context.globalAlpha = 1;
  }
}

// How far a place is from a side.
function beside(a, b, place) {
  const side = a.map((v, k) => b[k] - v), from = a.map((v, k) => place[k] - v), t = Math.max(0, Math.min(1, (side[0] * from[0] + side[1] * from[1]) / (side[0] ** 2 + side[1] ** 2 || 1)));
  return Math.hypot(...from.map((v, k) => v - t * side[k]));
}

const PATHS = {
  rings(context, { rings }) {
    for (const ring of rings) {
      ring.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
      context.closePath();
    }
  },
  disc(context, { center, radius }) { context.arc(center[0], center[1], radius, 0, 7); },
  half_plane(context, { normal, offset }) {
    const size = Math.hypot(...normal), [nx, ny] = normal.map((v) => v / size), far = 100;
    const [px, py] = [(-nx * offset) / size, (-ny * offset) / size];
    context.moveTo(px - ny * far, py + nx * far);
    context.lineTo(px + ny * far, py - nx * far);
    context.lineTo(px + (ny + nx) * far, py + (ny - nx) * far);
    context.lineTo(px + (nx - ny) * far, py + (ny + nx) * far);
    context.closePath();
  },
  lines(context, { lines }) {
    for (const [[ax, ay], [bx, by]] of lines) { context.moveTo(ax, ay); context.lineTo(bx, by); }
  },
  crosses(context, { points, size: pixels }, scale) {
    const size = pixels / scale / 2;
    for (const [x, y] of points) for (const sign of [-1, 1]) { context.moveTo(x - size, y - sign * size); context.lineTo(x + size, y + sign * size); }
  },
  points(context, { points, width = 4 }, scale) {
    const size = width / scale;
    for (const [x, y] of points) context.rect(x - size / 2, y - size / 2, size, size);
  },
};
