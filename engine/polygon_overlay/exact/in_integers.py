"""The overlay in Python integers: right for every input, and slow; for what the compiled one leaves open.

subject + clip  ->  arrangement  ->  faces with two labels  ->  faces kept  ->  rings  ->  doubles
    (floats)         (exact)             (exact)                 (a table)      (exact)    (rounded, made valid)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal, TypeVar

import numpy as np
import numpy.typing as npt

from engine.arrangement.arrange import arrange_rings
from engine.arrangement.exact_area import ExactRings
from engine.arrangement.nodes import NodeTable
from engine.arrangement.rings import Piece, trace_pieces
from engine.arrangement.subdivision import label_faces, subdivide
from engine.parallel import Budget
from engine.polygon_overlay.exact.rounding import Rounded, count_changes, round_to_nearest, round_to_valid
from engine.polygon_overlay.implicit_rings import RingArrays
from engine.polygon_overlay.result import Collapse, Overlay
from engine.polygon_overlay.run import KEPT, Operation, Output

Scalar = TypeVar("Scalar", bound=np.generic)

_SUBJECT: Final = 1
_CLIP: Final = 2


def overlay_exactly(
    subject: RingArrays, clip: RingArrays, operation: Operation, output: Output, budget: Budget
) -> tuple[Overlay, int]:
    """Return the overlay of checked rings (either may be empty), and how many pairs of edges the filter left open."""
    offsets = [*subject.offsets.tolist(), *(clip.offsets[1:] + len(subject.vertices)).tolist()]
    masks = [_SUBJECT] * (len(subject.offsets) - 1) + [_CLIP] * (len(clip.offsets) - 1)
    arrangement = arrange_rings(np.concatenate([subject.vertices, clip.vertices]), offsets, masks, budget)
    subdivision = subdivide(arrangement, budget)
    kept = KEPT[operation]
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
