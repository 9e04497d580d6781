"""Poses inside kernels: rounded positions with a proven error, and orientation signs that know it.

A posed vertex is exactly R p + t. Kernels read its rounded value and `error`, a bound on what rounding did to each
coordinate; a sign that this error could change is settled by expansions of the exact posed coordinates
(`triangle_triangle.py`) or UNDECIDED. Two bodies are placed together (`place_pair`): where both are posed, both are
moved back by the first translation, so that the error depends on their distance, not their position. A pose that turns
a lattice into itself (`is_lattice_rotation`) rounds nothing: error 0, and so does a body without a pose.

**error.** Of a coordinate x' = ((r x + s y) + q z) + t, (r, s, q) a row of R, with u = 2^-53, g4 = 4 u / (1 - 4 u), h =
2^-1075, `reach` the largest |x|, |y|, |z|; u |t| for the rounded difference of two translations:

    |x' - exact| <= g4 ((|r| + |s| + |q|) reach + |t|) + u |t| + 4 h,   |r| + |s| + |q| <= sqrt(3) (1 + 1e-12) < 1.75
                 <= 7.1 u reach + 5.1 u |t| + 4 h
                 <  error = 2^-50 (3 reach + max |t|) + 2^-1060

**Pose frames.** From the tree of one placed body to the tree of another, the maps that `lanes/boxes.py` takes, with
their margins. With p = o + s a for tree coordinates a (origin o, scale s a power of two), the placements R p + t of two
bodies give

    a = M b + T,    M = (s_b / s_a) R_a^-1 R_b,    T = (R_a^-1 (R_b o_b + t_b - t_a) - o_a) / s_a

R_a' is used for R_a^-1; `set_frame` has the margin. Where scales differ by more than 2^60 the axes of the smaller body
are left out: nothing is apart on them; so are those of a map that is not finite.
"""

from __future__ import annotations

from math import frexp, ldexp
from typing import Any, NamedTuple

import numpy as np

from engine.compiling.jit import inline, merged
from engine.predicates.orientation import orient2d
from engine.predicates.vectors import as_point3, dot, largest_of, minus
from engine.types import UNDECIDED, Float32Array, FloatArray, Point2, Point3


class PoseArrays(NamedTuple):
    """Poses of a body for kernels: rotations (n, 3, 3), translations (n, 3); is_posed: False if the body has no pose,
    the arrays then being the identity."""

    rotations: FloatArray
    translations: FloatArray
    is_posed: bool


class Placement(NamedTuple):
    """A pose ready for use: rows x, y, z of the rotation; shift, the translation; is_posed, False for no pose; error, a
    bound on the rounding of a placed coordinate (0: exact)."""

    x: Point3
    y: Point3
    z: Point3
    shift: Point3
    is_posed: bool
    error: float


class Extent(NamedTuple):
    """Extent of a body's coordinates: the largest magnitude (reach), and a power of two that divides all (grain)."""

    reach: float
    grain: float


@merged
def as_placement(pose: PoseArrays, item: int, shift: Point3, error: float) -> Placement:
    """Return the placement with the rotation of pose number ``item`` and the given translation and error."""
    r, i = pose.rotations, item
    x, y = Point3(r[i, 0, 0], r[i, 0, 1], r[i, 0, 2]), Point3(r[i, 1, 0], r[i, 1, 1], r[i, 1, 2])
    return Placement(x, y, Point3(r[i, 2, 0], r[i, 2, 1], r[i, 2, 2]), shift, pose.is_posed, error)


@inline
def is_lattice_rotation(rotation: FloatArray) -> bool:
    """Return whether a rotation only permutes axes and flips signs: all entries 0, 1 or -1."""
    for i in range(3):
        for k in range(3):
            if rotation[i, k] != 0.0 and abs(rotation[i, k]) != 1.0:
                return False
    return True


@merged
def has_equal_pose(rotations: FloatArray, translations: FloatArray, i: int, j: int) -> bool:
    """Return whether poses i and j are equal; the relation is then that of the two unposed bodies."""
    d = translations.shape[1]
    for k in range(d):
        for m in range(d):
            if translations[i, k] != translations[j, k] or rotations[i, k, m] != rotations[j, k, m]:
                return False
    return True


