"""Contenders: ours and one file per package, all with the same calls.

A contender is one file, with_NAME.py, with `MAKERS`: for each kind of question a function ``(subject, threads[, knob])
-> Prepared``, called once; that is its build. `PACKAGE` is the distribution that it needs, `NAMES` what it is called in
tables, by kind ("" for all others), `READERS` its own of files, by suffix. It imports its package when it is imported
itself, so one that is not installed is detected by `make`. The kinds, their subjects, items and answers:

    points            Mesh, Rings, Convex     points                      bool: contained, the boundary too
    scene             Bodies                  points                      point * n_bodies + body, sorted
    scene all, any    Bodies                  (n, 2, 3)                   as scene; bool: any body is met (first, too)
    segments          a solid of ours         (n, 2, dim)                 (n, 2 * dim) first piece, NaN where nothing
    hits              Mesh                    (n, 2, 3)                   bool: meets a face
    first hits        Mesh                    (n, 2, 3)                   parameter t of the first hit, NaN where none
    hit counts        Mesh                    (n, 2, 3)                   number of hits
    all hits          Mesh                    (n, 2, 3)                   [(segment, t)]
    volume            Mesh                    None                        its volume
    cut volumes       Mesh                    rows [a, b, c, d]           volumes of the closed halves, NaN not closed
    section areas     Mesh                    rows [a, b, c, d]           areas of the sections
    overlap           a couple                None                        volume in common
    pieces            Rings, a solid          (n, 2, dim)                 [(segment, start, end)]
    lines             Polygon of one ring     (n, size, 2)                the line of each piece
    layers            how                     two (n, size, 2)            areas of the rows
    join              predicate               two (n, size, 2)            pairs (n, 2)
    kept polygons     Aabb                    (n, size, dim)              bool: something is left
    polygon areas     Aabb of the plane       (n, size, 2)                area of what is left
    pair              a couple                None                        bool: a common point
    relations of polygons  two (n, size, 2)   pairs (n, 2)                numbers of `engine.Relation`
    poses             Pair                    rows of its poses           bool
    point distances   Mesh, Rings             points                      distances from its boundary
    signed distances  Mesh                    points                      the same, negative inside
    points within     (Mesh, distance)        points                      bool: at most so far from its surface
    clearance poses   Pair                    rows of its poses           distances
    clearance pairs   None                    couples                     distances, NaN refused, infinite not taken
    crowd             Crowd                   frames of poses             first * n_bodies + second, sorted
    overlay           operation               pairs of lists of rings     areas, NaN where refused
"""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import engine
from benchmarks.workloads import Bodies, Mesh, Rings


def files() -> dict[str, Path]:
    """Return the file of every contender."""
    result = (path for folder in __path__ for path in Path(folder).glob("with_*.py"))
    return {path.stem.removeprefix("with_"): path for path in result}


@cache
def stated(module: str) -> dict[str, Any]:
    """Return the constants of a contender's file, parsed and not imported: its package may be missing."""
    text = files()[module].read_text("utf-8") if is_there(module) else ""
    reported = [node for node in ast.parse(text).body if isinstance(node, ast.Assign)]
    names = {getattr(node.targets[0], "id", ""): node.value for node in reported}
    return {name: ast.literal_eval(names[name]) for name in ("PACKAGE", "NAMES") if name in names}


def packages() -> list[str]:
    """Return the distributions that contenders need; our own code needs none."""
    return [stated(module)["PACKAGE"] for module in sorted(files()) if "PACKAGE" in stated(module)]


def is_there(spec: str) -> bool:
    """Return whether a contender has a file."""
    return re.split("[:@]", spec)[0] in files()


def names_of(spec: str) -> Sequence[str]:
    """Return the names of a contender, of all kinds."""
    module = re.split("[:@]", spec)[0]
    return [module, *stated(module).get("NAMES", {}).values()] if is_there(spec) else []


def shown(module: str, kind: str) -> str:
    """Return the name of a contender in tables."""
    names = stated(module).get("NAMES", {})
    return names.get(kind) or names.get("", module)


def said_by(error: Exception) -> str:
    """Return what a peer raised in one line: without colours, and of paths of its builder's machine the file alone."""
    text = f"{type(error).__name__}: {error}".splitlines()[0]
    return re.sub(r"(?<![\w.])/(?:[\w.+-]+/)+", "", re.sub(r"\x1b\[[\d;]*m", "", text))


