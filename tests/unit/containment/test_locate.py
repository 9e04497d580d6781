"""Points in solids of every type, compiled and in rational arithmetic."""

from __future__ import annotations

import pickle
import random
from fractions import Fraction

import numpy as np
import pytest

import engine
from engine import (
    Aabb,
    Csg,
    HalfSpace,
    Implicit,
    Polygon,
    Pose,
    Sphere,
    Surface,
    Triangle,
    UnsupportedSolidError,
    contains,
    locate,
)
from engine.containment.methods.rational_locate import rational_location, to_body_frame, to_world_frame
from tests.reference.containment import locate as reference
from tests.unit.containment.scenes import box_mesh, lattice_points, lattice_solids, made, spelled


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_lattice_solids_equal_the_reference(dimension: int, seed: int) -> None:
    points = lattice_points(dimension)
    points = points[np.random.default_rng(seed).permutation(len(points))[:120]]
    for solid in lattice_solids(dimension, seed):
        try:
            expected = [reference(point, solid) for point in points.tolist()]
        except ValueError:  # a prism over a triangle without area
            expected = None
        if expected is not None:
            assert locate(points, made(solid)).tolist() == expected, spelled(solid)


@pytest.mark.parametrize("scale", [2.0**1015, 2.0**-1060])
@pytest.mark.parametrize("dimension", [2, 3])
def test_the_ends_of_the_exponent_range(dimension: int, scale: float) -> None:
    points = lattice_points(dimension)[:: 7 if dimension == 3 else 1]
    points = points[(points >= 0).all(axis=1)] * scale
    for solid in lattice_solids(dimension, 5):
        solid = scaled(solid, scale)
        if solid is not None:
            with np.errstate(under="ignore"):
                found = locate(points, made(solid)).tolist()
            assert found == [reference(point, solid) for point in points.tolist()], spelled(solid)


def scaled(solid: dict, scale: float) -> dict | None:  # type: ignore[type-arg]
    """Return a bounded solid times a power of two, None for the other kinds."""
    keys = {"center", "radius", "min", "max", "vertices", "rings", "offset"}
    if solid["type"] in ("implicit", "csg", "convex"):
        return None
    grown = {
        key: (np.array(value) * scale).tolist() if key in keys and key != "rings" else value
        for key, value in solid.items()
    }
    if "rings" in solid:
        grown["rings"] = [(np.array(ring) * scale).tolist() for ring in solid["rings"]]
    return grown


def test_mixed_exponents_are_settled_by_rationals() -> None:
    polygon = Polygon([[[0, 0], [1e300, 5e-324], [1e300, 1e300]]])
    found, accuracy = locate([[1e-300, 5e-324], [5e-324, 5e-324], [1e300, 5e-324], [5e-324, 0]], polygon, report=True)
    assert found.tolist() == [1, 0, 0, -1]
    assert accuracy.decisions == "exact"
    assert accuracy.n_rational <= accuracy.n_beyond_filter <= 4


def test_contains_is_the_closed_set() -> None:
    held, accuracy = contains([[0, 0], [1, 0], [2, 0]], HalfSpace([-1, 0], 1), report=True)
    assert held.dtype == np.bool_
    assert held.tolist() == [True, True, False]
    assert (accuracy.n_items, accuracy.coordinates_ulp) == (3, None)


def test_no_points_and_wrong_ones() -> None:
    box = Aabb([0, 0, 0], [1, 1, 1])
    assert locate([], box).shape == (0,)
    with pytest.raises(engine.WrongDimensionError):
        locate([[1, 2]], box)
    with pytest.raises(engine.NotFiniteError) as failure:
        locate([[0, 0, 0], [0, np.nan, 0]], box)
    assert failure.value.where == ("points", 1, 1)


def test_surface_names_the_alternatives() -> None:
    surface = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(engine.UnsupportedSolidError, match="polyhedron"):
        locate([[0, 0, 0]], surface)


def test_deadline_and_cancel_end_the_call() -> None:
    polygon = Polygon([np.random.default_rng(0).uniform(0, 1, (2000, 2))])
    points = np.random.default_rng(1).uniform(0, 1, (100_000, 2))
    with pytest.raises(engine.DeadlineExceededError):
        locate(points, polygon, deadline=0.0)
    cancel = engine.Cancel()
    cancel.set()
    with pytest.raises(engine.CancelledError):
        locate(points, polygon, cancel=cancel)


def test_threads_chunks_and_progress_change_nothing() -> None:
    solid = made(box_mesh([0, 0, 0], [1, 1, 1]))
    points = np.random.default_rng(2).uniform(-0.2, 1.2, (50_000, 3))
    done: list[int] = []
    one = locate(points, solid, workers=1, progress=done.append)
    assert sum(done) == len(points)
    assert (one == locate(points, solid)).all()
    assert (one[::-1] == locate(points[::-1], solid, workers=2)).all()
    assert (one == locate(points, pickle.loads(pickle.dumps(solid)))).all()
    inside = ((points > 0) & (points < 1)).all(axis=1)
    assert ((one == 1) == inside).all()


