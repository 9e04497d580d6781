"""Polygon on polygon: intersection, union, difference and symmetric difference, concave on concave, with holes.

    subject + clip  ->  arrangement  ->  faces with two labels  ->  faces kept  ->  rings  ->  doubles
        (floats)         (exact)             (exact)                 (a table)      (exact)    (rounded, made valid)

All rings of both polygons are split where they meet. Each face of that arrangement is known to lie in the subject or
not, in the clip or not (even-odd over the polygon's rings); the operation is a table over these two. Edges between a
kept face and one that is not bound the result. Decisions end there: rounding only moves vertices, and where it would
make rings invalid the rounded rings are arranged once more (overlay_rounding.py).

Sources: the textbook's exercise on clipping a polygon by a concave one; exact arrangements as in D. Halperin and
M. Sharir, Arrangements, Handbook of Discrete and Computational Geometry, 2018.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, TypeVar, overload

import numpy as np
import numpy.typing as npt

from engine.arrangement.arrange import arrange_rings
from engine.arrangement.exact_area import ExactRings
from engine.arrangement.nodes import NodeTable
from engine.arrangement.rings import Piece, trace_pieces
from engine.arrangement.subdivision import label_faces, subdivide
from engine.clipping.overlay_result import Collapse, Overlay
from engine.clipping.overlay_rounding import Rounded, count_changes, round_to_nearest, round_to_valid
from engine.errors import InvalidArrayError, InvalidOperationError, UnsupportedSolidError
from engine.parallel import Budget, Cancel, Progress, check_options, run_chunks
from engine.solids.base import Solid
from engine.solids.checks import shown
from engine.solids.polygon import Polygon
from engine.types import Accuracy

Operation = Literal["intersection", "union", "difference", "symmetric_difference"]
Output = Literal["valid", "nearest"]

Scalar = TypeVar("Scalar", bound=np.generic)

_SUBJECT, _CLIP = 1, 2
_KEPT: Final = {  # by the label of a face: in neither, in the subject, in the clip, in both
    "intersection": (False, False, False, True),
    "union": (False, True, True, True),
    "difference": (False, True, False, False),
    "symmetric_difference": (False, True, True, False),
}
_OUTPUTS: Final = ("valid", "nearest")


@dataclass(frozen=True, slots=True)
class RingArrays:
    """Rings as arrays: vertices (n, 2) float64 and where each ring begins, (n_rings + 1,) int64; may be empty."""

    vertices: npt.NDArray[np.float64]
    offsets: npt.NDArray[np.int64]


@overload
def overlay(
    subject: Solid,
    clip: Solid,
    operation: Operation = ...,
    *,
    output: Output = ...,
    workers: int | None = ...,
    deadline: float | None = ...,
    cancel: Cancel | None = ...,
    progress: Progress | None = ...,
    report: Literal[False] = ...,
) -> Overlay: ...


@overload
def overlay(
    subject: Solid,
    clip: Solid,
    operation: Operation = ...,
    *,
    output: Output = ...,
    workers: int | None = ...,
    deadline: float | None = ...,
    cancel: Cancel | None = ...,
    progress: Progress | None = ...,
    report: Literal[True],
) -> tuple[Overlay, Accuracy]: ...


def overlay(
    subject: Solid,
    clip: Solid,
    operation: Operation = "intersection",
    *,
    output: Output = "valid",
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Overlay | tuple[Overlay, Accuracy]:
    """Combine two polygons; the result is separate pieces with holes.

    An exact arrangement of both boundaries: nothing is assumed of the rings, which may cross, touch, overlap, repeat or
    have no area. For a convex region, a connected result and 3D there is `clip_polygons`.

    Parameters: subject, clip: `Polygon`, even-odd over all rings. operation: "intersection", "union", "difference"
    (subject without clip) or "symmetric_difference". output: "valid" (default): simple rings that cross nowhere, holes
    inside their shells; "nearest": every vertex the correctly rounded one and no more, which may be invalid. deadline
    in seconds; cancel: a switch for other threads; workers is accepted and not used, one overlay runs in one thread;
    progress is called with 1 at the end.
    Returns: `Overlay`; with report=True also an `Accuracy`, whose items are the edges of the input, and whose
    coordinates_ulp is 0.5 unless vertices were moved to keep rings valid: then it is the largest displacement in units
    in the last place of the largest coordinate.
    Boundary: pieces are the connected parts of the open interior. Parts that meet in one point are separate, a hole
    that touches its shell in a point stays a hole, walls between parts, spikes and shared edges vanish.
    Degenerate input: rings without area add nothing; an empty result has no pieces. Vertices on a straight stretch of
    the result's boundary are left out unless rings meet there, so equal point sets give equal rings.
    Accuracy: topology, counts and area are those of exact arithmetic for every finite input. Rounding may move, join,
    part or lose pieces: the result tells which (`collapsed`, `pieces_joined`, ...) and how far edges moved.
    Cost: n log n for n edges, plus pairs of edges whose extents overlap in x, plus some 10 us per crossing.
    Raises: UnsupportedSolidError, InvalidOperationError, DeadlineExceededError, CancelledError.

    >>> from engine import Polygon, overlay
    >>> result = overlay(Polygon([[(0, 0), (4, 0), (4, 4), (0, 4)]]), Polygon([[(2, 2), (6, 2), (6, 6), (2, 6)]]))
    >>> result.area, result.pieces[0].shell.tolist()
    (4.0, [[2.0, 2.0], [4.0, 2.0], [4.0, 4.0], [2.0, 4.0]])
    """
    _check_options(operation, output)
    rings = [_rings_of(solid, name) for solid, name in ((subject, "subject"), (clip, "clip"))]
    check_options(workers, progress)
    with Budget(deadline, cancel) as budget:
        budget.check()
        result, n_exact = overlay_rings(rings[0], rings[1], operation, output, budget)
    if progress is not None:
        progress(1)
    if not report:
        return result
    n_edges = sum(len(each.vertices) for each in rings)
    return result, _accuracy([result], n_edges, n_exact)


@dataclass(frozen=True, slots=True)
class OverlayBatch:
    """Results of many overlays.

    overlays: one for each pair; None where its status is not 0.
    status: (n_pairs,) int8; 0 done. No other value is in use: every pair of polygons has a result.
    """

    overlays: tuple[Overlay | None, ...]
    status: npt.NDArray[np.int8]


def overlay_batch(
    subjects: Sequence[Solid],
    clips: Sequence[Solid],
    operation: Operation = "intersection",
    *,
    output: Output = "valid",
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> OverlayBatch | tuple[OverlayBatch, Accuracy]:
    """Combine pairs of polygons, subjects[i] with clips[i]; the options are those of `overlay`.

    Returns: `OverlayBatch`, in the order of the pairs; with report=True also one `Accuracy` for all.
    Raises: as `overlay`, and InvalidArrayError where the lengths differ. Every solid is checked before the first is
    overlaid.
    """
    _check_options(operation, output)
    for solids, name in ((subjects, "subjects"), (clips, "clips")):
        if not isinstance(solids, (list, tuple)):
            raise InvalidArrayError(f"{name} must be a list of polygons, got {type(solids).__name__}", (name,))
    if len(subjects) != len(clips):
        raise InvalidArrayError(
            f"subjects and clips must be of equal length, got {len(subjects)} and {len(clips)}", ("clips",)
        )
    lefts = [_rings_of(solid, "subjects", i_pair) for i_pair, solid in enumerate(subjects)]
    rights = [_rings_of(solid, "clips", i_pair) for i_pair, solid in enumerate(clips)]
    results: list[Overlay | None] = [None] * len(lefts)
    n_exact = [0] * len(lefts)
    with Budget(deadline, cancel) as budget:

        def task(start: int, stop: int) -> None:
            for pair in range(start, stop):
                budget.check()
                results[pair], n_exact[pair] = overlay_rings(lefts[pair], rights[pair], operation, output, budget)

        run_chunks(task, len(lefts), budget=budget, first_chunk=1, workers=workers, progress=progress)
    batch = OverlayBatch(tuple(results), np.zeros(len(lefts), np.int8))
    if not report:
        return batch
    n_edges = sum(len(each.vertices) for each in (*lefts, *rights))
    return batch, _accuracy([result for result in results if result is not None], n_edges, sum(n_exact))


def _check_options(operation: str, output: str) -> None:
    for value, known, name in ((operation, _KEPT, "operation"), (output, _OUTPUTS, "output")):
        if not isinstance(value, str) or value not in known:
            raise InvalidOperationError(f"{name} must be one of {', '.join(known)}; got {shown(value)}", (name,))


def _rings_of(solid: object, *where: str | int) -> RingArrays:
    """Return the rings of a polygon; refuse anything else."""
    if not isinstance(solid, Polygon):
        kind = solid.type if isinstance(solid, Solid) else type(solid).__name__
        raise UnsupportedSolidError(
            f"overlay takes polygons (2D), got {kind!r}; give its outline as a polygon, or use clip_polygons to cut "
            "polygons by a half_space, aabb or convex",
            where,
        )
    return RingArrays(solid.vertices, solid.ring_offsets)


def overlay_rings(
    subject: RingArrays, clip: RingArrays, operation: Operation, output: Output, budget: Budget
) -> tuple[Overlay, int]:
    """Return the overlay of checked rings (either may be empty), and how many pairs of edges the filter left open."""
    offsets = [*subject.offsets.tolist(), *(clip.offsets[1:] + len(subject.vertices)).tolist()]
    masks = [_SUBJECT] * (len(subject.offsets) - 1) + [_CLIP] * (len(clip.offsets) - 1)
    arrangement = arrange_rings(np.concatenate([subject.vertices, clip.vertices]), offsets, masks, budget)
    subdivision = subdivide(arrangement, budget)
    kept = _KEPT[operation]
    inside = [kept[label] for label in label_faces(subdivision)]
    pieces = trace_pieces(subdivision, inside, [0] * subdivision.n_faces, budget)
    nodes = arrangement.nodes
    if output == "valid":
        rounded = round_to_valid(nodes, pieces, budget)
    else:
        rounded = round_to_nearest(nodes, pieces)
    return _result(nodes, pieces, rounded, output), arrangement.n_exact


def _result(nodes: NodeTable, pieces: Sequence[Piece], rounded: Rounded, output: Output) -> Overlay:
    """Gather the exact pieces and the rounded ones into an `Overlay`."""
    exact_rings = [ring for piece in pieces for ring in (piece.shell, *piece.holes)]
    images = {(nodes.xs[node], nodes.ys[node]) for ring in exact_rings for node in ring}
    rings = [ring for piece in rounded.pieces for ring in piece]
    vertices = [vertex for ring in rings for vertex in ring]
    n_holes_exact = sum(len(piece.holes) for piece in pieces)
    lost_pieces, pieces_joined, pieces_parted = count_changes(len(pieces), rounded.piece_origins)
    lost_holes, holes_joined, holes_parted = count_changes(n_holes_exact, rounded.hole_origins)
    holes = [hole for piece in pieces for hole in piece.holes]
    collapsed = [_collapse(nodes, "piece", [pieces[k].shell, *pieces[k].holes]) for k in lost_pieces]
    collapsed += [_collapse(nodes, "hole", [holes[k]]) for k in lost_holes]
    return Overlay(
        vertices=_frozen(np.array(vertices, np.float64).reshape(-1, 2)),
        ring_offsets=_frozen(np.cumsum([0, *map(len, rings)], dtype=np.int64)),
        piece_offsets=_frozen(np.cumsum([0, *map(len, rounded.pieces)], dtype=np.int64)),
        output=output,
        may_be_invalid=output == "nearest" and rounded.displacement > 0.0,
        n_pieces_exact=len(pieces),
        n_holes_exact=n_holes_exact,
        collapsed=tuple(collapsed),
        pieces_joined=pieces_joined,
        pieces_parted=pieces_parted,
        holes_joined=holes_joined,
        holes_parted=holes_parted,
        rounds=rounded.rounds,
        vertices_moved=sum(vertex not in images for vertex in vertices),
        largest_displacement=rounded.displacement,
        snapped=rounded.snapped,
        exact=_exact(nodes, exact_rings),
    )


def _frozen(array: npt.NDArray[Scalar]) -> npt.NDArray[Scalar]:
    array.setflags(write=False)
    return array


def _exact(nodes: NodeTable, rings: Sequence[Sequence[int]]) -> ExactRings:
    return ExactRings(tuple(tuple(nodes.points[node] for node in ring) for ring in rings), nodes.exponent)


def _collapse(nodes: NodeTable, kind: Literal["piece", "hole"], rings: Sequence[Sequence[int]]) -> Collapse:
    first = rings[0][0]
    return Collapse(kind, abs(_exact(nodes, rings).area()), (nodes.xs[first], nodes.ys[first]))


def _accuracy(results: Sequence[Overlay], n_edges: int, n_exact: int) -> Accuracy:
    """Return the report of one or many overlays; the worst of them counts."""
    ulps = 0.5
    for result in results:
        if result.vertices_moved:
            ulps = max(ulps, result.largest_displacement / float(np.spacing(np.abs(result.vertices).max())))
    return Accuracy(
        decisions="exact",
        coordinates_ulp=ulps,
        n_items=n_edges,
        n_beyond_filter=n_exact,
        n_rational=n_exact,
        method="arrangement",
    )
