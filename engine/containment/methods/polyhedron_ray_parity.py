"""Point location in a polyhedron by ray parity (crossing number, even-odd over triangles), exact, one ray a point.

The ray goes straight up from q = (x, y, z), moved by the symbolic (eps, eps^2, 0) (simulation of simplicity). So moved,
no vertex, no edge and no vertical triangle is above q, and every other triangle is crossed in its interior or missed:

| test | decision |
|---|---|
| orient2d(a, b, q), (b, c, q), (c, a, q) have the area's sign | q' is in the projection; zeros: see orientation.py |
| orient3d(a, b, c, q) | whether the triangle is above q or below |
| orient3d = 0, q in the closed projection | q is on the triangle: BOUNDARY, whatever the parity |
| all three orient2d = 0 (their sum is the area) | the triangle is vertical or degenerate: tested for BOUNDARY only |

In the last case q is on the triangle if it is in its plane and no projection has q on both sides of its edges; that
also holds for triangles that are a segment or a point.

Both triangles at an edge decide the zero on their common edge alike, so the parity is that of a generic ray close to q
for every surface that is even at each edge: also self-intersecting, non-manifold and degenerate ones.

A tree of boxes (bvh.py) gives the triangles above q; its float32 boxes contain theirs, and q is widened by more than
its own rounding. Eight triangles at a time are counted or excluded in single precision (`overhead`), the rest one by
one. A q with a blur (methods/filters.py) is located if all of its rays agree, else UNDECIDED.

Source: ray parity after Shimrat 1962 and the textbook.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.bounding.bvh import LEAST, STACK, WIDTH
from engine.compiling.jit import allocating_kernel, called, inline, kernel, merged
from engine.containment.methods.filters import NOT_FINITE, has_not_finite, orient2d_blurred
from engine.lanes.boxes import EMPTY, inside_box
from engine.lanes.faces import BAND, GROWTH, LEAST_REACH, OVERHEAD_ROWS, overhead
from engine.lanes.lanes import count_bits, lowest_bit
from engine.predicates.orientation import (
    orient2d,
    orient2d_exact,
    orient2d_filter,
    orient3d_exact,
    orient3d_filter,
    tie_sign,
)
from engine.predicates.posed import orient3d_rounded
from engine.predicates.vectors import as_point3, corners_of
from engine.types import UNDECIDED, FlagArray, Float32Array, FloatArray, Int8Array, Int32Array, IntArray, Point2, Point3

MISSED: Final = 0
CROSSED: Final = 1
ON_FACE: Final = 3
"""How the upward ray meets a triangle (CROSSED, MISSED), or ON_FACE: its start is on it. Else UNDECIDED: a sign is out
of the compiled range."""
BEYOND: Final = 4
"""Bit added to such a code where the filter left a sign open."""
_SLACK: Final = 2.0**-22
"""Widening of a coordinate, relative to its size in the tree: more than its rounding to float32 and that of boxes near
it."""
_ABOVE_ALL: Final = np.float32(8.0)


@inline
def orient2d_with_stage(a: Point2, b: Point2, c: Point2) -> Any:
    """Return the exact sign of orient2d(a, b, c), and 0 if the filter proved it, else BEYOND."""
    turn = orient2d_filter(a, b, c)
    if turn != UNDECIDED:
        return turn, 0
    return orient2d_exact(a, b, c), BEYOND


@inline
def perturbed_sign(turn: int, a: Point2, b: Point2) -> int:
    """Return `turn` = orient2d(a, b, q); where that is 0, its sign for q + (eps, eps^2)."""
    return turn if turn != 0 else tie_sign(a.x, a.y, b.x, b.y)


@inline
def has_both_signs(first: int, second: int, third: int) -> bool:
    """Return whether both 1 and -1 are among three signs; UNDECIDED counts as neither."""
    has_left = first == 1 or second == 1 or third == 1
    has_right = first == -1 or second == -1 or third == -1
    return has_left and has_right


@inline
def touch_in_plane(a: Point2, b: Point2, c: Point2, q: Point2) -> int:
    """Return whether q is in the planar triangle abc: MISSED if left of one edge and right of another, else ON_FACE or
    UNDECIDED."""
    first, second, third = orient2d(a, b, q), orient2d(b, c, q), orient2d(c, a, q)
    if has_both_signs(first, second, third):
        return MISSED
    if first == UNDECIDED or second == UNDECIDED or third == UNDECIDED:
        return UNDECIDED
    return ON_FACE


@inline
def touch_triangle(a: Point3, b: Point3, c: Point3, q: Point3) -> int:
    """Return ON_FACE if q lies on the closed triangle abc, which may be degenerate, else MISSED or UNDECIDED. Caller
    guarantees that q lies in the triangle's box."""
    side = orient3d_filter(a, b, c, q)
    if side != UNDECIDED:
        return MISSED
    side = orient3d_exact(a, b, c, q)
    if side == 1 or side == -1:
        return MISSED | BEYOND
    is_open = side == UNDECIDED
    for axis in range(3):
        if axis == 0:
            met = touch_in_plane(Point2(a.y, a.z), Point2(b.y, b.z), Point2(c.y, c.z), Point2(q.y, q.z))
        elif axis == 1:
            met = touch_in_plane(Point2(a.z, a.x), Point2(b.z, b.x), Point2(c.z, c.x), Point2(q.z, q.x))
        else:
            met = touch_in_plane(Point2(a.x, a.y), Point2(b.x, b.y), Point2(c.x, c.y), Point2(q.x, q.y))
        if met == MISSED:
            return MISSED | BEYOND
        is_open |= met == UNDECIDED
    return (UNDECIDED if is_open else ON_FACE) | BEYOND


