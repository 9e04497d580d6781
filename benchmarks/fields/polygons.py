"""Polygons on a convex region (Sutherland-Hodgman), judged by the exact area of what remains."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np

import engine
from benchmarks.contest import Ask, Contender, Contest, areas
from benchmarks.workloads import generator
from engine.textbook import sutherland_hodgman

BOX = np.array([[1.0, 0.0, 1.0], [-1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, -1.0, 1.0]])
"""The square [-1, 1]^2 by rows, in the order of an aabb."""


def contests(seed: int, scale: float) -> Iterator[Contest]:
    """Yield the contests of polygon clipping."""
    source = generator("report polygons", seed)
    n_polygons, n_exact = int(8_000 * scale), int(400 * min(1, 4 * scale))
    easy = _stars(source, n_polygons, 12)
    hard = np.round(_stars(source, n_polygons // 4, 12) * 2) / 2  # many vertices on the box, edges along it
    hard += source.integers(-1, 2, hard.shape) * np.spacing(np.abs(hard)) * (source.uniform(size=hard.shape) < 0.3)
    for name, rings in (("random stars", easy), ("along the box", hard)):
        exact = _exact(rings[:n_exact])
        is_hard = rings is hard
        about = "12 vertices each on the square [-1, 1]^2" + (
            ", on a lattice of halves, some an ulp off" if is_hard else ""
        )
        yield Contest("clipping polygons", name, is_hard, rings, exact, areas, CONTENDERS, about)


def _stars(source: np.random.Generator, n_polygons: int, size: int) -> np.ndarray:
    angles = np.sort(source.uniform(0, 2 * np.pi, (n_polygons, size)), axis=1)
    radii = source.uniform(0.4, 1.6, (n_polygons, size))
    middles = source.uniform(-1, 1, (n_polygons, 1, 2))
    return middles + np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=2)


def _exact(rings: np.ndarray) -> np.ndarray:
    from tests.reference.exact import vector
    from tests.reference.overlay import signed_area
    from tests.reference.sutherland_hodgman import clip_contour

    planes = [vector(row) for row in BOX.tolist()]
    found = [signed_area(clip_contour(ring, planes)) for ring in rings.tolist()]
    scale = [abs(signed_area([vector(p) for p in ring])) for ring in rings.tolist()]
    return np.array(
        [
            [abs(float(Fraction(area))), max(float(Fraction(size)), 1e-300)]
            for area, size in zip(found, scale, strict=True)
        ]
    )


def ring_areas(vertices: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Return the signed areas of rings of three or more vertices in plain float64."""
    starts = np.repeat(offsets[:-1], np.diff(offsets))
    following = np.arange(1, len(vertices) + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    a, b = vertices - vertices[starts], vertices[following] - vertices[starts]
    return 0.5 * np.add.reduceat(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], offsets[:-1])


def _ours() -> Ask:
    region = engine.Aabb((-1, -1), (1, 1))

    def ask(rings: np.ndarray) -> np.ndarray:
        clipped = engine.clip_polygons(rings, region)
        counts, found = np.diff(clipped.polygon_offsets), np.zeros(len(rings))
        found[counts > 0] = np.abs(ring_areas(clipped.vertices, clipped.ring_offsets))  # one ring each at most
        return found

    return ask


def _textbook() -> Ask:
    def ask(rings: np.ndarray) -> np.ndarray:
        clipped = [next(iter(sutherland_hodgman.clip_on_convex([ring], BOX)), np.empty((0, 2))) for ring in rings]
        found, sizes = np.zeros(len(rings)), np.array([len(ring) for ring in clipped])
        kept = sizes > 0
        found[kept] = np.abs(ring_areas(np.concatenate(clipped), np.append(0, np.cumsum(sizes[kept]))))
        return found

    return ask


def _shapely() -> Ask:
    import shapely

    def ask(rings: np.ndarray) -> np.ndarray:
        try:
            return shapely.area(shapely.clip_by_rect(shapely.polygons(rings), -1, -1, 1, 1))
        except shapely.GEOSException:  # one polygon it cannot clip ends the whole call
            return np.nan if len(rings) == 1 else np.hstack([ask(ring[None]) for ring in rings])

    return ask


def _pyclipper() -> Ask:
    import pyclipper

    scale = 2.0**40

    def ask(rings: np.ndarray) -> np.ndarray:
        box = [[int(x * scale), int(y * scale)] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        found = np.empty(len(rings))
        for i, ring in enumerate(np.rint(rings * scale).astype(np.int64).tolist()):
            clipper = pyclipper.Pyclipper()
            try:
                clipper.AddPath(ring, pyclipper.PT_SUBJECT, True)
                clipper.AddPath(box, pyclipper.PT_CLIP, True)
                found[i] = sum(pyclipper.Area(path) for path in clipper.Execute(pyclipper.CT_INTERSECTION)) / scale**2
            except pyclipper.ClipperException:
                found[i] = np.nan
        return found

    return ask


CONTENDERS = [
    Contender("ours", _ours),
    Contender("textbook: Sutherland-Hodgman", _textbook),
    Contender("shapely clip_by_rect", _shapely, "shapely"),
    Contender("pyclipper", _pyclipper, "pyclipper"),
]
