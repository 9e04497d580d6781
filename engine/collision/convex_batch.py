"""Many pairs of convex bodies in one kernel call: the portal filter, then contact at a vertex that two bodies share.

Bodies on a common grid, stacked or side by side, share vertices. If poses round no vertex, two vertices are equal or
not, and the plane of a face at the common one, which separates the bodies if they touch there and some edge or face
does, is tested by exact signs. What is left, the exact path decides.
"""

from __future__ import annotations

from engine.collision.codes import OVERLAPPING, TOUCHING, UNSETTLED
from engine.collision.convex_body import ConvexArrays, point_of
from engine.collision.convex_pair import PlacedBody, placed_body, relate_convex
from engine.collision.meshes.placement import PoseArrays, has_equal_pose, is_lattice_rotation, placed, rotate
from engine.compiling.jit import called, inline, kernel, merged
from engine.predicates.error_free import two_sum
from engine.predicates.orientation import orient3d
from engine.types import UNDECIDED, FlagArray, FloatArray, Int8Array, IntArray

_POLL_EVERY = 256
_MOST_PAIRS = 1 << 12
"""Most pairs of vertices among which an equal one is looked for."""


@merged
def _is_sum(a: float, b: float) -> bool:
    """Return whether a + b is a double."""
    _, rest = two_sum(a, b)
    return rest == 0.0


@inline
def _rounds_nothing(f: PlacedBody, rotation: FloatArray) -> bool:
    """Return whether placing the vertices of body f, with this rotation, rounds none of their coordinates."""
    if not is_lattice_rotation(rotation):
        return False
    t = f.place.shift
    for vertex in range(f.first, f.stop):
        p = rotate(f.place, point_of(f.points, vertex))
        if not (_is_sum(p.x, t.x) and _is_sum(p.y, t.y) and _is_sum(p.z, t.z)):
            return False
    return True


@inline
def _plane_separates(pool: ConvexArrays, face: int, own: PlacedBody, other: PlacedBody) -> bool:
    """Return whether the plane of a face of placed body `own` is proven to have the other body on its other side, both
    placed without rounding."""
    t, sides = pool.triangles, 0
    a = placed(point_of(own.points, t[face, 0]), own.place)
    b, c = placed(point_of(own.points, t[face, 1]), own.place), placed(point_of(own.points, t[face, 2]), own.place)
    for vertex in range(other.first, other.stop):
        side = orient3d(a, b, c, placed(point_of(other.points, vertex), other.place))
        if side == UNDECIDED or side * sides < 0:
            return False
        sides = side if sides == 0 else sides
    for vertex in range(own.first, own.stop):  # all on one side of it: the body is convex
        side = orient3d(a, b, c, placed(point_of(own.points, vertex), own.place))
        if side != 0:
            return side != UNDECIDED and side * sides < 0
    return False


@inline
def _is_separated_at(pool: ConvexArrays, body: int, own: PlacedBody, vertex: int, other: PlacedBody) -> bool:
    """Return whether the plane of some face at a vertex of body `body` of the pool, placed as `own`, separates it from
    the other."""
    for face in range(pool.firsts[1, body], pool.firsts[1, body + 1]):
        t = pool.triangles
        is_there = t[face, 0] == vertex or t[face, 1] == vertex or t[face, 2] == vertex
        if is_there and _plane_separates(pool, face, own, other):
            return True
    return False


@called
def _relation_at_vertex(pool: ConvexArrays, first: int, second: int, a: PlacedBody, b: PlacedBody, turn: FloatArray,
                        their_turn: FloatArray, is_boolean: bool) -> int:  # fmt: skip
    """Return TOUCHING if two bodies, of indices first and second in the pool, are placed without rounding and share a
    vertex, and the plane of a face there separates them (is_boolean: or nothing does), else UNSETTLED. turn,
    their_turn: their rotations."""
    if a.round > 0.0 or b.round > 0.0 or (a.stop - a.first) * (b.stop - b.first) > _MOST_PAIRS:
        return UNSETTLED
    if not (_rounds_nothing(a, turn) and _rounds_nothing(b, their_turn)):
        return UNSETTLED
    for p in range(a.first, a.stop):
        at = placed(point_of(a.points, p), a.place)
        for q in range(b.first, b.stop):
            there = placed(point_of(b.points, q), b.place)
            if at.x == there.x and at.y == there.y and at.z == there.z:
                if is_boolean or _is_separated_at(pool, first, a, p, b) or _is_separated_at(pool, second, b, q, a):
                    return TOUCHING
                return UNSETTLED
    return UNSETTLED


@kernel
def relate_convex_pairs(
    pool: ConvexArrays, bodies: IntArray, poses: PoseArrays, pairs: IntArray, is_boolean: bool, may_be_equal: bool,
    relations: Int8Array, flag: FlagArray,
) -> None:  # fmt: skip
    """Replace the UNSETTLED entries of relations (n,) int8 by the relation codes of pairs (n, 2) of rows where floats
    prove one. A row is a body under a pose: bodies (n_rows,), its index in the pool, -1 if it has none there; poses,
    one a row, row 0 the identity. is_boolean: OVERLAPPING may be given where one body contains the other; may_be_equal:
    and for equal bodies. Returns early when the flag is set."""
    for item in range(pairs.shape[0]):
        if item % _POLL_EVERY == 0 and flag[0] != 0:
            return
        i, j = pairs[item, 0], pairs[item, 1]
        first, second = bodies[i], bodies[j]
        if relations[item] != UNSETTLED or first < 0 or second < 0:
            continue
        if has_equal_pose(poses.rotations, poses.translations, i, j):
            i = j = 0
            if first == second and may_be_equal:
                relations[item] = OVERLAPPING
                continue
        a, b = placed_body(pool, first, poses, i), placed_body(pool, second, poses, j)
        relations[item] = relate_convex(pool, first, second, a, b, is_boolean, may_be_equal)
        if relations[item] == UNSETTLED:
            turns = poses.rotations
            relations[item] = _relation_at_vertex(pool, first, second, a, b, turns[i], turns[j], is_boolean)