@inline
def meet_upwards(a: Point3, b: Point3, c: Point3, q: Point3) -> int:
    """Return how the upward ray from q + (eps, eps^2, 0) meets triangle abc: CROSSED, MISSED, ON_FACE (q is on it) or
    UNDECIDED. BEYOND is added where the filter left a sign open."""
    if q.z > max(a.z, b.z, c.z):
        return MISSED
    a2, b2, c2, q2 = Point2(a.x, a.y), Point2(b.x, b.y), Point2(c.x, c.y), Point2(q.x, q.y)
    first, beyond = orient2d_with_stage(a2, b2, q2)
    second, more = orient2d_with_stage(b2, c2, q2)
    if first * second == -1:
        return MISSED | beyond | more
    third, most = orient2d_with_stage(c2, a2, q2)
    beyond |= more | most
    if has_both_signs(first, second, third):
        return MISSED | beyond
    if first == UNDECIDED or second == UNDECIDED or third == UNDECIDED:
        return UNDECIDED | beyond
    area = first if first != 0 else second if second != 0 else third
    if area == 0:
        is_outside = q.x < min(a.x, b.x, c.x) or q.x > max(a.x, b.x, c.x)
        is_outside |= q.y < min(a.y, b.y, c.y) or q.y > max(a.y, b.y, c.y)
        return (MISSED if is_outside or q.z < min(a.z, b.z, c.z) else touch_triangle(a, b, c, q)) | beyond
    is_inside = perturbed_sign(first, a2, b2) == area and perturbed_sign(second, b2, c2) == area
    is_inside = is_inside and perturbed_sign(third, c2, a2) == area
    if q.z < min(a.z, b.z, c.z):
        return (CROSSED if is_inside else MISSED) | beyond
    side = orient3d_filter(a, b, c, q)
    if side == UNDECIDED:
        beyond = BEYOND
        side = orient3d_exact(a, b, c, q)
    if side == 0:
        return ON_FACE | beyond
    if side == UNDECIDED:
        return UNDECIDED | beyond
    return (CROSSED if is_inside and side != area else MISSED) | beyond


@inline
def _meet_blurred(a: Point3, b: Point3, c: Point3, q: Point3, blur: float) -> int:
    """Return CROSSED or MISSED if that holds for the upward rays from all points with coordinates within blur / 2 of
    q's, else UNDECIDED."""
    if q.z - blur > max(a.z, b.z, c.z):
        return MISSED
    a2, b2, c2, q2 = Point2(a.x, a.y), Point2(b.x, b.y), Point2(c.x, c.y), Point2(q.x, q.y)
    first, second = orient2d_blurred(a2, b2, q2, blur), orient2d_blurred(b2, c2, q2, blur)
    third = orient2d_blurred(c2, a2, q2, blur)
    if has_both_signs(first, second, third):
        return MISSED
    if first == UNDECIDED or second == UNDECIDED or third == UNDECIDED:
        return UNDECIDED | BEYOND
    if q.z + blur < min(a.z, b.z, c.z):
        return CROSSED
    side = orient3d_rounded(a, b, c, q, blur)
    return UNDECIDED | BEYOND if side == UNDECIDED else MISSED if side == first else CROSSED


