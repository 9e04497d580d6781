"""Bounds of solids, boxes that they name themselves, planes of boxes."""

from __future__ import annotations

import threading
from fractions import Fraction

import numpy as np
import pytest

import engine
from engine import Aabb, HalfSpace, Polygon, Solid, Sphere, Triangle
from engine.solids.registry import own_box

BOX_PLANES = [[1, 0, 0, 0], [-1, 0, 0, 1], [0, 1, 0, 0], [0, -1, 0, 1], [0, 0, 1, 0], [0, 0, -1, 1]]
TETRAHEDRON = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def numbers(result: engine.Bounds) -> tuple[list[float], list[float], list[float], float]:
    box, ball = result.aabb, result.sphere
    return box.min.tolist(), box.max.tolist(), ball.center.tolist(), ball.radius


def test_of_solids_with_vertices() -> None:
    polygon = engine.Polygon([[[0, 0], [4, 0], [4, 3]], [[1, 1], [2, 1], [1, 2]]])
    assert numbers(engine.bounds(polygon)) == ([0.0, 0.0], [4.0, 3.0], [2.0, 1.5], 2.5)
    triangle = engine.Triangle([[0, 0, 7], [4, 0, 7], [4, 3, 7]])
    assert numbers(engine.bounds(triangle)) == ([0.0, 0.0, 7.0], [4.0, 3.0, 7.0], [2.0, 1.5, 7.0], 2.5)
    for kind in (engine.Polyhedron, engine.Surface):
        low, high, center, radius = numbers(engine.bounds(kind(*TETRAHEDRON)))
        assert (low, high) == ([0.0] * 3, [1.0] * 3)
        assert center == [1 / 3] * 3
        assert radius >= Fraction(2, 3) ** Fraction(1, 2)


def test_vertices_that_no_face_names_do_not_count() -> None:
    vertices, faces = TETRAHEDRON
    plain = engine.bounds(engine.Polyhedron(vertices, faces))
    more = engine.bounds(engine.Polyhedron([*vertices, [9, 9, 9]], faces))
    assert numbers(more) == numbers(plain)


def test_of_sphere_and_aabb() -> None:
    ball = engine.Sphere([0.1, 1.0], 0.2)
    assert numbers(engine.bounds(ball)) == ([0.1 - 0.2, 0.8], [0.1 + 0.2, 1.2], [0.1, 1.0], 0.2)
    assert engine.bounds(ball).sphere is ball
    box = engine.Aabb([0, 0, 0], [2, 4, 4])
    assert engine.bounds(box).aabb is box
    assert numbers(engine.bounds(box))[2:] == ([1.0, 2.0, 2.0], 3.0)
    point = engine.Aabb([5, 6], [5, 6])
    assert numbers(engine.bounds(point)) == ([5.0, 6.0], [5.0, 6.0], [5.0, 6.0], 0.0)
    with pytest.raises(engine.NotRepresentableError, match="largest float64") as info:
        engine.bounds(engine.Sphere([1.7e308, 0.0], 1e308))
    assert info.value.where == ("solid",)


def test_of_convex() -> None:
    low, high, center, radius = numbers(engine.bounds(engine.Convex(BOX_PLANES)))
    assert (low, high, center) == ([0.0] * 3, [1.0] * 3, [0.5] * 3)
    assert radius == engine.bounds(engine.Aabb([0] * 3, [1] * 3)).sphere.radius
    thirds = engine.Convex([[1, 0, 0], [0, 1, 0], [-3, -3, 1]])
    assert numbers(engine.bounds(thirds))[1] == [1 / 3, 1 / 3]
    flat = engine.Convex([[1, 0, -2], [-1, 0, 2], [0, 1, 0], [0, -1, 5]])
    assert numbers(engine.bounds(flat)) == ([2.0, 0.0], [2.0, 5.0], [2.0, 2.5], 2.5)
    huge = engine.Convex([[1, 0, -1e300], [-1, 0, 2e300], [0, 5e-324, 0], [0, -5e-324, 5e-324]])
    assert numbers(engine.bounds(huge))[:2] == ([1e300, 0.0], [2e300, 1.0])