class NotApplicable(Exception):
    """The contender does not answer this kind of question."""


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A body of a pair: a mesh, or a solid of ours without faces, with its rotation and translation."""

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
    """Return the meshes of two bodies without poses."""
    shapes = [body.shape for body in without_poses(pair)]
    if not all(isinstance(shape, Mesh) for shape in shapes):
        raise NotApplicable("meshes only")
    return shapes  # type: ignore[return-value]


def merged(bodies: Bodies) -> tuple[Mesh, np.ndarray]:
    """Return many meshes as one, and for each face the number of its body."""
    sizes = [len(body.vertices) for body in bodies.bodies]
    starts = np.cumsum([0, *sizes[:-1]])
    faces = np.concatenate([body.faces + start for body, start in zip(bodies.bodies, starts)])
    owners = np.repeat(np.arange(len(sizes)), [len(body.faces) for body in bodies.bodies])
    return Mesh(bodies.name, np.concatenate([body.vertices for body in bodies.bodies]), faces), owners


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
    """One contender, built for the questions of one workload."""

    ask: Callable[[Any], Any]
    """Answers all items; timed."""
    native: Callable[[Any], Any] = lambda items: items
    """Converts the items to the contender's types; not timed."""
    answer: Callable[[Any], Any] = lambda result: result
    """Converts the contender's answer; not timed."""
    memory: Callable[[], int] | None = None
    """Bytes that it reports."""
    method: Callable[[], str] | None = None
    """The method that it reports."""
    share: Callable[[], float] | None = None
    """Share of the items beyond floating point."""


def make(module: str, kind: str, subject: Any, threads: int = 2, *setting: float) -> Prepared:
    """Build a contender for questions of a kind; ImportError or OSError if its package does not run here."""
    makers = importlib.import_module(f"{__name__}.with_{module}").MAKERS
    if kind not in makers:
        raise NotApplicable(f"has no answer to {kind}")
    return makers[kind](subject, threads, *setting)


def readers_of(module: str) -> dict[str, Callable[[str], Any]]:
    """Return a contender's own readers of files by suffix: vertices and faces, or rings in a tuple."""
    return getattr(importlib.import_module(f"{__name__}.with_{module}"), "READERS", {})


def answers(module: str, kind: str, subject: Any, items: Any, threads: int = 1) -> Any:
    """Return the answers of a contender to one call."""
    made = make(module, kind, subject, threads)
    return made.answer(made.ask(made.native(items)))


def rebuilt_each_call(module: str, kind: str, subject: Any, threads: int = 2) -> Prepared:
    """Return a contender that is rebuilt from the subject's arrays at each call: build and answer are timed."""
    make(module, kind, subject, threads)  # whether its package runs
    return Prepared(lambda items: answers(module, kind, subject, items, threads))


@cache
def pool(threads: int) -> ThreadPoolExecutor:
    """Return threads for peers that have none of their own."""
    return ThreadPoolExecutor(threads)


