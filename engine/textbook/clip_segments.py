"""Segments clipped on half-spaces, boxes, convex polyhedra and spheres.

`on_half_space` keeps, removes, or replaces the end that is out by r(t) = r1 + t (r2 - r1) with t = -(n . r1 + d) /
(n . (r2 - r1)). `on_box` is Cohen-Sutherland, by code words of one bit per side, six in space and four in the plane:

    bit 0: x < xmin   bit 1: x > xmax          the plane, bits 3 2 1 0:
    bit 2: y < ymin   bit 3: y > ymax          1001 | 1000    | 1010       above
    bit 4: z < zmin   bit 5: z > zmax          0001 | 0000    | 0010       middle
                                               0101 | 0100    | 0110       below

Both code words zero: accept. A bit that both have: reject. Else the segment is cut on the plane of the first bit in
which they differ, the code word of the cut point is computed, and the procedure repeats. `on_convex` is the same with
one bit per face, and signed distances in place of coordinates.

Source: section 22.4.2 of the chapter on computer graphics in Algorithms of Informatics, algorithm
Cohen-Sutherland-Line-Clipping (figure 22.28); exercises 22.4-6 (convex polyhedra) and 22.4-7 (spheres).
What goes wrong: the cut point is rounded and may still be outside of the plane it was put on: the loop of the textbook
then never ends, for example on (1, 1)-(-1, -1) and the box from 1e-9 to 3 (evil-mad/plotink#40), and much more often on
convex polyhedra, since the distance of a cut point from its own plane is hardly ever exactly zero. Here it is capped
and says `unfinished`. Segments that pass close to an edge or a corner are accepted or rejected by rounding, and the
intersection carries the error of t times the length of the segment.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from engine.compiling.jit import allocating, allocating_kernel, inline, merged
from engine.textbook.solids import signed_distance
from engine.types import BoolArray, FloatArray, IntArray

REJECTED, ACCEPTED, UNFINISHED = 0, 1, 2
MAX_TURNS = 64  # six would do in exact arithmetic: each turn settles one plane


@allocating_kernel
def on_half_space(segments: FloatArray, normal: FloatArray, offset: float) -> tuple[FloatArray, BoolArray]:
    """Return segments (n, 2, dim) clipped to normal . p + offset >= 0, and (n,) bool, whether anything is left; a
    segment of which nothing is left is returned unchanged."""
    clipped, kept = segments.copy(), np.ones(len(segments), np.bool_)
    for i in range(len(segments)):
        first, second = segments[i, 0], segments[i, 1]
        at_first = signed_distance(first, normal, offset)
        at_second = signed_distance(second, normal, offset)
        if at_first < 0.0 and at_second < 0.0:
            kept[i] = False
        elif at_first < 0.0:
            clipped[i, 0] = first + at_first / (at_first - at_second) * (second - first)
        elif at_second < 0.0:
            clipped[i, 1] = first + at_first / (at_first - at_second) * (second - first)
    return clipped, kept


@merged
def code_word(p: FloatArray, low: FloatArray, high: FloatArray) -> int:
    """Return the code word (outcode) of p: a bit for each side of the box that p is outside of, 2 k for low and 2 k + 1
    for high on axis k."""
    code = 0
    for k in range(len(low)):
        if p[k] < low[k]:
            code |= 1 << 2 * k
        if p[k] > high[k]:
            code |= 2 << 2 * k
    return code


@allocating
def cut(p: FloatArray, q: FloatArray, bit: int, low: FloatArray, high: FloatArray) -> Any:
    """Return the intersection of segment pq with the plane of the side of the box whose bit number is `bit`."""
    axis = bit // 2
    plane = high[axis] if bit % 2 else low[axis]
    return p + (plane - p[axis]) / (q[axis] - p[axis]) * (q - p)


@allocating
def clip_one(p: FloatArray, q: FloatArray, n_turns: int, region: Any, code_word: Any, cut: Any) -> int:
    """Clip segment pq in place; return REJECTED, ACCEPTED, or UNFINISHED after n_turns cuts. region: arguments of the
    two functions. code_word(p, *region): a bit for each plane that p is outside of. cut(p, q, bit, *region):
    intersection with the plane of that bit number."""
    code_p, code_q = code_word(p, *region), code_word(q, *region)
    for _ in range(n_turns):
        if code_p == 0 and code_q == 0:
            return ACCEPTED
        if code_p & code_q:
            return REJECTED
        bit = 0
        while not (code_p ^ code_q) >> bit & 1:
            bit += 1
        if code_p >> bit & 1:
            p[:] = cut(p, q, bit, *region)
            code_p = code_word(p, *region)
        else:
            q[:] = cut(p, q, bit, *region)
            code_q = code_word(q, *region)
    return UNFINISHED


@allocating_kernel
def on_box(segments: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return segments (n, 2, dim) clipped to a box, and a status (n,): REJECTED, ACCEPTED or UNFINISHED."""
    clipped, status = segments.copy(), np.empty(len(segments), np.int64)
    for i in range(len(segments)):
        status[i] = clip_one(clipped[i, 0], clipped[i, 1], MAX_TURNS, (low, high), code_word, cut)
    return clipped, status


