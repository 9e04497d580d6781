"""locate and contains: every solid against the rational reference, options, errors."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import engine
from engine import Aabb, HalfSpace, Polygon, Surface, contains, locate
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
