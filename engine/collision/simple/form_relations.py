"""Exact relations of axis-aligned boxes and balls under poses; compiled.

A pose that moves, permutes axes and flips signs maps a box to a box. Its bounds are then sums of two doubles, stored
exactly as pairs; only their order on each axis matters, so they are replaced by their ranks. A ball stays a ball under
every pose; a box, or another ball's centre as a box without extent, has a nearest and a farthest point from its centre.
Their squared distances are compared with the sum and difference of radii, squared.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final, NamedTuple

from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, TOUCHING, UNSETTLED
from engine.collision.meshes.contact_kinds import EDGE_EDGE, EDGE_FACE, FACE_FACE, VERTEX_VERTEX
from engine.collision.meshes.placement import has_equal_pose
from engine.compiling.jit import called, inline, kernel
from engine.predicates.error_free import two_sum, workspace
from engine.predicates.expansion import add, add_product, grow, grow_product, is_safe, sign
from engine.predicates.vectors import as_point3, cross, dot, minus
from engine.types import BoolArray, FlagArray, FloatArray, Int8Array, Int32Array, IntArray, Point3

HIGH: Final = 3
RADIUS: Final = 6
IS_BALL: Final = 7
N_NUMBERS: Final = 8
"""Numbers of a box or ball: low corner (3), high corner (3), radius, and 1.0 if it is a ball."""
KIND_AT: Final = 3
FACE_AT: Final = 6
THEIR_FACE_AT: Final = 9
OF_BALL: Final = 1 << 12
RELATION_MASK: Final = (1 << KIND_AT) - 1
"""Bit positions in a code, above the relation, of the kind of contact and of the faces of two boxes. OF_BALL is set in
codes of `relate_form_pairs` where one of the two is a ball."""
_LARGEST: Final = 2.0**1022
_N_PAIRS: Final = 24
_N_RANKS: Final = 12
_THEIRS: Final = 6
"""Ranks of bounds: low and high of the first body on three axes each, then of the second."""
_N_COORDINATE: Final = 32  # 2 components for each of 3 products of either body, two translations, a radius
_N_TOTAL: Final = 1100  # as in `posed.py`
_POLL_EVERY: Final = 256


FormRows = namedtuple("FormRows", "forms kinds turns moves is_posed")
"""Bodies under poses, one a row; row 0 is under none. forms (n_solids, N_NUMBERS): of each solid, NaN if it is neither
ball nor box, or a flat one; kinds (n_rows,): index of the solid; turns (n_rows, d, d), moves (n_rows, d); is_posed
(n_rows,): False where no pose was given."""


class Placed(NamedTuple):
    """A box or ball under a pose: its numbers form (N_NUMBERS,), rotation turn (d, d) and translation move (d,)."""

    form: Any
    turn: Any
    move: Any


@inline
def source_of(turn: FloatArray, axis: int) -> tuple[int, float]:
    """Return (m, s) if row ``axis`` of a rotation has one nonzero entry, s = +-1 in column m; (-1, 0.0) for any other
    row."""
    source, factor = -1, 0.0
    for m in range(turn.shape[0]):
        if turn[axis, m] != 0.0:
            if source >= 0 or abs(turn[axis, m]) != 1.0:
                return -1, 0.0
            source, factor = m, turn[axis, m]
    return source, factor


@inline
def bound_at(form: FloatArray, turn: FloatArray, axis: int, side: int) -> float:
    """Return the low (side 0) or high (side 1) bound on an axis of a box turned by a lattice rotation, before
    translation."""
    source, factor = source_of(turn, axis)
    return factor * form[source + (HIGH if (side == 1) == (factor > 0.0) else 0)]


# ---- two boxes ------------------------------------------------------------------------------------------------------


@inline
def _place(a: Placed, w: Any, first: int) -> bool:
    """Write the bounds of a posed box as exact sums of two doubles to w[first:], at 4 axis + 2 side (0 low, 1 high).
    Returns False if the pose does not map axes to axes, or a bound is out of range."""
    form, turn, move = a
    for axis in range(turn.shape[0]):
        if source_of(turn, axis)[0] < 0:
            return False
        for side in range(2):
            at = first + 4 * axis + 2 * side
            w[at], w[at + 1] = two_sum(bound_at(form, turn, axis, side), move[axis])
            if not abs(w[at]) < _LARGEST:
                return False
    return True


@inline
def _rank(w: Any, d: int, ranks: Any) -> None:
    """Write to ranks[3 i + axis] how many of the four bounds on the axis are smaller than bound i: low, high of the
    first box, low, high of the second. w: 24 numbers, the bounds that `_place` wrote; pairs compare lexicographically.
    """
    for axis in range(d):
        for i in range(4):
            ranks[3 * i + axis] = 0.0
            for j in range(4):
                one, other = 4 * axis + 2 * i + (8 if i > 1 else 0), 4 * axis + 2 * j + (8 if j > 1 else 0)
                is_less = w[other] < w[one] or (w[other] == w[one] and w[other + 1] < w[one + 1])
                ranks[3 * i + axis] += 1.0 if is_less else 0.0


def relate_boxes(low: Any, high: Any, their_low: Any, their_high: Any) -> int:
    """Return the relation code of two closed boxes given by corners (d,), flat ones too; corners may be ranks."""
    meet = solid = i_within = j_within = interiors = True
    for axis in range(len(low)):
        a0, a1, b0, b1 = low[axis], high[axis], their_low[axis], their_high[axis]
        meet &= a0 <= b1 and b0 <= a1
        i_within &= b0 < a0 and a1 < b1
        j_within &= a0 < b0 and b1 < a1
        solid &= a0 < a1 and b0 < b1
        interiors &= a0 < b1 and b0 < a1
    if not meet:
        return DISJOINT
    if i_within or j_within:
        return FIRST_INSIDE_SECOND if i_within else SECOND_INSIDE_FIRST
    return OVERLAPPING if solid and interiors else TOUCHING


_relate = inline(relate_boxes)


@kernel
def relate_box_pairs(
    low: FloatArray, high: FloatArray, is_box: BoolArray, pairs: IntArray, relations: Int8Array
) -> None:
    """Fill relations (n,) int8 for those pairs (n, 2) of bodies that are both unposed boxes, is_box (n_bodies,). low,
    high (n_bodies, d): their corners."""
    for item in range(pairs.shape[0]):
        i, j = pairs[item, 0], pairs[item, 1]
        if is_box[i] and is_box[j]:
            relations[item] = _relate(low[i], high[i], low[j], high[j])


@inline
def _face(turn: FloatArray, axis: int, side: int) -> int:
    """Return the face of a box that a lattice rotation maps to side 0 (low) or 1 (high) of an axis."""
    source, factor = source_of(turn, axis)
    return 2 * source + (side if factor > 0.0 else 1 - side)


@inline
def _is_between(ranks: Any, body: int, axis: int, rank: float) -> bool:
    """Return whether a rank lies strictly between those of the bounds of body 0 or 1 on an axis."""
    return bool(ranks[_THEIRS * body + axis] < rank < ranks[_THEIRS * body + 3 + axis])


@called
def _name_overlap(ranks: Any, turn: FloatArray, their_turn: FloatArray) -> int:
    """Return kind | face << 3 | their_face << 6 of a contact of two boxes of space that overlap, or UNSETTLED. ranks:
    of their bounds (`_rank`). Faces in one plane on one side share an area. If there are none, an edge of one box
    passes through a face of the other: on each axis either both ends of one box lie within the other, or one of each.
    """
    for face in range(6):
        axis, side = face >> 1, face & 1
        if ranks[3 * side + axis] == ranks[_THEIRS + 3 * side + axis]:
            return FACE_FACE | _face(turn, axis, side) << 3 | _face(their_turn, axis, side) << 6
    for item in range(48):
        own, k, s, p, q = item & 1, item >> 4, item >> 1 & 1, item >> 2 & 1, item >> 3 & 1
        i, j, their = (k + 1) % 3, (k + 2) % 3, 1 - own
        if not _is_between(ranks, own, k, ranks[_THEIRS * their + 3 * s + k]):
            continue
        if not _is_between(ranks, their, i, ranks[_THEIRS * own + 3 * p + i]):
            continue
        if not _is_between(ranks, their, j, ranks[_THEIRS * own + 3 * q + j]):
            continue
        own_turn, other_turn = (turn, their_turn) if own == 0 else (their_turn, turn)
        edge, face = _face(own_turn, i, p), _face(other_turn, k, s)
        return EDGE_FACE | (edge << 3 | face << 6 if own == 0 else face << 3 | edge << 6)
    return UNSETTLED


@inline
def _name_touching(ranks: Any, turn: FloatArray, their_turn: FloatArray) -> int:
    """Return kind | face << 3 | their_face << 6 of the contact of two boxes of space that touch. ranks: of their bounds
    (`_rank`). They share a part of a face, an edge or a vertex, by the number of axes on which they only touch; faces:
    on the first of these."""
    n, faces = -1, 0
    for axis in range(3):
        side = 1 if ranks[3 + axis] == ranks[_THEIRS + axis] else 0
        if side == 1 or ranks[_THEIRS + 3 + axis] == ranks[axis]:
            n += 1
            if n == 0:
                faces = _face(turn, axis, side) << 3 | _face(their_turn, axis, 1 - side) << 6
    return faces | (FACE_FACE if n == 0 else (EDGE_EDGE if n == 1 else VERTEX_VERTEX))


@inline
def _axis(a: Placed, k: int) -> Point3:
    """Return the direction of side k of a posed box: column k of its rotation."""
    return Point3(a.turn[0, k], a.turn[1, k], a.turn[2, k])


@inline
def _middle(a: Placed) -> Point3:
    """Return the rounded centre of a box under its pose."""
    form, turn, move = a
    c = Point3(0.5 * (form[0] + form[HIGH]), 0.5 * (form[1] + form[HIGH + 1]), 0.5 * (form[2] + form[HIGH + 2]))
    x, y, z = as_point3(turn, 0), as_point3(turn, 1), as_point3(turn, 2)
    return Point3(dot(x, c) + move[0], dot(y, c) + move[1], dot(z, c) + move[2])


@called
def _has_separating_axis(a: Placed, b: Placed) -> bool:
    """Return whether a face normal of either box, or a cross product of two, provably separates two posed boxes of
    space.

    Along a direction d, as computed, a box reaches from its centre by half its sides times |d . axis|. With S for the
    magnitudes of translations and 3.1 times those of coordinates, as the entries of a column of a rotation add up to at
    most 1.75, d . (centre - centre) is off by less than 10 u |d|_1 S (u = 2^-53), six products by 20 u and their sum by
    12 u of that: below 2^-46 |d|_1 S in all; underflow is below 2^-1060 S, or 2^-1000.
    """
    between, size = minus(_middle(b), _middle(a)), 0.0
    for k in range(3):
        reach = max(abs(a.form[k]), abs(a.form[HIGH + k])) + max(abs(b.form[k]), abs(b.form[HIGH + k]))
        size += 3.1 * reach + abs(a.move[k]) + abs(b.move[k])
    if not size < 2.0**1000:
        return False
    for item in range(15):
        d = _axis(a, item) if item < 3 else _axis(b, item % 3)
        if item >= 6:
            d = cross(_axis(a, item // 3 - 2), d)
        gap = abs(dot(d, between)) - (2.0**-46 * (abs(d.x) + abs(d.y) + abs(d.z)) + 2.0**-1060) * size - 2.0**-1000
        for k in range(3):
            gap -= 0.5 * (a.form[HIGH + k] - a.form[k]) * abs(dot(d, _axis(a, k)))
            gap -= 0.5 * (b.form[HIGH + k] - b.form[k]) * abs(dot(d, _axis(b, k)))
        if gap > 0.0:
            return True
    return False


@inline
def _relate_boxes(a: Placed, b: Placed) -> int:
    """Return the code (`relate_forms`) of two posed boxes; UNSETTLED if a pose mixes axes."""
    w, ranks, d = workspace(_N_PAIRS), workspace(_N_RANKS), a.turn.shape[0]
    if not (_place(a, w, 0) and _place(b, w, 12)):
        return UNSETTLED
    _rank(w, d, ranks)
    relation = _relate(ranks[:d], ranks[3 : 3 + d], ranks[_THEIRS : _THEIRS + d], ranks[_THEIRS + 3 : _THEIRS + 3 + d])
    if d == 2 or relation < OVERLAPPING:
        return relation
    touch = relation == TOUCHING
    name = _name_touching(ranks, a.turn, b.turn) if touch else _name_overlap(ranks, a.turn, b.turn)
    return name if name == UNSETTLED else relation | name << KIND_AT


# ---- against a ball -------------------------------------------------------------------------------------------------


@inline
def _grow_coordinate(e: Any, n: int, a: Placed, axis: int, side: int, factor: float) -> int:
    """Add ``factor`` (+-1) times a bound of a posed box on an axis (side 0 low, 1 high), or a coordinate of a posed
    ball's centre, to expansion e of n components. Returns the new number of components."""
    form, turn, move = a
    if form[IS_BALL] == 0.0:
        n = grow(e, n, factor * bound_at(form, turn, axis, side))
    else:
        for m in range(turn.shape[0]):
            n = grow_product(e, n, factor * turn[axis, m], form[m])
    return grow(e, n, factor * move[axis])


