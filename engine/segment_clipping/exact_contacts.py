"""Contacts of a line with triangles under a pose, exactly: their codes, parameters, barycentrics and points.

The numbers are those of exact_lines.py; decisions as in on_boundary/triangle_contacts.py, in the plane of a triangle as
in flat_hits.py, perturbations too.

Source: K. Shoemake, Plucker coordinate tutorial, 1998 (a line passes a triangle on one side of all its edges).
"""

from __future__ import annotations

from engine.compiling.jit import called, inline
from engine.lanes.faces import AXES_BEFORE
from engine.predicates.digits import sign_of
from engine.segment_clipping.exact_lines import (
    ALONG,
    AT_END,
    AT_START,
    AXIS,
    BOTTOM,
    BOTTOM_TOO,
    CORNERS,
    CROSS,
    EDGES,
    FROM,
    IS_LONG,
    NORMAL,
    ONE,
    SCALE,
    SIDES,
    SIDEWAYS,
    START,
    STEP,
    TOP,
    TOP_TOO,
    TOTAL,
    TURNED,
    VALUE,
    VOLUME,
    WAY,
    WITHIN,
    Exact,
    load_triangle,
    put_copy,
    put_difference,
    put_parameter,
    put_pass,
    put_sum,
    put_term,
    quotient_of,
    see_corners,
    set_line,
)  # fmt: skip
from engine.segment_clipping.flat_hits import places_of
from engine.segment_clipping.hit_contacts import BACK, Line
from engine.segment_clipping.on_boundary.contacts import Bit, Kind, Place, code_of, decode_place, overlap_code
from engine.segment_clipping.on_boundary.triangle_contacts import triangle_at
from engine.types import FloatArray


@called
def _side_when_perturbed(s: Exact, first: int) -> int:
    """Return the side of the edge from corner `first` on which the line passes when moved by eps along the axis after
    the one along which it is longest, and by eps^2 along the next; 0 if they are parallel. Moved against these axes if
    it falls along the longest: so is a ray backwards, whose segment rises there."""
    k, side, way = s.state[AXIS], 0, -1 if s.state[TURNED] == BACK else 1
    a, b = CORNERS + 3 * first * STEP, CORNERS + 3 * ((first + 1) % 3) * STEP
    for turn in range(2):
        if side == 0:
            j = AXES_BEFORE[k + 1 - turn]
            put_term(s, 0, a + j * STEP, WAY + k * STEP, 1)
            put_term(s, 1, b + j * STEP, WAY + k * STEP, -1)
            put_term(s, 2, a + k * STEP, WAY + j * STEP, -1)
            put_term(s, 3, b + k * STEP, WAY + j * STEP, 1)
            put_sum(s, 4, VALUE)
            side = sign_of(s.heap, VALUE) * (1 - 2 * turn) * way
    return side


@called
def exact_codes(s: Exact, elements: FloatArray, element: int, line: Line, item: int) -> int:
    """Return the packed codes of the contacts of line number ``item`` and a triangle (contacts.py), APART if there is
    none; DEGENERATE if the triangle has no area, or numbers are too long."""
    set_line(s, line, item)
    load_triangle(s, elements, element)
    ab, bc, ca = sign_of(s.heap, EDGES), sign_of(s.heap, EDGES + STEP), sign_of(s.heap, EDGES + 2 * STEP)
    if s.state[IS_LONG] != 0:
        return Kind.DEGENERATE
    least, most = min(ab, bc, ca), max(ab, bc, ca)
    if least < 0 and most > 0:
        return Kind.APART
    way, of_start, beyond = least + most, sign_of(s.heap, VOLUME), -1
    if way == 0:
        code = _flat_codes(s, elements, element, line.is_ray)
        return Kind.DEGENERATE if s.state[IS_LONG] != 0 else code
    if of_start * way < 0:
        return Kind.APART
    if not line.is_ray:
        put_difference(s, VOLUME, TOTAL, VALUE)
        beyond = sign_of(s.heap, VALUE) * way
        if beyond > 0:
            return Kind.APART
    place, is_crossed = WITHIN, True
    if ab * bc * ca == 0:
        place = 3 if ab == 0 else 4 if bc == 0 else 5
        if (ab == 0) + (bc == 0) + (ca == 0) == 2:
            place = 0 if bc != 0 else 1 if ca != 0 else 2
        forth = sign_of(s.heap, WAY + s.state[AXIS] * STEP)
        ab = forth * ab if ab != 0 else _side_when_perturbed(s, 0)
        bc = forth * bc if bc != 0 else _side_when_perturbed(s, 1)
        ca = forth * ca if ca != 0 else _side_when_perturbed(s, 2)
        if ab * bc * ca == 0:
            return Kind.DEGENERATE
        is_crossed = ab == bc and bc == ca
    if of_start == 0 or beyond == 0:
        place = AT_START if of_start == 0 else AT_END
    return Kind.DEGENERATE if s.state[IS_LONG] != 0 else code_of(place, is_crossed)


