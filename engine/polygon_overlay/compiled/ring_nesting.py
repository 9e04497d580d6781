"""Face labelling by a fill rule, with the provenance of rounded rings.

The faces are walked as a tree, from the unbounded one and back: each step takes up or lays down the sources that it
crosses, however many there are; of two polygons, the bits of a label. What is inside is a rule: the table of an
operation on two polygons; where any source is (even-odd within each), or the first alone; where all rings together have
a winding number that is not zero, positive, or negative; or that of a round of rounding:

A face is inside where it lies (even-odd) in a shell and in no hole of that shell. Its evidence names those shells; that
of a face outside names the holes that it lies in, the innermost of them: those whose shell is smallest. Evidence tells,
part by part, what the result came from (in_integers.py states the same rule over integers of any length).

    .------------------.         Rings 0 and 2 are shells, 1 is a hole of 0: shells = [0, 0, 2].
    | 0   .-----.      |
    |     |  1  |   .--+---.     in {0}      in a shell, in no hole of it   inside    evidence {0}
    |     '-----'   |  | 2 |        {0, 1}   in the hole of the only shell  outside            {1}
    '---------------+--'   |        {0, 2}   in two shells                  inside             {0, 2}
                    '------'        {}       in none                        outside            {}

Only the few rings that a face lies in are looked at.

Source: K. Weiler, P. Atherton, 1977, for two polygons; winding numbers after K. Hormann, A. Agathos, 2001.
"""

from __future__ import annotations

from collections import namedtuple
from enum import IntEnum
from typing import Any, Final, NamedTuple

from engine.arrangement.union_find import root_of
from engine.compiling.jit import called, merged
from engine.polygon_overlay.compiled.chain_faces import Faces
from engine.polygon_overlay.compiled.chains import Chains, is_live
from engine.polygon_overlay.compiled.edge_tree import POLL
from engine.polygon_overlay.compiled.loading import Given
from engine.types import FlagArray, Int32Array, IntArray

NO_ROOM: Final = -1
_NOT_YET: Final = -2


class Rule(IntEnum):
    """Which faces are inside."""

    AGAIN = 0
    """By the shells and holes of a round of rounding."""
    ANY = 1
    """Within any source."""
    NON_ZERO = 2
    """By the winding number, as for the next two."""
    POSITIVE = 3
    NEGATIVE = 4
    PAIR = 5
    """By a table over the labels of two polygons (bit 0: in the subject, bit 1: in the clip)."""
    FIRST_ALONE = 6
    """Within source 0 and no other."""


class Nesting(NamedTuple):
    """AGAIN: by ring the number of its shell, its own where it is one, int64, and how large that shell is, float64.

    ANY, FIRST_ALONE: by ring the number of its source, no larger than that of the ring. Winding numbers: by ring any
    number. PAIR: no rings.
    """

    shells: Any
    sizes: Any
    rule: int
    """Of `Rule`, as an int: kernels are compiled for that."""


Holders = namedtuple("Holders", "held place stamp link first entered ring after region beyond offset")
"""Scratch. held: the rings that a face lies in; place: by ring its place there, or -1; stamp: by ring.

link: by half-chain the next one of its face; first: by face its first; entered: by face the half-chain through which it
was, from the other side. ring, after: by entry of evidence its ring, and the next of its region; region: by region its
first entry. beyond: regions on the other side of the rings of the result, those of ring k from offset[k] on.
"""


@merged
def _cross(given: Given, chains: Chains, nesting: Nesting, h: Holders, half: int, n_held: int) -> int:
    """Go over a half-chain, from its left, and take up or lay down all that it stands for; return how many are held.

    Of winding numbers and labels: return the one beyond, ``n_held`` being the one here.
    """
    chain = half >> 1
    if nesting.rule == Rule.PAIR:
        return n_held ^ chains.mask[chain]
    while chain >= 0:  # bound: the chains that coincide
        ring = given.masks[given.edges.ring[chains.first[chain]]]
        if Rule.NON_ZERO <= nesting.rule <= Rule.NEGATIVE:
            n_held += 1 if (chains.stands[chain] ^ half) & 1 else -1
        else:
            source = ring if nesting.rule == Rule.AGAIN else nesting.shells[ring]
            if h.place[source] < 0:
                h.place[source], h.held[n_held] = n_held, source
                n_held += 1
            else:
                n_held -= 1
                last = h.held[n_held]
                h.held[h.place[source]], h.place[last] = last, h.place[source]
                h.place[source] = -1
        chain = chains.twin[chain]
    return n_held


@merged
def _part_of(rule: int, h: Holders, kept: FlagArray, n_held: int) -> int:
    """Return the part of the result that a face is in, 0 for none, by a rule other than AGAIN."""
    if rule == Rule.PAIR:
        return int(kept[n_held])
    if rule == Rule.FIRST_ALONE:
        return int(n_held == 1 and h.place[0] == 0)
    return int(n_held < 0 if rule == Rule.NEGATIVE else n_held > 0 if rule != Rule.NON_ZERO else n_held != 0)


