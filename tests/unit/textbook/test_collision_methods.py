"""The textbook's collision tests: right on easy input, wrong where it is known that they are."""

from __future__ import annotations

import numpy as np
import pytest

from engine.bounding.aabb import box_of_points
from engine.textbook import collision
from tests.reference.bounds import exact_minimal_sphere
from tests.reference.collision import DISJOINT, relation
from tests.reference.exact import vector
from tests.reference.shapes import Solid, box, polygon, tetrahedron

UNIT = box((0, 0, 0), (1, 1, 1))
OVERLAPPING = box((0.5, 0.5, 0.5), (2, 2, 2))
PIERCING = box((0.25, 0.25, -1), (0.75, 0.75, 2))
INNER = box((0.25, 0.25, 0.25), (0.75, 0.75, 0.75))
APART = box((2, 0, 0), (3, 1, 1))
BESIDE = box((1.25, 1.25, 0), (3, 3, 1))


def arrays(first: Solid, second: Solid) -> tuple[np.ndarray, ...]:
    return tuple(
        array
        for solid in (first, second)
        for array in (np.array(solid["vertices"], float), np.array(solid["faces"], np.int64))
    )


@pytest.mark.parametrize(
    ("other", "by_vertices", "by_edges"),
    [(OVERLAPPING, True, True), (PIERCING, False, True), (INNER, True, False), (APART, False, False)],
    ids=["overlapping", "only edges", "within", "apart"],
)
def test_vertices_and_edges(other: Solid, by_vertices: bool, by_edges: bool) -> None:
    """Neither test is enough alone: figure 22.25."""
    assert collision.by_vertices(*arrays(UNIT, other)) == by_vertices
    assert collision.by_edges(*arrays(UNIT, other)) == by_edges
    for pair in ((UNIT, other), (other, UNIT)):
        assert collision.by_volumes(*arrays(*pair)) == (relation(*pair) != DISJOINT)


def test_volumes_save_the_last_test() -> None:
    assert not collision.by_volumes(*arrays(UNIT, BESIDE))


def test_a_vertex_half_an_ulp_off_a_face_is_seen_to_touch_it() -> None:
    tip = (0.4380334403865276, 0.3083740704788512, 0.4902617756956915)
    second = tetrahedron((0, 0, 0), (0.7, 0.1, 0.2), (0.1, 0.9, 0.3), (0.2, 0.3, 1.1))
    first = tetrahedron(tip, (2, 2, 2), (2, 2.5, 2), (2.5, 2, 2.1))
    assert relation(first, second) == DISJOINT
    assert collision.by_volumes(*arrays(first, second))


def test_boxes() -> None:
    low, high = box_of_points(np.array(UNIT["vertices"], float))
    assert (low.tolist(), high.tolist()) == ([0, 0, 0], [1, 1, 1])
    assert collision.boxes_meet(low, high, high, high + 1)
    assert not collision.boxes_meet(low, high, high + 1e-9, high + 1)


def test_ritters_sphere_is_too_large() -> None:
    points = np.random.default_rng(2).normal(size=(12, 3))
    center, radius = collision.bounding_sphere(points)
    assert (np.linalg.norm(points - center, axis=1) <= radius * (1 + 1e-15)).all()
    smallest = float(exact_minimal_sphere([vector(p) for p in points.tolist()])[1]) ** 0.5
    assert smallest * (1 + 1e-4) < radius < 1.25 * smallest


def test_triangles_in_the_plane() -> None:
    source = np.random.default_rng(9)
    first, second = source.uniform(0, 4, (200, 3, 2)), source.uniform(0, 4, (200, 3, 2))
    expected = [
        relation(polygon(a), polygon(b)) != DISJOINT for a, b in zip(first.tolist(), second.tolist(), strict=True)
    ]
    assert collision.of_triangles(first, second).tolist() == expected


def test_triangles_in_the_plane_are_wrong_beside_an_edge() -> None:
    """A vertex half an ulp off the long side of the other: the product rounds to the side's line."""
    first = [[0.0, 0.0], [0.3, 0.1], [0.3, -1.0]]
    second = [[0.1, 0.1 / 3.0 + 2.0**-57], [0.0, 1.0], [0.3, 1.0]]
    exact = relation(polygon(first), polygon(second)) != DISJOINT
    assert collision.of_triangles(np.array([first]), np.array([second]))[0] != exact
