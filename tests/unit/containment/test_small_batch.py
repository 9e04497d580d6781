"""Few points at once, and the types that are compiled."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import config as numba_config

import engine
from engine import Surface, contains, locate, locate_scene
from engine.containment.locate import SMALL_BATCH, locate_small_batch
from engine.containment.methods.filters import locate_by_polynomial, locate_in_ball, locate_in_box
from engine.containment.methods.half_spaces import locate_in_half_spaces
from engine.containment.methods.polygon_ray_parity import locate_in_rings
from engine.containment.methods.polyhedron_one_pass import locate_by_pass
from engine.containment.methods.polyhedron_ray_parity import locate_by_tree
from engine.containment.methods.rational_locate import rational_location
from engine.errors import UnsupportedSolidError
from tests.unit.containment.scenes import box_mesh, lattice_points, lattice_solids, made, merged


@pytest.mark.parametrize("dimension", [2, 3])
def test_every_kind_equals_the_general_way(dimension: int) -> None:
    points = lattice_points(dimension)
    for solid in (made(each) for seed in (3, 4) for each in lattice_solids(dimension, seed)):
        general = locate(points, solid, workers=1)
        for _ in range(3):  # the first compiles, the second may still build
            for step in (1, 7, 40):
                some = points[step::97] if step < 40 else points[:600]
                expected = general[step::97] if step < 40 else general[:600]
                assert (locate(some, solid) == expected).all(), solid
                assert (contains(some.tolist(), solid) == (expected >= 0)).all()
    assert general.tolist() == [rational_location(point, solid) for point in points.tolist()]


def test_reports_and_kinds_of_arrays() -> None:
    ball = engine.Sphere([0, 0, 0], 5)
    points = np.array([[3.0, 4.0, 0.0], [9, 9, 9]])
    locate(points, ball)
    for given in (points, points[::-1][::-1], np.asfortranarray(points), points.astype(np.float32), points.tolist()):
        found, accuracy = locate(given, ball, report=True)
        assert (found.tolist(), accuracy.n_items, accuracy.method) == ([0, -1], 2, "squared_distance")
        assert (accuracy.n_beyond_filter, accuracy.n_rational) == (1, 0)
    assert contains(points, ball, report=True)[0].tolist() == [True, False]
    far = np.full((2, 3), 1e200)  # squares out of range are no reason to refuse
    assert locate(far, ball).tolist() == [-1, -1]


@pytest.mark.parametrize(
    "bad", [[[np.nan, 0, 0]], [[0, 0, 0], [0, np.inf, 0]], [[0, 0]], [0, 0, 0], [[True, 0, 0]], np.array(3.0)]
)
def test_refusals_are_those_of_the_general_way(bad: Any) -> None:
    for solid in (engine.Sphere([0, 0, 0], 5), made(box_mesh([0] * 3, [1] * 3))):
        locate([[0, 0, 0]], solid)
        messages = []
        for given, options in ((bad, {}), (bad, {"workers": 1})):
            with pytest.raises(engine.EngineError) as error:
                locate(given, solid, **options)
            messages.append((type(error.value), str(error.value)))
        assert messages[0] == messages[1]


def test_many_points_and_other_solids_go_the_general_way() -> None:
    ball = engine.Sphere([0, 0, 0], 5)
    assert locate_small_batch(np.zeros((SMALL_BATCH + 1, 3)), ball) is None
    assert locate_small_batch(np.zeros((0, 3)), ball) is None
    assert locate_small_batch(np.zeros((1, 3)), engine.Implicit.from_callable(lambda points: points[:, 0], 3)) is None
    tree = engine.Csg("union", [ball, engine.Implicit.from_callable(lambda points: points[:, 0], 3)])
    assert locate_small_batch(np.zeros((1, 3)), tree) is None
    mesh = made(merged(*(box_mesh([k, 0, 0], [k + 1, 1, 1]) for k in range(50))))
    found = locate_small_batch(np.zeros((500, 3)), mesh)
    assert (found or ("",))[-1] == "ray_parity"
    locate(np.random.default_rng(0).uniform(0, 50, (40_000, 3)), mesh)  # builds cells
    assert locate_small_batch(np.zeros((500, 3)), mesh) is None
    assert locate(np.zeros((500, 3)), mesh, report=True)[1].method == "segment_parity"


def test_names_the_body_that_holds_no_points() -> None:
    with pytest.raises(UnsupportedSolidError) as refused:
        locate_scene([[0, 0, 0]], [Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])])
    assert refused.value.where == ("solids", 0)


# --- Each kernel is compiled once per dimension, whatever kind of array the caller passes ---


VERTICES = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
TURN = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]

SOLIDS = [
    (
        engine.Polyhedron(VERTICES, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
        [locate_by_tree, locate_by_pass],
    ),
    (engine.Triangle(VERTICES[:3]), [locate_in_half_spaces]),
    (engine.Convex([[1, 0, 0, 0]]), [locate_in_half_spaces]),
    (engine.Sphere([0, 0, 0], 1), [locate_in_ball]),
    (engine.Aabb([0, 0], [1, 1]), [locate_in_box]),
    (engine.HalfSpace([1, 0], 0), [locate_in_half_spaces]),
    (engine.Polygon([np.column_stack([np.arange(600.0), np.arange(600.0) ** 2])]), [locate_in_rings]),
    (engine.Triangle([[0, 0], [1, 0], [0, 1]]), [locate_in_rings]),
    (engine.Implicit([{"powers": [1, 0], "coefficient": 1}]), [locate_by_polynomial]),
]


@pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="about compiled code")
@pytest.mark.parametrize(("solid", "kernels"), SOLIDS)
def test_a_kernel_sees_one_kind_of_array(solid: engine.Solid, kernels: list[Any]) -> None:
    n_points = 600 if isinstance(solid, engine.Polygon) else 6  # beyond one pass over the edges
    points = np.random.default_rng(0).random((n_points, solid.dimension))
    frozen = points.copy()
    frozen.setflags(write=False)
    turn = engine.Pose([row[: solid.dimension] for row in TURN[: solid.dimension]], [0.25] * solid.dimension)
    for given in (points, frozen, points[::2], np.asfortranarray(points), points.astype(np.float32), points.tolist()):
        engine.locate(given, solid)
        engine.locate_scene(given, [solid, solid], [turn, None])
    if isinstance(solid, engine.Polyhedron):
        engine.locate(np.random.default_rng(1).random((1 << 15, 3)), solid)  # more than a few passes
    for kernel in kernels:
        layouts = {
            tuple((each.ndim, each.layout, each.mutable) for each in signature if hasattr(each, "layout"))
            for signature in kernel.signatures
        }
        assert len(layouts) == 1, kernel.py_func.__name__