@merged
def _in_tree(tree: Any, q: Point3, blur: float) -> tuple[Any, Any, Any, float, bool]:
    """Return (q in tree coordinates, its z rounded up; low, high: the float32 box of the upward rays from all of q's
    blur; the blur in tree coordinates; whether q is near enough to the tree for these to hold)."""
    origin, scale = tree.origin, tree.scale
    x, y, z = (q.x - origin[0]) / scale[0], (q.y - origin[1]) / scale[1], (q.z - origin[2]) / scale[2]
    wide = blur / min(scale[0], scale[1], scale[2])
    u, v, w = _SLACK * abs(x) + wide + LEAST, _SLACK * abs(y) + wide + LEAST, _SLACK * abs(z) + wide + LEAST
    least = np.float32(x - u), np.float32(y - v), np.float32(z - w)
    most = np.float32(x + u), np.float32(y + v), _ABOVE_ALL
    is_near = abs(x) < 4.0 and abs(y) < 4.0 and abs(z) < 4.0 and wide < 1.0  # not NaN
    return Point3(x, y, z + w), least, most, wide, is_near


@allocating_kernel
def list_uncertain(tree: Any, x: float, y: float, z: float, blur: float, uncertain: IntArray) -> tuple[int, bool]:
    """List the triangles that the upward rays from all points of the blurred (x, y, z) may meet differently: fill
    uncertain (n,) int64 with rows of `tree.triangles`. Return their number, and whether the rays cross an odd number of
    the other triangles. The number is -1 if there is no room, or the point is too far from the tree."""
    q, stack, n_uncertain, is_odd, n_stack = Point3(x, y, z), np.empty(STACK, np.int32), 0, False, 1
    _, least, most, _, is_near = _in_tree(tree, q, blur)
    if not is_near:
        return -1, False
    stack[0] = 0
    while n_stack > 0:  # bound: each node enters once
        n_stack -= 1
        node = int(stack[n_stack])
        lanes = inside_box(tree.boxes, node, least, most)
        while lanes != 0:
            child = int(tree.child[node, lowest_bit(lanes)])
            lanes &= lanes - 1
            if child >= 0:
                stack[n_stack] = child
                n_stack += 1
                continue
            a, b, c = corners_of(tree.vertices, tree.triangles, -1 - child)
            met = _meet_blurred(a, b, c, q, blur)
            is_odd ^= met == CROSSED
            if met & 3 == UNDECIDED:
                if n_uncertain == len(uncertain):
                    return -1, False
                uncertain[n_uncertain] = -1 - child
                n_uncertain += 1
    return n_uncertain, is_odd


@inline
def locate_in_tree(tree: Any, q: Point3, blur: float, stack: Int32Array, flag: FlagArray) -> tuple[int, bool]:
    """Return the location of a blurred q by a `TriangleTree` (1, 0, -1 or UNDECIDED), and whether the filter left it
    open. stack: (STACK,) int32, scratch. A point whose blur misses the tree's box is outside; one with a blur too large
    for the tree's coordinates is UNDECIDED."""
    low, high = tree.low, tree.high
    is_out = (q.x + blur < low[0]) | (q.x - blur > high[0]) | (q.y + blur < low[1]) | (q.y - blur > high[1])
    if is_out | (q.z + blur < low[2]) | (q.z - blur > high[2]):
        return -1, False
    local, least, most, wide, is_near = _in_tree(tree, q, blur)
    if not is_near:
        return UNDECIDED, True
    n_stack, is_odd, is_open, beyond = 1, False, False, 0
    stack[0] = 0
    while n_stack > 0 and not flag[0]:  # bound: each node enters once
        n_stack -= 1
        node = int(stack[n_stack])
        lanes = inside_box(tree.boxes, node, least, most)
        if lanes != 0 and tree.child[node, 0] < 0:
            u, v = local.x - float(tree.boxes[node, 0, 0]), local.y - float(tree.boxes[node, 1, 0])
            over, apart = overhead(tree.blocks, tree.boxes, node, u, v, local.z, wide)
            is_odd ^= (count_bits(lanes & over) & 1) == 1
            lanes &= ~(over | apart)
        while lanes != 0:
            child = int(tree.child[node, lowest_bit(lanes)])
            lanes &= lanes - 1
            if child >= 0:
                stack[n_stack] = child
                n_stack += 1
                continue
            a, b, c = corners_of(tree.vertices, tree.triangles, -1 - child)
            met = meet_upwards(a, b, c, q) if blur == 0.0 else _meet_blurred(a, b, c, q, blur)
            beyond |= met & BEYOND
            if met & 3 == ON_FACE:
                return 0, True
            is_open |= met & 3 == UNDECIDED
            is_odd ^= met & 3 == CROSSED
    return UNDECIDED if is_open else 1 if is_odd else -1, beyond != 0


