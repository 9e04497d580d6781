// Exact arithmetic on doubles, as whole numbers of the smallest unit that all of them share: for pictures of a boundary that
// passes between neighbouring doubles, where the rounded formula would draw it somewhere else.

const view = new DataView(new ArrayBuffer(8));

// A double as [m, e], its value m * 2^e.
function parts(x) {
  view.setFloat64(0, x);
  const bits = view.getBigUint64(0), e = Number((bits >> 52n) & 2047n), m = (bits & ((1n << 52n) - 1n)) | (e ? 1n << 52n : 0n);
  return [bits >> 63n ? -m : m, Math.max(e, 1) - 1075];
}

// The next double towards plus (direction 1) or minus infinity (-1).
export function next(x, direction) {
  if (x === 0) return direction * Number.MIN_VALUE;
  view.setFloat64(0, x);
  view.setBigInt64(0, view.getBigInt64(0) + (x > 0 === direction > 0 ? 1n : -1n));
  return view.getFloat64(0);
}

export const ulp = (x) => next(Math.abs(x), 1) - Math.abs(x);

// a / b of whole numbers as a double, right to some 60 bits before the last rounding.
export function ratio(a, b) {
  if (a === 0n) return 0;
  const size = (v) => (v < 0n ? -v : v).toString(2).length, shift = 62 - size(a) + size(b);
  return Number(shift > 0 ? (a << BigInt(shift)) / b : a / (b << BigInt(-shift))) * 2 ** -shift;
}

// The line or plane through the corners as seen from p: whole numbers n and d, so that n.(x - p) + d = 0 holds on it exactly
// when x - p is counted in 2^unit.
export function planeFrom(p, corners) {
  const all = [p, ...corners].map((point) => point.map(parts)), unit = Math.min(...all.flat().filter(([m]) => m).map(([, e]) => e), 0);
  const [origin, a, ...others] = all.map((point) => point.map(([m, e]) => (m ? m << BigInt(e - unit) : 0n)));
  const [u, v] = others.map((corner) => corner.map((x, k) => x - a[k]));
  const n = v ? [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]] : [-u[1], u[0]];
  return { n, d: n.reduce((sum, x, k) => sum + x * (origin[k] - a[k]), 0n), unit };
}
