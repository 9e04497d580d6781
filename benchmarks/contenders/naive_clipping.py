"""The textbook's clipping as careful code without exactness has it: scalars in the loop, nothing allocated there.

The same steps as `engine.textbook.clip_segments` and `clip_polygons`, written out for speed; on planes one pass over
the rows (Cyrus and Beck) in place of a code word after every cut. The yardstick of the tables of clipping: what exact
decisions and correct rounding cost is the time of these.
What goes wrong: the same as there.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.jit import allocating_kernel, inline
from engine.predicates.vectors import along, as_point2, as_point3
from engine.textbook.clip_segments import ACCEPTED, MAX_TURNS, REJECTED, UNFINISHED
from engine.types import Point2, Point3


@inline
def code_word_2d(p: Point2, low: Point2, high: Point2) -> int:
    """Return one bit per side that p is outside of."""
    code = 0
    if p.x < low.x:
        code |= 1
    elif p.x > high.x:
        code |= 2
    if p.y < low.y:
        code |= 4
    elif p.y > high.y:
        code |= 8
    return code


@inline
def code_word_3d(p: Point3, low: Point3, high: Point3) -> int:
    """Return one bit per side that p is outside of."""
    code = code_word_2d(Point2(p.x, p.y), Point2(low.x, low.y), Point2(high.x, high.y))
    if p.z < low.z:
        code |= 16
    elif p.z > high.z:
        code |= 32
    return code


@inline
def cut_2d(p: Point2, q: Point2, code: int, low: Point2, high: Point2) -> Point2:
    """Return where p q meets the side of the lowest bit of `code`."""
    if code & 3:
        x = low.x if code & 1 else high.x
        return Point2(x, p.y + (x - p.x) / (q.x - p.x) * (q.y - p.y))
    y = low.y if code & 4 else high.y
    return Point2(p.x + (y - p.y) / (q.y - p.y) * (q.x - p.x), y)


@inline
def cut_3d(p: Point3, q: Point3, code: int, low: Point3, high: Point3) -> Point3:
    """Return where p q meets the side of the lowest bit of `code`."""
    if code & 3:
        x = low.x if code & 1 else high.x
        t = (x - p.x) / (q.x - p.x)
        return Point3(x, p.y + t * (q.y - p.y), p.z + t * (q.z - p.z))
    if code & 12:
        y = low.y if code & 4 else high.y
        t = (y - p.y) / (q.y - p.y)
        return Point3(p.x + t * (q.x - p.x), y, p.z + t * (q.z - p.z))
    z = low.z if code & 16 else high.z
    t = (z - p.z) / (q.z - p.z)
    return Point3(p.x + t * (q.x - p.x), p.y + t * (q.y - p.y), z)


@inline
def store(clipped: Any, i: int, end: int, p: Point3) -> None:
    """Set one end of a segment."""
    clipped[i, end, 0], clipped[i, end, 1], clipped[i, end, 2] = p.x, p.y, p.z


@inline
def clip_one(p: Any, q: Any, low: Any, high: Any, code_word: Any, cut: Any) -> tuple[Any, Any, int]:
    """Return what is left of p q, and its status."""
    code_p, code_q = code_word(p, low, high), code_word(q, low, high)
    for _ in range(MAX_TURNS):
        if code_p | code_q == 0:
            return p, q, ACCEPTED
        if code_p & code_q:
            return p, q, REJECTED
        if code_p:
            p = cut(p, q, code_p, low, high)
            code_p = code_word(p, low, high)
        else:
            q = cut(p, q, code_q, low, high)
            code_q = code_word(q, low, high)
    return p, q, UNFINISHED


@allocating_kernel
def clip_on_box_2d(segments: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return (clipped segments (n, 2, 2), status (n,)) of Cohen-Sutherland."""
    a, b = Point2(low[0], low[1]), Point2(high[0], high[1])
    clipped, status = np.empty_like(segments), np.empty(len(segments), np.int64)
    for i in range(len(segments)):
        p, q = as_point2(segments[i], 0), as_point2(segments[i], 1)
        p, q, status[i] = clip_one(p, q, a, b, code_word_2d, cut_2d)
        clipped[i, 0, 0], clipped[i, 0, 1], clipped[i, 1, 0], clipped[i, 1, 1] = p.x, p.y, q.x, q.y
    return clipped, status


