// The plane on a 2D canvas: filled rings under even-odd, discs, half-planes, lines and points. Drag moves the second thing,
// drag on one of its corners moves that corner.

const GRIP = 14; // pixels within which a corner is taken

export class View2D {
  constructor(canvas, onMove, onCorner) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.items = []; this.corners = []; this.radius = 2;
    let held = null, last = null;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      last = this.at(event);
      const near = this.corners.map((corner) => Math.hypot(...corner.map((v, k) => v - last[k])) * this.scale());
      const best = near.indexOf(Math.min(...near));
      held = near[best] < GRIP ? best : -1;
    });
    canvas.addEventListener("pointermove", (event) => {
      if (held === null) return;
      const now = this.at(event);
      if (held >= 0) onCorner(held, now);
      else onMove([now[0] - last[0], now[1] - last[1], 0]);
      last = now;
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { held = null; });
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!step) return;
      event.preventDefault();
      onMove([...step.map((v) => (v * this.radius) / 40), 0]);
    });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  scale() { return Math.min(this.canvas.clientWidth, this.canvas.clientHeight) / (2.3 * this.radius); }

  at(event) {
    const box = this.canvas.getBoundingClientRect(), s = this.scale();
    return [(event.clientX - box.left - box.width / 2) / s, (box.height / 2 - event.clientY + box.top) / s];
  }

  // items: {kind: "rings" | "disc" | "half_plane" | "lines" | "points", ..., color: css, fill?: alpha, width?}
  show(items, radius, corners) { this.items = items; this.radius = radius; this.corners = corners; this.draw(); }

  draw() {
    const { canvas, context } = this, ratio = window.devicePixelRatio || 1;
    if (!canvas.clientWidth) return;
    canvas.width = canvas.clientWidth * ratio; canvas.height = canvas.clientHeight * ratio;
    const s = this.scale() * ratio;
    context.setTransform(s, 0, 0, -s, canvas.width / 2, canvas.height / 2);
    for (const item of this.items) {
      if (item.kind === "text") continue;
      context.beginPath();
      PATHS[item.kind](context, item, s / ratio);
      context.fillStyle = context.strokeStyle = item.color;
      context.lineWidth = ((item.width ?? 1.5) * ratio) / s;
      context.lineJoin = "round";
      if (item.kind === "points") { context.fill(); continue; }
      if (item.fill) { context.globalAlpha = item.fill; context.fill("evenodd"); context.globalAlpha = 1; }
      context.stroke();
    }
    context.save();
    context.setTransform(1, 0, 0, 1, canvas.width / 2, canvas.height / 2);
    for (const { text, at, color } of this.items.filter(({ kind }) => kind === "text")) {
      context.font = `600 ${14 * ratio}px system-ui, sans-serif`;
      context.fillStyle = color; context.textAlign = "center";
      context.fillText(text, at[0] * s, -at[1] * s);
    }
    context.restore();
    context.fillStyle = getComputedStyle(canvas).color;
    for (const [x, y] of this.corners) context.fillRect(x - (3 * ratio) / s, y - (3 * ratio) / s, (6 * ratio) / s, (6 * ratio) / s);
  }
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
