"""Contenders: ours and one file per package, all with the same calls.

A contender is a module with `MAKERS`: for each kind of question a function ``(subject, threads) -> Prepared``, called
once; that is its build. It imports its package when it is imported itself, so one that is not installed is found by
`make`. The kinds, what they are about, the items they are asked about and the answers:

    points            Mesh, Rings, Planes     points                      bool: contained, the boundary too
    scene             Bodies                  points                      point * n_bodies + body, sorted
    segments          a solid of ours         (n, 2, dim)                 (n, 2 * dim) first piece, NaN where nothing
    hits              Mesh                    (n, 2, 3)                   bool: meets a face
    pieces            Rings, a solid          (n, 2, dim)                 [(segment, start, end)]
    kept polygons     Aabb                    (n, size, dim)              bool: something is left
    polygon areas     Aabb of the plane       (n, size, 2)                area of what is left
    pair              a couple                None                        bool: a common point
    poses             Pair                    rows of its poses           bool
    crowd             Crowd                   frames of poses             first * n_bodies + second, sorted
    overlay           operation               pairs of lists of rings     areas, NaN where refused
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

import engine
from benchmarks.workloads import Mesh, Rings

PACKAGES = {
    "open3d": "open3d", "shapely": "shapely", "trimesh": "trimesh", "igl": "libigl", "vtk": "vtk", "cgal": "cgal",
    "matplotlib": "matplotlib", "coal": "coal", "fcl": "python-fcl", "manifold3d": "manifold3d", "numpy": "numpy",
    "pyclipper": "pyclipper", "celltree": "numba-celltree",
}  # fmt: skip
"""The distribution of each module; those of our own code have none."""


class NotApplicable(Exception):
    """The contender does not answer this kind of question."""


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A body of a pair: a mesh, or a solid of ours without faces, and its rotation and translation."""

    shape: Mesh | Rings | engine.Solid
    pose: tuple[np.ndarray, np.ndarray] | None = None
    is_closed: bool = True


Couple = tuple[Placed, Placed]


def without_poses(pair: Couple) -> Couple:
    """Leave posed bodies to the peers that take poses."""
    if any(body.pose is not None for body in pair):
        raise NotApplicable("no poses")
    return pair


def meshes_of(pair: Couple) -> list[Mesh]:
    """Return the meshes of two bodies that stand where they are."""
    shapes = [body.shape for body in without_poses(pair)]
    if not all(isinstance(shape, Mesh) for shape in shapes):
        raise NotApplicable("meshes only")
    return shapes  # type: ignore[return-value]


def rings_of(region: Rings | engine.Solid) -> list[np.ndarray]:
    """Return the rings of a polygon or a box of the plane."""
    match region:
        case Rings():
            return region.rings
        case engine.Aabb() if region.dimension == 2:
            (x0, y0), (x1, y1) = region.min, region.max
            return [np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])]
    raise NotApplicable(type(region).__name__)


@dataclass(frozen=True, slots=True)
class Prepared:
    """One contender, ready for the questions of one workload."""

    ask: Callable[[Any], Any]
    """Answers for all of them; timed."""
    native: Callable[[Any], Any] = lambda items: items
    """Converts the items to what the contender takes; not timed."""
    answer: Callable[[Any], Any] = lambda found: found
    """Reads the contender's answer; not timed."""
    memory: Callable[[], int] | None = None
    """Bytes that it says it holds."""
    method: Callable[[], str] | None = None
    """What it says it used."""
    share: Callable[[], float] | None = None
    """Share of the items that needed more than floating point."""


def make(module: str, kind: str, subject: Any, threads: int = 2) -> Prepared:
    """Return a contender ready for questions of a kind; ImportError or OSError where its package does not run here."""
    makers = importlib.import_module(f"benchmarks.contenders.with_{module}").MAKERS
    if kind not in makers:
        raise NotApplicable(kind)
    return makers[kind](subject, threads)


def answers(module: str, kind: str, subject: Any, items: Any, threads: int = 1) -> Any:
    """Return the answers of a contender asked once."""
    made = make(module, kind, subject, threads)
    return made.answer(made.ask(made.native(items)))


def anew(module: str, kind: str, subject: Any, threads: int = 2) -> Prepared:
    """Return a contender that starts from the subject's arrays at every question: build and answer are timed."""
    make(module, kind, subject, threads)  # whether its package runs
    return Prepared(lambda items: answers(module, kind, subject, items, threads))


@cache
def pool(threads: int) -> ThreadPoolExecutor:
    """Return threads for peers that have none of their own."""
    return ThreadPoolExecutor(threads)


def split(n_items: int, threads: int) -> list[slice]:
    """Return as many equal parts of 0 .. n_items as there are threads."""
    borders = [n_items * part // threads for part in range(threads + 1)]
    return [slice(start, stop) for start, stop in pairwise(borders)]


def in_threads(task: Callable[[slice], Any], n_items: int, threads: int) -> list[Any]:
    """Return what `task` returns for each part, all parts at once."""
    if threads == 1 or n_items < 1000:
        return [task(slice(0, n_items))]
    return list(pool(threads).map(task, split(n_items, threads)))


def rows_of(found: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return clipped segments as rows, NaN where not kept."""
    return np.where(np.asarray(kept)[:, None], found.reshape(len(found), -1), np.nan)


def each_pair(run: Callable[[Any], Any], area: Callable[[Any, Any], float]) -> Callable[[Any], np.ndarray]:
    """Return what asks for the area of pair after pair; whatever a peer raises is a refusal, NaN."""

    def one(pair: Any) -> float:
        try:
            return area(pair, run(pair))
        except Exception:
            return np.nan

    return lambda pairs: np.array([one(pair) for pair in pairs])


def overlays(
    read: Callable[[Any], Any], run: Callable[[Any, str], Any], area: Callable[[Any, Any], float]
) -> dict[str, Callable[[str, int], Prepared]]:
    """Return the makers of overlay: from rings, all timed; and of pairs that were read before, the areas untimed."""

    def whole(operation: str, threads: int) -> Prepared:
        def one(pair: Any) -> float:
            made = read(pair)
            return area(made, run(made, operation))

        return Prepared(each_pair(one, lambda _, found: found))

    def apart(operation: str, threads: int) -> Prepared:
        def ask(pairs: list[Any]) -> list[Any]:
            return [(made, run(made, operation)) for made in pairs]

        return Prepared(
            ask, lambda pairs: [read(pair) for pair in pairs], lambda found: np.array([area(*each) for each in found])
        )

    return {"overlay": whole, "overlay of made": apart}
