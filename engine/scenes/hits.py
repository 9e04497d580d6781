"""Hits of segments and rays on the bodies of a scene; in a body's own frame where it has a pose."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any, ClassVar, Final

import numpy as np

from engine.compiling.jit import entry_of, kernel
from engine.containment.methods.rational_locate import to_body_frame, to_world_frame
from engine.errors import UnsupportedSolidError
from engine.predicates.error_free import U2, two_diff
from engine.predicates.expansion import LARGEST, SMALLEST
from engine.running.budget import Budget, Cancel, reading
from engine.running.joining import join_columns
from engine.running.parallel import Progress, check_options
from engine.scenes.near_boxes import near_pairs, scratch_for
from engine.scenes.placements import Placements
from engine.scenes.posed_cut import _turned
from engine.scenes.table import frame_of
from engine.segment_clipping import hits as on_one
from engine.segment_clipping.hit_contacts import fill_normals
from engine.segment_clipping.hit_search import ANY, FIRST
from engine.segment_clipping.hits import ASIDE, Hits, Keep, Lines, Target, code_of_keep, find, plain_lines
from engine.solids.checks import as_point_groups
from engine.solids.columns import Columns
from engine.solids.pose import Pose
from engine.solids.ragged import run_offsets
from engine.solids.registry import refused, row_of
from engine.types import Accuracy, FloatArray, Int8Array, IntArray, read_only

_PAIRS: Final = 1 << 18
"""Pairs of lines and bodies that are looked at together."""
_BYTES_OF_PAIR: Final = 40


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SceneHits(Columns):
    """The hits of lines on the bodies of a scene, by source, then by t, then by body; columns as in `Hits`.

    Attributes
    ----------
    source, body : ndarray of int64, shape (m,)
        The line and the body of each hit.
    t, t_end, face, triangle, kind, barycentric, normal : ndarray
        As in `Hits`; normals under the body's pose.
    """

    _rows: ClassVar[str] = "hits"
    source: IntArray
    body: IntArray
    t: FloatArray
    t_end: FloatArray
    face: IntArray
    triangle: IntArray
    kind: Int8Array
    barycentric: FloatArray
    normal: FloatArray


def hits(
    self: Any,
    segments: object,
    *,
    rays: bool = False,
    keep: Keep = "all",
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Any:
    """Find where segments or rays meet the surfaces of the bodies; as `engine.hits`, under poses.

    Parameters
    ----------
    segments, rays, keep, workers, deadline, cancel, progress, report
        As for `engine.hits`. "first": of hits that begin at one point that of the first body.

    Returns
    -------
    SceneHits
        With "any" an ndarray of bool, shape (n,); with ``report=True`` a pair of the answer and an `Accuracy`.

    Raises
    ------
    UnsupportedSolidError
        A body that is no surface or polyhedron.
    EngineError
        As `engine.hits`.
    """
    check_options(workers, progress, report=report, rays=rays)
    code, scene = code_of_keep(keep), self._placements
    with reading(deadline, cancel) as reader:
        lines = plain_lines(read_only(as_point_groups(segments, 2, 3, ("segments",))), rays)
    with Budget(reader.left(), cancel, workers) as budget:
        answer, n_open = _on_bodies(lines, scene, code, budget, workers)
    if progress is not None and len(lines.rows):
        progress(len(lines.rows))
    n = len(lines.rows)
    return (answer, Accuracy("exact", 0.5, n, n_open, n_open, "body_boxes")) if report else answer


def _on_bodies(lines: Lines, scene: Placements, keep: int, budget: Budget, workers: int | None) -> tuple[Any, int]:
    """Return the hits of all lines, with ANY bools, and how many lines took the exact fallback."""
    for body, solid in enumerate(scene.base.solids):
        if row_of(solid).hits is None:
            error = refused(solid, "hits does not take", lambda row: row.hits)
            raise UnsupportedSolidError(f"solids[{body}]: {error.message}", ("solids", body))
    met, is_open = (np.zeros(len(lines.rows), np.bool_) for _ in range(2))
    merged = list[SceneHits]()
    for near, groups in _near(lines, scene, budget):
        parts, bodies, starts = list[Hits](), list[IntArray](), dict[int, Any]()
        for rows in groups:
            body, items = int(near[rows[0], 1]), near[rows, 0]
            items = items[~met[items]]
            if not len(items):
                continue
            solid, pose = scene.placed(body)
            make: Any = row_of(solid).hits
            target, some = make(solid, budget), lines_on(lines, items, pose)
            columns, left = find(some, target, keep, budget, workers)
            is_open[items[left]] = True
            if keep == ANY:
                met[items[columns]] = True
                continue
            hits = _with_faces(columns, target, pose, budget)
            hits.source[:] = items[hits.source]
            parts.append(hits)
            bodies.append(np.full(len(hits), body))
            starts[body] = partial(_exact_start, some, items, target, budget)
        if parts:
            merged.append(_merged(parts, bodies, starts, keep))
    n_open = int(is_open.sum())
    if keep == ANY:
        return met, n_open
    columns = [[getattr(each, name) for name in SceneHits.__slots__] for each in merged or [_merged([], [], {}, keep)]]
    return SceneHits(*join_columns(columns, budget, workers)), n_open


def _near(lines: Lines, scene: Placements, budget: Budget) -> Iterator[tuple[IntArray, list[IntArray]]]:
    """Yield, for some lines after others, rows (line, body) of bodies whose boxes a line may meet, and the rows of each
    body in turn, its lines in order."""
    n = np.zeros(2, np.int64)
    if not len(scene.base.solids):
        return
    words, scratch = scene.words(budget), scratch_for(scene.n_rows)
    while n[0] < len(lines.rows):  # bound: each turn takes a line at least
        room = min(max(_PAIRS, scene.n_rows), scene.n_rows * (len(lines.rows) - int(n[0])))
        budget.take(_BYTES_OF_PAIR * room)
        pairs = np.empty((room, 2), np.int64)
        entry_of(near_pairs)(lines.rows, lines.is_ray, words, scratch, budget.flag, pairs, n)
        budget.check()
        near = pairs[: n[1]]
        near[:, 1] = scene.names_of(near[:, 1])
        order = np.argsort(near[:, 1], kind="stable")
        yield near, np.split(order, run_offsets(near[order, 1])[1:-1]) if len(near) else []
        budget.take(-_BYTES_OF_PAIR * room)


def lines_on(lines: Lines, items: IntArray, pose: Pose | None) -> Lines:
    """Return some lines in the frame of a body."""
    rows = read_only(lines.rows[items])
    if pose is None:
        return plain_lines(rows, lines.is_ray)

    def exact(item: int) -> tuple[Any, Any]:
        p, q = rows[item].tolist()
        end = [Fraction(x) + Fraction(y) for x, y in zip(p, q)] if lines.is_ray else q
        start = to_body_frame(p, pose)
        return start, [y - x for x, y in zip(start, to_body_frame(end, pose))]

    frame, n = frame_of(pose), len(rows)
    placed, blurs, way = np.zeros((n + 1, 4, 3)), np.full(n + 1, np.inf), (pose.rotation @ ASIDE).astype(np.float32)
    if frame is not None:  # else: numbers out of range, which stay open
        entry_of(to_frame)(rows, lines.is_ray, way.astype(np.float64), frame, placed, blurs)
    # a ray aside: its vector, the same in the frame, the bound, and the tail
    numbers = [*pose.rotation, pose.translation, way, placed[n, 1], np.full(3, blurs[n]), placed[n, 3]]
    return Lines(rows, read_only(placed[:n]), read_only(blurs[:n]), lines.is_ray, read_only(np.array(numbers)), exact)


def _with_faces(columns: Any, target: Target, pose: Pose | None, budget: Budget) -> Hits:
    """Return hits on a body with faces and unit normals under its pose."""
    if pose is None:
        return on_one.with_faces(columns, target, target.normals[columns[3]], budget)
    frame, (triangles, rows) = frame_of(pose), np.unique(columns[3], return_inverse=True)
    normals = np.full((len(triangles), 3), np.nan)
    if frame is not None:
        elements = read_only(target.mesh.elements[triangles])
        entry_of(fill_normals)(elements, frame, budget.flag, normals)
        budget.check()
    return on_one.with_faces(
        columns, target, normals[rows.ravel()], budget, lambda corners: [to_world_frame(x, pose) for x in corners]
    )


def _exact_start(
    lines: Lines, items: IntArray, target: Target, budget: Budget, source: int, triangle: int, t: float
) -> Fraction:
    """Return the exact parameter of a hit on a body, given its source, triangle and nearest double; items: the source
    of each line."""
    place = np.searchsorted(items, [source])
    (hits,) = on_one.exact_on(lines, place, target, budget).values()
    return min((each.t for each in hits if each.triangle == triangle), key=lambda at: abs(at - Fraction(t)))


def _merged(parts: list[Hits], bodies: list[IntArray], starts: dict[int, Any], keep: int) -> SceneHits:
    """Return the hits on all bodies, by source, then t, then body; with keep FIRST only the first of each source.
    parts, bodies: for each body that was searched its hits, and its number once for each of them. starts: by body a
    function (source, triangle, t) that gives the exact parameter of a hit, called where parameters round alike."""
    if not parts:
        none, three, whole = np.zeros(0), np.zeros((0, 3)), np.zeros(0, np.int64)
        return SceneHits(whole, whole, none, none, whole, whole, np.zeros(0, np.int8), three, three)
    source, *others = (np.concatenate([getattr(part, name) for part in parts]) for name in Hits.__slots__)
    body, t, triangle = np.concatenate(bodies), others[0], others[3]
    order = np.lexsort((body, t, source))
    ties = np.flatnonzero((source[order][1:] == source[order][:-1]) & (t[order][1:] == t[order][:-1]))
    exact = {
        row: starts[body[row]](int(source[row]), int(triangle[row]), float(t[row]))
        for row in order[np.union1d(ties, ties + 1)].tolist()
    }
    if exact:
        ranked = sorted(order.tolist(), key=lambda row: (source[row], t[row], exact.get(row, 0), body[row]))
        order = np.array(ranked, np.int64)
    if keep == FIRST:
        order = order[run_offsets(source[order])[:-1]]
    return SceneHits(source[order], body[order], *(column[order] for column in others))


@kernel
def to_frame(
    lines: FloatArray, is_ray: bool, aside: FloatArray, frame: FloatArray, placed: FloatArray, blurs: FloatArray
) -> None:
    """Set placed (n + 1, 4, 3) to the start and the vector of lines (n, 2, 3) in the frame (3, 7) of a pose, heads and
    tails of double-doubles, the last to those of a ray along `aside` (3,), and blurs (n + 1,) to a bound on the error
    of their coordinates, infinite where they are out of range. Tiny ones may underflow: far below the bound."""
    n = lines.shape[0]
    for i in range(n + 1):
        p, q = lines[max(i - 1, 0), 0], aside
        if i < n:
            p, q = lines[i, 0], lines[i, 1]
        at, blur = _turned(frame, (
            two_diff(p[0], frame[0, 6]), two_diff(p[1], frame[1, 6]), two_diff(p[2], frame[2, 6])
        ))  # fmt: skip
        way = (q[0], 0.0), (q[1], 0.0), (q[2], 0.0)
        if not is_ray and i < n:
            way = two_diff(q[0], p[0]), two_diff(q[1], p[1]), two_diff(q[2], p[2])
        along, along_blur = _turned(frame, way)
        size = max(abs(at[0][0]), abs(at[1][0]), abs(at[2][0]), abs(along[0][0]), abs(along[1][0]), abs(along[2][0]))
        blurs[i] = max(blur, along_blur) + 8.0 * U2 * size if SMALLEST <= size <= LARGEST else np.inf
        for k in range(3):
            placed[i, 0, k], placed[i, 2, k] = at[k]
            placed[i, 1, k], placed[i, 3, k] = along[k]
