"""Nodes of crossing edges, and their rounding to a grid."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine.arrangement.arrange import arrange_rings, snap_rings
from engine.arrangement.nodes import NodeTable, float_nodes, nearest_quotient, rational_nodes, reduced
from engine.errors import NotRepresentableError


def exact_rings(seed: int, size: int) -> list[list[tuple[Fraction, Fraction]]]:
    """Return the edges of a random arrangement as degenerate rings: each is there and back again."""
    random = np.random.default_rng(seed)
    coordinates = random.integers(0, size, (12, 2)).astype(float)
    arrangement = arrange_rings(coordinates, [0, 6, 12], [1, 2])
    exact = arrangement.nodes.exact
    return [[exact(tail), exact(head)] for tail, head in zip(arrangement.tails, arrangement.heads, strict=True)]


@pytest.mark.parametrize("spacing", [-2, 0, 3])
@pytest.mark.parametrize("seed", range(12))
def test_snapped_edges_meet_in_lattice_points_only(seed: int, spacing: int) -> None:
    chains, _ = snap_rings(exact_rings(seed, 60), spacing)
    unit = 2.0**spacing
    vertices = np.array([vertex for chain in chains for vertex in chain]).reshape(-1, 2)
    assert (vertices / unit == np.rint(vertices / unit)).all()
    arrangement = arrange_rings(vertices, np.cumsum([0, *map(len, chains)]).tolist(), [1] * len(chains))
    assert arrangement.nodes.all_floats  # no new crossing: only points that were there


@pytest.mark.parametrize("seed", range(6))
def test_no_vertex_of_a_chain_is_far_from_its_edge(seed: int) -> None:
    rings = exact_rings(seed, 40)
    for (a, b), chain in zip(rings, snap_rings(rings, 1)[0], strict=True):
        for x, y in chain:
            cross = (b[0] - a[0]) * (Fraction(y) - a[1]) - (b[1] - a[1]) * (Fraction(x) - a[0])
            length = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2
            assert cross**2 <= length * 2  # half the diagonal of a pixel of side 2 is sqrt 2


def test_pixels_are_half_open() -> None:
    half = Fraction(1, 2)
    assert snap_rings([[(half, half), (-half, -half), (Fraction(3), Fraction(0))]], 0)[0] == [[(1, 1), (0, 0), (3, 0)]]


def test_edge_goes_through_the_hot_pixels_it_passes() -> None:
    zero = Fraction(0)
    near = [(Fraction(5), Fraction(1, 4)), (Fraction(5), Fraction(4)), (Fraction(6), Fraction(4))]
    edge = [(zero, zero), (Fraction(10), zero), (zero, Fraction(-9))]
    assert snap_rings([edge, near], 0)[0][0] == [(0, 0), (5, 0), (10, 0), (0, -9)]


def test_ring_smaller_than_a_pixel_shrinks_to_a_point() -> None:
    tiny = Fraction(1, 8)
    assert snap_rings([[(tiny, tiny), (2 * tiny, tiny), (tiny, 2 * tiny)]], 0)[0] == [[(0, 0)]]


# --- Exact points: union of equals, order, nearest doubles, extremes of the exponent range ---


TINY, HUGE = 5e-324, 1.7976931348623157e308


@pytest.mark.parametrize(
    "rows", [[(0.1, -0.2), (3.0, 4.5)], [(1e300, TINY), (-HUGE, 1.0)], [(2.0**80, 2.0**90)], [(0, 0)]]
)
def test_float_nodes_hold_the_floats_exactly(rows: list[tuple[float, float]]) -> None:
    nodes, numbers = float_nodes(np.array(rows, float))
    for row, number in zip(rows, numbers, strict=True):
        assert nodes.exact(number) == (Fraction(row[0]), Fraction(row[1]))
        assert (nodes.xs[number], nodes.ys[number]) == row
        assert nodes.displacement(number) == 0.0
    assert nodes.all_floats


def test_equal_points_are_one_node() -> None:
    nodes, numbers = float_nodes(np.array([(0.0, 1.0), (-0.0, 1.0), (1.0, 0.0)]))
    assert numbers == [0, 0, 1]
    nodes, numbers = rational_nodes([(Fraction(1, 3), 2), (Fraction(2, 6), 2.0)])
    assert numbers == [0, 0]
    assert not nodes.all_floats
    assert 0.0 < nodes.displacement(0) <= 2.0**-55


def test_order_is_exact_where_the_doubles_tie() -> None:
    third, other = Fraction(1, 3), Fraction(1, 3) + Fraction(1, 10**40)
    nodes, (a, b, c) = rational_nodes([(third, 0), (other, -5), (third, Fraction(-1, 10**400))])
    assert nodes.xs[a] == nodes.xs[b]
    assert nodes.compare(a, b) == -1
    assert nodes.compare(b, a) == 1
    assert nodes.compare(c, a) == -1
    assert nodes.compare(a, a) == 0


def test_points_stay_within_their_table_at_any_exponent() -> None:
    for exponent in (-1074, 0, 900):
        nodes = NodeTable(exponent)
        number = nodes.add(reduced(-6, 3, -9))
        assert nodes.points[number] == (2, -1, 3)
        assert nodes.exact(number) == (
            Fraction(2, 3) * Fraction(2) ** exponent,
            Fraction(-1, 3) * Fraction(2) ** exponent,
        )


def test_displacement_is_a_tight_bound() -> None:
    nodes, (third, tiny, whole) = rational_nodes([(Fraction(1, 3), 1), (Fraction(1, 10**400), 0), (2, 3)])
    error = abs(Fraction(1, 3) - Fraction(1 / 3))
    assert error <= nodes.displacement(third) <= error * (1 + Fraction(1, 2**50))
    assert 0.0 < nodes.displacement(tiny) <= 4 * TINY
    assert nodes.displacement(whole) == 0.0


def test_nearest_quotient_rounds_once_and_refuses_overflow() -> None:
    assert nearest_quotient(1, 3) == 1 / 3
    assert nearest_quotient(1, 2**1075) == 0.0  # tie to even
    assert nearest_quotient(3, 2**1076) == TINY
    assert str(nearest_quotient(-1, 10**400)) == "0.0"
    with pytest.raises(NotRepresentableError, match="beyond the largest"):
        nearest_quotient(2**1024, 1)
