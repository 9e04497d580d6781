"""Segments on a closed ball: the interval between two roots of a quadratic, decided exactly, 2D and 3D.

With d = q - p and f = p - c (g = q - c at the other end) the points of the ball have

    A t^2 + 2 B t + C <= 0,     A = d.d,  B = d.f,  C = f.f - r^2,     t = (-B -+ sqrt(D)) / A,

    D = B^2 - A C = A r^2 - |d x f|^2        (Lagrange: no cancellation unless the line is nearly tangent)

The signs of C at either end say which ends are inside. With both outside, the ball is met exactly if D >= 0 and the
foot of the centre lies between the ends: d.f < 0 < d.g. Doubles with a bound settle most items; then double-double;
what is still open (tangent lines, ends on the sphere) goes to integers and their square roots (profiles.py).

Source: the textbook's exercise, a segment on a sphere; bounds: see the comments at each constant.
"""

from __future__ import annotations

from typing import Any, Final

from engine.jit import called, inline, kernel, merged
from engine.predicates.double_double import U2, dd_add, dd_mul, dd_sub
from engine.predicates.error_free import two_diff, two_prod, workspace
from engine.predicates.expansion import add_product, add_scaled, grow_product, is_safe, sign
from engine.segment_clipping.pieces import DROPPED, KEPT, Triple, point_of
from engine.types import OPEN

ROUGH_BOUND: Final = 32.0 * 2.0**-53
"""Doubles: differences, products and three sums, each term at most (1 + u)^8, squared terms (1 + u)^14."""
DISCRIMINANT_BOUND: Final = 96.0 * U2
"""D: A r^2 carries 42 u^2; a squared component of the cross product 2 * 9 + 5 u^2 of (|d_i f_j| + |d_j f_i|)^2."""
DOT_BOUND: Final = 24.0 * U2
"""A sum of three products of differences in double-double: 5 u^2 a product, 4 u^2 a sum, of which r^2 is one more."""
TINY: Final = 2.0**-960
"""Added to bounds in doubles for products that underflow."""


@inline
def dd_dot(a: Triple, b: Triple, c: Triple, d: Triple) -> Triple:
    """Return (b - a) . (d - c) as a double-double within `DOT_BOUND` of the sum of absolute terms, and that sum."""
    h = low = size = 0.0
    for k in range(3):
        uh, ul = two_diff(b[k], a[k])
        vh, vl = two_diff(d[k], c[k])
        th, tl = dd_mul(uh, ul, vh, vl)
        h, low = dd_add(h, low, th, tl)
        size += abs(th)
    return h, low, size


@inline
def expand_dot(a: Triple, b: Triple, c: Triple, d: Triple, e: Any, n: int) -> int:
    """Add (b - a) . (d - c) to the expansion e of n components; 24 places."""
    for k in range(3):
        uh, ul = two_diff(b[k], a[k])
        vh, vl = two_diff(d[k], c[k])
        n = grow_product(e, n, ul, vl)
        n = grow_product(e, n, ul, vh)
        n = grow_product(e, n, uh, vl)
        n = grow_product(e, n, uh, vh)
    return n


@inline
def dot_sign(a: Triple, b: Triple, c: Triple, d: Triple, radius: float) -> int:
    """Return the exact sign of (b - a) . (d - c) - radius^2, all within the safe range."""
    h, low, size = dd_dot(a, b, c, d)
    rh, rl = two_prod(radius, radius)
    h, low = dd_sub(h, low, rh, rl)
    if abs(h) > DOT_BOUND * (size + rh):
        return 1 if h > 0.0 else -1
    e = workspace(26)
    return sign(e, expand_dot(a, b, c, d, e, grow_product(e, 0, -radius, radius)))


@inline
def discriminant(p: Triple, q: Triple, c: Triple, radius: float) -> Triple:
    """Return A r^2 - |d x f|^2 as a double-double, and its bound; that is 0 where it is exact."""
    ah, al, _ = dd_dot(p, q, p, q)
    rh, rl = two_prod(radius, radius)
    h, low = dd_mul(ah, al, rh, rl)
    size, lost = h, 0.0
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        dh, dl = two_diff(q[i], p[i])
        gh, gl = two_diff(p[j], c[j])
        eh, el = two_diff(q[j], p[j])
        fh, fl = two_diff(p[i], c[i])
        uh, ul = dd_mul(dh, dl, gh, gl)
        vh, vl = dd_mul(eh, el, fh, fl)
        ch, cl = dd_sub(uh, ul, vh, vl)
        sh, sl = dd_mul(ch, cl, ch, cl)
        h, low = dd_sub(h, low, sh, sl)
        size += (abs(uh) + abs(vh)) * (abs(uh) + abs(vh))
        lost += abs(dl) + abs(gl) + abs(el) + abs(fl)
    bound = DISCRIMINANT_BOUND * size
    if abs(h) > bound or lost != 0.0:
        return h, low, bound
    side = float(short_sign(p, q, c, radius))  # case: numbers of few bits, a lattice
    return (0.0, 0.0, 0.0) if side == 0.0 else (h, low, bound)


@inline
def short_sign(p: Triple, q: Triple, c: Triple, radius: float) -> int:
    """Return the exact sign of A r^2 - |d x f|^2; caller guarantees that all differences are doubles."""
    e, square, part = workspace(128), workspace(24), workspace(4)
    n_square = grow_product(part, 0, radius, radius)
    n = add_product(e, 0, square, expand_dot(p, q, p, q, square, 0), part, n_square)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        n_part = grow_product(part, grow_product(part, 0, q[i] - p[i], p[j] - c[j]), p[j] - q[j], p[i] - c[i])
        for i in range(n_part):
            n = add_scaled(e, n, part, n_part, -part[i])
    return sign(e, n)


