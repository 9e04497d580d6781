"""Where many points lie in one polyhedron: the answers of containment.py, some thousand times faster.

All coordinates are made integers by one power of two, and the mesh and the points are sheared along a random direction,
in integers, so that the half-line runs along the last axis. A sieve in floating point, widened far beyond its rounding,
leaves a few triangles to a point; these are decided in integers. A point whose half-line meets an edge, a vertex or a
triangle edge-on gets another direction.
"""

from __future__ import annotations

import random
from typing import Any

import numpy as np

from tests.reference.containment import BOUNDARY, INSIDE, OUTSIDE, locate_by_triangles, on_triangle
from tests.reference.exact import sign, vector

DEGENERATE = 2
_TURNS = 6
_STEP = 1 << 20
_WIDER = 2.0**-44  # of the largest coordinate: the sieve's own rounding is below 2^-50 of it

Row = tuple[int, int, int]


def locate_points(points: Any, vertices: Any, faces: Any, seed: int = 0) -> np.ndarray[Any, Any]:
    """Return int8 1 inside, 0 boundary, -1 outside for points (n, 3) in the solid of triangles faces (m, 3)."""
    points, vertices = np.asarray(points, float), np.asarray(vertices, float)
    rows, corners = _as_integers(points, vertices)
    found = np.full(len(points), DEGENERATE, np.int8)
    source = random.Random(seed)
    for _ in range(_TURNS):
        left = np.flatnonzero(found == DEGENERATE)
        if not len(left):
            return found
        dx, dy = source.randint(-_STEP, _STEP), source.randint(-_STEP, _STEP)
        sheared = [_sheared(row, dx, dy) for row in corners]
        asked = [_sheared(rows[item], dx, dy) for item in left]
        for item, place in zip(left, _locate_upwards(asked, sheared, np.asarray(faces)), strict=True):
            found[item] = place
    left = np.flatnonzero(found == DEGENERATE)
    triangles = [tuple(vector(vertices[corner].tolist()) for corner in face) for face in faces] if len(left) else []
    for item in left:
        found[item] = locate_by_triangles(vector(points[item].tolist()), triangles)
    return found


def _as_integers(*arrays: np.ndarray[Any, Any]) -> list[list[Row]]:
    """Return the rows of float arrays times a common power of two."""
    scale = max(x.as_integer_ratio()[1] for array in arrays for x in array.ravel().tolist())  # powers of two
    found = []
    for array in arrays:
        numbers = [x.as_integer_ratio() for x in array.ravel().tolist()]
        scaled = [n * (scale // d) for n, d in numbers]
        found.append(list(zip(scaled[0::3], scaled[1::3], scaled[2::3], strict=True)))
    return found


def _sheared(row: Row, dx: int, dy: int) -> Row:
    return row[0] * _STEP - dx * row[2], row[1] * _STEP - dy * row[2], row[2]


def _as_floats(rows: list[Row], shift: int) -> np.ndarray[Any, Any]:
    return np.array([[float(x >> shift) for x in row] for row in rows])


def _locate_upwards(points: list[Row], corners: list[Row], faces: np.ndarray[Any, Any]) -> list[int]:
    """Return the location of each point by the half-line along the last axis, DEGENERATE where it decides nothing."""
    largest = max(abs(x) for row in (*points, *corners) for x in row)
    shift = max(0, largest.bit_length() - 900)
    places, at = _as_floats(corners, shift), _as_floats(points, shift)
    margin = float(largest >> shift) * _WIDER + 2.0
    low, high = places[faces].min(axis=1) - margin, places[faces].max(axis=1) + margin
    order = np.argsort(low[:, 0])
    low, high, faces = low[order], high[order], faces[order]
    widest = (high[:, 0] - low[:, 0]).max()
    first = np.searchsorted(low[:, 0], at[:, 0] - widest)
    last = np.searchsorted(low[:, 0], at[:, 0], side="right")
    found = []
    for item, (x, y, z) in enumerate(at):
        some = slice(first[item], last[item])
        near = (high[some, 0] >= x) & (low[some, 1] <= y) & (high[some, 1] >= y) & (high[some, 2] >= z)
        triangles = faces[some][near].tolist()
        found.append(_decide(points[item], [(corners[a], corners[b], corners[c]) for a, b, c in triangles]))
    return found


def _decide(p: Row, triangles: list[tuple[Row, Row, Row]]) -> int:
    parity, is_degenerate = 0, False
    for a, b, c in triangles:
        turns = (_turn(a, b, p), _turn(b, c, p), _turn(c, a, p))
        if min(turns) < 0 < max(turns):
            continue
        if 0 in turns:
            if on_triangle(vector(p), vector(a), vector(b), vector(c)):
                return BOUNDARY
            is_degenerate = True
            continue
        side = _volume(a, b, c, p) * sign(turns[0])  # above 0: p is above the plane
        if side == 0:
            return BOUNDARY
        parity ^= side < 0
    return DEGENERATE if is_degenerate else INSIDE if parity else OUTSIDE


def _turn(a: Row, b: Row, p: Row) -> int:
    return (a[0] - p[0]) * (b[1] - p[1]) - (a[1] - p[1]) * (b[0] - p[0])


def _volume(a: Row, b: Row, c: Row, p: Row) -> int:
    """Return a positive number if p lies where the normal of a, b, c points to."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return (
        (uy * vz - uz * vy) * (p[0] - a[0]) + (uz * vx - ux * vz) * (p[1] - a[1]) + (ux * vy - uy * vx) * (p[2] - a[2])
    )