@inline
def _largest_power_of_two(value: float) -> float:
    """Return the largest power of two that divides a nonzero number."""
    mantissa, exponent = frexp(value)
    whole = int(mantissa * 2.0**53)
    return ldexp(float(whole & -whole), exponent - 53)


@inline
def place_pair(
    a: Extent, a_pose: PoseArrays, a_item: int, b: Extent, b_pose: PoseArrays, b_item: int
) -> tuple[Placement, Placement]:
    """Return the placements of two bodies under pose number a_item of a_pose and b_item of b_pose. If both are posed,
    both are moved by minus the first translation, so that the first has none."""
    s, t = as_point3(a_pose.translations, a_item), as_point3(b_pose.translations, b_item)
    none, apart = Point3(0.0, 0.0, 0.0), minus(t, s)
    shift, grain = largest_of(apart), min(a.grain, b.grain)
    is_exact = not (a_pose.is_posed or b_pose.is_posed)
    if not is_exact and is_lattice_rotation(a_pose.rotations[a_item]) and is_lattice_rotation(b_pose.rotations[b_item]):
        for value in (s.x, s.y, s.z, t.x, t.y, t.z):
            grain = min(grain, _largest_power_of_two(value)) if value != 0.0 else grain
        is_exact = a.reach + b.reach + shift < 2.0**53 * grain and a.reach + b.reach + shift < 1e300
        is_exact = is_exact and max(largest_of(s), largest_of(t)) < 2.0**53 * grain
    a_error = b_error = 0.0
    if a_pose.is_posed and not is_exact:
        a_error = 2.0**-50 * (3.0 * a.reach + (0.0 if b_pose.is_posed else shift)) + 2.0**-1060
    if b_pose.is_posed and not is_exact:
        b_error = 2.0**-50 * (3.0 * b.reach + shift) + 2.0**-1060
    if b_pose.is_posed:  # an unposed body's translation is 0
        return as_placement(a_pose, a_item, none, a_error), as_placement(b_pose, b_item, apart, b_error)
    return as_placement(a_pose, a_item, s, a_error), as_placement(b_pose, b_item, none, 0.0)


@merged
def placed(p: Point3, place: Placement) -> Point3:
    """Return R p + t, rounded; p itself if the body has no pose."""
    t = place.shift
    return Point3(dot(place.x, p) + t.x, dot(place.y, p) + t.y, dot(place.z, p) + t.z) if place.is_posed else p


@merged
def rotate(place: Placement, v: Point3) -> Point3:
    """Return R v, R the rotation of a placement, rounded."""
    return Point3(dot(place.x, v), dot(place.y, v), dot(place.z, v))


@merged
def rotate_back(place: Placement, v: Point3) -> Point3:
    """Return R' v, R' the transpose of the rotation R of a placement, rounded."""
    x, y, z = column(place, 0), column(place, 1), column(place, 2)
    return Point3(dot(x, v), dot(y, v), dot(z, v))


@merged
def column(place: Placement, axis: int) -> Point3:
    """Return column ``axis`` of the rotation: the image of that axis."""
    x, y, z = place.x, place.y, place.z
    return Point3(x.x, y.x, z.x) if axis == 0 else (Point3(x.y, y.y, z.y) if axis == 1 else Point3(x.z, y.z, z.z))


@inline
def orient2d_near(a: Point2, b: Point2, c: Point2, error: float) -> int:
    """Return orient2d of points known to +- `error` a coordinate; UNDECIDED if that could change the sign. With e twice
    the error and M the largest difference, ``|det - exact| <= 4 e M + 2 e^2`` (four entries, each times one)."""
    if error == 0.0:
        return orient2d(a, b, c)
    ux, uy = b.x - a.x, b.y - a.y
    vx, vy = c.x - a.x, c.y - a.y
    left, right = ux * vy, uy * vx
    det = left - right
    m = max(max(abs(ux), abs(uy)), max(abs(vx), abs(vy)))
    e = 2.0 * error
    threshold = 2.0**-51 * (abs(left) + abs(right)) + 4.5 * e * (m + e) + 2.0**-1070
    return 1 if det > threshold else (-1 if -det > threshold else UNDECIDED)


@inline
def axis_at(axis: int, place: Placement) -> int:
    """Return the axis onto which a placement maps a coordinate axis; a negative axis stays. Caller guarantees that the
    rotation permutes axes, or that there is no pose."""
    if not place.is_posed or axis < 0:
        return axis
    there = column(place, axis)
    return 0 if there.x != 0.0 else (1 if there.y != 0.0 else 2)


