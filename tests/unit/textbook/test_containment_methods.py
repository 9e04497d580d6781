"""The textbook's containment tests: right on easy input, wrong where it is known that they are."""

from __future__ import annotations

from math import pi, tan

import numpy as np
import pytest

from engine.textbook import polygons, polyhedra, solids
from tests.reference.containment import locate, locate_many
from tests.reference.shapes import box, polygon, reversed_faces, union_of
from tests.reference.shapes import half_space as half_space_solid

SHELL = union_of(box((0, 0, 0), (6, 6, 6)), reversed_faces(box((2, 2, 2), (4, 4, 4))))
VERTICES, TRIANGLES = np.array(SHELL["vertices"], float), np.array(SHELL["faces"], np.int64)
AHEAD = np.array([0.3, 0.5, 0.8])
PENTAGON = np.array([[0.0, 0.0], [4.0, 0.0], [5.0, 3.0], [2.0, 5.0], [-1.0, 3.0]])


def scattered(n: int, dim: int) -> np.ndarray:
    return np.random.default_rng(7).uniform(-2.0, 8.0, (n, dim))


def test_implicit_sphere() -> None:
    powers = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]])
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.8, 0.8, 0.0]])
    assert solids.in_implicit(points, powers, np.array([1.0, -1.0, -1.0, -1.0])).tolist() == [True, True, False]


def test_implicit_is_wrong_where_terms_cancel() -> None:
    """x^2 - 2x + 1 is positive beside 1, and the float sum is a negative multiple of an ulp or zero."""
    powers, coefficients = np.array([[1, 0], [2, 0], [0, 0]]), np.array([2.0, -1.0, -1.0])
    beside = np.array([[1.0 + 2.0**-30, 0.0]])
    terms = [{"powers": p, "coefficient": c} for p, c in zip(powers.tolist(), coefficients.tolist(), strict=True)]
    assert solids.in_implicit(beside, powers, coefficients).tolist() == [True]
    assert locate(beside[0].tolist(), {"type": "implicit", "terms": terms}) == -1


def test_half_space() -> None:
    normal = np.array([0.0, 0.0, 1.0])
    points = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [5.0, 5.0, 0.5]])
    assert solids.in_half_space(points, normal, -1.0).tolist() == [True, True, False]
    assert solids.clip_points(points, normal, -1.0).tolist() == points[:2].tolist()


def test_half_space_is_wrong_beside_the_plane() -> None:
    normal, offset, point = [3.2, 1.5], -34.71000000000001, [6.300000000000001, 9.700000000000001]
    assert solids.in_half_space(np.array([point]), np.array(normal), offset)[0]
    assert locate(point, half_space_solid(normal, offset)) == -1


def test_convex() -> None:
    planes = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, -1.0, 2.0]])
    assert solids.in_convex(np.array([[0.5, 0.5], [1.0, 1.0], [1.5, 1.0]]), planes).tolist() == [True, True, False]


def test_polyhedron_parity_agrees_away_from_the_surface() -> None:
    points = scattered(200, 3)
    expected = [location > 0 for location in locate_many(points.tolist(), SHELL)]
    assert polyhedra.by_half_line(points, VERTICES, TRIANGLES, AHEAD).tolist() == expected
    directions = np.array([[0.0, 0.0, 1.0], AHEAD])
    contained, unfinished = polyhedra.by_other_half_lines(points, VERTICES, TRIANGLES, directions, 1e-9)
    assert contained.tolist() == expected
    assert not unfinished.any()


def test_polyhedron_parity_is_wrong_through_an_edge() -> None:
    """Straight up from (1, 1, 1) the half-line meets the diagonal of the top: both triangles are counted."""
    point, up = np.array([[1.0, 1.0, 1.0]]), np.array([0.0, 0.0, 1.0])
    assert not polyhedra.by_half_line(point, VERTICES, TRIANGLES, up)[0]
    assert locate(point[0].tolist(), SHELL) == 1
    contained, unfinished = polyhedra.by_other_half_lines(point, VERTICES, TRIANGLES, np.array([up, AHEAD]), 1e-9)
    assert contained[0]
    assert not unfinished[0]


def test_recasting_cannot_finish_on_an_edge() -> None:
    """A point on an edge is close to it whatever the direction."""
    directions = np.random.default_rng(1).normal(size=(100, 3))
    _, unfinished = polyhedra.by_other_half_lines(np.array([[0.0, 0.0, 3.0]]), VERTICES, TRIANGLES, directions, 1e-9)
    assert unfinished[0]


def test_polygon_methods_agree_away_from_the_boundary() -> None:
    points = scattered(300, 2)
    expected = [location > 0 for location in locate_many(points.tolist(), polygon(PENTAGON.tolist()))]
    assert polygons.by_half_line(points, PENTAGON, np.array([0, 5])).tolist() == expected
    assert polygons.by_same_side(points, PENTAGON).tolist() == expected
    assert polygons.by_same_side(points, PENTAGON[::-1].copy()).tolist() == expected
    assert polygons.by_signed_angles(points, PENTAGON).tolist() == expected
    assert polygons.by_unsigned_angles(points, PENTAGON, 1e-9).tolist() == expected


