"""Wrong answers, counted against exact ones.

Hard sets carry their exact answers. On workloads made for speed, what contenders disagree on, and a random sample of
the others, is settled by tests/reference: rational arithmetic that shares nothing with the engine.
The exact location of a point in a large mesh is found with a nearly axial half-line, whose box throws out, by plain
comparisons, all but the few faces that it could meet.
"""

from __future__ import annotations

import random
from typing import Any

import numpy as np

from benchmarks.workloads import Mesh, Planes, Rings

try:
    from tests.reference import containment as reference
    from tests.reference.exact import Q, vector

    REASON = ""
except ImportError as error:  # the reference needs gmpy2
    REASON = f"exact answers need {error.name}, of the extra test"

_TILT = 2.0**-10


def contained(point: np.ndarray, subject: Mesh | Rings | Planes) -> tuple[bool, bool]:
    """Return the exact answer: whether the point is in the closed solid, and whether it is on its boundary."""
    match subject:
        case Mesh():
            location = _in_mesh(point, subject)
        case Rings(rings=rings):
            location = _in_rings(point, rings)
        case Planes(rows=rows):
            p = vector(point.tolist())
            values = [sum((Q(c) * x for c, x in zip(row, (*p, 1), strict=True)), Q(0)) for row in rows.tolist()]
            location = min((v > 0) - (v < 0) for v in values)
    return location >= 0, location == 0


def _in_mesh(point: np.ndarray, mesh: Mesh) -> int:
    if not hasattr(_in_mesh, "boxes") or _in_mesh.boxes[0] is not mesh:
        corners = mesh.vertices[mesh.faces]
        _in_mesh.boxes = (mesh, corners.min(axis=1), corners.max(axis=1), float(np.ptp(mesh.vertices, axis=0).max()))
    _, lows, highs, extent = _in_mesh.boxes
    p = vector(point.tolist())

    def faces(chosen: np.ndarray) -> list:
        return [tuple(vector(corner) for corner in mesh.vertices[face].tolist()) for face in mesh.faces[chosen]]

    touching = ((lows <= point) & (highs >= point)).all(axis=1)
    if any(reference.on_triangle(p, *face) for face in faces(touching)):
        return 0
    source = random.Random(1)
    while True:  # bound: a random half-line meets an edge with probability nearly 0
        u = (Q(1), *(Q(source.randint(1, 1000)) * Q(_TILT) / 1000 for _ in range(2)))
        # from the point to beyond the mesh the half-line drifts by less than 2 * _TILT * (its length along x)
        drift = 4.0 * _TILT * (extent + abs(highs[:, 0].max() - point[0]))
        met = (highs[:, 0] >= point[0]) & (highs[:, 1:] >= point[1:]).all(axis=1)
        met &= (lows[:, 1:] <= point[1:] + drift).all(axis=1)
        parity = reference._parity_in_space(p, u, faces(met))
        if parity is not None:
            return 1 if parity else -1


def _in_rings(point: np.ndarray, rings: list[np.ndarray]) -> int:
    """Return the even-odd location by the edges that the vertical line through the point meets, and no others."""
    starts, ends = np.concatenate(rings), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
    x, y = point
    touching = (np.minimum(starts, ends) <= point).all(axis=1) & (np.maximum(starts, ends) >= point).all(axis=1)
    p = vector(point.tolist())
    pairs = zip(starts[touching].tolist(), ends[touching].tolist(), strict=True)
    if any(reference.on_segment(p, vector(a), vector(b)) for a, b in pairs):
        return 0
    passed = (starts[:, 0] <= x) != (ends[:, 0] <= x)  # a half-line upwards, moved right by an infinitesimal
    parity = False
    for (ax, ay), (bx, by) in zip(starts[passed].tolist(), ends[passed].tolist(), strict=True):
        height = (Q(y) - Q(ay)) * (Q(bx) - Q(ax)) - (Q(by) - Q(ay)) * (Q(x) - Q(ax))
        parity ^= (height < 0) == (bx > ax)
    return 1 if parity else -1


def locations(points: np.ndarray, subject: Any) -> np.ndarray:
    """Return whether each point is in the closed subject, by rational arithmetic."""
    return np.array([contained(point, subject)[0] for point in points], bool)


# --- judging ----------------------------------------------------------------------------------------------------------

REFUSED = -9
"""In place of an answer: the contender raised an error for this item."""
AREA_TOLERANCE = 2.0**-20
"""Of the largest area of the pair: more than rounding coordinates does, less than any piece anyone would miss."""


def same(answers: np.ndarray, exact: np.ndarray) -> dict[str, Any]:
    """Judge answers that are labels: equal or wrong."""
    answers, exact = np.asarray(answers).astype(np.int64), np.asarray(exact).astype(np.int64)
    refused = answers == REFUSED
    return {
        "judged": len(exact),
        "wrong": int(((answers != exact) & ~refused).sum()),
        "refused": int(refused.sum()),
    }


def coordinates(answers: np.ndarray, exact: np.ndarray) -> dict[str, Any]:
    """Judge rows of coordinates, NaN where nothing remains: wrong where that differs; else their errors in ulps."""
    kept, should = ~np.isnan(answers).any(axis=1), ~np.isnan(exact).any(axis=1)
    both = kept & should
    ulps = np.abs(answers[both] - exact[both]) / np.spacing(np.maximum(np.abs(exact[both]), np.finfo(float).tiny))
    values = ulps.ravel()
    return {
        "judged": len(exact),
        "wrong": int((kept != should).sum()),
        "refused": 0,
        "ulp_largest": float(values.max(initial=0.0)),
        "ulp_median": float(np.median(values)) if len(values) else 0.0,
        "ulp_histogram": np.bincount(np.minimum(np.ceil(np.log2(values + 1)).astype(int), 20), minlength=21).tolist(),
        "off": int((values > 0).sum()),
        "coordinates": len(values),
    }


def areas(answers: np.ndarray, exact: np.ndarray) -> dict[str, Any]:
    """Judge (area, scale) pairs: NaN is a refusal; wrong is an area off by more than `AREA_TOLERANCE` of the scale."""
    answers = np.asarray(answers, float)
    refused = np.isnan(answers)
    error = np.abs(answers - exact[:, 0]) / exact[:, 1]
    good = error[~refused & (error <= AREA_TOLERANCE)] * 2.0**53
    return {
        "judged": len(exact),
        "wrong": int((error > AREA_TOLERANCE).sum()),
        "refused": int(refused.sum()),
        "ulp_largest": float(good.max(initial=0.0)),
        "ulp_median": float(np.median(good)) if len(good) else 0.0,
    }
