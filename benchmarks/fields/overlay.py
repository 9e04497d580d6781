"""Concave polygons on concave polygons: the area of the intersection, from public test suites and on lattices."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

import engine
from benchmarks import polygon_pairs
from benchmarks.contest import Contest, Goals, Size, Task, field_of, two_threads
from benchmarks.errors import areas, overlay_area, scale_of
from benchmarks.fields import Figure
from benchmarks.measure import clocked
from benchmarks.workloads import Rings, document

Pair = tuple[list[np.ndarray], list[np.ndarray]]
MOST_VERTICES = 40
"""Largest pair whose exact answer the slow reference computes."""
PEERS = ("textbook", "shapely", "shapely@1e-12", "shapely@1e-6", "manifold3d")
"""On the page: shapely also on grids of such a size."""
PAGE = {
    "random stars": (False, "star", 10, "10 vertices each"),
    "lattice": (True, "lattice", 5, "6 to 9 vertices on a lattice of 5 x 5: shared edges and vertices, self-crossings"),
}
LARGE: dict[str, Goals] = {"shapely": (6.0, 15.0), "manifold3d": (0.4, 1.0)}
SMALL: dict[str, Goals] = {"shapely:small pairs": (5.0, 15.0)}
OPERATIONS = ("union", "difference", "symmetric_difference")
UNIONS = ("circles", "parcels", "squares")


def tasks(size: Size) -> Iterator[Task]:
    """Yield the rows; of the table: one thread, intersections unless a row says otherwise, polygons made before."""
    for name in (*PAGE, "public suites"):
        yield Task(name, partial(_on_page, size, name), True)
    for n in (1_000, 10_000, 100_000)[: size.of(3, 1)]:
        for family in ("smooth", "spiky", "comb", "soup"):
            if (family, n) != ("soup", 100_000):
                yield Task(f"{family} of {n:,}", partial(_large, size, family, n))
    yield Task("soup of 30,000", partial(_large, size, "soup", size.of(30_000, 2_000)))
    yield Task("dense comb of 300", partial(_large, size, "dense comb", 300))
    for family in ("star", "convex"):
        for n in (4, 10, 30, 100):
            yield Task(f"batch of {family}s of {n}", partial(_batch, size, family, n))
    for n in (10, 100):
        yield Task(f"batch of stars of {n}, two threads", partial(_batch, size, "star", n, "two threads"))
    for operation in OPERATIONS:
        yield Task(f"batch of stars of 10, {operation}", partial(_batch, size, "star", 10, operation))
    for how in ("intersection", "difference", "union"):
        yield Task(f"layers of 20,000, {how}", partial(_layers, size, how))
    for family in UNIONS:
        yield Task(f"union of {family}", partial(_union, size, family), is_figure=True)
    yield Task("public pairs", partial(_public, size))
    yield Task("exact area", partial(_area, size))


def _on_page(size: Size, name: str) -> Contest:
    if name in PAGE:
        is_hard, family, n, about = PAGE[name]
        pairs = polygon_pairs.small(family, n, size.n(400, 100), size.seed)
    else:
        pairs, is_hard = list(polygon_pairs.public(MOST_VERTICES))[: size.n(200, 60)], True
        about = f"at most {MOST_VERTICES} vertices, filed by users and suites of GEOS, polygon-clipping and Clipper"
    exact = np.array([overlay_area(pair) for pair in pairs])
    result = field_of("overlay", "intersection", PEERS)
    return Contest("overlay", name, is_hard, pairs, exact, areas, result, about, request=partial(request, pairs))


def request(pairs: list[Pair], item: int) -> tuple[str, dict[str, Any]]:
    """Return path and body that ask about one pair."""
    subject, clip = (document(Rings("", rings)) for rings in pairs[item])
    return "/v1/overlay", {"subject": subject, "clip": clip, "operation": "intersection"}


# --- the table --------------------------------------------------------------------------------------------------------


def _exact_areas(pairs: list[Pair], rows: np.ndarray) -> np.ndarray:
    """Return exact areas and scales: by the reference where it is quick, else by our exact rings, which tests prove."""
    small = [sum(len(ring) for side in pairs[row] for ring in side) <= MOST_VERTICES for row in rows]
    return np.array([overlay_area(pairs[row]) if is_small else by_ours(pairs[row])
                     for row, is_small in zip(rows, small)])  # fmt: skip


def by_ours(pair: Pair) -> tuple[float, float]:
    """Return the area of the intersection by our exact rings, and the scale of a pair."""
    return engine.overlay(*map(engine.Polygon, pair)).area, scale_of(pair)


def _contest(name: str, pairs: list[Pair], result: list[Any], is_judged: bool = True, **more: Any) -> Contest:
    exact = partial(_exact_areas, pairs) if is_judged else None
    return Contest("overlay", name, False, pairs, exact, areas, result, count=len(pairs), **more)


def _large(size: Size, family: str, n: int) -> Contest:
    pairs = [polygon_pairs.large(family, n, size.seed)]
    return _contest(f"{family} of {n:,}", pairs, field_of("overlay of made", "intersection", LARGE, 1))


def _batch(size: Size, family: str, n: int, how: str = "intersection") -> Contest:
    """All polygons are simple: shapely is given them at once, their areas are read untimed."""
    name = f"batch of {family}s of {n}"
    pairs = polygon_pairs.small(family, n, max(1000, size.n(120_000) // n), size.seed)
    if how == "two threads":
        return _contest(f"{name}, {how}", pairs, two_threads("overlay of made", "intersection"), False)
    peers: Mapping[str, Any] = SMALL if how == "intersection" else {}
    result = field_of("overlay of made", how, peers, 1)
    return _contest(name if peers else f"{name}, {how}", pairs, result, bool(peers),
                    n_sample=max(3, min(60, 1500 // n**2)), most=0)  # fmt: skip


def _layers(size: Size, how: str) -> Contest:
    """Two layers of parcels, each meets some four of the other; from frame to frame, one thread. Ours alone."""
    layers = tuple(polygon_pairs.parcels(size.n(20_000, 2_000), size.seed + side) for side in range(2))
    result = field_of("layers", how, (), 1)
    return Contest("layers", f"layers of 20,000, {how}", False, layers, None, areas, result, count=len(layers[0]))


def _union(size: Size, family: str) -> Figure:
    """Our seconds for one of shapely.union_all, turn by turn, medians; beside it, those of ours on a grid."""
    import shapely

    layer = polygon_pairs.layer(family, size.of(1, 10), size.seed)
    ours, theirs = [engine.Polygon([ring]) for ring in layer], [shapely.Polygon(ring) for ring in layer]
    engine.union_all(ours)
    engine.union_all(ours, grid=1e-6)
    turns = [
        [clocked(ask)[0] for ask in (partial(shapely.union_all, theirs), partial(engine.union_all, ours),
                                     partial(engine.union_all, ours, grid=1e-6))]
        for _ in range(5)
    ]  # fmt: skip
    peer, plain, snapped = np.median(turns, axis=0)
    about = (
        f"{len(layer):,} polygons: shapely {peer * 1e3:.0f} ms, ours {plain * 1e3:.0f}, on a grid {snapped * 1e3:.0f}"
    )
    return Figure(f"union of {family}", "of the time of shapely.union_all", [plain / peer], 1 / 3, 1 / 6, about)


def _filed(size: Size) -> list[Pair]:
    return list(polygon_pairs.public(size.of(5_000, 300)))


def _public(size: Size) -> Contest:
    """Pairs of public suites, polygons made while the clock runs."""
    pairs = _filed(size)
    exact = np.array([by_ours(pair) for pair in pairs])
    result = field_of("overlay", "intersection", ["shapely", "manifold3d"], 1)
    return Contest("overlay", "public pairs", True, pairs, exact, areas, result, count=len(pairs))


def _area(size: Size) -> Contest:
    pairs = [polygon_pairs.large("spiky", 300, size.seed)]
    return _contest("exact area", pairs, field_of("exact area", "intersection", (), 1), False)
