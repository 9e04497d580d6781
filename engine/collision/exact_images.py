"""Exact images of points and half-spaces under a pose, as rationals.

A pose maps p to R p + t, R and t exact. R is not quite orthogonal, so the image of the half-space n . p + d >= 0 is
that of the affine map: with A = R^-1 det R the adjugate and det R > 0, (n A) . q + (d det R - (n A) . t) >= 0.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import TypeVar

import numpy as np

from engine.containment.methods.rational_locate import adjugate, to_world_frame
from engine.predicates.rational import dot
from engine.solids.mesh import Mesh
from engine.solids.polygon import Polygon
from engine.solids.pose import Pose
from engine.solids.primitives import HalfSpace
from engine.types import read_only

Vector = tuple[Fraction, ...]
Point = Iterable[float | Fraction]
Outlined = TypeVar("Outlined", bound=Mesh | Polygon)
HalfSpaceImage = tuple[Vector, Fraction]
"""Normal n and offset d of the half-space n . x + d >= 0."""


def as_vector(numbers: Point) -> Vector:
    """Return the numbers as exact fractions."""
    return tuple(Fraction(number) for number in numbers)


def image_point(point: Point, pose: Pose | None) -> Vector:
    """Return the exact image of a point under a pose."""
    p = as_vector(point)
    return p if pose is None else tuple(to_world_frame(p, pose))


def image_in_doubles(solid: Outlined, pose: Pose) -> Outlined | None:
    """Return the image of a mesh or polygon under a pose as a solid without one, if the pose permutes axes, up to sign,
    and every moved vertex is a double; else None."""
    sizes, step = np.abs(pose.rotation), pose.translation
    if not ((sizes == 0.0) | (sizes == 1.0)).all():
        return None
    turned = solid.vertices @ pose.rotation.T
    with np.errstate(all="ignore"):
        moved = turned + step
        rest = moved - turned
        lost = (turned - (moved - rest)) + (step - rest)
    if not (lost == 0.0).all():  # what overflows has lost no number
        return None
    image = object.__new__(type(solid))
    image._set(**{name: getattr(solid, name) for name in solid._fields()} | {"vertices": read_only(moved + 0.0)})
    return image


def image_half_space(half_space: HalfSpace, pose: Pose | None) -> HalfSpaceImage:
    """Return normal and offset of the exact image of a half-space under a pose, up to a positive factor."""
    return image_plane((as_vector(half_space.normal), Fraction(half_space.offset)), pose)


def image_plane(plane: HalfSpaceImage, pose: Pose | None) -> HalfSpaceImage:
    """Return normal and offset of the exact image of a plane under a pose, times det R."""
    if pose is None:
        return plane
    adjugated, determinant = adjugate([as_vector(row) for row in pose.rotation.tolist()])
    image = tuple(dot(plane[0], column) for column in zip(*adjugated))
    return image, plane[1] * determinant - dot(image, as_vector(pose.translation))


def plane_in_frame(plane: HalfSpaceImage, pose: Pose | None) -> HalfSpaceImage:
    """Return (N, D), exact, with N . p + D the plane's value at the image of p under a pose."""
    if pose is None:
        return plane
    normal, move = plane[0], as_vector(pose.translation.tolist())
    turned = tuple(dot(normal, as_vector(column)) for column in pose.rotation.T.tolist())
    return turned, plane[1] + dot(normal, move)


def value_at(half_space: HalfSpaceImage, point: Vector) -> Fraction:
    """Return n . p + d for the half-space (n, d) and a point p: positive inside, 0 on the plane."""
    return dot(half_space[0], point) + half_space[1]


def rounded(value: Fraction) -> float:
    """Return the double nearest to a rational, an infinity beyond the largest double. Rounding is monotone, so rounded
    corners bound rounded points."""
    return rounded_quotient(value.numerator, value.denominator)


def rounded_quotient(numerator: int, denominator: int) -> float:
    """Return the double nearest to a quotient, an infinity beyond the largest."""
    try:
        return numerator / denominator
    except OverflowError:
        return float("inf") if numerator > 0 else float("-inf")
