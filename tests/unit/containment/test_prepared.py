"""Building what queries share stops when the call must end, and leaves nothing half built."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from engine.containment.locate import locate
from engine.containment.locators import locator_of
from engine.containment.prepared import rings_of
from engine.errors import DeadlineExceededError
from engine.scenes.point_queries import locate_scene
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.primitives import Triangle
from tests.unit.containment.scenes import box_mesh, made

TETRAHEDRON = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


def test_every_step_can_be_the_last() -> None:
    solid, n_checks = Polygon([[[0, 0], [1, 0], [0, 1]]]), 0
    while True:
        n_left = n_checks

        def check() -> None:
            nonlocal n_left
            if n_left == 0:
                raise DeadlineExceededError("the deadline of the test")
            n_left -= 1

        try:
            built = rings_of(solid, check)
        except DeadlineExceededError:
            n_checks += 1
            continue
        break
    assert n_checks >= 2
    assert rings_of(solid) is built


def test_choosing_a_method_prepares_nothing() -> None:
    """A tree of many prisms would otherwise spend minutes in rational arithmetic before the first look at the clock."""
    prism = Triangle(np.eye(3))
    locator_of(prism)
    assert prism.memory == prism.vertices.nbytes


def test_threads_share_what_is_prepared_and_pickles_leave_it_out() -> None:
    """Several threads ask the same solids for the first time; each gets the answer of one that is alone."""
    random = np.random.default_rng(0)
    mesh, square = box_mesh([0, 0, 0], [2, 2, 2]), [[[0, 0], [4, 0], [4, 4], [0, 4]]]
    points = np.round(random.uniform(-1, 3, (6000, 3)) * 2) / 2

    def ask(solid: Polyhedron, polygon: Polygon) -> list[list[int]]:
        scene = locate_scene(points, [solid, solid])
        found = [locate(points, solid), locate(points[:, :2], polygon), scene.indices, scene.on_boundary]
        return [each.tolist() for each in found]

    expected = ask(made(mesh), Polygon(square))
    solid, polygon = made(mesh), Polygon(square)
    plain = pickle.dumps(solid)
    bare = solid.memory
    with ThreadPoolExecutor(4) as pool:
        assert all(found == expected for found in pool.map(lambda _: ask(solid, polygon), range(8)))
    assert solid.memory > bare + solid.cached("sides").statuses.nbytes
    assert pickle.dumps(solid) == plain
    again = pickle.loads(plain)
    assert again.memory == bare
    assert ask(again, polygon) == expected
