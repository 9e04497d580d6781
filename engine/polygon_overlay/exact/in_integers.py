"""The overlay in Python integers: right for every input, and slow; for what the compiled one leaves open.

subject + clip  ->  arrangement  ->  faces with two labels  ->  faces kept  ->  rings  ->  doubles
    (floats)         (exact)             (exact)                 (a table)      (exact)    (rounded, made valid)
"""

from __future__ import annotations

import functools
from dataclasses import replace
from math import inf, nextafter
from typing import Final

import numpy as np

from engine.arrangement.arrange import arrange_rings
from engine.arrangement.exact_area import ExactRings
from engine.arrangement.rings import trace_pieces
from engine.arrangement.subdivision import label_faces, subdivide
from engine.errors import TooComplexError
from engine.parallel import Budget
from engine.polygon_overlay.exact.rounding import arranged_again, rings_of, rounded
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
    first = replace(first, displacement=nextafter(first.displacement, inf) if first.displacement else 0.0)
    result = settle_rings(first, exact, functools.partial(arranged_again, budget=budget), True, budget)
    if result is None:
        raise TooComplexError("snap rounding left a vertex off its lattice; please report this input")
    return result, arrangement.n_exact
