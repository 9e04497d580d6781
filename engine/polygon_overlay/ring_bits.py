"""Which bit of a label stands for which ring, and which rings are meant by bits: for rings arranged again.

Up to `MOST_BITS` rings each has a bit of its own. Of more, rings whose boxes are apart share bits as ring_labels.py
allows: the shells of small pieces, and the holes of one shell or of shells that share a bit. A bit in the evidence of a
part then means rings of that bit whose boxes meet the part's: it lies in them, so the boxes do meet. Where these are
several, the rings are arranged once more with bits dealt out in another order. Rings whose bit is missing once are not
meant; those left alone with a bit, once, are.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.bounding.sweep import pairs_of_boxes
from engine.parallel import Budget
from engine.polygon_overlay.compiled.ring_labels import MOST_BITS, RingBits

_SPREAD: Final = 16
"""Bits that rings are dealt out to though fewer would do: those of one bit are then further from each other."""

_MOST_ORDERS: Final = 8
"""Orders in which bits are dealt out: a ring that is not meant passes for one in each with the part's share of bits."""

Corners = tuple[FloatArray, FloatArray]


def assign_bits(boxes: Corners, piece_offsets: IntArray, budget: Budget, order: int = 0) -> RingBits | None:
    """Return a bit for each ring, None where there are too few.

    boxes: of the rings, as `boxes_of` gives them. piece_offsets: into the rings, the shell of each piece first. order:
    number of the order in which bits are dealt out.
    """
    n_rings = int(piece_offsets[-1])
    shell_of = np.repeat(piece_offsets[:-1], np.diff(piece_offsets))
    if n_rings <= MOST_BITS:
        return RingBits(np.arange(n_rings), shell_of)
    rank = np.random.default_rng(order).permutation(n_rings) if order else np.arange(n_rings)
    # meeting: the rings before each, by rank, that it may share no bit with
    meeting: list[list[int]] = [[] for _ in range(n_rings)]
    is_shell = shell_of == np.arange(n_rings)
    pairs = pairs_of_boxes(*boxes, budget)
    pairs = pairs[is_shell[pairs[:, 0]] == is_shell[pairs[:, 1]]]
    swapped = rank[pairs[:, 0]] > rank[pairs[:, 1]]
    pairs[swapped] = pairs[swapped, ::-1]
    for i, j in pairs.tolist():
        meeting[j].append(i)
    ranked = np.argsort(rank)
    bits = np.zeros(n_rings, np.int64)
    shells: list[int] = []
    groups: dict[int, list[int]] = {}  # by bit of shells those of their holes, longest unused first; at -1 all shells
    for rings, is_hole in ((ranked[is_shell[ranked]], False), (ranked[~is_shell[ranked]], True)):
        for ring in rings.tolist():
            shell = int(bits[shell_of[ring]]) if is_hole else -1
            taken = {int(bits[other]) for other in meeting[ring]}
            group = groups.setdefault(shell, [])
            bit = next((bit for bit in group if bit not in taken), -1)
            if bit < 0 or (len(group) < _SPREAD and len(shells) < MOST_BITS - _SPREAD):
                if len(shells) == MOST_BITS:
                    return None
                bit = len(shells)
                shells.append(shell if is_hole else bit)
            else:
                group.remove(bit)
            group.append(bit)
            bits[ring] = bit
    return RingBits(bits, np.array(shells))


def boxes_of(vertices: FloatArray, ring_offsets: IntArray) -> Corners:
    """Return the least and the largest coordinates of each ring, (n_rings, 2) float64 each."""
    if len(ring_offsets) == 1:
        return np.zeros((0, 2)), np.zeros((0, 2))
    starts = ring_offsets[:-1]
    return np.minimum.reduceat(vertices, starts), np.maximum.reduceat(vertices, starts)


def rings_meant(
    labels: RingBits,
    evidence: IntArray,
    boxes: Corners,
    piece_offsets: IntArray,
    found: Corners,
    again: Callable[[RingBits], IntArray],
    budget: Budget,
) -> list[list[int]] | None:
    """Return for each ring found which of the rings its evidence names; None where that is not sure.

    boxes, piece_offsets: of the rings that ``labels`` are of; found: boxes of those whose evidence it is. again:
    returns their evidence for other labels.
    """
    if len(labels.bits) == len(labels.shells):
        return [places_of(bits) for bits in evidence.tolist()]
    n_rings = len(labels.bits)
    low, high = np.concatenate([boxes[0], found[0]]), np.concatenate([boxes[1], found[1]])
    pairs = pairs_of_boxes(low, high, budget)
    across = (pairs[:, 0] < n_rings) & (pairs[:, 1] >= n_rings)
    rings, parts = pairs[across, 0], pairs[across, 1] - n_rings
    dealt: list[IntArray] = []
    for order in range(1, _MOST_ORDERS + 1):
        budget.check()
        dealt.append(labels.bits)
        is_named = (evidence[parts] >> labels.bits[rings]) & 1 == 1
        rings, parts = rings[is_named], parts[is_named]
        # invariant: all rings that are meant are among these
        is_sure = np.zeros(len(rings), np.bool_)
        for bits in dealt:
            _, which, counts = np.unique(parts * 64 + bits[rings], return_inverse=True, return_counts=True)
            is_sure |= counts[which] == 1
        if is_sure.all():
            meant: list[list[int]] = [[] for _ in evidence]
            for ring, part in zip(rings.tolist(), parts.tolist(), strict=True):
                meant[part].append(ring)
            return meant
        other = assign_bits(boxes, piece_offsets, budget, order)
        if other is None:
            return None
        labels, evidence = other, again(other)
    return None


def places_of(number: int) -> list[int]:
    """Return the places of the bits that are set."""
    places = []
    while number:  # bound: each turn clears a bit
        bit = number & -number
        places.append(bit.bit_length() - 1)
        number ^= bit
    return places
