"""Points in scenes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import engine
from engine import Aabb, Convex, HalfSpace, Implicit, Polygon, Pose, Sphere, Triangle, locate, locate_scene
from engine.containment.methods.rational_locate import rational_location
from engine.containment.prepared import tree_of
from engine.running.budget import Budget
from engine.scenes import locate as locate_module
from engine.scenes.bodies import Bodies
from engine.scenes.locate import locate_all
from engine.scenes.placements import Placements
from engine.solids.registry import BodyKind
from engine.types import read_only
from tests.reference.containment import locate as reference
from tests.unit.containment.scenes import box_mesh, lattice_points, lattice_solids, made, merged, spelled

TURNS = {2: [[0.6, -0.8], [0.8, 0.6]], 3: [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]]}
QUARTERS = {2: [[0, -1], [1, 0]], 3: [[0, -1, 0], [0, 0, -1], [1, 0, 0]]}


def table(held: engine.SceneLocations, n_bodies: int) -> np.ndarray[Any, Any]:
    """Return the scene's answer as a table of locations, points by bodies."""
    located = np.full((len(held.offsets) - 1, n_bodies), -1)
    owners = np.repeat(np.arange(len(located)), np.diff(held.offsets))
    located[owners, held.indices] = np.where(held.on_boundary, 0, 1)
    for first, last in zip(held.offsets[:-1], held.offsets[1:]):
        assert (np.diff(held.indices[first:last]) > 0).all()
    return located


@pytest.mark.parametrize("dimension", [2, 3])
def test_unposed_scene_equals_locate(dimension: int) -> None:
    points = lattice_points(dimension)
    solids = [made(solid) for seed in (1, 2) for solid in lattice_solids(dimension, seed)]
    found = table(locate_scene(points, solids), len(solids))
    for index, solid in enumerate(solids):
        assert (found[:, index] == locate(points, solid)).all(), solid


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kind", ["turned", "quarter", "moved"])
def test_posed_scene_equals_the_reference(dimension: int, kind: str) -> None:
    turn = {"turned": TURNS, "quarter": QUARTERS, "moved": {2: np.eye(2), 3: np.eye(3)}}[kind][dimension]
    pose = Pose(turn, [0.5, -0.25, 1.0][:dimension] if kind != "turned" else [0.1, -0.7, 0.3][:dimension])
    as_json = {"rotation": pose.rotation.tolist(), "translation": pose.translation.tolist()}
    lattice = lattice_points(dimension)[:: 1 if dimension == 2 else 23]
    on_image = lattice @ pose.rotation.T + pose.translation  # close to the images of lattice points, or on them
    points = np.concatenate([lattice, on_image])
    for solid in lattice_solids(dimension, 4):
        try:
            expected = [reference(point, solid, as_json) for point in points.tolist()]
        except ValueError:
            continue
        found, accuracy = locate_scene(points, [made(solid)], [pose], report=True)
        assert table(found, 1)[:, 0].tolist() == expected, spelled(solid)
        if kind != "turned" and solid["type"] in ("aabb", "half_space", "polygon", "polyhedron"):
            assert accuracy.n_rational <= 3  # points whose difference to the translation rounds


def test_random_instances_of_one_mesh() -> None:
    random = np.random.default_rng(8)
    solid = made(box_mesh([-1, -2, -0.5], [1, 1, 0.5]))
    poses: list[Pose | None] = [None]
    for _ in range(30):
        matrix, _ = np.linalg.qr(random.normal(size=(3, 3)))
        poses.append(Pose(matrix * np.sign(np.linalg.det(matrix)), random.uniform(-4, 4, 3)))
    points = random.uniform(-5, 5, (4000, 3))
    found, accuracy = locate_scene(points, [solid] * 31, poses, report=True)
    located = table(found, 31)
    for index, pose in enumerate(poses):
        local = points if pose is None else (points - pose.translation) @ np.linalg.inv(pose.rotation).T
        inside = (np.abs(local - [0, -0.5, 0]) < [1, 1.5, 0.5]).all(axis=1)
        assert ((located[:, index] == 1) == inside).all()
    assert accuracy.n_rational == 0
    assert (accuracy.method, accuracy.decisions) == ("box_grid", "exact")