@merged
def _judge(nesting: Nesting, h: Holders, face: int, n_held: int, n: int) -> tuple[bool, int]:
    """Tell whether a face is inside, and enter its evidence after n entries; return how many there are then."""
    shells, sizes, room = nesting.shells, nesting.sizes, h.ring.shape[0]
    least = float("inf")
    for k in range(n_held):
        ring = h.held[k]
        if shells[ring] != ring:
            h.stamp[shells[ring]] = face
            least = min(least, sizes[ring])
    is_inside = False
    for k in range(n_held):
        ring = h.held[k]
        is_inside |= shells[ring] == ring and h.stamp[ring] != face
    for k in range(n_held):
        ring = h.held[k]
        is_shell = shells[ring] == ring
        if (is_shell and h.stamp[ring] != face) if is_inside else (not is_shell and not sizes[ring] > least):
            if n >= room:
                return is_inside, NO_ROOM
            h.ring[n], h.after[n] = ring, face
            n += 1
    return is_inside, n


@called
def spread_sources(
    given: Given, chains: Chains, faces: Faces, nesting: Nesting, h: Holders, kept: FlagArray, sizes: tuple[int, int],
    stop: FlagArray,
) -> int:  # fmt: skip
    """Fill ``faces.inside`` and the entries of evidence, ``after`` with their faces; return how many, or NO_ROOM.

    kept: by label of two polygons the part of the result that such a face is in, or 0. sizes: the numbers of chains and
    cycles. ``faces.joined`` joins the cycles of one face.
    """
    n_chains, n_cycles = sizes
    cycle, joined, inside = faces.cycle, faces.joined, faces.inside
    for ring in range(nesting.shells.shape[0]):
        h.place[ring] = h.stamp[ring] = -1
    for i in range(n_cycles + 1):
        h.first[i], h.entered[i] = -1, _NOT_YET
    for half in range(2 * n_chains):
        if is_live(chains, half >> 1):
            face = root_of(joined, cycle[half])
            h.link[half], h.first[face] = h.first[face], half
    n_held = n_entries = steps = 0
    face = root_of(joined, n_cycles)
    h.entered[face], inside[face] = -1, 0
    while True:  # bound: each half-chain is looked at once, each face left once
        steps += 1
        if steps & POLL == 0 and stop[0]:
            return 0
        half = h.first[face]
        if half >= 0:
            h.first[face] = h.link[half]
            other = root_of(joined, cycle[half ^ 1])
            if h.entered[other] == _NOT_YET:
                n_held = _cross(given, chains, nesting, h, half, n_held)
                if nesting.rule != Rule.AGAIN:
                    inside[other] = _part_of(nesting.rule, h, kept, n_held)
                else:
                    inside[other], n_entries = _judge(nesting, h, other, n_held, n_entries)
                    if n_entries == NO_ROOM:
                        return NO_ROOM
                h.entered[other], face = half, other
        else:
            half = h.entered[face]
            if half < 0:
                break
            n_held = _cross(given, chains, nesting, h, half ^ 1, n_held)
            face = root_of(joined, cycle[half])
    for i in range(n_cycles):
        inside[i] = inside[root_of(joined, i)]
    return n_entries


@called
def gather_evidence(faces: Faces, h: Holders, n_entries: int, n_cycles: int, n_rings: int, stop: FlagArray) -> None:
    """Put the entries of each region together, each ring once; ``faces.regions`` is filled."""
    for i in range(n_cycles + 1):
        h.region[i] = h.entered[i] = -1  # order: from here on `entered` tells which ring of the result was beyond last
    for k in range(n_entries):
        region = root_of(faces.regions, h.after[k])
        h.after[k], h.region[region] = h.region[region], k
    for ring in range(n_rings):
        h.stamp[ring] = -1
    for region in range(n_cycles + 1):
        if region & POLL == 0 and stop[0]:
            return
        k, before = h.region[region], -1
        while k >= 0:  # bound: the entries of the region
            if h.stamp[h.ring[k]] == region:
                h.after[before] = h.after[k]
            else:
                h.stamp[h.ring[k]], before = region, k
            k = h.after[k]
    for ring in range(n_rings):
        h.stamp[ring] = -1
    h.offset[0] = 0


@merged
def enter_beyond(faces: Faces, h: Holders, path: Int32Array, first: int, last: int, n_rings: int) -> None:
    """Enter the regions beyond the ring of the half-chains ``path[first:last]``."""
    n = h.offset[n_rings]
    for k in range(first, last):
        region = root_of(faces.regions, faces.cycle[path[k] ^ 1])
        if h.entered[region] != n_rings:
            h.entered[region], h.beyond[n] = n_rings, region
            n += 1
    h.offset[n_rings + 1] = n


@called
def write_evidence(
    h: Holders, ring: int, region: int, is_hole: bool, name: int, base: int, evidence: IntArray, n: int
) -> int:  # fmt: skip
    """Append rows ``name``, number of a ring that a ring of the result comes from; return how many, or NO_ROOM.

    A shell comes from what its own region says, a hole from what those beyond say. base: number of the first ring.
    """
    for at in range(h.offset[ring] if is_hole else 0, h.offset[ring + 1] if is_hole else 1):
        k = h.region[h.beyond[at] if is_hole else region]
        while k >= 0:  # bound: the entries of the region
            source = h.ring[k]
            if h.stamp[source] != ring:
                if n >= evidence.shape[0]:
                    return NO_ROOM
                h.stamp[source] = ring
                evidence[n, 0], evidence[n, 1] = name, base + source
                n += 1
            k = h.after[k]
    return n