@inline
def _are_safe(a: Placed) -> bool:
    """Return whether expansions of degree four are exact for the numbers of a posed box or ball, and a box is mapped to
    a box."""
    form, turn, move = a
    safe = is_safe(form[RADIUS])
    for axis in range(turn.shape[0]):
        safe = safe and is_safe(form[axis]) and is_safe(form[HIGH + axis]) and is_safe(move[axis])
        safe = safe and (form[IS_BALL] != 0.0 or source_of(turn, axis)[0] >= 0)
        for m in range(turn.shape[0]):
            safe = safe and is_safe(turn[axis, m])
    return safe


@inline
def _outside(e: Any, a: Placed, ball: Placed, axis: int, side: int) -> int:
    """Set expansion e to how far the centre of `ball` lies beyond the low (side 0) or high (side 1) bound of box a on
    an axis, negative if it does not; of a ball a: beyond its centre. Returns the number of components."""
    factor = 1.0 if side == 0 else -1.0
    n = _grow_coordinate(e, 0, a, axis, side, factor)
    return _grow_coordinate(e, n, ball, axis, 0, -factor)


@called
def _order(a: Placed, ball: Placed, is_far: bool, factor: float) -> int:
    """Return the exact sign of distance^2 - (r + factor s)^2, r the radius of `ball` and s that of a. Distance: from
    the ball's centre to the nearest point of box a (or a's centre); if is_far, to the farthest."""
    total, n = workspace(_N_TOTAL), 0
    below, above, both = workspace(_N_COORDINATE), workspace(_N_COORDINATE), workspace(_N_COORDINATE)
    for axis in range(a.turn.shape[0]):
        m = _outside(below, a, ball, axis, 0)
        k = _outside(above, a, ball, axis, 1)
        is_below = sign(below, m) > 0
        if is_far:  # of both, of which the sum is negative, the lesser is the farther
            for i in range(m):
                both[i] = -below[i]
            is_below = sign(both, add(both, m, above, k)) > 0
        elif not is_below and sign(above, k) < 0:
            k = 0
        n = add_product(total, n, below, m, below, m) if is_below else add_product(total, n, above, k, above, k)
    m = grow(below, grow(below, 0, ball.form[RADIUS]), factor * a.form[RADIUS])
    k = grow(above, grow(above, 0, -ball.form[RADIUS]), -factor * a.form[RADIUS])
    return sign(total, add_product(total, n, below, m, above, k))