WIDEST_RATIO = 2.0**60
WIDEST_MARGIN = 1e15
NEVER_APART = 1e20
"""Margin of an axis that is not tested: far above all boxes, far below `bvh.UNUSED`, which stays apart from everything.
"""


@inline
def defect_of(place: Placement) -> float:
    """Return a bound on the entries of |R' R - I|, R the rotation; 0 without a pose."""
    if not place.is_posed:
        return 0.0
    x, y = rotate_back(place, column(place, 0)), rotate_back(place, column(place, 1))
    z = rotate_back(place, column(place, 2))
    off = max(abs(x.y), abs(x.z), abs(y.z))
    return max(off, abs(x.x - 1.0), abs(y.y - 1.0), abs(z.z - 1.0)) + 2.0**-50


@inline
def set_frame(frame: Float32Array, a: Placement, first: Any, b: Placement, second: Any, defect: float) -> bool:
    """Fill frame (25, 8) float32 with the map a = M b + T from the tree coordinates of body b to those of body a, and
    its margins (rows: `lanes/boxes.py`; derivation: top). a, b: placements; first, second: `MeshArrays` of either;
    defect: bound on |R' R - I| of both.

    Returns whether the trees are proven disjoint. |.| of vectors is the largest component; tree coordinates are at most
    2:

        size   = (|o_a| + |o_b| + |t_b - t_a|) / s_a + 2 + 2 s_b / s_a
        margin = 2^-19 (2 + 3.5 s_b / s_a + |T|)      float32: M, T, sums of `meeting`: < 32 roundings
               + 32 defect size                       R_a^-1 = (I + E)^-1 R_a', |E_ij| <= defect:
                                                      |R_a^-1 v - R_a' v| <= 3.1 defect sqrt(3) |v| < 5.4 defect |v|
               + 2^-46 size                           float64, < 128 roundings
               + 2^-1071 / s_a                        six products that may underflow
        on axis k, e largest coordinates by axis: e_a,k + sum |M_kj| e_b,j + |T_k| instead of the first bracket
    """
    a_origin, a_scale, ratio, shift = first.origin, first.scale, second.scale / first.scale, minus(b.shift, a.shift)
    origin = Point3(second.origin[0], second.origin[1], second.origin[2])
    there = rotate(b, origin)
    v = rotate_back(a, Point3(there.x + shift.x, there.y + shift.y, there.z + shift.z))
    t = Point3((v.x - a_origin[0]) / a_scale, (v.y - a_origin[1]) / a_scale, (v.z - a_origin[2]) / a_scale)
    a_reach = max(abs(a_origin[0]), abs(a_origin[1]), abs(a_origin[2]))
    sizes = (a_reach + largest_of(origin) + largest_of(shift)) / a_scale + 2.0 + 2.0 * ratio
    least = (32.0 * defect + 2.0**-46) * sizes + 2.0**-1071 / a_scale
    margin = 2.0**-19 * (2.0 + 3.5 * ratio + largest_of(t)) + least
    if not (ratio <= WIDEST_RATIO and margin <= WIDEST_MARGIN and np.isfinite(t.x + t.y + t.z)):
        for row in range(21):
            frame[row, :] = 1.0 if 9 <= row < 18 else 0.0
        frame[21:, :] = NEVER_APART
        return False
    reach = first.sizes[0] + abs(t.x), first.sizes[1] + abs(t.y), first.sizes[2] + abs(t.z)
    for k in range(3):
        m = rotate_back(a, column(b, k))
        frame[k, :], frame[3 + k, :], frame[6 + k, :] = ratio * m.x, ratio * m.y, ratio * m.z
        frame[9 + k, :], frame[12 + k, :], frame[15 + k, :] = ratio * abs(m.x), ratio * abs(m.y), ratio * abs(m.z)
        size = ratio * second.sizes[k]
        reach = reach[0] + size * abs(m.x), reach[1] + size * abs(m.y), reach[2] + size * abs(m.z)
    frame[18, :], frame[19, :], frame[20, :] = t.x, t.y, t.z
    frame[21, :] = margin
    for k in range(3):
        frame[22 + k, :] = 2.0**-19 * 1.01 * reach[k] + least + 2.0**-100
    return largest_of(t) > 2.0 + 3.5 * ratio + margin
