"""The overlay in Python integers, the exact fallback of the kernel: correct for every input, and slow.

The steps are those of overlay.py, the rules those of ring_nesting.py; a label is the set of sources (numbers) that a
face lies in.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from engine.arrangement.arrange import Arrangement, arrange_rings
from engine.arrangement.rings import ExactRings, Piece, trace_pieces
from engine.arrangement.subdivision import Subdivision, label_faces, subdivide
from engine.errors import TooComplexError
from engine.polygon_overlay.compiled.kernel import PairStatus
from engine.polygon_overlay.compiled.loading import RingArrays
from engine.polygon_overlay.compiled.ring_nesting import Nesting, Rule
from engine.polygon_overlay.grid import snapped_to_units
from engine.polygon_overlay.pair_arrays import PairResults, one_pair, ring_sizes
from engine.polygon_overlay.result import Overlay
from engine.polygon_overlay.rounds import make_valid_after_rounding
from engine.polygon_overlay.run import SELECTED, UNNAMED, Operation
from engine.running.budget import Budget, polled
from engine.types import FloatArray, IntArray

_Sources = frozenset[int]


def overlay_exactly(
    subject: RingArrays, clip: RingArrays, operation: Operation, budget: Budget, nesting: Nesting = UNNAMED,
    is_on_grid: bool = False,
) -> tuple[Overlay, int]:  # fmt: skip
    """Return the overlay of checked rings (either side may be empty), and the number of edge pairs decided exactly.
    nesting: fill rule, if not that of two polygons. is_on_grid: coordinates are in units of a grid; snap the result to
    integer points."""
    subdivision, inside = _label_arrangement(subject, clip, SELECTED[operation], budget, nesting)
    pieces = trace_pieces(subdivision, inside, [frozenset()] * subdivision.n_faces)
    result = valid_overlay(subdivision.arrangement, pieces, budget, is_on_grid)
    return replace(result, _starts=np.array([len(subject.vertices)])), subdivision.arrangement.n_exact


def valid_overlay(
    arrangement: Arrangement, pieces: Sequence[Piece], budget: Budget, is_on_grid: bool = False
) -> Overlay:
    """Return pieces of an arrangement, rounded and valid; is_on_grid: as for `overlay_exactly`."""
    nodes = arrangement.nodes
    corners = [[arrangement.origin(half_edge) for half_edge in ring] for ring in rings_of(pieces)]
    exact = ExactRings(tuple(tuple(nodes.points[node] for node in ring) for ring in corners), nodes.exponent)
    first = round_pieces(arrangement, pieces)
    moved = first.displacement
    first = first._replace(displacement=np.where(moved, np.nextafter(moved, np.inf), 0.0))
    result = make_valid_after_rounding(
        first, exact, rebuild_from_rounded_rings, True, budget, snapped_to_units if is_on_grid else None
    )
    if result is None:
        raise TooComplexError("snap rounding left a vertex off its lattice; please report this input")
    return result


def parts_exactly(subject: RingArrays, clip: RingArrays, budget: Budget) -> tuple[PairResults, IntArray]:
    """Return the regions in the subject alone, in the clip alone and in both, in the kernel's form for `EACH_PART`, and
    by vertex the number of its exact point."""
    subdivision, inside = _label_arrangement(subject, clip, range(4), budget)
    pieces = trace_pieces(subdivision, inside, [frozenset((part,)) for part in inside])
    result = round_pieces(subdivision.arrangement, pieces)
    parts = [part for piece in pieces for part in (*piece.evidence,) * (1 + len(piece.holes))]
    places = [subdivision.arrangement.origin(half_edge) for ring in rings_of(pieces) for half_edge in ring]
    return result._replace(evidence=np.array([range(len(parts)), parts], np.int64).T), np.array(places, np.int64)


def _label_arrangement(
    subject: RingArrays, clip: RingArrays, selected: Sequence[int], budget: Budget, nesting: Nesting = UNNAMED
) -> tuple[Subdivision, list[int]]:
    """Return the subdivision of checked rings, and for each face the part of the result that it belongs to, or 0.
    selected: by label 0 .. 3 (bit 0: in the subject, bit 1: in the clip) the part; nesting: fill rule, if not that of
    two polygons."""
    vertices = np.concatenate([subject.vertices, clip.vertices])
    offsets = [*subject.offsets.tolist(), *(clip.offsets[1:] + len(subject.vertices)).tolist()]
    arrangement = arrange_rings(vertices, offsets, None, budget)
    subdivision = subdivide(arrangement)
    sources = nesting.shells
    if nesting.rule == Rule.PAIR:
        sources = np.repeat([0, 1], [len(subject.offsets) - 1, len(clip.offsets) - 1])
    if nesting.rule in (Rule.NON_ZERO, Rule.POSITIVE, Rule.NEGATIVE):
        labels = label_faces(subdivision, _windings(arrangement, vertices, offsets), winds=True)
        inside = [
            {Rule.NON_ZERO: label != 0, Rule.POSITIVE: label > 0, Rule.NEGATIVE: label < 0}[Rule(nesting.rule)]
            for label in labels
        ]
    else:
        source_of = np.repeat(sources, np.diff(offsets)).tolist()
        masks = [_odd_sources(source_of[k] for k in edges) for edges in polled(arrangement.cover)]
        labels = [label or frozenset() for label in label_faces(subdivision, masks)]  # 0 where there is no edge
        if nesting.rule == Rule.PAIR:
            inside = [selected[sum(1 << source for source in label)] for label in labels]
        else:
            inside = [label == {0} if nesting.rule == Rule.FIRST_ALONE else bool(label) for label in labels]
    budget.check()
    return subdivision, inside


def _odd_sources(sources: Iterable[int]) -> _Sources:
    """Return the sources that occur an odd number of times."""
    odd: set[int] = set()
    for source in sources:
        odd ^= {source}
    return frozenset(odd)


def _windings(arrangement: Arrangement, vertices: FloatArray, offsets: Sequence[int]) -> list[int]:
    """Return, by edge of the arrangement, the number of input edges that run along it minus the number that run against
    it. vertices, offsets: the rings of the input."""
    places = list(map(tuple, vertices.tolist()))
    along = [0] * len(places)
    for start, stop in itertools.pairwise(offsets):
        for k in polled(range(start, stop)):
            along[k] = 1 if places[k] < places[k + 1 if k + 1 < stop else start] else -1
    return [sum(along[k] for k in edges) for edges in polled(arrangement.cover)]


def rings_of(pieces: Iterable[Piece]) -> list[list[int]]:
    """Return the rings of all pieces, the shell of each first."""
    return [ring for piece in pieces for ring in (piece.shell, *piece.holes)]


def round_pieces(arrangement: Arrangement, pieces: Sequence[Piece]) -> PairResults:
    """Return the pieces with all nodes rounded to nearest doubles: status DONE if none moves, else MAY_CROSS. A row of
    sources is (e, e), e the lowest input edge along which the ring continues, at vertices and crossings alike."""
    rings, nodes = rings_of(pieces), arrangement.nodes
    half_edges = [half_edge for ring in rings for half_edge in ring]
    used = [arrangement.origin(half_edge) for half_edge in polled(half_edges)]
    edges = [min(arrangement.cover[half_edge >> 1]) for half_edge in polled(half_edges)]
    displacement = max(map(nodes.displacement, polled(set(used))), default=0.0)
    return one_pair(
        np.array([(nodes.xs[node], nodes.ys[node]) for node in used]).reshape(-1, 2), np.cumsum([0, *map(len, rings)]),
        np.cumsum([0, *(1 + len(piece.holes) for piece in pieces)]), displacement, 0,
        np.array([edges, edges], np.int32).T, PairStatus.MAY_CROSS if displacement else PairStatus.DONE,
    )  # fmt: skip


def rebuild_from_rounded_rings(rings: PairResults, budget: Budget) -> PairResults:
    """Arrange the rounded rings of one pair exactly and trace the pieces: a face is inside if it is inside a shell and
    in none of that shell's holes (rule AGAIN). The result has evidence rows (ring, rounded ring it comes from)."""
    ends = rings.piece_offsets.tolist()
    holes_of = {shell: frozenset(range(shell + 1, end)) for shell, end in itertools.pairwise(ends)}
    sizes = np.repeat(ring_sizes(rings)[rings.piece_offsets[:-1]], np.diff(rings.piece_offsets)).tolist()
    ring_of = np.repeat(np.arange(len(sizes)), np.diff(rings.ring_offsets)).tolist()
    arrangement = arrange_rings(rings.vertices, rings.ring_offsets.tolist(), None, budget)
    subdivision = subdivide(arrangement)
    budget.check()

    @functools.cache
    def classify(label: _Sources) -> tuple[bool, _Sources]:
        """Return whether a face is inside, and its evidence: the shells that make it so, or the innermost holes that it
        lies in if it is outside. label: the rings that contain it."""
        inside = frozenset(ring for ring in label if ring in holes_of and not label & holes_of[ring])
        holes = [] if inside else [ring for ring in label if ring not in holes_of]
        least = min((sizes[hole] for hole in holes), default=0.0)
        return bool(inside), inside or frozenset(hole for hole in holes if sizes[hole] == least)

    masks = [_odd_sources(ring_of[k] for k in edges) for edges in polled(arrangement.cover)]
    labels = [label or frozenset() for label in label_faces(subdivision, masks)]
    inside, evidence = zip(*map(classify, labels), strict=True)
    pieces = trace_pieces(subdivision, inside, evidence)
    meant = [sorted(named) for piece in pieces for named in (piece.evidence, *piece.hole_evidence)]
    provenance = [(ring, source) for ring, sources in enumerate(meant) for source in sources]
    return round_pieces(arrangement, pieces)._replace(evidence=np.array(provenance, np.int64).reshape(-1, 2))