@called
def _is_within(a: Placed, ball: Placed) -> bool:
    """Return whether a ball lies in the open interior of a box; exact."""
    e = workspace(_N_COORDINATE)
    for axis in range(a.turn.shape[0]):
        for side in range(2):
            n = _outside(e, a, ball, axis, side)
            if sign(e, grow(e, n, ball.form[RADIUS])) >= 0:
                return False
    return True


@inline
def _relate_to_ball(a: Placed, ball: Placed) -> int:
    """Return the relation code of a box or ball (first) and a ball (second), exact; UNSETTLED if expansions are not
    exact or a box is rotated."""
    r, s, is_ball = ball.form[RADIUS], a.form[RADIUS], a.form[IS_BALL] != 0.0
    if not (_are_safe(a) and _are_safe(ball)):
        return UNSETTLED
    by_sum = _order(a, ball, False, 1.0)
    if by_sum > 0:
        return DISJOINT
    # of balls the farthest point is the nearest: the centre
    if (r > s or is_ball) and _order(a, ball, True, -1.0) < 0:
        return FIRST_INSIDE_SECOND if r > s else SECOND_INSIDE_FIRST
    if not is_ball and _is_within(a, ball):
        return SECOND_INSIDE_FIRST
    return OVERLAPPING if by_sum < 0 and r > 0.0 and (s > 0.0 or not is_ball) else TOUCHING


