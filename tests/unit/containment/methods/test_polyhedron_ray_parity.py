"""Polyhedron by ray and parity, in a pass and by a tree: degeneracies by hand, the hard sets, invariance."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from engine import Polyhedron, locate
from engine.containment import policy
from engine.containment.methods.polyhedron_ray_parity import locate_by_tree
from engine.containment.methods.rational_locate import rational_location
from engine.containment.prepared import tree_of
from engine.types import UNDECIDED, read_only
from tests.reference.containment import locate_many
from tests.unit.containment.scenes import box_mesh, lattice_points, made, merged

HARD = (
    "c3d_spot",
    "c3d_spot_off1e6",
    "syn_bracket",
    "syn_bracket_off1e9",
    "syn_gear_off1e9",
    "syn_menger2",
    "syn_sliver_uv",
    "syn_voxrand",
)


@pytest.fixture(autouse=True, params=[0, 1 << 60], ids=["tree", "pass"])
def _method(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every test twice: a tree from the first point on, and never."""
    monkeypatch.setattr(policy, "_TREE", request.param)
    monkeypatch.setattr(policy, "_TREE_A_FACE", 0)


@pytest.mark.data
@pytest.mark.parametrize("name", HARD)
def test_hard_sets(data: Path, name: str) -> None:
    case = np.load(data / "hard_containment" / f"{name}.npz")
    found = locate(case["points"], Polyhedron(case["vertices"], case["faces"]))
    assert (found == case["location"]).all()


@pytest.mark.data
@pytest.mark.parametrize("scale", [2.0**990, 2.0**-1000])
def test_hard_sets_at_the_ends_of_the_range(data: Path, scale: float) -> None:
    case = np.load(data / "hard_containment" / "syn_menger2.npz")
    points = case["points"] * scale
    exact = (points / scale == case["points"]).all(axis=1)
    found = locate(points[exact], Polyhedron(case["vertices"] * scale, case["faces"]))
    assert (found == case["location"][exact]).all()


def assert_equals_reference(solid: dict, points: np.ndarray) -> None:  # type: ignore[type-arg]
    assert locate(points, made(solid)).tolist() == locate_many(points.tolist(), solid)


def test_every_place_of_a_box() -> None:
    points = lattice_points(3)[::3]
    assert_equals_reference(box_mesh([0, 0, 0], [4, 4, 4]), points)


@pytest.mark.some(6)
@pytest.mark.parametrize(
    "pair",
    [
        ([0, 0, 0], [2, 2, 2], [2, 0, 0], [4, 2, 2]),  # a shared wall cancels, and is still boundary
        ([0, 0, 0], [2, 2, 2], [2, 2, 0], [4, 4, 2]),  # an edge in common
        ([0, 0, 0], [4, 4, 4], [1, 1, 1], [3, 3, 3]),  # nested: a void by even-odd
        ([0, 0, 0], [3, 3, 3], [1, 1, 1], [4, 4, 4]),  # crossing itself
        ([0, 0, 0], [2, 2, 2], [0, 0, 0], [2, 2, 2]),  # twice the same: nothing inside, all of it boundary
        ([0, 0, 0], [3, 3, 0], [1, 1, 0], [2, 2, 2]),  # one of no height
        ([0, 0, 0], [0, 0, 3], [0, 0, 1], [0, 0, 2]),  # needles of no width
    ],
)
def test_pairs_of_boxes_as_one_solid(pair: tuple[list[float], ...]) -> None:
    solid = merged(box_mesh(pair[0], pair[1]), box_mesh(pair[2], pair[3]))
    assert_equals_reference(solid, lattice_points(3)[::4])


def test_slanted_mesh_with_random_and_surface_points() -> None:
    random = np.random.default_rng(7)
    vertices = random.uniform(-1, 1, (6, 3))
    faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    solid = merged(
        {"vertices": vertices[:4].tolist(), "faces": faces}, {"vertices": vertices[2:].tolist(), "faces": faces}
    )
    weights = random.dirichlet([1, 1, 1], 40)
    on_faces = np.concatenate([weights @ vertices[[0, 2, 1]], (vertices[:3] + vertices[1:4]) / 2, vertices])
    assert_equals_reference(solid, np.concatenate([random.uniform(-1, 1, (80, 3)), on_faces]))


