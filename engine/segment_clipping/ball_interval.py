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

from engine.jit import bare_kernel, inline, merged
from engine.predicates.double_double import U2, dd_add, dd_mul, dd_sub
from engine.predicates.error_free import two_diff, two_prod, workspace
from engine.predicates.expansion import grow_product, is_safe, sign
from engine.segment_clipping.cyrus_beck import is_segment_safe
from engine.segment_clipping.pieces import DROPPED, KEPT, Triple, point_of
from engine.types import OPEN

ROUGH_BOUND: Final = 32.0 * 2.0**-53
"""Doubles: differences, products and three sums, each term at most (1 + u)^8, squared terms (1 + u)^14."""
DISCRIMINANT_BOUND: Final = 96.0 * U2
"""D: A r^2 carries 42 u^2; a squared component of the cross product 2 * 9 + 5 u^2 of (|d_i f_j| + |d_j f_i|)^2."""
TINY: Final = 2.0**-960
"""Added to bounds in doubles for products that underflow."""


@inline
def power_sign(point: Any, center: Any, radius: float) -> int:
    """Return the exact sign of |point - center|^2 - radius^2, all within the safe range."""
    e = workspace(26)
    n = grow_product(e, 0, -radius, radius)
    for k in range(center.size):
        h, low = two_diff(point[k], center[k])
        n = grow_product(e, n, low, low)
        n = grow_product(e, n, 2.0 * low, h)
        n = grow_product(e, n, h, h)
    return sign(e, n)


@inline
def direction_sign(segment: Any, point: Any, center: Any) -> int:
    """Return the exact sign of (q - p) . (point - center), all within the safe range."""
    e = workspace(24)
    n = 0
    for k in range(center.size):
        dh, dl = two_diff(segment[1, k], segment[0, k])
        fh, fl = two_diff(point[k], center[k])
        n = grow_product(e, n, dl, fl)
        n = grow_product(e, n, dl, fh)
        n = grow_product(e, n, dh, fl)
        n = grow_product(e, n, dh, fh)
    return sign(e, n)


@inline
def discriminant(segment: Any, center: Any, radius: float) -> tuple[float, float]:
    """Return A r^2 - |d x f|^2, from double-doubles, and its bound."""
    ah = al = 0.0
    for k in range(center.size):
        dh, dl = two_diff(segment[1, k], segment[0, k])
        sh, sl = dd_mul(dh, dl, dh, dl)
        ah, al = dd_add(ah, al, sh, sl)
    rh, rl = two_prod(radius, radius)
    h, low = dd_mul(ah, al, rh, rl)
    size = h
    for k in range(center.size):
        dh, dl = two_diff(segment[1, k], segment[0, k])
        fh, fl = two_diff(segment[0, k], center[k])
        for j in range(k):
            eh, el = two_diff(segment[1, j], segment[0, j])
            gh, gl = two_diff(segment[0, j], center[j])
            uh, ul = dd_mul(dh, dl, gh, gl)
            vh, vl = dd_mul(eh, el, fh, fl)
            ch, cl = dd_sub(uh, ul, vh, vl)
            sh, sl = dd_mul(ch, cl, ch, cl)
            h, low = dd_sub(h, low, sh, sl)
            size += (abs(uh) + abs(vh)) * (abs(uh) + abs(vh))
    return h, DISCRIMINANT_BOUND * size


@inline
def decide_exactly(segment: Any, center: Any, radius: float) -> tuple[int, int, int]:
    """Decide on one segment by exact signs: state, and 0 for an end on the sphere, -1 for one of the segment."""
    safe = is_segment_safe(segment) and is_safe(radius)
    for k in range(center.size):
        safe = safe and is_safe(center[k])
    if not safe:
        return OPEN, -1, -1
    p_out, q_out = power_sign(segment[0], center, radius) > 0, power_sign(segment[1], center, radius) > 0
    if not (p_out and q_out):
        return KEPT, 0 if p_out else -1, 0 if q_out else -1
    if direction_sign(segment, segment[0], center) >= 0 or direction_sign(segment, segment[1], center) <= 0:
        return DROPPED, -1, -1  # a point too
    value, bound = discriminant(segment, center, radius)
    if -value > bound:
        return DROPPED, -1, -1
    return (KEPT, 0, 0) if value > bound else (OPEN, -1, -1)  # case: tangent, or nearly so


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


@bare_kernel
def decide_on_sphere(
    segments: Any,
    center: Any,
    radius: float,
    first: int,
    last: int,
    stop: Any,
    items: Any,
    planes: Any,
    still: Any,
    n: Any,
) -> None:
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
            fx * fx + fy * fy + fz * fz,
            gx * gx + gy * gy + gz * gz,
            dx * dx + dy * dy + dz * dz,
            dx * fx + dy * fy + dz * fz,
            abs(dx * fx) + abs(dy * fy) + abs(dz * fz),
            dx * gx + dy * gy + dz * gz,
            abs(dx * gx) + abs(dy * gy) + abs(dz * gz),
            x * x + y * y + z * z,
            x_size * x_size + y_size * y_size + z_size * z_size,
            rr,
        )
        if state == OPEN:
            beyond += 1
            state, entered, left = decide_exactly(segments[i], center, radius)
            if state == OPEN:
                still[n_open] = i
                n_open += 1
        if state == KEPT:
            items[kept], planes[kept, 0], planes[kept, 1] = i, entered, left
            kept += 1
    n[0], n[1], n[2] = kept, n_open, beyond