@called
def _flat_codes(s: Exact, elements: FloatArray, element: int, is_ray: bool) -> int:
    """Return the packed codes of the overlap of the line with a triangle of its plane, as `exact_codes` does."""
    axis = see_corners(s)
    if axis < 0:
        return Kind.DEGENERATE
    signs = sign_of(s.heap, SIDES), sign_of(s.heap, SIDES + STEP), sign_of(s.heap, SIDES + 2 * STEP)
    if min(signs) > 0 or max(signs) < 0:
        return Kind.APART
    k = s.state[AXIS]
    turn, is_forth = sign_of(s.heap, NORMAL + axis * STEP), sign_of(s.heap, WAY + k * STEP) > 0
    enter, leave = places_of(triangle_at(elements, element), signs, turn, k, is_forth)
    put_pass(s, leave, axis)
    of_last, last_beyond = sign_of(s.heap, TOP), _beyond_end(s, is_ray)
    if of_last < 0:
        return Kind.APART
    put_pass(s, enter, axis)
    of_first, first_beyond = sign_of(s.heap, TOP), _beyond_end(s, is_ray)
    if first_beyond > 0:
        return Kind.APART
    if of_last == 0 or first_beyond == 0 or enter == leave:
        place = AT_END if first_beyond == 0 else enter
        return code_of(AT_START if of_last == 0 or of_first == 0 else place, False) | Bit.ALONG
    return overlap_code(AT_START if of_first <= 0 else enter, AT_END if last_beyond >= 0 else leave)


@inline
def _beyond_end(s: Exact, is_ray: bool) -> int:
    """Return the sign of t - 1 of the stored parameter, -1 for a ray."""
    if is_ray:
        return -1
    put_difference(s, TOP, BOTTOM, VALUE)
    return sign_of(s.heap, VALUE)