@merged
def is_ball_safe(p: Triple, q: Triple, c: Triple, radius: float) -> bool:
    """Tell whether all numbers are zero or of a size for which expansions are exact."""
    safe = is_safe(radius)
    for point in (p, q, c):
        safe = safe & is_safe(point[0]) & is_safe(point[1]) & is_safe(point[2])
    return safe


@called
def decide_exactly(p: Triple, q: Triple, c: Triple, radius: float) -> tuple[int, int, int]:
    """Decide on one segment by exact signs: state, and 0 for an end on the sphere, -1 for one of the segment."""
    if not is_ball_safe(p, q, c, radius):
        return OPEN, -1, -1
    p_out, q_out = dot_sign(c, p, c, p, radius) > 0, dot_sign(c, q, c, q, radius) > 0
    if not (p_out and q_out):
        return KEPT, 0 if p_out else -1, 0 if q_out else -1
    if dot_sign(p, q, c, p, 0.0) >= 0 or dot_sign(p, q, c, q, 0.0) <= 0:
        return DROPPED, -1, -1  # a point too
    value, _, bound = discriminant(p, q, c, radius)
    if -value > bound:
        return DROPPED, -1, -1
    return (KEPT, 0, 0) if value > bound or bound == 0.0 else (OPEN, -1, -1)  # case: nearly tangent


@merged
def center_of(center: Any, is_flat: bool) -> Triple:
    """Return the centre, in the plane with z = 0 as `point_of` does: all terms of z are 0 then."""
    return center[0], center[1], (0.0 if is_flat else center[2])


@inline
def axis_terms(p: float, q: float, c: float) -> tuple[float, float, float]:
    """Return p - c, q - c and q - p."""
    return p - c, q - c, q - p


@inline
def decide_roughly(
    ff: float, gg: float, dd: float, df: float, df_size: float, dg: float, dg_size: float, cross: float, size: float,
    rr: float,
) -> tuple[int, int, int]:  # fmt: skip
    """Decide from sums of products in doubles, with sums of their absolute terms; OPEN where they prove nothing."""
    p_gap, q_gap = ff - rr, gg - rr
    p_bound, q_bound = ROUGH_BOUND * (ff + rr) + TINY, ROUGH_BOUND * (gg + rr) + TINY
    if not ((abs(p_gap) > p_bound) & (abs(q_gap) > q_bound)):
        return OPEN, -1, -1
    p_out, q_out = p_gap > 0.0, q_gap > 0.0
    if not (p_out & q_out):
        return KEPT, 0 if p_out else -1, 0 if q_out else -1
    df_bound, dg_bound = ROUGH_BOUND * df_size + TINY, ROUGH_BOUND * dg_size + TINY
    gap, bound = dd * rr - cross, ROUGH_BOUND * (size + dd * rr) + TINY
    if (df > df_bound) | (-dg > dg_bound) | (-gap > bound):
        return DROPPED, -1, -1
    if (-df > df_bound) & (dg > dg_bound) & (gap > bound):
        return KEPT, 0, 0
    return OPEN, -1, -1


@kernel
def decide_on_sphere(
    segments: Any, center: Any, radius: float, first: int, last: int, stop: Any, items: Any, planes: Any, still: Any,
    n: Any,
) -> None:  # fmt: skip
    """Decide on ``segments[first:last]`` ((n, 2, dim) float64) and the closed ball: see `decide_on_boxes`."""
    is_flat = center.size == 2
    kept, n_open, beyond = 0, 0, 0
    rr, c = radius * radius, center_of(center, is_flat)
    for i in range(first, last):
        if stop[0]:
            return
        p, q = point_of(segments, i, 0, is_flat), point_of(segments, i, 1, is_flat)
        fx, gx, dx = axis_terms(p[0], q[0], c[0])
        fy, gy, dy = axis_terms(p[1], q[1], c[1])
        fz, gz, dz = axis_terms(p[2], q[2], c[2])
        x, x_size = dy * fz - dz * fy, abs(dy * fz) + abs(dz * fy)
        y, y_size = dz * fx - dx * fz, abs(dz * fx) + abs(dx * fz)
        z, z_size = dx * fy - dy * fx, abs(dx * fy) + abs(dy * fx)
        state, entered, left = decide_roughly(
            fx * fx + fy * fy + fz * fz, gx * gx + gy * gy + gz * gz, dx * dx + dy * dy + dz * dz,
            dx * fx + dy * fy + dz * fz, abs(dx * fx) + abs(dy * fy) + abs(dz * fz), dx * gx + dy * gy + dz * gz,
            abs(dx * gx) + abs(dy * gy) + abs(dz * gz), x * x + y * y + z * z,
            x_size * x_size + y_size * y_size + z_size * z_size, rr,
        )  # fmt: skip
        if state == OPEN:
            beyond += 1
            state, entered, left = decide_exactly(p, q, c, radius)
            if state == OPEN:
                still[n_open] = i
                n_open += 1
        if state == KEPT:
            items[kept], planes[kept, 0], planes[kept, 1] = i, entered, left
            kept += 1
    n[0], n[1], n[2] = kept, n_open, beyond