# --- What the table of methods makes of solids: prisms, trees and callables ---


def test_prism_over_a_triangle_of_space() -> None:
    prism = Triangle([[0, 0, 1], [4, 0, 1], [0, 4, 1]])
    assert locate([[1, 1, 99], [0, 1, -7], [4, 0, 3], [2, 2, 0], [2, 2.1, 0]], prism).tolist() == [1, 0, 0, 0, -1]
    tilted = Triangle([[0, 0, 0], [1, 0.1, 0.3], [0.7, 1, 0.1]])
    points = np.random.default_rng(1).uniform(-1, 2, (200, 3))
    solid = {"type": "triangle", "vertices": tilted.vertices.tolist()}
    assert locate(points, tilted).tolist() == [reference(point, solid) for point in points.tolist()]


def test_prism_without_area_is_all_boundary() -> None:
    assert locate([[5, 5, 5], [0, 0, 0]], Triangle([[0, 0, 0], [1, 1, 1], [2, 2, 2]])).tolist() == [0, 0]


def test_csg_shares_operands() -> None:
    ball = Sphere([0, 0], 2)
    tree: engine.Solid = ball
    for _ in range(20):  # two to the twentieth leaves along all paths, one in truth
        tree = Csg("union", [tree, tree]) if tree is ball or tree.n_leaves < 1 << 18 else tree  # type: ignore[attr-defined]
    assert locate([[0, 0], [2, 0], [3, 0]], tree).tolist() == [1, 0, -1]


def test_csg_difference_of_touching_boxes() -> None:
    tree = Csg("difference", [Aabb([0, 0], [4, 4]), Aabb([0, 0], [2, 4])])
    assert locate([[1, 1], [2, 1], [3, 1], [0, 1], [4, 4]], tree).tolist() == [-1, 0, 1, 0, 0]


def test_callable_reports_float64() -> None:
    solid = Implicit.from_callable(lambda p: 1.0 - p[:, 0] ** 2 - p[:, 1] ** 2, 2)
    found, accuracy = locate([[0, 0], [1, 0], [2, 0]], solid, report=True)
    assert found.tolist() == [1, 0, -1]
    assert accuracy.decisions == "float64"
    nested = Csg("union", [solid, Aabb([5, 5], [6, 6])])
    assert locate([[5, 5]], nested, report=True)[1].decisions == "float64"


def test_callable_that_returns_nan_or_another_shape_is_refused() -> None:
    with pytest.raises(engine.NotFiniteError, match=r"\[1.0, 2.0\]"):
        locate([[1, 2]], Implicit.from_callable(lambda p: p[:, 0] * np.nan, 2))
    with pytest.raises(engine.InvalidArrayError):
        locate([[1, 2]], Implicit.from_callable(lambda p: p, 2))


# --- Rational_location: points that are no floats, poses, every solid ---


TURNS = {2: [[0.6, -0.8], [0.8, 0.6]], 3: [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]]}


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("posed", [False, True])
def test_rational_points_equal_the_reference(dimension: int, posed: bool) -> None:
    source = random.Random(dimension)
    pose = Pose(TURNS[dimension], [0.1, -0.7, 0.3][:dimension]) if posed else None
    as_json = {"rotation": pose.rotation.tolist(), "translation": pose.translation.tolist()} if pose else None
    for solid in lattice_solids(dimension, 1):
        for _ in range(12):
            point = [Fraction(source.randint(0, 12), 3) for _ in range(dimension)]
            if pose is not None:
                point = to_world_frame(point, pose)
            try:
                expected = reference(point, solid, as_json)
            except ValueError:
                continue
            assert rational_location(point, made(solid), pose) == expected, (spelled(solid), point)


def test_frames_are_inverse() -> None:
    pose = Pose(TURNS[3], [1e300, -5e-324, 0.1])
    point = [Fraction(1, 3), Fraction(-2, 7), Fraction(5)]
    assert to_body_frame(to_world_frame(point, pose), pose) == point


def test_points_beyond_the_floats() -> None:
    box = made(box_mesh([0, 0, 0], [1, 1, 1]))
    assert rational_location([Fraction(1, 3), Fraction(10) ** 400, 0], box) == -1
    assert rational_location([Fraction(1, 3), Fraction(1, 10**400), Fraction(1, 2)], box) == 1


def test_surface_is_refused_and_checks_are_made() -> None:
    with pytest.raises(UnsupportedSolidError):
        rational_location([0, 0, 0], Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    calls: list[int] = []
    rational_location([0.5, 0.5, 0.5], made(box_mesh([0, 0, 0], [1, 1, 1])), check=lambda: calls.append(1))
    assert calls