@allocating_kernel
def clip_on_box_3d(segments: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return (clipped segments (n, 2, 3), status (n,)) of Cohen-Sutherland."""
    a, b = Point3(low[0], low[1], low[2]), Point3(high[0], high[1], high[2])
    clipped, status = np.empty_like(segments), np.empty(len(segments), np.int64)
    for i in range(len(segments)):
        p, q = as_point3(segments[i], 0), as_point3(segments[i], 1)
        p, q, status[i] = clip_one(p, q, a, b, code_word_3d, cut_3d)
        store(clipped, i, 0, p)
        store(clipped, i, 1, q)
    return clipped, status


@allocating_kernel
def clip_on_planes_3d(segments: FloatArray, rows: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return (clipped segments (n, 2, 3), kept (n,)) of one pass over rows (m, 4)."""
    clipped, kept = np.empty_like(segments), np.zeros(len(segments), np.bool_)
    for i in range(len(segments)):
        p, q = as_point3(segments[i], 0), as_point3(segments[i], 1)
        t0, t1 = 0.0, 1.0
        for j in range(len(rows)):
            at_p = rows[j, 0] * p.x + rows[j, 1] * p.y + rows[j, 2] * p.z + rows[j, 3]
            at_q = rows[j, 0] * q.x + rows[j, 1] * q.y + rows[j, 2] * q.z + rows[j, 3]
            if at_p < 0.0:
                if at_q < 0.0:
                    t0 = 2.0
                    break
                t0 = max(t0, at_p / (at_p - at_q))
            elif at_q < 0.0:
                t1 = min(t1, at_p / (at_p - at_q))
            if t0 > t1:
                break
        if t0 <= t1:
            kept[i] = True
            store(clipped, i, 0, along(p, q, t0))
            store(clipped, i, 1, along(p, q, t1))
    return clipped, kept


@allocating_kernel
def clip_on_sphere_3d(segments: FloatArray, center: FloatArray, radius: float) -> tuple[FloatArray, BoolArray]:
    """Return (clipped segments (n, 2, 3), kept (n,)) by the two roots of the quadratic."""
    clipped, kept = np.empty_like(segments), np.zeros(len(segments), np.bool_)
    for i in range(len(segments)):
        px, py, pz = segments[i, 0, 0], segments[i, 0, 1], segments[i, 0, 2]
        ux, uy, uz = segments[i, 1, 0] - px, segments[i, 1, 1] - py, segments[i, 1, 2] - pz
        wx, wy, wz = px - center[0], py - center[1], pz - center[2]
        a, half_b = ux * ux + uy * uy + uz * uz, ux * wx + uy * wy + uz * wz
        c = wx * wx + wy * wy + wz * wz - radius * radius
        discriminant = half_b * half_b - a * c
        if discriminant < 0.0 or a == 0.0:
            kept[i] = a == 0.0 and c <= 0.0
            clipped[i] = segments[i]
            continue
        root = sqrt(discriminant)
        low, high = max(0.0, (-half_b - root) / a), min(1.0, (-half_b + root) / a)
        if low <= high:
            kept[i] = True
            clipped[i, 0, 0], clipped[i, 0, 1], clipped[i, 0, 2] = px + low * ux, py + low * uy, pz + low * uz
            clipped[i, 1, 0], clipped[i, 1, 1], clipped[i, 1, 2] = px + high * ux, py + high * uy, pz + high * uz
    return clipped, kept


@allocating_kernel
def clip_rings_on_planes(vertices: FloatArray, offsets: IntArray, rows: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return (vertices, offsets) that Sutherland-Hodgman leaves of rings ``offsets[i]`` .. ``offsets[i + 1]``."""
    n, dimension = len(offsets) - 1, vertices.shape[1]
    room = 0
    for i in range(n):
        room = max(room, offsets[i + 1] - offsets[i])
    room = 2 * room + 2 * len(rows)
    here, there, values = np.empty((room, dimension)), np.empty((room, dimension)), np.empty(room)
    kept, ends = np.empty((2 * len(vertices) + n * len(rows), dimension)), np.zeros(n + 1, np.int64)
    for i in range(n):
        m = offsets[i + 1] - offsets[i]
        for j in range(m):
            for k in range(dimension):
                here[j, k] = vertices[offsets[i] + j, k]
        for plane in range(len(rows)):
            for j in range(m):
                value = rows[plane, dimension]
                for k in range(dimension):
                    value += rows[plane, k] * here[j, k]
                values[j] = value
            left = 0
            for j in range(m):
                after = j + 1 if j + 1 < m else 0
                if values[j] >= 0.0:
                    for k in range(dimension):
                        there[left, k] = here[j, k]
                    left += 1
                if (values[j] >= 0.0) != (values[after] >= 0.0):
                    t = values[j] / (values[j] - values[after])
                    for k in range(dimension):
                        there[left, k] = here[j, k] + t * (here[after, k] - here[j, k])
                    left += 1
            here, there, m = there, here, min(left, room // 2)
        for j in range(m):
            for k in range(dimension):
                kept[ends[i] + j, k] = here[j, k]
        ends[i + 1] = ends[i] + m
    return kept[: ends[n]], ends