@kernel
def relate_forms(
    form: FloatArray, turn: FloatArray, move: FloatArray, other: FloatArray, their_turn: FloatArray,
    their_move: FloatArray,
) -> int:  # fmt: skip
    """Return a code of two boxes or balls, a box before a ball, each with rotation (d, d) and translation (d,): the
    relation, or UNSETTLED if undecided. For two intersecting boxes of space also the kind of contact << KIND_AT and the
    faces << FACE_AT, << THEIR_FACE_AT."""
    a, b = Placed(form, turn, move), Placed(other, their_turn, their_move)
    if other[IS_BALL] != 0.0:
        return _relate_to_ball(a, b)
    code = _relate_boxes(a, b)
    return DISJOINT if code == UNSETTLED and turn.shape[0] == 3 and _has_separating_axis(a, b) else code


@kernel
def relate_form_pairs(
    table: FormRows, pairs: IntArray, relations: Int8Array, is_named: bool, with_balls: bool, codes: Int32Array,
    flag: FlagArray,
) -> None:  # fmt: skip
    """Write the codes (n,) int32 of those pairs (n, 2) of rows whose relations (n,) are UNSETTLED, exact; UNSETTLED
    where one of the two is neither box nor ball or `relate_forms` decides nothing. Equal poses count as none.

    is_named: also where a witness would need the edges of a box, in the plane, or the face of a posed box before a
    ball. with_balls: also pairs with a ball. Returns early when the flag is set."""
    forms, kinds, turns, moves, is_posed = table
    d = moves.shape[1]
    for item in range(pairs.shape[0]):
        i, j = pairs[item, 0], pairs[item, 1]
        first, second = kinds[i], kinds[j]
        codes[item] = UNSETTLED
        if item % _POLL_EVERY == 0 and flag[0] != 0:
            return
        n_balls = forms[first, IS_BALL] + forms[second, IS_BALL]  # NaN if one is neither
        if relations[item] != UNSETTLED or not 0.0 <= n_balls <= (2.0 if with_balls else 0.0):
            continue
        is_swapped = n_balls == 1.0 and forms[first, IS_BALL] == 1.0  # the box comes first
        if is_swapped:
            i, j, first, second = j, i, second, first
        are_boxes = n_balls == 0.0
        if is_named and ((d == 2 and are_boxes) or (n_balls == 1.0 and is_posed[i])):
            continue
        if has_equal_pose(turns, moves, i, j):
            i = j = 0
        a, b = Placed(forms[first], turns[i], moves[i]), Placed(forms[second], turns[j], moves[j])
        code = _relate_boxes(a, b) if are_boxes else _relate_to_ball(a, b)
        if is_swapped and FIRST_INSIDE_SECOND <= code <= SECOND_INSIDE_FIRST:
            code = FIRST_INSIDE_SECOND + SECOND_INSIDE_FIRST - code
        codes[item] = code | OF_BALL if n_balls > 0.0 and code != UNSETTLED else code