@allocating_kernel
def locate_by_tree(points: FloatArray, blurs: FloatArray, tree: Any, locations: Int8Array, flag: FlagArray) -> int:
    """Fill locations (n,) int8 of points (n, 3) in a polyhedron; return how many the filter left open, or NOT_FINITE.
    blurs: (n,), or (0,) for exact points; only these are tested for NaN and infinity. Caller guarantees that an even
    number of triangles meets at each edge."""
    if len(blurs) == 0 and has_not_finite(points):
        return NOT_FINITE
    return int(_locate_each(points, blurs, tree, locations, np.empty(STACK, np.int32), flag))


@called
def _locate_each(
    points: FloatArray, blurs: FloatArray, tree: Any, locations: Int8Array, stack: Int32Array, flag: FlagArray
) -> int:
    """Fill locations (n,) int8 for `locate_by_tree`, with its arguments and its result. A function of its own, so that
    the tree's arrays are not reference-counted at each point. stack: scratch."""
    n_beyond = 0
    for item in range(len(points)):
        if flag[0]:
            break
        blur = float(blurs[item]) if len(blurs) > 0 else 0.0
        locations[item], is_beyond = locate_in_tree(tree, as_point3(points, item), blur, stack, flag)
        n_beyond += is_beyond
    return n_beyond


@kernel
def reorder_by_tree(
    vertices: FloatArray, triangles: IntArray, boxes: Float32Array, children: Int32Array, origin: FloatArray,
    scale: FloatArray, place: int, child: Int32Array, ordered: Int32Array, blocks: Float32Array,
) -> None:  # fmt: skip
    """Fill ordered (m, 3) int32, from row `place` on, with the triangles in the order of nodes of a `Bvh`, and child
    with children of these nodes, triangles renumbered accordingly. boxes, children: of the nodes; origin, scale: of
    `build_stretched_bvh`. blocks: (n_nodes, 8, 8) float32; filled with the triangles of each node as `overhead` takes
    them, zeros in other lanes."""
    for node in range(len(child)):
        centre_x, centre_y = float(boxes[node, 0, 0]), float(boxes[node, 1, 0])
        reach = 0.0
        for lane in range(WIDTH):
            triangle = -1 - children[node, lane]
            child[node, lane] = children[node, lane]
            if triangle < 0 or children[node, lane] == EMPTY:
                blocks[node, :, lane] = 0.0
                continue
            for corner in range(3):
                vertex = triangles[triangle, corner]
                x = (vertices[vertex, 0] - origin[0]) / scale[0] - centre_x
                y = (vertices[vertex, 1] - origin[1]) / scale[1] - centre_y
                blocks[node, 2 * corner, lane], blocks[node, 2 * corner + 1, lane] = x, y
                reach = max(reach, abs(x), abs(y))
                ordered[place, corner] = vertex
            child[node, lane] = -1 - place
            place += 1
        reach += 2.0 * _SLACK * (reach + max(abs(centre_x), abs(centre_y))) + LEAST_REACH
        for lane in range(WIDTH):
            blocks[node, OVERHEAD_ROWS - 2, lane] = BAND * reach * reach
            blocks[node, OVERHEAD_ROWS - 1, lane] = GROWTH * reach
