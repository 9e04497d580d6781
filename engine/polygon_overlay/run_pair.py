"""Runs the compiled overlay on one pair of small polygons.

Small overlays are called so often that what stands around the kernel counts, of which an array made, or a tuple with
names, takes a tenth of the whole call: nothing is made that is not asked for. For two small polygons the kernel is
called at once, and what it leaves stays bytes until it is asked for.
"""

from __future__ import annotations

import functools
from typing import Any, Final

import numpy as np

from engine.arrays import FlagArray
from engine.budget import UNLIMITED
from engine.direct import entry_of
from engine.polygon_overlay.compiled.boundary.ring_nesting import PAIR, Nesting
from engine.polygon_overlay.compiled.kernel import DONE, FINISHED, overlay_pairs
from engine.polygon_overlay.compiled.loading import Loaded, RingArrays
from engine.polygon_overlay.compiled.workspace import FEW_VERTICES, scratch_for_few, spare
from engine.polygon_overlay.implicit_rings import ImplicitRings, one_polygon
from engine.polygon_overlay.result import Overlay
from engine.solids.polygon import Polygon

NOT_REDUCED: Final = Loaded(0, 0, 0, 0.0)
"""What stands in the place of the result of reduce_pair."""
UNNAMED: Final = Nesting(np.zeros(0, np.int64), np.zeros(0), PAIR)
"""That of two polygons."""


def overlay_few(subject: Polygon, clip: Polygon, kept: FlagArray) -> Overlay | None:
    """Return the overlay of two polygons, without a limit; None of more vertices, or where the kernel leaves doubt."""
    first, second = RingArrays(subject.vertices, subject.ring_offsets), RingArrays(clip.vertices, clip.ring_offsets)
    if len(first.vertices) + len(second.vertices) > FEW_VERTICES:
        return None
    scratch = scratch_for_few()
    items = one_polygon(len(first.offsets) - 1), one_polygon(len(second.offsets) - 1)
    _, needs, n, n_rings, n_pieces, _, _ = entry_of(overlay_pairs)(
        first, items[0], second, items[1], 0, NOT_REDUCED, kept, UNNAMED, UNLIMITED.flag, scratch.words, scratch.outcome
    )
    status, _, displacement = scratch.outcome
    is_done, moved_by, left = needs == FINISHED and status.item(0) == DONE, displacement.item(0), scratch.output
    vertices, sources, rings = left.vertices[:n].tobytes(), left.sources[:n].tobytes(), None
    if n_rings != 1:
        rings = left.rings[: n_rings + 1].tobytes(), left.pieces[: n_pieces + 1].tobytes()
    spare.append(scratch)
    if not is_done:
        return None
    told: dict[str, Any] = {"_later": functools.partial(_fields, first, second, vertices, sources, rings)}
    if moved_by > 0.0:
        told |= {"rounds": 1, "largest_displacement": moved_by}
    result = object.__new__(Overlay)
    object.__setattr__(result, "__dict__", told)
    return result


def _fields(
    subject: RingArrays, clip: RingArrays, vertices: bytes, sources: bytes, rings: tuple[bytes, bytes] | None
) -> dict[str, Any]:
    """Return the fields of an `Overlay` that are made when one of them is asked for."""
    places = np.frombuffer(vertices).reshape(-1, 2)
    ring_offsets, piece_offsets = one_polygon(len(places)), one_polygon(1)
    if rings is not None:
        ring_offsets, piece_offsets = (np.frombuffer(each, np.int64) for each in rings)
    exact = ImplicitRings(subject, clip, np.frombuffer(sources, np.int32).reshape(-1, 2), ring_offsets)
    n_pieces = len(piece_offsets) - 1
    return {
        "vertices": places, "ring_offsets": ring_offsets, "piece_offsets": piece_offsets, "exact": exact,
        "n_pieces_exact": n_pieces, "n_holes_exact": len(ring_offsets) - 1 - n_pieces,
    }  # fmt: skip