def test_zero_area_faces_count_for_boundary_only() -> None:
    mesh = box_mesh([0, 0, 0], [2, 2, 2])
    mesh["vertices"] += [[1.0, 0.0, 1.0], [3.0, 0.0, 1.0], [5.0, 0.0, 1.0]]
    mesh["faces"] += [[8, 9, 10], [10, 9, 8]]  # a double face without area, sticking out
    found = locate([[4, 0, 1], [1, 0, 1], [4, 0.5, 1], [1, 1, 1], [4, 0, 0]], made(mesh))
    assert found.tolist() == [0, 0, -1, 1, -1]


def test_order_of_faces_and_translation_change_nothing() -> None:
    mesh = merged(box_mesh([0, 0, 0], [3, 3, 3]), box_mesh([1, 1, 1], [4, 4, 2]))
    points = lattice_points(3)
    points = points[(points * 2 == np.round(points * 2)).all(axis=1)]  # those that translate exactly
    found = locate(points, made(mesh))
    random = np.random.default_rng(3)
    faces = [mesh["faces"][i] for i in random.permutation(len(mesh["faces"]))]
    turned = [face[k:] + face[:k] for face, k in zip(faces, random.integers(0, 3, len(faces)))]
    assert (locate(points, Polyhedron(mesh["vertices"], turned)) == found).all()
    assert (locate(points + 2.0**40, Polyhedron(np.array(mesh["vertices"]) + 2.0**40, turned)) == found).all()


def test_a_tree_of_slivers_far_away_tells_what_rationals_tell() -> None:
    """Triangles that are thin, upright, or flat seen from above; points over edges, on them and a blur beside."""
    random = np.random.default_rng(11)
    flat = random.integers(0, 5, (40, 4, 3)).astype(np.float64)
    flat[::3, :, 0] = flat[::3, :1, 0]  # upright
    flat[1::3, 3] = flat[1::3, 0] + 2.0**-40  # thin
    tetrahedra = [{"vertices": four.tolist(), "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]} for four in flat]
    mesh = merged(*tetrahedra)
    for shift, scale in ((0.0, 1.0), (2.0**30, 1.0), (0.0, 2.0**-600)):
        solid = Polyhedron((np.array(mesh["vertices"]) + shift) * scale, mesh["faces"])
        points = np.concatenate([lattice_points(3)[::5], random.uniform(-1, 5, (100, 3))]) + shift
        points = read_only(points * scale)
        found, flag = np.empty(len(points), np.int8), np.zeros(1, np.uint8)
        locate_by_tree(points, np.zeros(len(points)), tree_of(solid), found, flag)
        no_tree = Polyhedron(solid.vertices, mesh["faces"])
        expected = np.array([rational_location(point, no_tree) for point in points.tolist()])
        assert ((found == expected) | (found == UNDECIDED)).all()
        assert (found != UNDECIDED).mean() > 0.95 or scale != 1.0
        beside = Fraction(scale) / 3**40
        for point in points[::4].tolist():  # no doubles: the tree leaves the triangles that are not clear
            exact = [Fraction(value) + beside * int(random.integers(-1, 2)) for value in point]
            assert rational_location(exact, solid) == rational_location(exact, no_tree)
        blurs = np.full(len(points), 2.0**-20 * scale)
        locate_by_tree(points, blurs, tree_of(solid), found, flag)
        assert ((found == expected) | (found == UNDECIDED)).all()
        assert (found != UNDECIDED).any()


def test_what_is_no_number_is_undecided() -> None:
    tree, flag, found = tree_of(made(box_mesh([0, 0, 0], [2, 2, 2]))), np.zeros(1, np.uint8), np.zeros(4, np.int8)
    points = read_only(np.array([[np.nan, 1, 1], [1, np.nan, 1], [1, 1, np.nan], [1, 1, 1]]))
    with np.errstate(invalid="ignore"):
        locate_by_tree(points, np.array([0.0, 1e-9, 0.0, np.nan]), tree, found, flag)
    assert found.tolist() == [UNDECIDED] * 4
