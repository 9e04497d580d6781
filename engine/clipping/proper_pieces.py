"""The pieces of segments whose contacts are all proper crossings, compiled: the common case on meshes.

Every crossing turns the location over, so only the order of the crossings along the segment matters. Plane values in
double-double give each parameter and point with a bound (cut_point.py); parameters that are surely rounded and differ
as doubles are in their exact order. A segment with two crossings that round alike, or a coordinate that may round
either way, is left open for exact_pieces.py.

Bound of a plane value s = ((b - a) x (c - a)) . (x - a): differences are exact; a component of the normal carries
14 u^2 of m = |u_i v_j| + |u_j v_i|, its product with x - a another 5 u^2, the sums 8 u^2: 32 u^2 of the sum of
m |x - a|. In the plane s = (b - a) x (x - a) carries 14 u^2 likewise.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.clipping.cut_point import is_safe
from engine.clipping.cyrus_beck import cut_with, is_segment_safe
from engine.jit import inline, kernel
from engine.predicates.double_double import U2, dd_add, dd_mul, dd_sub
from engine.predicates.error_free import two_diff

SETTLED: Final = 0
OPEN: Final = 1
VALUE_BOUND: Final = 32.0 * U2


@inline
def line_value(vertices: Any, element: Any, point: Any) -> tuple[float, float, float]:
    """Return (b - a) x (point - a) for an edge of the plane as a double-double, and its bound."""
    a, b = element[0], element[1]
    ux, uxl = two_diff(vertices[b, 0], vertices[a, 0])
    uy, uyl = two_diff(vertices[b, 1], vertices[a, 1])
    wx, wxl = two_diff(point[0], vertices[a, 0])
    wy, wyl = two_diff(point[1], vertices[a, 1])
    ph, pl = dd_mul(ux, uxl, wy, wyl)
    qh, ql = dd_mul(uy, uyl, wx, wxl)
    h, low = dd_sub(ph, pl, qh, ql)
    return h, low, VALUE_BOUND * (abs(ph) + abs(qh))


@inline
def plane_value(vertices: Any, element: Any, point: Any) -> tuple[float, float, float]:
    """Return ((b - a) x (c - a)) . (point - a) for a triangle of space as a double-double, and its bound."""
    a, b, c = element[0], element[1], element[2]
    h = low = size = 0.0
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        ui, uil = two_diff(vertices[b, i], vertices[a, i])
        uj, ujl = two_diff(vertices[b, j], vertices[a, j])
        vi, vil = two_diff(vertices[c, i], vertices[a, i])
        vj, vjl = two_diff(vertices[c, j], vertices[a, j])
        w, wl = two_diff(point[k], vertices[a, k])
        ph, pl = dd_mul(ui, uil, vj, vjl)
        qh, ql = dd_mul(uj, ujl, vi, vil)
        nh, nl = dd_sub(ph, pl, qh, ql)
        sh, sl = dd_mul(nh, nl, w, wl)
        h, low = dd_add(h, low, sh, sl)
        size += (abs(ph) + abs(qh)) * abs(w)
    return h, low, VALUE_BOUND * size


@inline
def is_element_safe(vertices: Any, element: Any) -> bool:
    """Tell whether every coordinate of an element is zero or of a size for which double-doubles keep their bounds."""
    safe = True
    for corner in element:
        for k in range(vertices.shape[1]):
            safe = safe and is_safe(vertices[corner, k])
    return safe


@inline
def emit(
    segment: Any,
    is_inside: bool,
    ts: Any,
    points: Any,
    met: Any,
    n: int,
    faces: Any,
    at: int,
    start: Any,
    end: Any,
    t: Any,
    crossed: Any,
) -> bool:
    """Write the pieces between n crossings to rows `at` and on; False where two crossings round alike.

    ts, points, met: parameter, point and element of each crossing in any order, sorted here.
    """
    for i in range(1, n):  # insertion sort: n is small
        for j in range(i, 0, -1):
            if ts[j - 1] <= ts[j]:
                break
            ts[j - 1], ts[j] = ts[j], ts[j - 1]
            met[j - 1], met[j] = met[j], met[j - 1]
            for k in range(points.shape[1]):
                points[j - 1, k], points[j, k] = points[j, k], points[j - 1, k]
    for i in range(1, n):
        if ts[i - 1] == ts[i]:
            return False
    row = at
    if is_inside:
        start[row], t[row, 0], crossed[row, 0] = segment[0], 0.0, -1
    for i in range(n):
        if is_inside:
            end[row], t[row, 1], crossed[row, 1] = points[i], ts[i], faces[met[i]]
            row += 1
        else:
            start[row], t[row, 0], crossed[row, 0] = points[i], ts[i], faces[met[i]]
        is_inside = not is_inside
    if is_inside:
        end[row], t[row, 1], crossed[row, 1] = segment[1], 1.0, -1
    return True


@kernel
def clip_properly_2d(
    segments: Any,
    chosen: Any,
    locations: Any,
    offsets: Any,
    met: Any,
    vertices: Any,
    elements: Any,
    faces: Any,
    rows: Any,
    stop: Any,
    start: Any,
    end: Any,
    t: Any,
    crossed: Any,
    state: Any,
) -> None:
    """Cut the ``chosen`` of some segments at their proper crossings.

    segments: (n, 2, 2) float64; locations: (n,) int8 of their first ends, none on the boundary. offsets, met: the
    elements each meets. vertices, elements, faces: the boundary. rows: (chosen,) int64, where the pieces of each begin
    in start, end, t, crossed, (m, 2) each. stop: one uint8, polled. state: (chosen,) uint8, SETTLED or OPEN.
    """
    most = 0
    for segment in chosen:
        most = max(most, offsets[segment + 1] - offsets[segment])
    ts, points, here = np.empty(most), np.empty((most, segments.shape[2])), np.empty(most, np.int64)
    for i in range(chosen.size):
        item = chosen[i]
        state[i] = OPEN
        if stop[0]:
            return
        segment, n = segments[item], offsets[item + 1] - offsets[item]
        sure = is_segment_safe(segment)
        for j in range(n):
            here[j] = met[offsets[item] + j]
            element = elements[here[j]]
            if not (sure and is_element_safe(vertices, element)):
                sure = False
                break
            ts[j], sure = cut_with(
                segment, points[j], line_value(vertices, element, segment[0]), line_value(vertices, element, segment[1])
            )
        if sure and emit(segment, locations[item] > 0, ts, points, here, n, faces, rows[i], start, end, t, crossed):
            state[i] = SETTLED


@kernel
def clip_properly_3d(
    segments: Any,
    chosen: Any,
    locations: Any,
    offsets: Any,
    met: Any,
    vertices: Any,
    elements: Any,
    faces: Any,
    rows: Any,
    stop: Any,
    start: Any,
    end: Any,
    t: Any,
    crossed: Any,
    state: Any,
) -> None:
    """Cut the ``chosen`` of some segments of space at their proper crossings: see `clip_properly_2d`."""
    most = 0
    for segment in chosen:
        most = max(most, offsets[segment + 1] - offsets[segment])
    ts, points, here = np.empty(most), np.empty((most, segments.shape[2])), np.empty(most, np.int64)
    for i in range(chosen.size):
        item = chosen[i]
        state[i] = OPEN
        if stop[0]:
            return
        segment, n = segments[item], offsets[item + 1] - offsets[item]
        sure = is_segment_safe(segment)
        for j in range(n):
            here[j] = met[offsets[item] + j]
            element = elements[here[j]]
            if not (sure and is_element_safe(vertices, element)):
                sure = False
                break
            ts[j], sure = cut_with(
                segment,
                points[j],
                plane_value(vertices, element, segment[0]),
                plane_value(vertices, element, segment[1]),
            )
        if sure and emit(segment, locations[item] > 0, ts, points, here, n, faces, rows[i], start, end, t, crossed):
            state[i] = SETTLED
