"use strict";
const $ = id => document.getElementById(id);
const data = JSON.parse($("data").textContent);
const esc = text => String(text).replace(/[&<>"]/g, c => ({"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;"})[c]);
const PLAYGROUND = new Set(["/v1/contains", "/v1/clip/segments", "/v1/clip/polygons", "/v1/overlay", "/v1/collide", "/v1/clearance"]);

// The same question to the service: a link into the playground, and a command.
function asking([path, body]) {
  const text = JSON.stringify(body), link = encodeURIComponent(JSON.stringify([path, body]));
  return (PLAYGROUND.has(path) && !body.poses ? `<p><a href="http://127.0.0.1:8000/#request=${link}">Open in the playground</a> <span class="soft">of a service on this machine: python -m service.</span></p>` : "")
    + `<pre tabindex="0" aria-label="The same question to the service">curl -s http://127.0.0.1:8000${path} -H 'content-type: application/json' -d '${esc(text)}'</pre>`;
}

// The body of a request as a picture; wrong: the items among points and segments that somebody gets wrong.
function drawing(body, wrong = new Set()) {
  const shapes = [], dots = [];
  const add = (rings, color, kind, width = 1.5) => shapes.push({rings, color, kind, width});
  const moved = pose => pose ? p => pose.rotation.map((row, i) => row.reduce((sum, r, k) => sum + r * p[k], pose.translation[i])) : p => p;
  const solid = (s, color, pose) => {
    if (!s) return;
    const at = moved(pose);
    if (s.rings) add(s.rings.map(ring => ring.map(at)), color, "area");
    else if (s.faces) {
      const edges = new Map();
      for (const face of s.faces.slice(0, 3000)) face.forEach((a, i) => { const b = face[(i + 1) % face.length];
        edges.set(Math.min(a, b) + " " + Math.max(a, b), [at(s.vertices[a]), at(s.vertices[b])]); });
      for (const edge of edges.values()) add([edge], color, "line", edges.size > 60 ? 0.6 : 1.2);
    } else if (s.vertices) add([s.vertices.map(at)], color, "area");
    else if (s.min && s.min.length === 2) add([[s.min, [s.max[0], s.min[1]], s.max, [s.min[0], s.max[1]]].map(at)], color, "area");
    else if (s.min) for (let k = 0; k < 8; k++) for (const bit of [1, 2, 4]) if (!(k & bit)) {
      const corner = c => at([0, 1, 2].map(i => c >> i & 1 ? s.max[i] : s.min[i])); add([[corner(k), corner(k | bit)]], color, "line"); }
    else if (s.radius !== undefined) {
      const round = (u, v) => [...Array(65).keys()].map(k => at(s.center.map((c, i) => c + s.radius * (i === u ? Math.cos(k / 32 * Math.PI) : i === v ? Math.sin(k / 32 * Math.PI) : 0))));
      (s.center.length === 2 ? [[0, 1]] : [[0, 1], [0, 2], [1, 2]]).forEach(([u, v]) => add([round(u, v)], color, s.center.length === 2 ? "area" : "line"));
    }
  };
  [body.solid, body.surface, body.region, body.first, body.subject].forEach(s => solid(s, "var(--book)"));
  const corners = body.solid && body.solid.vertices, half = body.region || {};
  for (const row of corners ? [...(body.planes || []), ...(half.normal ? [[...half.normal, half.offset]] : [])] : []) {  // a patch of the plane
    const n = row.slice(0, 3), size = Math.hypot(...n), unit = n.map(x => x / size), axes = [0, 1, 2];
    const middle = axes.map(i => corners.reduce((sum, p) => sum + p[i] / corners.length, 0));
    const along = way => { const places = corners.map(p => p.reduce((sum, x, i) => sum + x * way[i], 0)); return 0.6 * (Math.max(...places) - Math.min(...places)); };
    const above = unit.reduce((sum, x, i) => sum + x * middle[i], row[3] / size), foot = middle.map((x, i) => x - above * unit[i]);
    const least = axes.reduce((a, i) => Math.abs(unit[i]) < Math.abs(unit[a]) ? i : a, 0), other = axes.map(i => (i === least) - unit[least] * unit[i]);
    const u = other.map(x => x / Math.hypot(...other)), v = axes.map(i => unit[(i + 1) % 3] * u[(i + 2) % 3] - unit[(i + 2) % 3] * u[(i + 1) % 3]);
    add([[[1, 1], [-1, 1], [-1, -1], [1, -1]].map(([a, b]) => foot.map((x, i) => x + a * along(u) * u[i] + b * along(v) * v[i]))], "var(--peer)", "area");
  }
  solid(body.second || body.clip, "var(--peer)", body.poses && body.poses[0]);
  (body.bodies || []).forEach((each, i) => solid(each.solid, i ? "var(--peer)" : "var(--book)", each.pose));
  (body.segments || []).forEach((s, i) => add([s], wrong.has(i) ? "var(--bad)" : "var(--ours)", "line", 2.5));
  (body.polygons || []).forEach(rings => add(rings, "var(--ours)", "area", 2));
  (body.points || []).forEach((p, i) => dots.push([p, wrong.has(i)]));
  const given = [...shapes.flatMap(shape => shape.rings.flat()), ...dots.map(dot => dot[0])];
  if (!given.length) return "";
  // Axes along which the input is more than a hundred times as short as along another are stretched, and the picture says so.
  const lows = given[0].map((_, i) => given.map(p => p[i]).reduce((a, b) => Math.min(a, b)));
  const sizes = lows.map((low, i) => given.map(p => p[i]).reduce((a, b) => Math.max(a, b)) - low), longest = Math.max(...sizes);
  const stretch = sizes.map(size => size > 0 && longest > 100 * size ? longest / size : 1), isStretched = stretch.some(by => by > 1);
  const flat = p => { const q = p.map((x, i) => (x - lows[i]) * stretch[i]); return q.length === 3 ? [q[0] - 0.45 * q[1], q[2] - 0.3 * q[1] - 0.15 * q[0]] : q; };
  for (const shape of shapes) shape.rings = shape.rings.map(ring => ring.map(flat));
  for (const dot of dots) dot[0] = flat(dot[0]);
  const all = [...shapes.flatMap(shape => shape.rings.flat()), ...dots.map(dot => dot[0])];
  const least = (f, i) => all.map(p => p[i]).reduce((a, b) => f(a, b));
  const [x0, x1, y0, y1] = [least(Math.min, 0), least(Math.max, 0), least(Math.min, 1), least(Math.max, 1)];
  const scale = Math.min(360 / Math.max(x1 - x0, 1e-300), 260 / Math.max(y1 - y0, 1e-300));
  const left = 200 - (x1 - x0) * scale / 2, top = 150 - (y1 - y0) * scale / 2;
  const at = p => `${(left + (p[0] - x0) * scale).toFixed(1)},${(top + (y1 - p[1]) * scale).toFixed(1)}`;
  const size = dots.length > 40 ? 2.5 : 4.5;
  return `<svg viewBox="0 0 400 300" role="img" aria-label="The input">`
    + shapes.map(({rings, color, kind, width}) => `<path d="${rings.map(ring => "M" + ring.map(at).join("L") + (kind === "area" ? "Z" : "")).join("")}" fill="${kind === "area" ? color : "none"}" fill-opacity=".14" fill-rule="evenodd" stroke="${color}" stroke-width="${width}" stroke-linecap="round"/>`).join("")
    + dots.map(([p, isWrong]) => { const [cx, cy] = at(p).split(","); return `<circle cx="${cx}" cy="${cy}" r="${isWrong ? size + 1 : size}" fill="var(--${isWrong ? "bad" : wrong.size ? "ink" : "ours"})"/>`; }).join("")
    + (isStretched ? `<text class="soft" x="8" y="294">axes stretched: ${sizes.map(size => size.toPrecision(2)).join(" by ")}</text>` : "") + "</svg>";
}
