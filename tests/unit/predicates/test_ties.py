"""The rule for ties, (eps, eps^2): all that count crossings decide as exact arithmetic does for a small eps."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import numpy as np
import pytest

from engine.collision.meshes.exact_regions import _perturbed_line_hits
from engine.collision.meshes.parity import MISSED as PASSED_BY
from engine.collision.meshes.parity import ray_crosses
from engine.collision.meshes.triangle_triangle import Facet
from engine.containment.methods import rational_locate
from engine.containment.methods.polyhedron_ray_parity import CROSSED, meet_upwards
from engine.predicates.orientation import tie_sign, tie_sign_exact
from engine.segment_clipping.exact_pieces import is_crossed
from engine.segment_clipping.on_boundary.contacts import Bit, Kind
from engine.segment_clipping.on_boundary.triangle_contacts import exact_contact
from engine.types import Point3

EPS = Fraction(1, 10**6)  # far below what differences of coordinates up to 4 could be taken over by
Corner = tuple[int, int]


def turn(a: Corner, b: Corner, x: Fraction, y: Fraction) -> Fraction:
    return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])


def is_over_moved(corners: list[Corner], q: Corner) -> bool:
    """Tell whether q + (eps, eps^2) lies within a triangle of the plane."""
    x, y = q[0] + EPS, q[1] + EPS**2
    signs = [turn(a, b, x, y) for a, b in zip(corners, [*corners[1:], corners[0]])]
    return min(signs) > 0 or max(signs) < 0


def triangles() -> list[list[Corner]]:
    """Return triangles of a lattice, upright ones and points among them."""
    rng = np.random.default_rng(8)
    return [[(int(x), int(y)) for x, y in corners] for corners in rng.integers(0, 5, (60, 3, 2))]


def test_the_sign_of_a_tie_is_that_of_the_moved_point() -> None:
    lattice = list(product(range(4), repeat=2))
    for a, b in product(lattice, lattice):
        q = 2 * a[0] - b[0], 2 * a[1] - b[1]  # on the line of a and b
        value = turn(a, b, q[0] + EPS, q[1] + EPS**2)
        assert tie_sign_exact(*a, *b) == (value > 0) - (value < 0)
        assert tie_sign(*map(float, (*a, *b))) == tie_sign_exact(*a, *b)


@pytest.mark.parametrize("corners", triangles())
def test_all_that_count_crossings_decide_alike(corners: list[Corner]) -> None:
    above = [(x, y, 1) for x, y in corners]
    points = [Point3(float(x), float(y), 1.0) for x, y in corners]
    has_area = turn(corners[0], corners[1], Fraction(corners[2][0]), Fraction(corners[2][1])) != 0
    for x, y in product(range(5), repeat=2):
        is_over, q, top = is_over_moved(corners, (x, y)), (x, y, 0), (x, y, 3)
        low, high = Point3(float(x), float(y), 0.0), Point3(float(x), float(y), 3.0)
        assert (meet_upwards(*points, low) & 3 == CROSSED) == is_over
        assert (rational_locate._cross_upwards(*above, q) == rational_locate.CROSSED) == is_over
        assert (ray_crosses(Facet(*points), low, 0.0) != PASSED_BY) == is_over
        assert is_crossed(q, top, above) == is_over
        if has_area:  # others are upright, and not asked
            assert _perturbed_line_hits(above, 0, 1, x, y, 1) == is_over
            kind = exact_contact(*points, low, high, False)
            assert kind != Kind.DEGENERATE
            assert (kind == Kind.PROPER or (kind > Kind.DEGENERATE and kind & Bit.CROSSES != 0)) == is_over