def test_flush_instances_share_their_walls() -> None:
    box = made(box_mesh([0, 0, 0], [1, 1, 1]))
    poses = [Pose(np.eye(3), [i, j, 0]) for i in range(3) for j in range(3)]
    held = locate_scene([[1, 0.5, 0.5], [1, 1, 0.5], [1.5, 1.5, 0.5], [1, 1, 2]], [box] * 9, poses)
    assert held.offsets.tolist() == [0, 2, 6, 7, 7]
    assert held.indices.tolist() == [0, 3, 0, 1, 3, 4, 4]
    assert held.on_boundary.tolist() == [True] * 6 + [False]


def test_a_turned_mesh_finds_its_own_vertices() -> None:
    """Exact images of lattice vertices under a float rotation are rarely floats; those that are, are boundary."""
    pose = Pose(TURNS[3], [0.25, 0.5, -1.0])
    solid = box_mesh([0, 0, 0], [4, 4, 4])
    points = np.array(solid["vertices"]) @ pose.rotation.T + pose.translation
    as_json = {"rotation": pose.rotation.tolist(), "translation": pose.translation.tolist()}
    expected = [reference(point, solid, as_json) for point in points.tolist()]
    assert table(locate_scene(points, [made(solid)], [pose]), 1)[:, 0].tolist() == expected


def test_unbounded_and_callable_bodies() -> None:
    solids = [
        HalfSpace([0, 1], 0),
        Sphere([0, 0], 1),
        Implicit.from_callable(lambda p: p[:, 0] - 3.0, 2),
        Aabb([2, 0], [5, 5]),
    ]
    poses = [None, None, Pose([[1, 0], [0, 1]], [1, 0]), None]
    held, accuracy = locate_scene([[0, 0], [4, 1], [9, -9]], solids, poses, report=True)
    assert held.indices.tolist() == [0, 1, 0, 2, 3, 2]
    assert held.on_boundary.tolist() == [True, False, False, True, False, False]
    assert accuracy.decisions == "float64"


@pytest.mark.parametrize("far", [1e9, 1e300])
def test_far_translations(far: float) -> None:
    pose = Pose(TURNS[2], [far, -far])
    square = {"type": "polygon", "rings": [[[0, 0], [8, 0], [8, 8], [0, 8]]]}
    as_json = {"rotation": pose.rotation.tolist(), "translation": pose.translation.tolist()}
    points = [[far, -far], [far + 1, -far + 5], [far * 1.5, 0], [far, np.nextafter(-far, 0)]]
    expected = [reference(point, square, as_json) for point in points]
    assert table(locate_scene(points, [made(square)], [pose]), 1)[:, 0].tolist() == expected


def test_portions_threads_and_order_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(9)
    solids = [Sphere(center, 0.5) for center in random.uniform(0, 4, (60, 3))] + [HalfSpace([1, 0, 0], -2)]
    points = random.uniform(0, 4, (3000, 3))
    whole = table(locate_scene(points, solids, workers=1), 61)
    monkeypatch.setattr("engine.scenes.locate._MOST_IN_GROUP", 7)
    monkeypatch.setattr("engine.scenes.locate._MOST_SORTED", 1)
    done: list[int] = []
    cut = table(locate_scene(points[::-1], solids[::-1], progress=done.append), 61)
    assert (whole == cut[::-1, ::-1]).all()
    assert sum(done) == 3000
    assert len(done) > 1


def test_nothing_and_errors() -> None:
    box = Aabb([0, 0], [1, 1])
    assert locate_scene([], [box]).offsets.tolist() == [0]
    assert locate_scene([[0, 0]], []).offsets.tolist() == [0, 0]
    with pytest.raises(engine.UnsupportedSolidError) as failure:
        locate_scene([[0, 0]], [box, "box"])  # type: ignore[list-item]
    assert failure.value.where == ("solids", 1)
    with pytest.raises(engine.WrongDimensionError):
        locate_scene([[0, 0]], [box, Aabb([0, 0, 0], [1, 1, 1])])
    with pytest.raises(engine.InvalidArrayError):
        locate_scene([[0, 0]], [box], [None, None])
    with pytest.raises(engine.WrongDimensionError):
        locate_scene([[0, 0]], [box], [Pose.identity(3)])
    surface = engine.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(engine.UnsupportedSolidError) as refused:
        locate_scene([[0, 0, 0]], [surface])
    assert refused.value.where == ("solids", 0)
    with pytest.raises(engine.DeadlineExceededError):
        locate_scene(np.zeros((1000, 2)), [box] * 100, deadline=0.0)


