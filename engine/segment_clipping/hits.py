"""Public: where segments and rays meet a surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from fractions import Fraction
from typing import Any, ClassVar, Final, Literal, NamedTuple

import numpy as np

from engine.compiling.jit import entry_of
from engine.errors import InvalidOperationError
from engine.predicates.rational import nearest_float
from engine.running.budget import Budget, Cancel, reading
from engine.running.joining import join_columns
from engine.running.parallel import Progress, check_options, run_chunks
from engine.segment_clipping import hit_rows
from engine.segment_clipping.exact_hits import ExactHit, exact_hits, exact_normal, near_elements
from engine.segment_clipping.hit_contacts import fill_normals
from engine.segment_clipping.hit_rows import Rows
from engine.segment_clipping.hit_search import ALL, ANY, FIRST, MET, NEAR, find_hits
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, boundary_of
from engine.solids.accepted import LinesLike, SolidLike
from engine.solids.checks import as_point_groups, shown
from engine.solids.columns import Columns
from engine.solids.mesh import Polyhedron, Surface
from engine.solids.registry import refused, row_of
from engine.solids.shapes import as_solid
from engine.types import OPEN, Accuracy, BoolArray, FlagArray, FloatArray, Int8Array, IntArray, read_only

Keep = Literal["all", "first", "any"]
_KEEPS: Final = {"all": ALL, "first": FIRST, "any": ANY}
_FEW: Final = 256
"""Lines that are searched for at once, without a measure of time."""
_ROOM: Final = 128
_BYTES: Final = 400
"""Memory counted for a hit, in its part and joined."""
_NO_LINES: Final = read_only(np.zeros((0, 4, 3)))
_NO_BLURS: Final = read_only(np.zeros(0))
ASIDE: Final = np.array([0.53, 0.46, 0.71], np.float32)
"""A direction along which a ray leaves most bodies soon, across no plane that many of them have."""
_IDENTITY: Final = read_only(np.vstack([np.eye(4, 3), ASIDE, ASIDE, np.zeros((2, 3))]))
NO_FRAME: Final = read_only(np.zeros((0, 7)))


class Lines(NamedTuple):
    """Lines as `find_hits` reads them, and a function that gives the exact start and vector of one."""

    rows: FloatArray
    placed: FloatArray
    blurs: FloatArray
    is_ray: bool
    pose: FloatArray
    exact: Callable[[int], tuple[Any, Any]]

    def part(self, rows: IntArray) -> Lines:
        """Return what kernels read of some of the lines."""
        some = rows if len(self.placed) else slice(None)
        placed, blurs = read_only(self.placed[some]), read_only(self.blurs[some])
        return self._replace(rows=read_only(self.rows[rows]), placed=placed, blurs=blurs)


class HitKind(IntEnum):
    """How a line and a surface meet in a hit; the first line that is true, from the bottom, decides."""

    ACROSS = hit_rows.ACROSS
    """A point where the line changes sides: moved by infinitesimals, it crosses an odd number of triangles there."""
    TOUCH = hit_rows.TOUCH
    """A point where it crosses an even number: a corner or an edge seen from outside, two coincident sheets."""
    RIM = hit_rows.RIM
    """A point on a rim: a side whose pair of corners, by coordinates, an odd number of triangles has."""
    END = hit_rows.END
    """A point at the start of the line, or at the far end of a segment."""
    ALONG = hit_rows.ALONG
    """A stretch longer than a point: the line runs in a face, or along an edge."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Hits(Columns):
    """The hits of a batch of lines, by source and then by t.

    Attributes
    ----------
    source : ndarray of int64, shape (m,)
        The segment or ray of each hit.
    t, t_end : ndarray of float64, shape (m,)
        The parameters at which it begins and ends, each the nearest double; equal but for ALONG.
    face, triangle : ndarray of int64, shape (m,)
        At t: the face as given with the smallest number, and its triangle, a row of ``surface.triangles``; faces in
        whose plane the line runs, or without area, only if there is no other.
    kind : ndarray of int8, shape (m,)
        See `HitKind`.
    barycentric : ndarray of float64, shape (m, 3)
        Weights of the triangle's corners at t, each the nearest double, so they need not add up to 1.
    normal : ndarray of float64, shape (m, 3)
        Unit normal of the triangle, each component the nearest double.
    """

    _rows: ClassVar[str] = "hits"
    source: IntArray
    t: FloatArray
    t_end: FloatArray
    face: IntArray
    triangle: IntArray
    kind: Int8Array
    barycentric: FloatArray
    normal: FloatArray


class Target(NamedTuple):
    """A mesh, the sides of its triangles that are rims, as bits, and its unit normals, NaN where they are open."""

    mesh: Mesh
    rims: FlagArray
    normals: FloatArray


