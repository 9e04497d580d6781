"""What is known of a cut vertex beside its coordinates, and what exact signs settle from that.

origins: (room, 5) int64, for each vertex of a ring

    EDGE                  the original edge that goes on from it, by its first vertex; -1 for one along a plane
    PLANES                a bit for each plane known to hold it
    CORNER                planes among them that meet in one point only, 0 where none are known
    CUT_EDGE, CUT_PLANE   the original edge and the plane that it was cut from, -1 for neither

A bit stands for a place in `cutting`, the planes that matter. Where double-doubles leave a sign or an equality open, it
is often exactly zero, and one of these says why: an edge through a corner of the region, planes that meet in a point, a
line of two planes along which a coordinate is zero.
"""

from __future__ import annotations

from typing import Any, Final

from engine.clipping.cut_point import is_safe
from engine.clipping.cut_vertices import VALUE_BOUND, compare_vertices, is_double_row
from engine.clipping.cyrus_beck import exact_sign, expand_value
from engine.jit import inline
from engine.predicates.error_free import two_prod, workspace
from engine.predicates.expansion import sign
from engine.predicates.parameters import compare_products
from engine.types import UNDECIDED

EDGE: Final = 0
PLANES: Final = 1
CORNER: Final = 2
CUT_EDGE: Final = 3
CUT_PLANE: Final = 4
COLUMNS: Final = 5
MOST_BITS: Final = 62
"""Planes that have a bit each; of those after them nothing is remembered."""
TINY: Final = 2.0**-1000
"""Products that underflow."""


@inline
def are_crossing(high: Any, i: int, j: int) -> bool:
    """Tell whether two planes of space surely cross: a minor of their normals is not zero."""
    for k in range(3):
        following = k + 1 if k < 2 else 0
        first, second = high[i, k] * high[j, following], high[i, following] * high[j, k]
        if abs(first - second) > VALUE_BOUND * (abs(first) + abs(second)) + TINY:
            return True
    return False


@inline
def corner_planes(high: Any, cutting: Any, shared: int, i_plane: int) -> int:
    """Return planes, a bit each, that meet in one point only: those that an edge runs along and one that cuts it.

    shared: the planes that the edge runs along. 0 where no such planes are known.
    """
    if i_plane >= MOST_BITS or shared == 0:
        return 0
    first = -1
    for bit in range(i_plane):
        if shared >> bit & 1 == 0:
            continue
        if high.shape[1] == 3:
            return 1 << bit | 1 << i_plane
        if first >= 0 and are_crossing(high, cutting[first], cutting[bit]):
            return 1 << first | 1 << bit | 1 << i_plane
        if first < 0:
            first = bit
    return 0


@inline
def settle_corner(high: Any, low: Any, cutting: Any, corner: int, points: Any, j: int) -> None:
    """Make vertex j, where the planes of `corner` meet, a point of doubles if exact signs say that it is one."""
    point = workspace(4)
    for k in range(points.shape[1]):
        h, rest, bound = points[j, k, 0], points[j, k, 1], points[j, k, 2]
        if abs(rest) > bound:
            return
        point[k] = h if abs(h) > bound else 0.0
        if not is_safe(point[k]):
            return
    for bit in range(MOST_BITS):
        if corner >> bit & 1 and not (is_double_row(low[cutting[bit]]) and exact_sign(high[cutting[bit]], point) == 0):
            return
    for k in range(points.shape[1]):
        points[j, k, 0], points[j, k, 1], points[j, k, 2] = point[k], 0.0, 0.0


@inline
def settle_zeros(high: Any, low: Any, cutting: Any, shared: int, i_plane: int, points: Any, j: int) -> None:
    """Make coordinates of vertex j exactly zero that are so all along the line of two planes that hold it.

    Two planes of space whose normals without component k are parallel meet where x_k is one number; it is zero where
    their offsets are in the same ratio.
    """
    own = cutting[i_plane]
    for k in range(3):
        if points[j, k, 2] == 0.0 or abs(points[j, k, 0]) > points[j, k, 2]:
            continue
        a, b = (k + 1) % 3, (k + 2) % 3
        for bit in range(min(i_plane, MOST_BITS)):
            other = cutting[bit]
            if shared >> bit & 1 == 0 or not (is_double_row(low[own]) and is_double_row(low[other])):
                continue
            if (
                are_equal_products(high[own, a], high[other, b], high[own, b], high[other, a])
                and are_equal_products(high[own, a], high[other, 3], high[own, 3], high[other, a])
                and are_equal_products(high[own, b], high[other, 3], high[own, 3], high[other, b])
                and are_crossing(high, own, other)
            ):
                points[j, k, 0], points[j, k, 1], points[j, k, 2] = 0.0, 0.0, 0.0
                break


@inline
def are_equal_products(a: float, b: float, c: float, d: float) -> bool:
    """Tell whether a b = c d exactly; within the safe range."""
    h, low = two_prod(a, b)
    other_h, other_low = two_prod(c, d)
    return h == other_h and low == other_low


@inline
def sign_on_edge(high: Any, low: Any, cutting: Any, ring: Any, n_ring: int, edge: int, by: int, plane: int) -> int:
    """Return the exact sign of a plane where an original edge crosses plane ``cutting[by]``, or UNDECIDED."""
    row_i, row_j = high[cutting[by]], high[plane]
    if not (is_double_row(low[cutting[by]]) and is_double_row(low[plane])):
        return UNDECIDED
    after = edge + 1 if edge + 1 < n_ring else 0
    p_i, q_i, p_j, q_j, e = workspace(8), workspace(8), workspace(8), workspace(8), workspace(200)
    n_pi, n_qi = expand_value(row_i, ring[edge, :, 0], p_i), expand_value(row_i, ring[after, :, 0], q_i)
    n_pj, n_qj = expand_value(row_j, ring[edge, :, 0], p_j), expand_value(row_j, ring[after, :, 0], q_j)
    sign_p, sign_q = sign(p_j, n_pj), sign(q_j, n_qj)
    if sign_p * sign_q >= 0:
        return sign_p if sign_p != 0 else sign_q
    order = compare_products(q_i, n_qi, p_j, n_pj, p_i, n_pi, q_j, n_qj, e)  # the weights of both ends, times values
    return sign_p if order > 0 else (sign_q if order < 0 else 0)


@inline
def relation_of(points: Any, origins: Any, i: int, j: int) -> int:
    """Return `compare_vertices`, or 0 where planes that meet in one point only hold both vertices."""
    relation = compare_vertices(points, i, j)
    if relation == UNDECIDED:
        for a, b in ((i, j), (j, i)):
            if origins[a, CORNER] != 0 and origins[a, CORNER] & origins[b, PLANES] == origins[a, CORNER]:
                return 0
    return relation
