"""Face labelling by a fill rule, with the provenance of rounded rings.

Labels are propagated by a depth-first flood fill from the unbounded face: each step over a half-chain toggles the
sources that bound there (for two polygons: bits of a label). `Rule` says which labels are inside. By the rule AGAIN, of
a round of rounding, a face is inside where it lies (even-odd) in a shell and in no hole of that shell. Its evidence
names those shells; the evidence of a face outside names the innermost holes it lies in (smallest shell). Evidence is
the provenance of the result's parts (in_integers.py states the same rule over integers of any length).

    .------------------.         Rings 0 and 2 are shells, 1 is a hole of 0: shells = [0, 0, 2].
    | 0   .-----.      |
    |     |  1  |   .--+---.     in {0}      in a shell, in no hole of it   inside    evidence {0}
    |     '-----'   |  | 2 |        {0, 1}   in the hole of the only shell  outside            {1}
    '---------------+--'   |        {0, 2}   in two shells                  inside             {0, 2}
                    '------'        {}       in none                        outside            {}

Source: K. Weiler, P. Atherton, 1977, for two polygons; winding numbers after K. Hormann, A. Agathos, 2001.
"""

from __future__ import annotations

from collections import namedtuple
from enum import IntEnum
from typing import Any, Final, NamedTuple

from engine.arrangement.union_find import root_of
from engine.compiling.jit import called, merged
from engine.polygon_overlay.compiled.chain_faces import Faces
from engine.polygon_overlay.compiled.chains import Chains, is_representative
from engine.polygon_overlay.compiled.edge_tree import POLL
from engine.polygon_overlay.compiled.loading import Given
from engine.types import FlagArray, Int32Array, IntArray

NO_ROOM: Final = -1
_NOT_YET: Final = -2


class Rule(IntEnum):
    """The fill rule: which faces of the arrangement are inside."""

    AGAIN = 0
    """Inside a shell and in no hole of that shell; used for rounded rings."""
    ANY = 1
    """Inside at least one source."""
    NON_ZERO = 2
    """By the winding number: not zero here, positive or negative for the next two."""
    POSITIVE = 3
    NEGATIVE = 4
    ONCE = 5
    """By the winding number: part 1 where it is 1, part 2 where it is neither that nor 0."""
    PAIR = 6
    """By a table over the labels of two polygons (bit 0: in the subject, bit 1: in the clip)."""
    FIRST_ALONE = 7
    """Inside source 0 and no other."""
    PART = 8
    """As ANY, of some of the sources: rounded rings count as valid only if all edges are apart by the margin."""


class Nesting(NamedTuple):
    """The fill rule, and what it needs by ring.

    | rule | shells (n_rings,) int64 | sizes (n_rings,) float64 |
    | --- | --- | --- |
    | AGAIN | the number of its shell, its own for a shell | the size of its shell |
    | ANY, FIRST_ALONE, PART | the number of its source, at most its own number | unused |
    | winding numbers | unused values | unused |
    | PAIR | empty | empty |
    """

    shells: Any
    sizes: Any
    rule: int
    """Of `Rule`, as an int: kernels are compiled for that."""


FloodFill = namedtuple("FloodFill", "sources place stamp link first entered ring after region beyond offset")
"""Scratch of the flood fill.

| field | by | meaning |
| --- | --- | --- |
| sources | - | stack of the sources that contain the current face |
| place, stamp | ring | its place on the stack or -1; last visitor |
| link, first | half-chain, face | linked list of the half-chains of a face |
| entered | face | the half-chain through which it was entered, from the other side |
| ring, after | entry of evidence | its ring; the next entry of its region |
| region | region | its first entry of evidence |
| beyond, offset | ring of the result | the regions on its other side, from offset[k] on |
"""


@merged
def _cross_half_chain(given: Given, chains: Chains, nesting: Nesting, h: FloodFill, half: int, n_sources: int) -> int:
    """Update the state of the flood fill, n_sources, on a step from the left of half-chain ``half`` to its right;
    return the new state. By the rule PAIR it is the label of the face, by rules of winding numbers that number, by
    other rules the number of sources that contain the face, listed in ``h.sources``."""
    chain = half >> 1
    if nesting.rule == Rule.PAIR:
        return n_sources ^ chains.mask[chain]
    while chain >= 0:  # bound: the chains that coincide
        ring = given.masks[given.edges.ring[chains.first[chain]]]
        if Rule.NON_ZERO <= nesting.rule <= Rule.ONCE:
            n_sources += 1 if (chains.representative[chain] ^ half) & 1 else -1
        else:
            source = ring if nesting.rule == Rule.AGAIN else nesting.shells[ring]
            if h.place[source] < 0:
                h.place[source], h.sources[n_sources] = n_sources, source
                n_sources += 1
            else:
                n_sources -= 1
                last = h.sources[n_sources]
                h.sources[h.place[source]], h.place[last] = last, h.place[source]
                h.place[source] = -1
        chain = chains.twin[chain]
    return n_sources


@merged
def _part_of(rule: int, h: FloodFill, selected: FlagArray, n_sources: int) -> int:
    """Return the part of the result that a face belongs to, 0 for none, by any fill rule but AGAIN. n_sources: the
    state of the flood fill in the face (`_cross_half_chain`). selected: by label the part, for the rule PAIR."""
    if rule == Rule.PAIR:
        return int(selected[n_sources])
    if rule == Rule.ONCE:
        return 2 if n_sources < 0 else min(n_sources, 2)
    if rule == Rule.FIRST_ALONE:
        return int(n_sources == 1 and h.place[0] == 0)
    return int(n_sources < 0 if rule == Rule.NEGATIVE else n_sources > 0 if rule != Rule.NON_ZERO else n_sources != 0)