@pytest.mark.parametrize(
    "solid",
    [
        engine.HalfSpace([1, 0], 0),
        engine.Convex([[1, 0, 0], [0, 1, 0]]),
        engine.Convex([[1, 0, 0, 0]]),
        engine.Implicit([{"powers": [2, 0], "coefficient": -1}]),
        engine.Csg("union", [engine.Sphere([0, 0], 1)]),
    ],
    ids=repr,
)
def test_unbounded_and_implicit_ones_are_refused(solid: engine.Solid) -> None:
    with pytest.raises(engine.UnsupportedSolidError, match=r"polyhedron|reaches to infinity, so") as info:
        engine.bounds(solid)
    assert info.value.where[0] == "solid"


def test_no_solid_and_empty_convex_are_refused() -> None:
    with pytest.raises(engine.UnsupportedSolidError, match="must be a solid"):
        engine.bounds(np.zeros(3))  # type: ignore[call-overload]
    with pytest.raises(engine.EmptyGeometryError, match="no point satisfies") as info:
        engine.bounds(engine.Convex([[1, 0, -1], [-1, 0, 0]]))
    assert info.value.where == ("solid", "planes")
    with pytest.raises(engine.NotRepresentableError):
        engine.bounds(engine.Convex([[5e-324, 0, 1e300], [-1, 0, 0], [0, 1, 0], [0, -1, 1]]))


def test_report_progress_deadline_cancel() -> None:
    solid = engine.Polyhedron(*TETRAHEDRON)
    with pytest.raises(engine.DeadlineExceededError):
        engine.bounds(solid, deadline=0.0)
    cancel = engine.Cancel()
    cancel.set()
    with pytest.raises(engine.CancelledError):
        engine.bounds(solid, cancel=cancel)
    seen: list[int] = []
    result, accuracy = engine.bounds(solid, progress=seen.append, report=True)
    assert seen == [1]
    assert accuracy.decisions == "exact"
    assert accuracy.n_items == 4
    assert engine.bounds(solid) is result


def test_threads_share_one_answer() -> None:
    solid = engine.Polyhedron(*TETRAHEDRON)
    found: list[engine.Bounds] = []
    threads = [threading.Thread(target=lambda: found.append(engine.bounds(solid))) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len({id(result) for result in found}) == 1


# --- Boxes of solids before their poses, and how far their points are from the middle ---


def test_boxes_and_balls_and_bodies_without_bounds() -> None:
    low, high, reach = own_box(Aabb([0, 1], [2, 3]))
    assert (low.tolist(), high.tolist(), reach) == ([0, 1], [2, 3], np.inf)
    low, high, reach = own_box(Sphere([1, 2, 3], 9))
    assert low.tolist() == high.tolist() == [1, 2, 3]
    assert reach == 0.0
    low, high, reach = own_box(HalfSpace([1, 0, 0], 0))
    assert (low == -np.inf).all()
    assert (high == np.inf).all()
    assert reach == np.inf


@pytest.mark.parametrize("scale", [1e-160, 1.0, 1e160])
def test_every_vertex_is_within_reach_of_the_middle(scale: float) -> None:
    rng = np.random.default_rng(3)
    bodies: list[Solid] = [Polygon([scale * rng.normal(size=(7, 2))]), Triangle(scale * rng.normal(size=(3, 2)))]
    for body in bodies:
        low, high, reach = own_box(body)
        vertices = body.vertices  # type: ignore[attr-defined]
        assert (low == vertices.min(axis=0)).all()
        assert (high == vertices.max(axis=0)).all()
        middle = [Fraction(float(x)) for x in 0.5 * low + 0.5 * high]
        squares = [sum((Fraction(float(x)) - m) ** 2 for x, m in zip(p, middle)) for p in vertices]
        assert max(squares) <= Fraction(reach) ** 2 if np.isfinite(reach) else scale > 1
        assert own_box(body) is own_box(body)


# --- The rows of a box: zero on its sides, in their order ---


def test_rows_stand_in_the_order_of_the_sides() -> None:
    rows = Aabb([-0.0, 2.0], [1.0, 5.0]).rows
    assert str(rows.tolist()) == "[[1.0, 0.0, 0.0], [-1.0, 0.0, 1.0], [0.0, 1.0, -2.0], [0.0, -1.0, 5.0]]"