def hits(
    segments: LinesLike,
    surface: SolidLike,
    *,
    rays: bool = False,
    keep: Keep = "all",
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Any:
    """Find where segments or rays meet a surface, with face, normal and barycentrics.

    Parameters
    ----------
    segments : array_like, shape (n, 2, 3)
        Two points each; with ``rays=True`` origin and direction of half-lines. May be empty.
    surface : Solid
        A surface, or a polyhedron, of which the boundary is meant.
    rays : bool, optional
        A ray has no far end, and t counts lengths of its direction.
    keep : {"all", "first", "any"}
        "first": of each line the first hit; "any": whether there is one. These end as soon as the answer is certain.
    workers, deadline, cancel, progress, report
        As for `locate`; progress counts lines.

    Returns
    -------
    Hits
        With "any" an ndarray of bool, shape (n,); with ``report=True`` a pair of the answer and an `Accuracy`.

    Raises
    ------
    UnsupportedSolidError, InvalidArrayError, WrongDimensionError, NotFiniteError, InvalidOperationError
        For arguments that break a rule.
    NotRepresentableError
        The parameter of a ray is beyond the largest float64.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    A hit is a maximal connected common part of line and surface: an edge or a vertex that is met is one hit, so are
    coincident sheets, and a stretch within faces with all that meets it. `kind` says how (`HitKind`).

    Normals follow the order of a face's corners, not the line: they point to the side from which that order is
    counter-clockwise, which is the outside of a polyhedron. A face without area has the normal zero, and barycentrics
    on its first side that has the point.

    Degenerate input: a segment of no length, or a ray without direction, is a point: one END at t = 0 if it lies on the
    surface.

    Accuracy: decisions exact for every finite input; numbers are nearest doubles, each on its own, zero as +0.0.

    Cost: a tree, unit normals and rims are prepared once, then O(log faces + hits) a line. A face along which a line
    runs takes some 1 us, under poses 3 us; faces without area and numbers beyond 2^120 rationals, some 0.2 ms.

    References
    ----------
    Moller, Trumbore, Fast, minimum storage ray/triangle intersection, 1997; Wald, Benthin, Boulos, Getting rid of
    packets, 2008.

    Examples
    --------
    >>> from engine import Surface
    >>> roof = Surface([[0, 0, 1], [4, 0, 1], [0, 4, 1]], [[0, 1, 2]])
    >>> met = hits([[[1, 1, 3], [0, 0, -1]], [[0, 1, 3], [0, 0, -1]]], roof, rays=True)
    >>> met.t.tolist(), [HitKind(kind).name for kind in met.kind], met.barycentric.tolist(), met.normal[0].tolist()
    ([2.0, 2.0], ['ACROSS', 'RIM'], [[0.5, 0.25, 0.25], [0.75, 0.0, 0.25]], [0.0, 0.0, 1.0])
    """
    check_options(workers, progress, report=report, rays=rays)
    code = code_of_keep(keep)
    with reading(deadline, cancel) as reader:
        solid = as_solid(surface, "surface")
        make = row_of(solid).hits
        if make is None:
            raise refused(solid, "hits does not take", lambda row: row.hits, where=("surface",))
        lines = read_only(as_point_groups(segments, 2, 3, ("segments",)))
    with Budget(reader.left(), cancel, workers) as budget:
        target = make(solid, budget)
        columns, left = find(plain_lines(lines, rays), target, code, budget, workers, progress)
        answer = columns if code == ANY else with_faces(columns, target, target.normals[columns[3]], budget)
    return (answer, Accuracy("exact", 0.5, len(lines), len(left), len(left), "ordered_tree")) if report else answer


def code_of_keep(keep: object) -> int:
    """Return the code of `keep`. Raises: InvalidOperationError."""
    if not isinstance(keep, str) or keep not in _KEEPS:
        raise InvalidOperationError(f"keep must be all, first or any, got {shown(keep)}", ("keep",))
    return _KEEPS[keep]


def on_mesh(solid: Polyhedron | Surface, budget: Budget) -> Target:
    """Return what hits on a mesh need, built at first use."""

    def build() -> Target:
        mesh: Any = boundary_of(solid)
        rims, normals = np.zeros(len(mesh.elements), np.uint8), np.empty((len(mesh.elements), 3))
        entry_of(fill_normals)(mesh.elements, NO_FRAME, budget.flag, normals)
        budget.check()
        if isinstance(solid, Surface):
            low, high = np.sort(np.stack([solid.triangles, np.roll(solid.triangles, -1, 1)]), axis=0).reshape(2, -1)
            _, place, counts = np.unique(low * len(solid.vertices) + high, return_inverse=True, return_counts=True)
            are_odd = ((counts % 2 == 1)[place.ravel()] & (low != high)).reshape(-1, 3)
            rims = (are_odd * np.array([1, 2, 4])).sum(axis=1).astype(np.uint8)
        return Target(mesh, read_only(rims), read_only(normals))

    return solid.prepared("hits", build, budget.check)


def plain_lines(lines: FloatArray, is_ray: bool) -> Lines:
    """Return lines (n, 2, 3) without a pose."""

    def exact(item: int) -> tuple[Any, Any]:
        p, q = lines[item].tolist()
        return p, q if is_ray else [Fraction(y) - Fraction(x) for x, y in zip(p, q)]

    return Lines(lines, _NO_LINES, _NO_BLURS, is_ray, _IDENTITY, exact)


def search(
    lines: Lines, target: Target, keep: int, budget: Budget, workers: int | None, progress: Progress | None = None
) -> tuple[Rows, FlagArray]:
    """Return the hits that the kernel decides, and the state of each line (`find_hits`)."""
    arrays, is_ray, pose, _ = lines[:3], *lines[3:]
    n, parts, state = len(arrays[0]), dict[int, list[Rows]](), np.empty(len(arrays[0]), np.uint8)

    def task(first: int, last: int) -> None:
        parts[first], reached, room = [], np.array([0, 0, 0]), _ROOM
        while reached[0] < last - first:  # bound: each turn takes a line, or has twice the room
            before, m = reached[0], room + (last - first if keep != ANY else 0)
            out = Rows(
                np.empty(m, np.int64),
                np.empty(m),
                np.empty(m),
                np.empty(m, np.int64),
                np.empty(m, np.int8),
                np.empty((m, 3)),
            )
            entry_of(find_hits)(
                *(arrays if last - first == n else [array[first:last] for array in arrays]), is_ray, pose, target.mesh,
                target.rims, keep, room, budget.flag, out, state[first:last], reached,
            )  # fmt: skip
            budget.check()
            rows = int(reached[1])
            budget.take(_BYTES * rows)
            part = Rows(*(column[:rows] for column in out))
            if first:
                part.source[:] += first
            parts[first].append(part)
            room *= 2 if reached[0] == before else 1

    if 0 < n <= _FEW and progress is None:
        task(0, n)
    else:
        run_chunks(task, n, budget=budget, workers=workers, progress=progress, first_chunk=_FEW)
    every = [part for first in sorted(parts) for part in parts[first]]
    if not every:
        none, whole = np.zeros(0), np.zeros(0, np.int64)
        return Rows(whole, none, none, whole, np.zeros(0, np.int8), np.zeros((0, 3))), state
    return Rows(*join_columns(every, budget, workers)), state


def find(
    lines: Lines, target: Target, keep: int, budget: Budget, workers: int | None, progress: Progress | None = None
) -> tuple[Any, IntArray]:
    """Return (source, t, t_end, triangle, kind, barycentric), with ANY bools, and the lines that took the exact
    fallback."""
    columns, state = search(lines, target, keep, budget, workers, progress)
    left = np.flatnonzero(state == OPEN)
    exact = exact_on(lines, left, target, budget) if len(left) else {}
    if keep == ANY:
        answer: BoolArray = state == MET
        answer[left] = [bool(exact[item]) for item in left.tolist()]
        return answer, left
    if not len(left):
        return [*columns], left
    more = columns_of([(item, each) for item, hits in exact.items() for each in hits[: 1 if keep == FIRST else None]])
    joint = [np.concatenate(pair) for pair in zip(columns, more)]
    order = np.argsort(joint[0], kind="stable")
    return [column[order] for column in joint], left


def columns_of(rows: list[tuple[int, ExactHit]]) -> list[Any]:
    """Return exact hits with their sources as columns (source, t, t_end, triangle, kind, barycentric)."""
    return [
        np.array([item for item, _ in rows], np.int64),
        np.array([nearest_float(each.t) for _, each in rows], np.float64),
        np.array([nearest_float(each.t_end) for _, each in rows], np.float64),
        np.array([each.triangle for _, each in rows], np.int64),
        np.array([each.kind for _, each in rows], np.int8),
        np.array([[nearest_float(x) for x in each.weights] for _, each in rows], np.float64).reshape(-1, 3),
    ]


def exact_on(lines: Lines, items: IntArray, target: Target, budget: Budget) -> dict[int, list[ExactHit]]:
    """Return the exact hits of each of some lines."""
    near, state = search(lines.part(items), target, NEAR, budget, 1)
    starts, exact = np.searchsorted(near.source, np.arange(len(items) + 1)).tolist(), {}
    for place, item in enumerate(items.tolist()):
        budget.check()
        p, way = lines.exact(item)
        some = near.triangle[starts[place] : starts[place + 1]]
        if state[place] == OPEN:
            some = near_elements(target.mesh.elements, p, way, lines.is_ray)
        exact[item] = exact_hits(p, way, lines.is_ray, target.mesh, target.rims, some, budget.check)
        budget.take(_BYTES * len(exact[item]))
    return exact


def with_faces(
    columns: Any, target: Target, normal: FloatArray, budget: Budget,
    image: Callable[[Any], Any] = lambda corners: corners,
) -> Hits:  # fmt: skip
    """Return hits with the faces of their triangles and their unit normals (m, 3), of which rows of NaN are computed
    exactly. image: of the corners of a triangle."""
    source, t, t_end, triangle, kind, barycentric = columns
    are_open = np.isnan(normal[:, 0])
    for each in {*triangle[are_open].tolist()} if are_open.any() else ():
        budget.check()
        normal[triangle == each] = exact_normal(image(target.mesh.elements[each].tolist()))
    return Hits(source, t, t_end, target.mesh.faces[triangle], triangle, kind, barycentric, normal)