@merged
def _classify_face(nesting: Nesting, h: FloodFill, face: int, n_sources: int, n: int) -> tuple[bool, int]:
    """Return whether a face is inside by the rule AGAIN (in a shell and in none of its holes), and the new number of
    evidence entries, or NO_ROOM. The face lies in the rings ``h.sources[:n_sources]``. Entries are appended after the n
    there: those shells, or the innermost holes if the face is outside."""
    shells, sizes, room = nesting.shells, nesting.sizes, h.ring.shape[0]
    least = float("inf")
    for k in range(n_sources):
        ring = h.sources[k]
        if shells[ring] != ring:
            h.stamp[shells[ring]] = face
            least = min(least, sizes[ring])
    is_inside = False
    for k in range(n_sources):
        ring = h.sources[k]
        is_inside |= shells[ring] == ring and h.stamp[ring] != face
    for k in range(n_sources):
        ring = h.sources[k]
        is_shell = shells[ring] == ring
        if (is_shell and h.stamp[ring] != face) if is_inside else (not is_shell and not sizes[ring] > least):
            if n >= room:
                return is_inside, NO_ROOM
            h.ring[n], h.after[n] = ring, face
            n += 1
    return is_inside, n


@called
def propagate_labels(
    given: Given, chains: Chains, faces: Faces, nesting: Nesting, h: FloodFill, selected: FlagArray,
    sizes: tuple[int, int], stop: FlagArray,
) -> int:  # fmt: skip
    """Fill ``faces.inside`` (by cycle the part of the result, 0 outside) by flood fill from the unbounded face over
    half-chains. By rule AGAIN also append to ``h`` the evidence, pairs of a source ring and a face that it puts inside
    or outside; return their number, or NO_ROOM. selected: for the rule PAIR the part by label (bit 0: in the subject,
    bit 1: in the clip). sizes: numbers of chains and cycles. ``faces.joined``, filled before, unites the cycles of one
    face."""
    n_chains, n_cycles = sizes
    cycle, joined, inside = faces.cycle, faces.joined, faces.inside
    for ring in range(nesting.shells.shape[0]):
        h.place[ring] = h.stamp[ring] = -1
    for i in range(n_cycles + 1):
        h.first[i], h.entered[i] = -1, _NOT_YET
    for half in range(2 * n_chains):
        if is_representative(chains, half >> 1):
            face = root_of(joined, cycle[half])
            h.link[half], h.first[face] = h.first[face], half
    n_sources = n_entries = steps = 0
    face = root_of(joined, n_cycles)
    h.entered[face], inside[face] = -1, 0
    while True:  # bound: each half-chain is visited once, each face left once
        steps += 1
        if steps & POLL == 0 and stop[0]:
            return 0
        half = h.first[face]
        if half >= 0:
            h.first[face] = h.link[half]
            other = root_of(joined, cycle[half ^ 1])
            if h.entered[other] == _NOT_YET:
                n_sources = _cross_half_chain(given, chains, nesting, h, half, n_sources)
                if nesting.rule != Rule.AGAIN:
                    inside[other] = _part_of(nesting.rule, h, selected, n_sources)
                else:
                    inside[other], n_entries = _classify_face(nesting, h, other, n_sources, n_entries)
                    if n_entries == NO_ROOM:
                        return NO_ROOM
                h.entered[other], face = half, other
        else:
            half = h.entered[face]
            if half < 0:
                break
            n_sources = _cross_half_chain(given, chains, nesting, h, half ^ 1, n_sources)
            face = root_of(joined, cycle[half])
    for i in range(n_cycles):
        inside[i] = inside[root_of(joined, i)]
    return n_entries


@called
def group_provenance_by_region(
    faces: Faces, h: FloodFill, n_entries: int, n_cycles: int, n_rings: int, stop: FlagArray
) -> None:
    """Link the n_entries evidence entries of faces into one list a region, in which each of the n_rings source rings
    occurs once: fill ``h.region`` (first entry) and ``h.after`` (next entry, -1 at the end). ``faces.regions`` is
    filled."""
    for i in range(n_cycles + 1):
        h.region[i] = h.entered[
            i
        ] = -1  # order: from here on `entered` is by region the ring of the result last recorded
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
def record_adjacent_regions(faces: Faces, h: FloodFill, path: Int32Array, first: int, last: int, n_rings: int) -> None:
    """Append to ``h.beyond`` the regions on the other side of the result's ring number n_rings, each once; its
    half-chains are ``path[first:last]``."""
    n = h.offset[n_rings]
    for k in range(first, last):
        region = root_of(faces.regions, faces.cycle[path[k] ^ 1])
        if h.entered[region] != n_rings:
            h.entered[region], h.beyond[n] = n_rings, region
            n += 1
    h.offset[n_rings + 1] = n


@called
def write_evidence(
    h: FloodFill, ring: int, region: int, is_hole: bool, name: int, base: int, evidence: IntArray, n: int
) -> int:  # fmt: skip
    """Append to ``evidence``, after its n rows, a row (``name``, ``base`` + source ring) for each source ring of one
    ring of the result; return the number of rows then, or NO_ROOM. h: the finished flood fill. The sources of a shell
    are those of its region ``region``, the sources of a hole those of the regions on its other side."""
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
