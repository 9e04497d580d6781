"""The overlay in Python integers: right for every input, and slow; for what the compiled one leaves open.

The steps are those of overlay.py; the rule of a round that of ring_nesting.py, over integers of any length: bit k of a
label stands for ring k.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from engine.arrangement.arrange import arrange_rings
from engine.arrangement.exact_area import ExactRings
from engine.arrangement.nodes import NodeTable
from engine.arrangement.rings import Piece, trace_pieces
from engine.arrangement.subdivision import label_faces, subdivide
from engine.errors import TooComplexError
from engine.parallel import Budget
from engine.polygon_overlay.compiled.kernel import DONE, MAY_CROSS
from engine.polygon_overlay.found import Found, one_pair, ring_sizes
from engine.polygon_overlay.implicit_rings import RingArrays
from engine.polygon_overlay.nearest import leave_nearest
from engine.polygon_overlay.result import Output, Overlay
from engine.polygon_overlay.rounds import settle_rings
from engine.polygon_overlay.run import KEPT, Operation

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
    inside = [KEPT[operation][label] for label in label_faces(subdivision)]
    pieces = trace_pieces(subdivision, inside, [0] * subdivision.n_faces, budget)
    nodes = arrangement.nodes
    exact = ExactRings(tuple(tuple(nodes.points[node] for node in ring) for ring in rings_of(pieces)), nodes.exponent)
    first = rounded(nodes, pieces)
    if output == "nearest":
        return leave_nearest(first, exact, budget), arrangement.n_exact
    moved = first.displacement
    first = first._replace(displacement=np.where(moved, np.nextafter(moved, np.inf), 0.0))
    result = settle_rings(first, exact, arranged_again, True, budget)
    if result is None:
        raise TooComplexError("snap rounding left a vertex off its lattice; please report this input")
    return result, arrangement.n_exact


def rings_of(pieces: Iterable[Piece]) -> list[list[int]]:
    """Return the rings of all pieces, the shell of each first."""
    return [ring for piece in pieces for ring in (piece.shell, *piece.holes)]


def rounded(nodes: NodeTable, pieces: Sequence[Piece]) -> Found:
    """Return the nearest doubles of the nodes of all rings; done where nothing moves."""
    rings = rings_of(pieces)
    used = [node for ring in rings for node in ring]
    displacement = max(map(nodes.displacement, set(used)), default=0.0)
    return one_pair(
        np.array([(nodes.xs[node], nodes.ys[node]) for node in used]).reshape(-1, 2),
        np.cumsum([0, *map(len, rings)]),
        np.cumsum([0, *(1 + len(piece.holes) for piece in pieces)]),
        displacement,
        0,
        status=MAY_CROSS if displacement else DONE,
    )


def arranged_again(rings: Found, budget: Budget) -> Found:
    """Trace the pieces of one pair anew from the exact arrangement of rounded rings."""
    holes_of = {  # for each shell's bit the bits of its holes
        shell: (1 << end) - (1 << (shell + 1)) for shell, end in itertools.pairwise(rings.piece_offsets.tolist())
    }
    all_shells = sum(1 << bit for bit in holes_of)
    sizes = np.repeat(ring_sizes(rings)[rings.piece_offsets[:-1]], np.diff(rings.piece_offsets)).tolist()
    masks = [1 << bit for bit in range(len(sizes))]
    arrangement = arrange_rings(rings.vertices, rings.ring_offsets.tolist(), masks, budget)
    subdivision = subdivide(arrangement, budget)
    budget.check()

    @functools.cache
    def verdict(label: int) -> tuple[bool, int]:
        """Tell whether a face is inside, and name the shells it lies in, or else the innermost holes."""
        inside = sum(1 << shell for shell in _places(label & all_shells) if not label & holes_of[shell])
        holes = [] if inside else _places(label & ~all_shells)
        least = min((sizes[hole] for hole in holes), default=0.0)
        return inside != 0, inside or sum(1 << hole for hole in holes if sizes[hole] == least)

    inside, evidence = zip(*map(verdict, label_faces(subdivision)), strict=True)
    pieces = trace_pieces(subdivision, inside, evidence, budget)
    meant = [_places(bits) for piece in pieces for bits in (piece.evidence, *piece.hole_evidence)]
    named = [(ring, source) for ring, sources in enumerate(meant) for source in sources]
    return rounded(arrangement.nodes, pieces)._replace(evidence=np.array(named, np.int64).reshape(-1, 2))


def _places(number: int) -> list[int]:
    """Return the places of the bits that are set."""
    places = []
    while number:  # bound: each turn clears a bit
        bit = number & -number
        places.append(bit.bit_length() - 1)
        number ^= bit
    return places
