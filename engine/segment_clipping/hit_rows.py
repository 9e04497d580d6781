"""From the contacts of one line to the rows of its hits, compiled.

Contacts at one parameter are one hit. Their parameters are double-doubles, within 2^-67 of themselves: where that does
not prove two apart they must be one point by their codes, or exact signs decide (exact_contacts.py); where numbers are
too long the line stays OPEN.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final

from engine.compiling.jit import called, inline
from engine.segment_clipping.exact_contacts import compare_contacts, put_exact_point
from engine.segment_clipping.exact_lines import Exact
from engine.segment_clipping.hit_contacts import Line
from engine.segment_clipping.on_boundary.boundary_cut import UNSURE, Crossings, sort_crossings
from engine.segment_clipping.on_boundary.contacts import Bit, Place, are_same_point, decode_place
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh
from engine.segment_clipping.on_boundary.triangle_contacts import are_flush
from engine.segment_clipping.pieces import put_point
from engine.types import FlagArray, FloatArray

ACROSS, TOUCH, RIM, END, ALONG = 0, 1, 2, 3, 4
Rows = namedtuple("Rows", "source t t_end triangle kind barycentric")
"""Hits as columns. Of triangles near only source and triangle."""
_LOW: Final = 2.0**-67
_SIDES: Final = (5, 3, 6, 1, 2, 4)
"""The sides, as bits, on which each place of a triangle (corners 0, 1, 2, sides 3, 4, 5) lies."""


@inline
def _are_apart(cuts: Crossings, i: int, j: int) -> bool:
    """Return whether two contacts are proven to have different parameters."""
    t, other = cuts.t[i], cuts.t[j]
    return t != other or abs(cuts.points[i, 3] - cuts.points[j, 3]) > 2.0**-65 * abs(t)


@inline
def _sort(cuts: Crossings, n: int) -> None:
    """Sort n contacts along the line into cuts.order; those that are not proven apart by their doubles t anyhow."""
    sort_crossings(cuts, n)
    for at in range(1, n):  # t alone is in order: runs of equal t are short
        i, place, t = cuts.order[at], at, cuts.t[cuts.order[at]]
        while (
            place > 0
            and cuts.t[cuts.order[place - 1]] == t
            and cuts.points[cuts.order[place - 1], 3] > cuts.points[i, 3]
        ):
            cuts.order[place] = cuts.order[place - 1]
            place -= 1
        cuts.order[place] = i


@called
def order_contacts(mesh: Mesh, line: Line, item: int, cuts: Crossings, n: int, exact: Exact) -> int:
    """Sort n contacts of a line along it, those that are not in the point of the one before with `Bit.LATER`; return n,
    or UNSURE if some that are not proven apart may be different points."""
    cuts.order[0] = 0
    if n > 1:
        _sort(cuts, n)
    for last in range(1, n):
        i, place, sign = cuts.order[last], last, 0
        while place > 0:
            sign = _compare(mesh, line, item, cuts, i, cuts.order[place - 1], exact)
            if sign >= 0:
                break
            cuts.order[place] = cuts.order[place - 1]
            place -= 1
        if sign > 1:
            return UNSURE
        cuts.order[place] = i
        if place > 0 and sign > 0:
            cuts.codes[i] |= Bit.LATER
        if place < last:
            cuts.codes[cuts.order[place + 1]] |= Bit.LATER
    return n


@inline
def _compare(mesh: Mesh, line: Line, item: int, cuts: Crossings, i: int, j: int, exact: Exact) -> int:
    """Return the sign of the difference of the parameters of two contacts in the order of `_sort`; 2 if it is open.
    Triangles of one plane in which the line does not lie are met in one point."""
    if _are_apart(cuts, i, j):
        return 1
    element, code, other, its = cuts.met[i], cuts.codes[i], cuts.met[j], cuts.codes[j]
    if are_same_point(mesh.elements, other, its, element, code) or (
        (code | its) & Bit.ALONG == 0 and are_flush(mesh.elements, other, element)
    ):
        return 0
    return compare_contacts(exact, mesh.elements, element, code, other, its, line, item)


@inline
def write_hits(
    mesh: Mesh, rims: FlagArray, cuts: Crossings, n: int, is_first: bool, source: int, out: Rows, row: int
) -> int:
    """Write the hits that n contacts, ordered, make to `out` from `row` on, with `is_first` one; return the next."""
    place, n_rows = 0, 1 if is_first else n
    while place < n and n_rows > 0:  # bound: each turn passes a contact
        first, n_rows = cuts.order[place], n_rows - 1
        here, best, turns, is_rim, n_along = first, first, 0, False, 0
        while place < n:
            i = cuts.order[place]
            element, code = cuts.met[i], cuts.codes[i]
            if i != first and code & Bit.LATER != 0:
                if n_along == 0:
                    break
                here = i
            turns ^= code & 1
            n_along += (code & Bit.BEGINS != 0) - (code & Bit.CEASES != 0)
            if here == first:
                at = decode_place(code)
                is_rim |= at < Place.START and rims[element] & _SIDES[at] != 0
                if _comes_before(mesh, cuts, i, best):
                    best = i
            place += 1
        is_end = Place.START <= decode_place(cuts.codes[first]) <= Place.END
        out.source[row], out.t[row], out.t_end[row], out.triangle[row] = (
            source,
            cuts.t[first],
            cuts.t[here],
            cuts.met[best],
        )
        out.kind[row] = END if is_end else RIM if is_rim else ACROSS if turns == 1 else TOUCH
        if here != first:
            out.kind[row] = ALONG
        for k in range(3):
            out.barycentric[row, k] = cuts.points[best, k]
        row += 1
    return row


@called
def write_contacts(
    mesh: Mesh, lines: FloatArray, item: int, line: Line, cuts: Crossings, n: int, exact: Exact, out: Rows, row: int
) -> int:
    """Write n contacts, ordered, of a segment under a pose to `out` from `row` on: in t_end their
    codes, in barycentric their points; return the next row, or UNSURE."""
    for place in range(n):
        i = cuts.order[place]
        t, low, code, point = cuts.t[i], cuts.points[i, 3], cuts.codes[i], out.barycentric[row]
        out.source[row], out.t[row], out.triangle[row], out.t_end[row] = item, t, cuts.met[i], code
        if Place.START <= decode_place(code) <= Place.END:
            for k in range(3):
                point[k] = lines[item, decode_place(code) - Place.START, k] + 0.0
        elif not put_point(point, lines, item, t, low, _LOW) and not put_exact_point(
            exact, mesh.elements, cuts.met[i], code, line, item, point
        ):
            return UNSURE
        row += 1
    return row


@inline
def _comes_before(mesh: Mesh, cuts: Crossings, i: int, j: int) -> bool:
    """Return whether the triangle of contact i counts before that of contact j at the same point: those in whose plane
    the line lies are the last, then the least face counts."""
    is_along, is_other = cuts.codes[i] & Bit.ALONG, cuts.codes[j] & Bit.ALONG
    if is_along != is_other:
        return is_along < is_other
    face, other = mesh.faces[cuts.met[i]], mesh.faces[cuts.met[j]]
    return face < other or (face == other and cuts.met[i] < cuts.met[j])
