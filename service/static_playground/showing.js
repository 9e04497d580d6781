// The answer's figures and the request, beside the picture.

const $ = (id) => document.getElementById(id);

export function showFigures(figures, accuracy, timing, seconds, items) {
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

export const shownRequest = () => request;

export function showRequest(path, text) {
  request = { path, text };
  const short = text.length > 1200 ? `${text.slice(0, 1150)} … (${text.length.toLocaleString("en")} characters, Copy takes all)` : text;
  $("request").textContent = `POST ${path}\n${short}`;
  $("curl").textContent = curl(short);
}

export function curl(text) {
  const address = new URL(request.path.slice(1), document.baseURI);
  return `curl -s ${address} -H 'content-type: application/json' -d '${text}'`;
}
