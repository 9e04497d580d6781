"""Clearance by closed forms: boxes, balls, half-spaces (`closed_forms.py`), small planar bodies (`outlines.py`).

A linear function over a body attains its maximum at a vertex: against a half-space floats select candidates, rationals
decide.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import lcm
from operator import attrgetter
from typing import Final

import numpy as np

from engine.collision.exact_images import Vector, image_half_space, image_point, value_at
from engine.collision.result import Clearance, Feature, Poses
from engine.collision.simple.boundary import pulled_back
from engine.collision.simple.closed_forms import FORMS, form_of, form_of_point
from engine.compiling.jit import entry_of
from engine.distance.closed_forms import UNSURE, nearest_of_forms, nearest_of_plane
from engine.distance.exact import Gap, Rational, ScaledGap
from engine.distance.from_plane import corners_of, gaps_from_plane
from engine.distance.outlines import nearest_under_poses
from engine.distance.spreads import BALL, feature_of, outline_of, radius_of, spread_of
from engine.predicates.rational import minus, squared_length
from engine.running.budget import UNLIMITED, Budget, polled
from engine.solids.base import Solid
from engine.solids.pose import motion_of
from engine.solids.primitives import HalfSpace, Sphere
from engine.types import FloatArray

_MOST_PAIRS: Final = 1 << 18
"""Largest number of pairs of edges of two outlines of which all are tested: some milliseconds if no boxes separate
them."""
_NONE: Final = np.empty(0)
PLANE: Final = Feature("plane")
MEETING: Final = Clearance(0.0)
"""The clearance of bodies with a common point."""


def _feature(faces: int, d: int) -> Feature:
    """Return the feature (vertex, edge or face) of a box of dimension d in which some of its faces meet, given as bits
    2 axis + side (0 low, 1 high)."""
    numbers = [0]
    for axis in range(d):
        is_within = not faces >> 2 * axis & 3
        sides = (0, 1) if is_within else (faces >> 2 * axis + 1 & 1,)
        numbers = [number | side << axis for side in sides for number in numbers]
    if len(numbers) == 4:
        return Feature("face", (faces.bit_length() - 1,))
    return Feature("edge" if len(numbers) == 2 else "vertex", tuple(sorted(numbers)))


FEATURES = {d: [_feature(faces, d) for faces in range(1 << 2 * d)] for d in (2, 3)}
"""Features of a box by dimension, then by its faces as bits."""


def _gap_from_closed_form(distance: float, least: float | None) -> Clearance | bool | None:
    """Return the answer that a correctly rounded distance, or UNSURE, decides. Given `least`, whether the distance is
    at least that, None if they round alike; else MEETING for distance 0.0, None for any other."""
    if least is not None and distance not in (UNSURE, least):
        return bool(distance > least)
    return MEETING if distance == 0.0 else None


def between_forms(first: Solid, second: Solid, poses: Poses, least: float | None) -> Clearance | bool | None:
    """Return the clearance of two boxes, balls or small planar bodies; given `least`, whether it is at least that; None
    if unproven."""
    d, (pose, their_pose) = first.dimension, poses
    if first.type in FORMS and second.type in FORMS:
        form, other = form_of(first), form_of(second)
        if form is not None and other is not None:
            points, motions = np.empty((2, d)), (motion_of(pose, d), motion_of(their_pose, d))
            distance, faces, theirs = entry_of(nearest_of_forms)(form, *motions[0], other, *motions[1], points)
            answer = _gap_from_closed_form(distance, least)
            if answer is None and distance > 0.0 and faces >= 0 and least is None:
                return _answer(distance, points, _named(first, faces), _named(second, theirs))
            if answer is not None:
                return answer
    if d == 3:
        return None
    (at, after, radius, names), (there, next_there, their_radius, their_names) = outline_of(first), outline_of(second)
    if len(at) * len(there) > _MOST_PAIRS:
        return None
    own = STILL2 if pose is None else (pose.rotation[None], pose.translation[None])
    their = STILL2 if their_pose is None else (their_pose.rotation[None], their_pose.translation[None])
    points = np.empty((2, 2))
    distance, faces, theirs = entry_of(nearest_under_poses)(
        at, after, radius, *own, there, next_there, their_radius, *their, _NONE, points, UNLIMITED.flag
    )
    if faces < 0 or least is not None:
        return _gap_from_closed_form(distance, least)
    return _answer(distance, points, names[faces], their_names[theirs])


def between_body_and_plane(first: Solid, second: Solid, poses: Poses, least: float | None) -> Clearance | bool | None:
    """Return the clearance of a body and an unposed half-space, in either order; given `least`, whether it is at least
    that; None if unproven."""
    is_second = isinstance(second, HalfSpace)
    plane, body = (second, first) if is_second else (first, second)
    if not isinstance(plane, HalfSpace) or poses[is_second] is not None or isinstance(body, HalfSpace):
        return None
    form, motion, feature = form_of(body), motion_of(poses[not is_second], body.dimension), None
    distance, status, points = UNSURE, -1, np.empty((2, body.dimension))
    if form is not None:
        distance, status, faces = entry_of(nearest_of_plane)(plane.row, form, *motion, points)
        feature = _named(body, faces)
    if distance == UNSURE and not isinstance(body, Sphere):
        motions = motion[0][None], motion[1][None]
        (distance,), (corner,) = (some.tolist() for some in gaps_from_plane(plane, body, motions, UNLIMITED.flag))
        if distance > 0.0 and corner >= 0 and least is None:
            vertices, numbers = corners_of(body)
            _, status, _ = entry_of(nearest_of_plane)(plane.row, form_of_point(vertices[corner]), *motion, points)
            feature = Feature("vertex", (int(numbers[corner]),))
    answer = _gap_from_closed_form(distance, least)
    if answer is not None or not distance > 0.0 or status < 0 or least is not None or feature is None:
        return answer
    if is_second:
        return _answer(distance, points[::-1].copy(), feature, PLANE)
    return _answer(distance, points, PLANE, feature)


STILL2: Final = tuple(array[None] for array in motion_of(None, 2))
"""Rotations and translations of an unposed planar body, as arrays of one pose."""


def distances_under_poses(
    first: Solid, second: Solid, motions: Sequence[FloatArray], least: Fraction | None, budget: Budget
) -> FloatArray:
    """Return the distances of two small planar bodies under n poses, NaN if unproven. least: if given, 0.0 for nearer
    bodies and infinity for others instead. motions: rotations and translations of the first body, then of the second,
    read-only."""
    turns, moves, their_turns, their_moves = motions
    distances = np.empty(len(their_turns))
    entry_of(nearest_under_poses)(
        *outline_of(first)[:3], turns, moves, *outline_of(second)[:3], their_turns, their_moves, distances,
        np.empty((2, 2)), budget.flag,
    )  # fmt: skip
    budget.check()
    answers = np.where(distances == UNSURE, np.nan, distances)
    if least is not None:
        bound = float(least)
        answers = np.where(answers > bound, np.inf, np.where(answers < bound, 0.0, np.nan))
    return answers


def are_small(first: Solid, second: Solid) -> bool:
    """Return whether two bodies are planar, with few enough pairs of edges for `distances_under_poses`."""
    if first.dimension == 3:
        return False
    return len(outline_of(first)[0]) * len(outline_of(second)[0]) <= _MOST_PAIRS


def _answer(distance: float, points: FloatArray, first: Feature, second: Feature) -> Clearance:
    """Return the clearance with nearest points (2, d) and the features that they lie on."""
    points.setflags(write=False)
    return Clearance(distance, points, (first, second))


def _named(solid: Solid, faces: int) -> Feature:
    """Return the feature of a ball, or of a box by its faces as bits 2 axis + side."""
    return BALL if isinstance(solid, Sphere) else FEATURES[solid.dimension][faces]


def scaled_gap(p: Vector, q: Vector, radii: tuple[float, float]) -> ScaledGap:
    """Return the gap between points p and q with rational coordinates, and balls of the given radii about them, in
    integers."""
    numbers = [*p, *q, *map(Fraction, radii)]
    scale = lcm(*(x.denominator for x in numbers))
    whole = [int(x * scale) for x in numbers]
    n = len(p)
    a, b = tuple(whole[:n]), tuple(whole[n : 2 * n])
    gap = Gap(Rational(a, 1), Rational(b, 1), 0, 0, squared_length(minus(b, a)), 1)
    return ScaledGap(gap, (whole[-2], whole[-1]), scale)


def gap_of_planes(one: Solid, other: Solid, poses: Poses, budget: Budget) -> tuple[ScaledGap, tuple[Feature, Feature]]:
    """Return the gap of two disjoint bodies, at least one a half-space, and the features at its ends; exact."""
    if isinstance(one, HalfSpace) and isinstance(other, HalfSpace):
        # their planes are parallel; of all lines across, that through the origin
        planes = image_half_space(one, poses[0]), image_half_space(other, poses[1])
        p, q = (tuple(-offset * x / squared_length(normal) for x in normal) for normal, offset in planes)
        return scaled_gap(p, q, (0.0, 0.0)), (PLANE, PLANE)
    if isinstance(one, HalfSpace):
        foot, point, feature = _foot_and_vertex(one, other, poses, budget)
        return scaled_gap(foot, point, (0.0, radius_of(other))), (PLANE, feature)
    assert isinstance(other, HalfSpace)
    foot, point, feature = _foot_and_vertex(other, one, poses[::-1], budget)
    return scaled_gap(point, foot, (radius_of(one), 0.0)), (feature, PLANE)


def _foot_and_vertex(space: HalfSpace, body: Solid, poses: Poses, budget: Budget) -> tuple[Vector, Vector, Feature]:
    """Return the nearest points of a half-space's plane and a body, and the body's vertex there as a feature; exact."""
    mesh, d = spread_of(body), body.dimension
    plane = image_half_space(space, poses[0])
    (_, weights, _), points = pulled_back(plane, poses[1]), mesh.arrays.vertices[:, :d]
    with np.errstate(all="ignore"):  # the rounding is that of `signs_of`
        values = points @ weights
        bounds = 2.0**-49 * (np.abs(points) @ np.abs(weights)) + 2.0**-1000 + 2.0**-1073 * np.abs(points).sum(axis=1)
        is_below = values + bounds < np.max(values - bounds)
    images = {}
    for vertex in polled(np.flatnonzero(~is_below).tolist()):
        images[vertex] = image_point(points[vertex].tolist(), poses[1])
    exact = {vertex: value_at(plane, image) for vertex, image in polled(images.items())}
    value = max(exact.values())
    used, places = np.unique(mesh.arrays.triangles, return_index=True)
    corners = dict(zip(used.tolist(), places.tolist()))
    nearest = [vertex for vertex in exact if exact[vertex] == value]
    names = {feature_of(body, mesh.arrays, *divmod(corners[vertex], 3)): vertex for vertex in polled(nearest)}
    feature = min(names, key=attrgetter("indices"))
    point = images[names[feature]]
    return tuple(x - value * n / squared_length(plane[0]) for x, n in zip(point, plane[0])), point, feature
