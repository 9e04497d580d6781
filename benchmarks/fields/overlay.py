"""Concave polygons on concave polygons: the area of the intersection, from public test suites and on lattices."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from fractions import Fraction
from functools import partial

import numpy as np

import engine
from benchmarks import polygon_pairs
from benchmarks.contenders import Prepared
from benchmarks.contest import Contender, Contest, Goals, contender
from benchmarks.errors import areas
from benchmarks.fields import Figure, Size, Task
from benchmarks.measure import clocked
from benchmarks.workloads import MissingDataError, generator

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
    with contextlib.suppress(MissingDataError):
        for pair in polygon_pairs.public(("geos_pairs", "mfogel_cases"), n_most=2):
            if sum(len(ring) for rings in pair for ring in rings) <= MOST_VERTICES:
                yield pair


def _scale(pair: Pair) -> float:
    return max(*(float(np.prod(np.ptp(np.concatenate(rings), axis=0))) for rings in pair), 1e-300)


def _exact_area(pair: Pair) -> tuple[float, float]:
    from tests.reference import overlay as reference

    solids = [{"type": "polygon", "rings": [ring.tolist() for ring in rings]} for rings in pair]
    return float(Fraction(reference.overlay(*solids, "intersection").area)), _scale(pair)


def _contest(name: str, is_hard: bool, pairs: list[Pair], about: str) -> Contest:
    exact = np.array([_exact_area(pair) for pair in pairs])
    return Contest("overlay", name, is_hard, pairs, exact, areas, contenders(), about)


def contenders(kind: str = "overlay", goals: dict[str, Goals] | None = None, threads: int = 2) -> list[Contender]:
    """Return the contenders; items are pairs of lists of rings under even-odd."""
    shown = {
        "ours": "ours", "textbook: Greiner-Hormann": "textbook", "shapely (GEOS)": "shapely", "pyclipper": "pyclipper",
        "Clipper2 by manifold3d": "manifold3d",
    }  # fmt: skip
    return [
        contender(name, module, kind, "intersection", threads, (goals or {}).get(module, (None, None)))
        for name, module in shown.items()
        if module != "textbook" or kind == "overlay"
    ]


# --- the table --------------------------------------------------------------------------------------------------------

LARGE = {"shapely": (6.0, 15.0), "pyclipper": (0.4, 1.0), "manifold3d": (0.4, 1.0)}
SMALL = {"shapely": (5.0, 15.0), "pyclipper": (2.0, 5.0)}
OPERATIONS = ("union", "difference", "symmetric_difference")


def table(size: Size) -> Iterator[Task]:
    """Yield the rows of the table: one thread, intersections unless a row says otherwise, polygons made before."""
    for n in (1_000, 10_000, 100_000)[: size.of(3, 1)]:
        for family in ("smooth", "spiky", "comb", "soup"):
            if (family, n) != ("soup", 100_000):
                yield f"{family} of {n:,}", partial(_large, size, family, n)
    yield "soup of 30,000", partial(_large, size, "soup", size.of(30_000, 2_000))
    yield "dense comb of 300", partial(_large, size, "dense comb", 300)
    for family in ("star", "convex"):
        for n in (4, 10, 30, 100):
            yield f"batch of {family}s of {n}", partial(_batch, size, family, n)
    for n in (10, 100):
        yield f"batch of stars of {n}, two threads", partial(_two_threads, size, n)
    for operation in OPERATIONS:
        name = f"batch of stars of 10, {operation}"
        yield name, partial(_batch, size, "star", 10, operation)
    yield "batch on a lattice", partial(_on_lattice, size)
    yield "public pairs", partial(_public, size)
    yield "exact area", partial(_area, size)


def figures(size: Size) -> Iterator[Task]:
    """Yield what is no contest."""
    yield "public pairs, four operations", partial(_identities, size)
    yield "late after a deadline", partial(_deadline, size)


def _exact_areas(pairs: list[Pair], rows: np.ndarray) -> np.ndarray:
    """Return exact areas and scales: by the reference where it is quick, else by our exact rings, which tests prove."""
    found = []
    for row in rows:
        rings = [polygon for side in pairs[row] for polygon in side]
        is_small = sum(map(len, rings)) <= MOST_VERTICES
        found.append(_exact_area(pairs[row]) if is_small else _ours_exactly(pairs[row]))
    return np.array(found)


def _ours_exactly(pair: Pair) -> tuple[float, float]:
    return float(engine.overlay(*map(engine.Polygon, pair)).area_exact), _scale(pair)


def _large(size: Size, family: str, n: int) -> Contest:
    pairs = [polygon_pairs.large(family, n, size.seed)]
    return Contest(
        "overlay", f"{family} of {n:,}", False, pairs, partial(_exact_areas, pairs), areas,
        contenders("overlay of made", LARGE, 1), count=1,
    )  # fmt: skip


def _small(size: Size, family: str, n: int) -> list[Pair]:
    sides = polygon_pairs.small(family, n, max(1000, size.of(120_000, 12_000) // n), size.seed)
    return [([first], [second]) for first, second in zip(*sides, strict=True)]


def _batch(size: Size, family: str, n: int, operation: str = "intersection") -> Contest:
    """All polygons are simple: shapely is given them at once, pyclipper one by one, their areas are read untimed."""
    pairs, name = _small(size, family, n), f"batch of {family}s of {n}"
    if operation != "intersection":
        ours = [contender("ours", "ours", "overlay of made", operation, 1)]
        return Contest("overlay", f"{name}, {operation}", False, pairs, None, areas, ours, count=len(pairs))
    ours, *_ = contenders("overlay of made", None, 1)
    others = [
        contender("shapely (GEOS)", "shapely", "small pairs", None, 1, SMALL["shapely"]),
        contender("pyclipper, gross", "pyclipper", "small pairs", True, 1, SMALL["pyclipper"]),
        contender("pyclipper, only made and filled", "pyclipper", "small pairs", False, 1),
    ]
    n_sample = max(3, min(60, 1500 // n**2))
    exact = partial(_exact_areas, pairs)
    return Contest(
        "overlay", name, False, pairs, exact, areas, [ours, *others], n_sample=n_sample, most=0, count=len(pairs)
    )


def _two_threads(size: Size, n: int) -> Contest:
    pairs = _small(size, "star", n)
    two, one = (contender(name, "ours", "overlay of made", "intersection", threads, goals) for name, threads, goals in
                (("ours", 2, (None, None)), ("ours, one thread", 1, (1.7, 1.9))))  # fmt: skip
    name = f"batch of stars of {n}, two threads"
    return Contest("overlay", name, False, pairs, None, areas, [two, one], count=len(pairs))


def _on_lattice(size: Size) -> Contest:
    source = generator("rows/lattice", size.seed)
    pairs = [([_lattice_ring(source)], [_lattice_ring(source)]) for _ in range(size.of(1_000, 200))]
    ours = contenders("overlay of made", None, 1)[:1]
    return Contest("overlay", "batch on a lattice", True, pairs, None, areas, ours, count=len(pairs))


def _filed(size: Size) -> list[Pair]:
    most = size.of(5_000, 300)
    return [pair for pair in polygon_pairs.public() if sum(map(len, pair[0] + pair[1])) <= most]


def _public(size: Size) -> Contest:
    """Pairs of public suites, polygons made while the clock runs."""
    pairs = _filed(size)
    found = [each for each in contenders("overlay", None, 1) if not each.name.startswith("textbook")]
    exact = np.array([_ours_exactly(pair) for pair in pairs])
    return Contest("overlay", "public pairs", True, pairs, exact, areas, found, count=len(pairs))


def _identities(size: Size) -> Figure:
    """How many areas of ours do not add up exactly over the four operations."""
    wrong, pairs = 0, _filed(size)
    for pair in pairs:
        first, second = map(engine.Polygon, pair)
        both, union, only, either = (
            engine.overlay(first, second, operation).area_exact  # type: ignore[call-overload]
            for operation in ("intersection", *OPERATIONS)
        )
        other = engine.overlay(second, first, "difference").area_exact
        wrong += (either + both != union) or (only + other != either)
    return Figure("public pairs, four operations", "wrong", [wrong], 0, 0, f"{len(pairs)} pairs")


def _area(size: Size) -> Contest:
    pairs = [polygon_pairs.large("spiky", 300, size.seed)]
    first, second = map(engine.Polygon, pairs[0])
    ours = Contender("ours", lambda: Prepared(lambda _: engine.overlay(first, second, workers=1).area_exact))
    return Contest("overlay", "exact area", False, pairs, None, areas, [ours], count=1)


def _deadline(size: Size) -> Figure:
    """How long after its deadline a large overlay returns at the latest, for deadlines all over its time."""
    first, second = map(engine.Polygon, polygon_pairs.large("comb", size.of(100_000, 1_000), size.seed))
    engine.overlay(first, second)
    whole = clocked(partial(engine.overlay, first, second))[0]
    late = [0.0]
    for share in np.linspace(0.02, 0.98, 13):
        start = time.perf_counter()
        with contextlib.suppress(engine.DeadlineExceededError):
            engine.overlay(first, second, deadline=whole * share)
            continue
        late.append(time.perf_counter() - start - whole * share)
    note = f"the longest of {len(late) - 1} deadlines; the whole takes {whole:.3g} s"
    return Figure("late after a deadline", "s", [max(late)], note=note)