def test_polygon_parity_with_a_hole() -> None:
    rings = np.array([[0, 0], [6, 0], [6, 6], [0, 6], [2, 2], [4, 2], [4, 4], [2, 4]], float)
    points = np.array([[1.0, 1.0], [3.0, 3.0], [7.0, 3.0]])
    assert polygons.by_half_line(points, rings, np.array([0, 4, 8])).tolist() == [True, False, False]


@pytest.mark.parametrize(
    ("method", "vertices", "point", "is_inside"),
    [
        ("parity", [[8.9, 6.800000000000001], [7.2, 8.3], [1.5, 4.4]], [7.362951722178885, 8.15621906866569], True),
        ("side", [[9.1, 9.1], [1.1, 5.6000000000000005], [5.2, 5.300000000000001]],
         [4.869943890058179, 7.249350451900454], False),
        ("signed", [[9.1, 9.1], [1.1, 5.6000000000000005], [5.2, 5.300000000000001]],
         [4.869943890058179, 7.249350451900454], False),
        ("unsigned", [[4.6000000000000005, 2.1], [4.0, 4.2], [5.1000000000000005, 3.8000000000000003]],
         [4.109641440033739, 3.816254959881913], False),
    ],
)  # fmt: skip
def test_polygon_methods_are_wrong_beside_an_edge(
    method: str, vertices: list[list[float]], point: list[float], is_inside: bool
) -> None:
    ring, points = np.array(vertices), np.array([point])
    found = {
        "parity": lambda: polygons.by_half_line(points, ring, np.array([0, 3])),
        "side": lambda: polygons.by_same_side(points, ring),
        "signed": lambda: polygons.by_signed_angles(points, ring),
        "unsigned": lambda: polygons.by_unsigned_angles(points, ring, 1e-9),
    }[method]()
    assert (locate(point, polygon(vertices)) >= 0) == is_inside
    assert found[0] != is_inside


def test_the_unsigned_sum_needs_a_tolerance() -> None:
    """Outside, at height h under the middle of a side, the sum is a full turn less about 4 h / length."""
    ring = np.array([[-1.0, 0.0], [1.0, 0.0], [1.0, 2.0], [-1.0, 2.0]])
    for h in (1e-3, 1e-6):
        below, tolerance = np.array([[0.0, -h]]), 8.0 * tan(h) + 1e-12
        assert polygons.by_unsigned_angles(below, ring, tolerance)[0]  # wrong: it is outside
        assert not polygons.by_unsigned_angles(below, ring, 1e-7)[0]
        assert not polygons.by_signed_angles(below, ring)[0]
    inside = np.random.default_rng(3).uniform((-0.9, 0.1), (0.9, 1.9), (200, 2))
    without = polygons.by_unsigned_angles(inside, ring, 0.0)
    assert 0 < without.sum() < len(inside)  # without a tolerance rounding alone loses points of the inside
    assert polygons.by_unsigned_angles(inside, ring, 1e-9).all()
    assert polygons.unsigned_angle(0.0, 0.0, 1.0, 0.0) == pi


def test_triangle_methods_agree() -> None:
    triangle = np.array([[0.0, 0.0, 0.0], [6.0, 1.0, 2.0], [1.0, 5.0, 1.0]])
    weights = np.random.default_rng(5).uniform(-0.5, 1.0, (200, 2))
    points = weights @ (triangle[1:] - triangle[0])
    expected = (weights.min(axis=1) >= 0.0) & (weights.sum(axis=1) <= 1.0)
    for order in ([0, 1, 2], [1, 0, 2]):
        for axes in ([0, 1, 2], [1, 2, 0], [2, 0, 1]):
            turned = np.ascontiguousarray(triangle[order][:, axes])
            assert (solids.by_products(np.ascontiguousarray(points[:, axes]), turned) == expected).all()
            assert (solids.by_projection(np.ascontiguousarray(points[:, axes]), turned) == expected).all()


def test_triangle_methods_are_wrong_beside_an_edge() -> None:
    triangle = [[8.8, 1.7000000000000002, 0.1], [1.9000000000000001, 9.8, 0.7], [1.9000000000000001, 4.9, 0.3]]
    point = [4.524423672699365, 6.719154819005095, 0.47178924585222914]
    assert locate(point, {"type": "triangle", "vertices": triangle}) == -1
    assert solids.by_products(np.array([point]), np.array(triangle))[0]
    assert solids.by_projection(np.array([point]), np.array(triangle))[0]


def test_prism_of_a_tiny_triangle_holds_everything() -> None:
    """The normal underflows to zero, and every product is >= 0."""
    tiny = np.array([[0.0, 0.0, 0.0], [1e-170, 0.0, 0.0], [0.0, 1e-170, 0.0]])
    assert solids.by_products(np.array([[5.0, 5.0, 5.0]]), tiny)[0]


def test_csg_tree() -> None:
    def left(points: np.ndarray) -> np.ndarray:
        return points[:, 0] <= 2.0

    def right(points: np.ndarray) -> np.ndarray:
        return points[:, 0] >= 1.0

    points = np.array([[0.0], [1.5], [3.0], [2.0]])
    assert solids.in_csg_tree(points, ("intersection", left, right)).tolist() == [False, True, False, True]
    assert solids.in_csg_tree(points, ("union", left, right)).all()
    nested = ("difference", left, ("intersection", left, right))
    assert solids.in_csg_tree(points, nested).tolist() == [True, False, False, False]
    with pytest.raises(ValueError, match="'xor'"):
        solids.in_csg_tree(points, ("xor", left, right))