@called
def _put_weights(s: Exact, code: int, axis: int, weights: FloatArray) -> bool:
    """Write the barycentrics of a contact, of which `put_parameter` stored the parameter and returned `axis`; return
    whether each is the proven nearest double."""
    place, is_sure = decode_place(code), True
    for k in range(3):
        weights[k] = 0.0
    if axis < 0:
        for k in range(3):
            put_copy(s, EDGES + ((k + 1) % 3) * STEP, TOP)
            put_copy(s, TOTAL, BOTTOM)
            weights[k], _, is_x = quotient_of(s, TOP, BOTTOM)
            is_sure &= is_x
        return is_sure
    if place < 3:
        weights[place] = 1.0
        return True
    i, j = AXES_BEFORE[axis] * STEP, AXES_BEFORE[axis + 1] * STEP
    put_copy(s, BOTTOM, BOTTOM_TOO)
    put_copy(s, TOP, TOP_TOO)
    for k in range(3):
        if place < Place.START:  # of the ends of a side: the sides of the other ends
            first = place - 3
            if k == (first + 2) % 3:
                continue
            a, b = SIDES + first * STEP, SIDES + ((first + 1) % 3) * STEP
            put_term(s, 0, b if k == first else a, ONE, 1 if k == first else -1)
            put_sum(s, 1, TOP)
            put_difference(s, b, a, BOTTOM)
        else:  # at t = top / bottom: w (b x c) + (c - b) x (P + t E), times bottom; over w times the area
            b, c = CORNERS + 3 * ((k + 1) % 3) * STEP, CORNERS + 3 * ((k + 2) % 3) * STEP
            for axis_too in range(3):
                put_term(s, 0, START + axis_too * STEP, BOTTOM_TOO, 1)
                put_term(s, 1, WAY + axis_too * STEP, TOP_TOO, 1)
                put_sum(s, 2, SIDEWAYS + axis_too * STEP)
            put_term(s, 0, SCALE, BOTTOM_TOO, 1)
            put_sum(s, 1, VALUE)
            put_term(s, 0, VALUE, CROSS + (3 * ((k + 1) % 3) + axis) * STEP, 1)
            put_term(s, 1, c + i, SIDEWAYS + j, 1)
            put_term(s, 2, b + i, SIDEWAYS + j, -1)
            put_term(s, 3, c + j, SIDEWAYS + i, -1)
            put_term(s, 4, b + j, SIDEWAYS + i, 1)
            put_sum(s, 5, TOP)
            put_term(s, 0, VALUE, NORMAL + axis * STEP, 1)
            put_sum(s, 1, BOTTOM)
        weights[k], _, is_x = quotient_of(s, TOP, BOTTOM)
        is_sure &= is_x
    return is_sure and s.state[IS_LONG] == 0


@called
def put_exact_contact(
    s: Exact, elements: FloatArray, element: int, code: int, weights: FloatArray, has_weights: bool
) -> tuple[float, bool]:
    """Return the parameter of a contact of the stored line as the nearest double, and whether it is proven; write what
    is beyond it to weights[3], and with `has_weights` the barycentrics to weights[:3]. code: of the contact."""
    axis = put_parameter(s, elements, code, element)
    t, weights[3], is_sure = quotient_of(s, TOP, BOTTOM)
    if has_weights and is_sure:
        is_sure = _put_weights(s, code, axis, weights)
    return t, is_sure and s.state[IS_LONG] == 0


@called
def put_exact_point(
    s: Exact, elements: FloatArray, element: int, code: int, line: Line, item: int, point: FloatArray
) -> bool:
    """Write the point of a contact of line number ``item`` to point[:3]; return whether each coordinate is the proven
    nearest double."""
    set_line(s, line, item)
    put_parameter(s, elements, code, element)
    is_sure = True
    for k in range(3):
        put_term(s, 0, FROM + k * STEP, BOTTOM, 1)
        put_term(s, 1, ALONG + k * STEP, TOP, 1)
        put_sum(s, 2, VALUE)
        point[k], _, is_x = quotient_of(s, VALUE, BOTTOM)
        is_sure &= is_x
    return is_sure and s.state[IS_LONG] == 0


@called
def compare_contacts(
    s: Exact, elements: FloatArray, element: int, code: int, other: int, its: int, line: Line, item: int
) -> int:
    """Return the exact sign of the difference of the parameters of two contacts of line number ``item``; 2 if numbers
    are too long. element, other: the triangles; code, its: the codes of the contacts."""
    set_line(s, line, item)
    put_parameter(s, elements, its, other)
    put_copy(s, TOP, TOP_TOO)
    put_copy(s, BOTTOM, BOTTOM_TOO)
    put_parameter(s, elements, code, element)
    put_term(s, 0, TOP, BOTTOM_TOO, 1)
    put_term(s, 1, TOP_TOO, BOTTOM, -1)
    put_sum(s, 2, VALUE)
    return 2 if s.state[IS_LONG] != 0 else sign_of(s.heap, VALUE)