def in_threads(task: Callable[[slice], Any], n_items: int, threads: int) -> list[Any]:
    """Return the results of `task` on as many equal parts as there are threads, run concurrently."""
    if threads == 1 or n_items < 1000:
        return [task(slice(0, n_items))]
    borders = [n_items * part // threads for part in range(threads + 1)]
    return list(pool(threads).map(task, map(slice, borders, borders[1:])))


def t_by_segment(n_segments: int, segments: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Return the least parameter of each segment's hits, NaN where it has none."""
    result = np.full(n_segments, np.inf)
    np.minimum.at(result, segments, t)
    return np.where(np.isinf(result), np.nan, result)


def is_closed(vertices: np.ndarray, faces: np.ndarray) -> bool:
    """Return whether every side of a triangle is used as often in one direction as in the other, by position."""
    numbers = np.unique(vertices, axis=0, return_inverse=True)[1].ravel()[faces]
    sides = np.stack([numbers, np.roll(numbers, -1, axis=1)], axis=-1).reshape(-1, 2)
    sides = sides[sides[:, 0] != sides[:, 1]]
    signs = np.where(sides[:, 0] < sides[:, 1], 1, -1)
    where = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)[1].ravel()
    return not np.bincount(where, signs).any()


def rows_of(result: np.ndarray, remaining: np.ndarray) -> np.ndarray:
    """Return clipped segments as rows, NaN for those that are clipped away."""
    return np.where(np.asarray(remaining)[:, None], result.reshape(len(result), -1), np.nan)


def pieces_of(make: Callable[..., Prepared]) -> Callable[..., Prepared]:
    """Return the maker of `pieces` from one of `segments`: at most one piece a segment."""

    def of(region: Any, threads: int) -> Prepared:
        made = make(region, threads)

        def answer(result: Any) -> list[Any]:
            ends = [np.split(row, 2) for row in made.answer(result)]
            return [(i, *each) for i, each in enumerate(ends) if not np.isnan(each).any()]

        return replace(made, answer=answer)

    return of


def each_or_nan(area: Callable[[Any], float]) -> Callable[[Any], np.ndarray]:
    """Return a function that computes one number an item; an error of a peer becomes NaN, a refusal."""

    def one(item: Any) -> float:
        try:
            return area(item)
        except NotApplicable:
            return np.inf  # out of its domain
        except Exception:
            return np.nan

    return lambda items: np.array([one(item) for item in items])


def _made_or_none(made: Callable[[Any], Any], item: Any) -> Any:
    try:
        return made(item)
    except NotApplicable:
        return None


def each_alone(made: Callable[[Any], Any], ask: Callable[[Any], float]) -> Prepared:
    """Return a function that makes each item untimed, then computes one number of each; errors as in `each_or_nan`."""

    def native(items: Any) -> list[Any]:
        return [_made_or_none(made, item) for item in items]

    def one(item: Any) -> float:
        if item is None:
            raise NotApplicable("not made")
        return ask(item)

    return Prepared(each_or_nan(one), native)


def overlays(
    read: Callable[..., Any], run: Callable[[Any, str], Any], area: Callable[[Any, Any], float]
) -> dict[str, Callable[..., Prepared]]:
    """Return the makers of overlay: from rings, all timed; and of pairs read before, the areas untimed."""

    def whole(operation: str, threads: int, *setting: float) -> Prepared:
        def one(pair: Any) -> float:
            made = read(pair, *setting)
            return area(made, run(made, operation))

        return Prepared(each_or_nan(one))

    def apart(operation: str, threads: int) -> Prepared:
        def ask(pairs: list[Any]) -> list[Any]:
            return [(made, run(made, operation)) for made in pairs]

        return Prepared(
            ask, lambda pairs: [read(pair) for pair in pairs], lambda result: np.array([area(*each) for each in result])
        )

    return {"overlay": whole, "overlay of made": apart}


def box_of(body: Placed) -> tuple[np.ndarray, np.ndarray] | None:
    """Return low and high of a box without a pose; None for a ball; other bodies are out of domain."""
    match body.shape:
        case engine.Aabb() | engine.Sphere() if body.pose is not None or body.shape.dimension == 2:
            raise NotApplicable("poses of meshes only, and space only")
        case engine.Aabb(min=low, max=high):
            return low, high
        case engine.Sphere():
            return None
    raise NotApplicable(type(body.shape).__name__)


class Library(NamedTuple):
    """How to call a collision library: one body a call, or one pose a call."""

    model: Callable[[Mesh], Any]
    """Its tree of a mesh."""
    convex: Callable[[Mesh], Any]
    place: Callable[..., Any]
    """Rotation and translation as it takes them."""
    body: Callable[[Any], Any]
    """A model that stands where it is."""
    shape: Callable[[Placed], Any]
    """A body of any kind."""
    at: Callable[[Any, Any], Any]
    """A body moved to a place."""
    meet: Callable[[Any, Any], bool]
    apart: Callable[[Any, Any], float]


def makers_of(library: Library) -> dict[str, Callable[..., Prepared]]:
    """Return the makers of pairs and poses; setting a body's pose is part of a question, and so it is timed."""

    def posed(ask: Callable[[Any, Any], Any], model: Callable[[Mesh], Any]) -> Callable[..., Prepared]:
        def make(pair: Any, threads: int) -> Prepared:
            first, second = (library.body(model(mesh)) for mesh in (pair.first, pair.second))
            return Prepared(
                lambda places: [ask(first, library.at(second, place)) for place in places],
                lambda rows: [library.place(pair.rotations[row], pair.translations[row]) for row in rows], np.array,
            )  # fmt: skip

        return make

    def pair(couple: Couple, threads: int) -> Prepared:
        first, second = map(library.shape, couple)
        return Prepared(lambda _: library.meet(first, second))

    return {
        "pair": pair, "poses": posed(library.meet, library.model), "convex poses": posed(library.meet, library.convex),
        "clearance poses": posed(library.apart, library.model),
        "clearance pairs": lambda _, threads: each_alone(lambda couple: list(map(library.shape, couple)),
                                                         lambda made: library.apart(*made)),
        "tree": lambda mesh, threads: Prepared(lambda _: library.model(mesh), answer=lambda _: None),
    }  # fmt: skip