@inline
def code_word_of_planes(p: FloatArray, planes: FloatArray) -> int:
    """Return the code word of p: a bit for each plane row (normal, offset) that p is outside of."""
    code = 0
    for j in range(len(planes)):
        if signed_distance(p, planes[j, :-1], planes[j, -1]) < 0.0:
            code |= 1 << j
    return code


@allocating
def cut_on_plane(p: FloatArray, q: FloatArray, bit: int, planes: FloatArray) -> Any:
    """Return the intersection of segment pq with the plane of row number `bit`."""
    normal, offset = planes[bit, :-1], planes[bit, -1]
    at_p, at_q = signed_distance(p, normal, offset), signed_distance(q, normal, offset)
    return p + at_p / (at_p - at_q) * (q - p)


@allocating_kernel
def on_convex(segments: FloatArray, planes: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return segments (n, 2, dim) clipped to a convex polyhedron, and a status (n,): REJECTED, ACCEPTED or UNFINISHED.
    planes (m, dim + 1): rows (normal, offset), m <= 62 for the code word."""
    clipped, status = segments.copy(), np.empty(len(segments), np.int64)
    for i in range(len(segments)):
        ends = clipped[i, 0], clipped[i, 1]
        status[i] = clip_one(*ends, 2 * len(planes) + 2, (planes,), code_word_of_planes, cut_on_plane)
    return clipped, status


@allocating_kernel
def on_sphere(segments: FloatArray, center: FloatArray, radius: float) -> tuple[FloatArray, BoolArray]:
    """Return segments (n, 2, dim) clipped to a ball, and (n,) bool, whether anything is left: by the roots of |p + t (q
    - p) - c|^2 = r^2, cut to [0, 1].

    A segment of which nothing is left is returned unchanged. What goes wrong: the discriminant cancels for a segment
    that nearly touches the sphere, far from the origin or far from the sphere, so that it is kept or removed by
    rounding; the roots lose half of their digits there."""
    clipped, kept = segments.copy(), np.zeros(len(segments), np.bool_)
    for i in range(len(segments)):
        p, u = segments[i, 0], segments[i, 1] - segments[i, 0]
        a, half_b, c = 0.0, 0.0, -radius * radius
        for k in range(len(center)):
            w = p[k] - center[k]
            a += u[k] * u[k]
            half_b += u[k] * w
            c += w * w
        if a == 0.0:
            kept[i] = c <= 0.0
            continue
        discriminant = half_b * half_b - a * c
        if discriminant < 0.0:
            continue
        low = max(0.0, (-half_b - sqrt(discriminant)) / a)
        high = min(1.0, (-half_b + sqrt(discriminant)) / a)
        if low <= high:
            kept[i] = True
            clipped[i, 0], clipped[i, 1] = p + low * u, p + high * u
    return clipped, kept
