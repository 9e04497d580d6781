"""One round of rounding in Python integers: rounded rings arranged exactly, each a source of its own.

The rule is that of ring_labels.py, over integers of any length: bit k of a label stands for ring k.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable, Sequence

import numpy as np

from engine.arrangement.arrange import arrange_rings
from engine.arrangement.nodes import NodeTable
from engine.arrangement.rings import Piece, trace_pieces
from engine.arrangement.subdivision import label_faces, subdivide
from engine.parallel import Budget
from engine.polygon_overlay.ring_bits import places_of
from engine.polygon_overlay.rounds import ArrangedAgain, RoundedRings


def rings_of(pieces: Iterable[Piece]) -> list[list[int]]:
    """Return the rings of all pieces, the shell of each first."""
    return [ring for piece in pieces for ring in (piece.shell, *piece.holes)]


def rounded(nodes: NodeTable, pieces: Sequence[Piece]) -> RoundedRings:
    """Return the nearest doubles of the nodes of all rings; valid where nothing moves."""
    rings = rings_of(pieces)
    used = [node for ring in rings for node in ring]
    displacement = max(map(nodes.displacement, set(used)), default=0.0)
    return RoundedRings(
        vertices=np.array([(nodes.xs[node], nodes.ys[node]) for node in used]).reshape(-1, 2),
        ring_offsets=np.cumsum([0, *map(len, rings)]),
        piece_offsets=np.cumsum([0, *(1 + len(piece.holes) for piece in pieces)]),
        displacement=displacement,
        is_valid=displacement == 0.0,
        has_crossings=True,
    )


def arranged_again(rings: RoundedRings, budget: Budget) -> ArrangedAgain:
    """Trace the pieces anew from the exact arrangement of rounded rings."""
    holes_of = {  # for each shell's bit the bits of its holes
        shell: (1 << end) - (1 << (shell + 1)) for shell, end in itertools.pairwise(rings.piece_offsets.tolist())
    }
    all_shells = sum(1 << bit for bit in holes_of)
    masks = [1 << bit for bit in range(rings.n_rings)]
    arrangement = arrange_rings(rings.vertices, rings.ring_offsets.tolist(), masks, budget)
    subdivision = subdivide(arrangement, budget)
    budget.check()

    @functools.cache
    def verdict(label: int) -> tuple[bool, int]:
        """Tell whether a face is inside, and name the shells it lies in, or else the holes."""
        within = (shell for shell in places_of(label & all_shells) if not label & holes_of[shell])
        inside = sum(1 << shell for shell in within)
        return inside != 0, inside or label & ~all_shells

    inside, evidence = zip(*map(verdict, label_faces(subdivision)), strict=True)
    pieces = trace_pieces(subdivision, inside, evidence, budget)
    meant = [places_of(bits) for piece in pieces for bits in (piece.evidence, *piece.hole_evidence)]
    return ArrangedAgain(rounded(arrangement.nodes, pieces), meant)
