"""Concave polygons on concave polygons: the area of the intersection, from public test suites and on lattices."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np

import engine
from benchmarks.contest import Ask, Contender, Contest, areas
from benchmarks.workloads import DATA, generator
from engine.textbook import greiner_hormann

Pair = tuple[list[np.ndarray], list[np.ndarray]]
MOST_VERTICES = 40
"""Of a pair whose exact answer is found by the slow reference."""


def contests(seed: int, scale: float) -> Iterator[Contest]:
    """Yield the contests of overlay."""
    source = generator("report overlay", seed)
    easy = [tuple([_star(source, 10)] for _ in range(2)) for _ in range(int(400 * scale))]
    yield _contest("random stars", False, easy, "10 vertices each")
    lattice = [tuple([_lattice_ring(source)] for _ in range(2)) for _ in range(int(400 * scale))]
    yield _contest(
        "lattice", True, lattice, "6 to 9 vertices on a lattice of 5 x 5: shared edges and vertices, self-crossings"
    )
    public = list(_public_pairs())[: int(200 * min(1, 2 * scale))]
    if public:
        yield _contest(
            "public suites",
            True,
            public,
            f"pairs of at most {MOST_VERTICES} vertices that users and suites of GEOS and polygon-clipping filed",
        )


def _star(source: np.random.Generator, size: int) -> np.ndarray:
    angles, radii = np.sort(source.uniform(0, 2 * np.pi, size)), source.uniform(0.3, 1, size)
    return source.uniform(-0.5, 0.5, 2) + np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)


def _lattice_ring(source: np.random.Generator) -> np.ndarray:
    return source.integers(0, 5, (source.integers(6, 10), 2)).astype(float)


def _public_pairs() -> Iterator[Pair]:
    for name, fields in (("geos_pairs", ("a", "b")), ("mfogel_cases", None)):
        path = DATA / "clipping" / f"{name}.json.gz"
        if not path.is_file():
            continue
        for case in json.loads(gzip.decompress(path.read_bytes())):
            both = [case[field] for field in fields] if fields else case["geoms"][:2]
            if len(both) < 2:
                continue
            rings = [[_ring(ring) for polygon in shape for ring in polygon] for shape in both]
            sizes = [len(ring) for shape in rings for ring in shape]
            if all(rings) and min(sizes) >= 3 and sum(sizes) <= MOST_VERTICES:
                yield rings[0], rings[1]


def _ring(positions: list[list[float]]) -> np.ndarray:
    ring = np.array([position[:2] for position in positions], float)
    return ring[:-1] if len(ring) > 1 and (ring[0] == ring[-1]).all() else ring


def _contest(name: str, is_hard: bool, pairs: list[Pair], about: str) -> Contest:
    from tests.reference import overlay as reference

    exact = np.empty((len(pairs), 2))
    for row, (first, second) in zip(exact, pairs, strict=True):
        solids = [{"type": "polygon", "rings": [ring.tolist() for ring in rings]} for rings in (first, second)]
        area = reference.overlay(*solids, "intersection").area
        scale = max(float(np.prod(np.ptp(np.concatenate(rings), axis=0))) for rings in (first, second))
        row[:] = float(Fraction(area)), max(scale, 1e-300)
    return Contest("overlay", name, is_hard, np.arange(len(pairs)), exact, areas, contenders(pairs), about)


def contenders(pairs: list[Pair]) -> list[Contender]:
    """Return the contenders; items are indices of pairs; rings are under even-odd."""

    def each(build: Callable[[], Callable[[Pair], float]]) -> Callable[[], Ask]:
        def make() -> Ask:
            one = build()

            def called(pair: Pair) -> float:
                try:
                    return one(pair)
                except Exception:  # whatever a peer raises: a refusal
                    return np.nan

            return lambda rows: np.array([called(pairs[row]) for row in rows])

        return make

    return [
        Contender("ours", lambda: _ours(pairs)),
        Contender("textbook: Greiner-Hormann", each(_textbook)),
        Contender("shapely (GEOS)", each(_shapely), "shapely"),
        Contender("pyclipper", each(_pyclipper), "pyclipper"),
        Contender("Clipper2 by manifold3d", each(_manifold), "manifold3d"),
    ]


def _ours(pairs: list[Pair]) -> Ask:
    def ask(rows: np.ndarray) -> np.ndarray:  # polygons are made here, as the peers make theirs
        subjects, clips = ([engine.Polygon(pairs[row][side]) for row in rows] for side in range(2))
        return areas_of(engine.overlay_batch(subjects, clips))

    return ask


def areas_of(batch: engine.OverlayBatch) -> np.ndarray:
    """Return the areas of the rounded outputs in plain float64, shells less holes, like those of the peers."""
    n, rings = len(batch), batch.piece_offsets[batch.pair_offsets]
    if not len(batch.vertices):
        return np.zeros(n)
    starts, ends = batch.ring_offsets[:-1], batch.ring_offsets[1:]
    x, y = (batch.vertices - np.repeat(batch.vertices[starts], ends - starts, axis=0)).T
    following = np.arange(1, len(x) + 1)
    following[ends - 1] = starts
    twice = np.add.reduceat(x * y[following] - y * x[following], starts)
    return 0.5 * np.bincount(np.repeat(np.arange(n), np.diff(rings)), weights=twice, minlength=n)


def signed(ring: np.ndarray) -> float:
    """Return the signed area of a ring in plain float64."""
    x, y = ring[:, 0] - ring[0, 0], ring[:, 1] - ring[0, 1]
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _textbook() -> Callable[[Pair], float]:
    def one(pair: Pair) -> float:
        if len(pair[0]) > 1 or len(pair[1]) > 1:
            raise ValueError("single rings only")
        return sum(abs(signed(ring)) for ring in greiner_hormann.intersection(pair[0][0], pair[1][0]) if len(ring) > 2)

    return one


def _shapely() -> Callable[[Pair], float]:
    import shapely

    def shape(rings: list[np.ndarray]) -> Any:
        polygons = [shapely.Polygon(ring) for ring in rings]
        polygons = [polygon if polygon.is_valid else shapely.make_valid(polygon) for polygon in polygons]
        made = polygons[0]
        for polygon in polygons[1:]:
            made = made.symmetric_difference(polygon)
        return made

    return lambda pair: shape(pair[0]).intersection(shape(pair[1])).area


def _pyclipper() -> Callable[[Pair], float]:
    import pyclipper

    def one(pair: Pair) -> float:
        every = np.concatenate([ring for rings in pair for ring in rings])
        middle = every.mean(axis=0)
        scale = 2.0 ** np.floor(50 - np.log2(max(np.abs(every - middle).max(), 1e-300)))
        clipper = pyclipper.Pyclipper()
        for rings, kind in zip(pair, (pyclipper.PT_SUBJECT, pyclipper.PT_CLIP), strict=True):
            paths = [np.rint((ring - middle) * scale).astype(np.int64).tolist() for ring in rings]
            clipper.AddPaths(paths, kind, True)
        found = clipper.Execute(pyclipper.CT_INTERSECTION, pyclipper.PFT_EVENODD, pyclipper.PFT_EVENODD)
        return sum(pyclipper.Area(path) for path in found) / scale**2

    return one


def _manifold() -> Callable[[Pair], float]:
    from manifold3d import CrossSection, FillRule

    def one(pair: Pair) -> float:
        first, second = (CrossSection(list(rings), FillRule.EvenOdd) for rings in pair)
        return (first ^ second).area()

    return one