def test_a_scene_asked_often_answers_alike() -> None:
    """Points in polyhedra are located by rays, then by sides of cells: same answers, also on walls and vertices."""
    random = np.random.default_rng(3)
    shifts = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 1], [1e6, 0, 0]])
    meshes = [merged(box_mesh([0, 0, 0], [4, 4, 4]), box_mesh([1, 1, 1], [2, 3, 5])) for _ in shifts]
    for mesh, shift in zip(meshes, shifts):
        mesh["vertices"] = (np.array(mesh["vertices"]) + shift).tolist()
    solids = [made(mesh) for mesh in meshes]
    near = np.concatenate([random.uniform(-1, 6, (2000, 3)) + shift for shift in shifts])
    points = np.concatenate([near, np.round(near * 2.0) / 2.0, *(solid.vertices for solid in solids)])
    expected = np.stack([locate(points, solid) for solid in solids], axis=1)
    for _ in range(3):
        assert (table(locate_scene(points, solids), len(solids)) == expected).all()
    assert all(solid.cached("sides") is not None for solid in solids)


def test_instances_by_cells_equal_the_reference() -> None:
    random = np.random.default_rng(4)
    mesh = merged(box_mesh([0, 0, 0], [4, 4, 4]), box_mesh([1, 1, 1], [2, 3, 5]))
    solid = made(mesh)
    poses = [Pose(turn, move) for turn in (TURNS[3], QUARTERS[3], np.eye(3)) for move in random.integers(-2, 3, (4, 3))]
    points = np.concatenate([np.array(mesh["vertices"]) @ pose.rotation.T + pose.translation for pose in poses])
    points = np.concatenate([points, random.uniform(-6, 8, (4000, 3))])
    found = [table(locate_scene(points, [solid] * len(poses), poses), len(poses)) for _ in range(2)]
    assert solid.cached("sides") is not None
    assert (found[0] == found[1]).all()
    for body in (0, 5, 11):
        as_json = {"rotation": poses[body].rotation.tolist(), "translation": poses[body].translation.tolist()}
        chosen = np.concatenate([np.arange(0, len(points) - 4000, 7), np.flatnonzero(found[0][:, body] >= 0)[:20]])
        expected = [reference(points[item].tolist(), mesh, as_json) for item in chosen]
        assert found[0][chosen, body].tolist() == expected


@pytest.mark.parametrize("shift", [0.0, 1e6, 2.0**52])
def test_many_polygons_with_walls_in_common(shift: float) -> None:
    """Squares on a lattice, some with a hole; points at their vertices, on their edges and an ulp beside them."""
    squares = []
    for i in range(6):
        for j in range(6):
            low = np.array([shift + 4 * i, shift + 4 * j])
            rings = [low + np.array([[0, 0], [4, 0], [4, 4], [0, 4]])]
            if (i + j) % 2:
                rings.append(low + np.array([[1, 1], [3, 1], [2, 3]]))
            squares.append(engine.Polygon(rings))
    axis = shift + np.arange(-1.0, 26.0)
    lattice = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    points = np.concatenate([lattice, np.nextafter(lattice, np.inf), lattice + 0.5])
    found = table(locate_scene(points, squares), len(squares))
    for index, square in enumerate(squares):
        assert (found[:, index] == locate(points, square)).all()
    assert (found[27 * 5 + 5] == 0).sum() == 4  # a corner of the lattice is on four squares


def test_a_point_in_all_of_many_bodies_takes_room() -> None:
    boxes = [Aabb([-k, -k], [k, k]) for k in range(1, 301)]
    held = locate_scene(np.zeros((2000, 2)), boxes)
    assert (np.diff(held.offsets) == 300).all()
    assert not held.on_boundary.any()


# --- What tables leave is settled body by body, by trees or as `locate` does; some bodies moved ---


TURN = Pose([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]], [0.5, 0.25, 1])


