"""Sutherland-Hodgman, overlay and bounds references against answers by hand."""

from __future__ import annotations

import random

from tests.reference.bounds import bounding_box, convex_vertices, exact_minimal_sphere, minimal_sphere, points_of
from tests.reference.exact import Q, square, sub, vector
from tests.reference.overlay import area, overlay, signed_area
from tests.reference.shapes import aabb, box, half_space, polygon, rectangle, sphere
from tests.reference.solids import cut_face
from tests.reference.sutherland_hodgman import clip_contour, planes_of, rounded, same_cycle

FRAME = polygon([[0, 0], [6, 0], [6, 6], [0, 6]], [[2, 2], [4, 2], [4, 4], [2, 4]])


def test_sutherland_hodgman_cuts_a_corner() -> None:
    triangle = [[0, 0], [4, 0], [0, 4]]
    found = rounded(clip_contour(triangle, planes_of(aabb((1, 1), (9, 9)))))
    assert same_cycle(found, [[1, 1], [3, 1], [1, 3]])
    assert clip_contour(triangle, planes_of(aabb((5, 5), (9, 9)))) == []
    assert rounded(clip_contour(triangle, planes_of(aabb((4, 0), (9, 9))))) == [[4, 0]]
    assert rounded(clip_contour([*triangle, [0, 4]], planes_of(half_space((1, 0), 1)))) == triangle


def test_sutherland_hodgman_keeps_bridges() -> None:
    """A concave contour falls apart but stays connected by edges there and back."""
    comb = [[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]]
    found = rounded(clip_contour(comb, planes_of(half_space((0, 1), -2))))
    assert len(found) == 8
    assert signed_area(found) == 2


def test_polyhedron_planes_equal_box_planes() -> None:
    contour = [[-1, 0.5, 0.25], [2, 0.25, 0.5], [0.5, 2, 0.75]]
    by_box = clip_contour(contour, planes_of(aabb((0, 0, 0), (1, 1, 1))))
    by_faces = clip_contour(contour, planes_of(box((0, 0, 0), (1, 1, 1))))
    assert set(by_box) == set(by_faces)
    assert len(by_box) > 3


def test_overlay_by_hand() -> None:
    square_, shifted = rectangle((0, 0), (4, 4)), rectangle((2, 2), (6, 6))
    assert overlay(square_, shifted, "intersection") == (4, [(4, 0)])
    assert overlay(square_, shifted, "union") == (28, [(28, 0)])
    assert overlay(square_, shifted, "difference") == (12, [(12, 0)])
    assert overlay(square_, shifted, "symmetric_difference") == (24, [(12, 0), (12, 0)])
    assert overlay(FRAME, rectangle((2, 2), (4, 4)), "union") == (36, [(36, 0)])
    assert overlay(FRAME, rectangle((1, 1), (5, 5)), "difference") == (20, [(20, 1)])
    assert overlay(rectangle((0, 0), (6, 6)), polygon([[0, 3], [3, 1], [4, 4]]), "difference").pieces[0][1] == 1
    assert overlay(rectangle((0, 0), (2, 2)), rectangle((2, 0), (4, 2)), "union") == (8, [(8, 0)])
    assert overlay(rectangle((0, 0), (2, 2)), rectangle((2, 2), (4, 4)), "union") == (8, [(4, 0), (4, 0)])
    assert overlay(square_, rectangle((9, 9), (10, 10)), "intersection") == (0, [])


def test_areas_by_shoelace() -> None:
    source = random.Random(2)
    for _ in range(20):
        ring = [[source.randint(0, 9), source.randint(0, 9)] for _ in range(3)]
        if signed_area(ring):
            assert area(polygon(ring)) == abs(signed_area(ring))
    assert area(FRAME) == 32
    assert area(polygon([[0, 0], [2, 2], [2, 0], [0, 2]])) == 2  # the bow


def test_minimal_sphere_by_hand() -> None:
    assert minimal_sphere(points_of(box((0, 0, 0), (2, 2, 2)))) == ([1, 1, 1], 1.7320508075688774)
    assert 1.7320508075688774**2 >= 3
    assert minimal_sphere([vector(p) for p in ((0, 0), (4, 0), (2, 1))]) == ([2, 0], 2)
    assert minimal_sphere([vector(p) for p in ((0, 0), (4, 0), (2, 4))]) == ([2, 1.5], 2.5)
    assert minimal_sphere([vector((3, 4))] * 2) == ([3, 4], 0)


def test_minimal_sphere_is_minimal() -> None:
    source = random.Random(4)
    for n in (2, 3):
        points = [tuple(Q(source.randint(-9, 9)) for _ in range(n)) for _ in range(8)]
        center, size = exact_minimal_sphere(points)
        assert max(square(sub(p, center)) for p in points) == size
        for _ in range(100):
            other = tuple(x + Q(source.randint(-9, 9), 100) for x in center)
            assert max(square(sub(p, other)) for p in points) >= size


def test_convex_vertices() -> None:
    corner = {"type": "convex", "planes": [[1, 0, 0], [0, 1, 0], [-1, -1, 1]]}
    assert convex_vertices(corner) == [(0, 0), (0, 1), (1, 0)]
    assert bounding_box(corner) == ([0, 0], [1, 1])
    assert convex_vertices({"type": "convex", "planes": [[1, 0, 0], [0, 1, 0]]}) is None
    assert convex_vertices({"type": "convex", "planes": [[1, 0, 0], [-1, 0, -1], [0, 1, 0]]}) == []
    assert convex_vertices({"type": "convex", "planes": [[1, 0, 0]]}) is None
    assert bounding_box(sphere((1, 2), 3)) == ([-2, -1], [4, 5])


def test_faces_are_cut_at_the_first_empty_ear() -> None:
    points = [vector((x, y, 0)) for x, y in ((0, 0), (4, 0), (4, 4), (2, 1), (0, 4))]
    for face in ([0, 1, 2, 3, 4], [3, 4, 0, 1, 2]):
        parts = cut_face(points, face)
        assert sum(signed_area([points[i][:2] for i in part]) for part in parts) == Q(10)
        assert all(signed_area([points[i][:2] for i in part]) > 0 for part in parts)
