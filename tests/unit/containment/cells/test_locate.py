"""Cells: certified answers equal the ray's, on hard sets and on what cells could get wrong; when they are built."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from engine import NotFiniteError, Polyhedron, locate
from engine.containment.cells.build import build_cells
from engine.containment.cells.locate import locate_by_cells
from engine.running.budget import Budget
from engine.types import UNDECIDED
from tests.unit.containment.methods.test_polyhedron_ray_parity import HARD
from tests.unit.containment.scenes import box_mesh, lattice_points, made, merged

MESHES = ("tm_rabbit", "tm_quadknot", "tm_cycloidal", "syn_sliver_uv", "c3d_fandisk", "syn_menger2", "tm_unit_cube")


def by_cells(points: Any, solid: Polyhedron) -> np.ndarray[Any, Any]:
    """Return what the cells answer by themselves, UNDECIDED where they leave it to the ray."""
    found = np.empty(len(points), np.int8)
    with Budget() as budget:
        cells = build_cells(solid, budget)
    n_open = locate_by_cells(np.ascontiguousarray(points), cells, found, np.zeros(1, np.uint8))
    assert n_open == (found == UNDECIDED).sum()
    return found


def assert_certified(points: Any, solid: Polyhedron, most_open: float = 1.0) -> None:
    found, expected = by_cells(points, solid), locate(points, solid)
    sure = found != UNDECIDED
    assert (found[sure] == expected[sure]).all()
    assert (~sure).mean() <= most_open


def around(vertices: Any, faces: Any, n: int, spread: float, seed: int = 0) -> Any:
    """Return points close to the faces."""
    random = np.random.default_rng(seed)
    corners = vertices[faces[random.integers(0, len(faces), n)]]
    points = (corners * random.dirichlet([1, 1, 1], n)[:, :, None]).sum(axis=1)
    return points + random.normal(size=points.shape) * spread * np.ptp(vertices, axis=0).max()


@pytest.mark.data
@pytest.mark.parametrize("name", HARD)
def test_hard_sets(data: Path, name: str) -> None:
    case = np.load(data / "hard_containment" / f"{name}.npz")
    found = by_cells(case["points"], Polyhedron(case["vertices"], case["faces"]))
    sure = found != UNDECIDED
    assert (found[sure] == case["location"][sure]).all()
    assert not (case["location"][sure] == 0).any()


@pytest.mark.data
@pytest.mark.parametrize("name", MESHES)
def test_meshes_equal_the_ray(data: Path, name: str) -> None:
    mesh = np.load(data / "meshes" / f"{name}.npz")
    vertices, faces = mesh["vertices"], mesh["faces"]
    solid = Polyhedron(vertices, faces)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    assert_certified(np.random.default_rng(1).uniform(low - 0.1, high + 0.1, (20_000, 3)), solid, 1e-3)
    for spread in (1e-2, 1e-4, 1e-7):
        assert_certified(around(vertices, faces, 5000, spread), solid)
    middles = (vertices[faces] + vertices[np.roll(faces, 1, axis=1)]).reshape(-1, 3) / 2
    assert_certified(np.concatenate([vertices, middles])[:20_000], solid)


@pytest.mark.parametrize("offset", [0.0, 1e9, -3e5])
@pytest.mark.parametrize("scale", [1.0, 2.0**300, 2.0**-300])
def test_lattice_solids(offset: float, scale: float) -> None:
    boxes = [box_mesh([0, 0, 0], [3, 3, 3]), box_mesh([1, 1, 1], [4, 4, 2]), box_mesh([0, 0, 3], [1, 4, 4])]
    mesh = merged(*boxes)
    solid = Polyhedron((np.array(mesh["vertices"]) + offset) * scale, mesh["faces"])
    points = np.concatenate([lattice_points(3), np.random.default_rng(2).uniform(-1, 5, (2000, 3))])
    assert_certified((points + offset) * scale, solid)


@pytest.mark.parametrize("stretch", [(1, 1, 1e-6), (1e-12, 1, 1), (1, 1e-3, 1e3)])
def test_flat_and_long_solids(stretch: tuple[float, float, float]) -> None:
    random = np.random.default_rng(3)
    faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    parts = [{"vertices": random.uniform(0, 1, (4, 3)).tolist(), "faces": faces} for _ in range(40)]
    mesh = merged(*parts)
    vertices = np.array(mesh["vertices"]) * stretch
    solid = Polyhedron(vertices, mesh["faces"])
    assert_certified(random.uniform(0, 1, (5000, 3)) * stretch, solid)
    assert_certified(around(vertices, np.array(mesh["faces"]), 2000, 1e-9), solid)


def test_faces_without_area_leave_their_points_to_the_ray() -> None:
    mesh = box_mesh([0, 0, 0], [2, 2, 2])
    mesh["vertices"] += [[1.0, 0.0, 1.0], [3.0, 0.0, 1.0], [5.0, 0.0, 1.0]]
    mesh["faces"] += [[8, 9, 10], [10, 9, 8]]
    points = np.concatenate([[[4, 0, 1], [1, 0, 1], [4.5, 0, 1]], np.random.default_rng(4).uniform(0, 5, (500, 3))])
    assert_certified(points, made(mesh))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("workers", [1, 2])
def test_the_first_of_the_points_that_are_not_finite_is_named(bad: float, workers: int) -> None:
    """The cells themselves look for them; chunks may end in any order."""
    solid = made(box_mesh([0, 0, 0], [1, 1, 1]))
    points = np.random.default_rng(9).uniform(-0.1, 1.1, (60_000, 3))
    assert locate(points, solid, report=True)[1].method == "segment_parity"
    points[41_234, 2] = points[55_555] = bad
    with pytest.raises(NotFiniteError, match=r"points\[41234\]\[2\]"):
        locate(points, solid, workers=workers)
    many = np.tile(points, (20, 1))  # on threads, whatever the machine
    for limits in ({}, {"deadline": 60.0}):
        with pytest.raises(NotFiniteError, match=r"points\[41234\]\[2\]"):
            locate(many, solid, workers=workers, **limits)
    far = np.array([[1e308, -1e308, 1e308], [0.5, 0.5, 0.5]] * 300)  # finite, though their sum is not
    assert locate(far, solid).tolist() == [-1, 1] * 300