@pytest.mark.parametrize("fewest", [1, 1 << 30])
def test_points_get_their_locations(fewest: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(locate_module, "_FEWEST_FOR_TREES", fewest)
    solid = made(merged(box_mesh([0, 0, 0], [3, 3, 3]), box_mesh([1, 1, 1], [4, 4, 2])))
    solids, poses = [solid, Sphere([1, 1, 1], 2), solid], [None, TURN, TURN]
    random = np.random.default_rng(2)
    points = read_only(random.integers(-1, 10, (200, 3)) / 2.0)
    with Budget() as budget:
        placements = Placements(Bodies((*solids, solid), (*poses, None)), {3: TURN})
        found, accuracy = locate_all(points, placements, budget, None, None)
        few, _ = locate_all(points[:9], placements, budget, None, None)
    expected = [
        (item, body, location == 0)
        for item, point in enumerate(points.tolist())
        for body, (each, pose) in enumerate(zip([*solids, solid], [*poses, TURN]))
        if (location := rational_location(point, each, pose)) >= 0
    ]
    owners = np.repeat(np.arange(200), np.diff(found.offsets)).tolist()
    assert list(zip(owners, found.indices.tolist(), found.on_boundary.tolist())) == expected
    assert few.indices.tolist() == [body for item, body, _ in expected if item < 9]
    assert solid.cached("tree") is not None
    assert accuracy.n_rational > 0


# --- Tables of bodies: each body finds its own solid again, in the slot of its kind ---


def test_kinds_and_slots_of_the_plane() -> None:
    ring = Polygon([[[0, 0], [4, 0], [0, 4]], [[1, 1], [2, 1], [1, 2]]])
    triangle, ball, box = Triangle([[5, 5], [6, 5], [5, 7]]), Sphere([1, 2], 3), Aabb([0, 0], [1, 2])
    half, wedge = HalfSpace([1, 0], 2), Convex([[1, 0, 0], [0, 1, 0]])
    many = Polygon([np.column_stack([np.cos(np.arange(200)), np.sin(np.arange(200))])])
    other = Implicit([{"powers": [1, 0], "coefficient": 1.0}])
    solids = [ball, ring, box, half, triangle, wedge, many, other, ring, ball]
    with Budget() as budget:
        tables = Bodies(tuple(solids), (*[None] * 9, Pose.identity(2))).tables(budget)
    names = "BALL RINGS BOX ROWS RINGS ROWS OTHER OTHER RINGS BALL"
    assert tables.kinds.tolist() == [BodyKind[name] for name in names.split()]
    first = tables.rings[tables.polygon_offsets[tables.slots[8]] + 1, 0]
    assert (tables.xs[first : first + 4].tolist(), tables.ys[first : first + 4].tolist()) == (
        [1, 2, 1, 1],
        [1, 1, 2, 1],
    )
    assert tables.rows[tables.row_offsets[tables.slots[5]] :][:2].tolist() == [[1, 0, 0, 0], [0, 1, 0, 0]]
    assert tables.balls[tables.slots[0]].tolist() == [3.0, 0.0]


def test_polyhedra_have_the_trees_that_are_there() -> None:
    solid = made(box_mesh([0, 0, 0], [1, 2, 3]))
    with Budget() as budget:
        for has_tree in (False, True):
            tables = Bodies((solid,), (None,)).tables(budget)
            assert tables.kinds.tolist() == [BodyKind.MESH]
            assert bool(tables.addresses.any()) == has_tree
            tree_of(solid)


@pytest.mark.parametrize("n_bodies", [300, 40_000, 33_000])
def test_scenes_of_any_size_in_one_process(n_bodies: int) -> None:
    """Unit boxes along a line, each flush with the next: a tree of many bodies is built on threads."""
    boxes = [Aabb([k, 0, 0], [k + 1, 1, 1]) for k in range(n_bodies)]
    found = engine.Scene(boxes).locate([[7, 0.5, 0.5], [n_bodies - 0.5, 0.5, 0.5], [-1, 0, 0]])
    assert found.offsets.tolist() == [0, 2, 3, 3]
    assert found.indices.tolist() == [6, 7, n_bodies - 1]
    assert found.on_boundary.tolist() == [True, True, False]
