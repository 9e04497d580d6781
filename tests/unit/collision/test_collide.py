"""Relations of meshes: by hand, against the reference, and under everything that must not change them."""

from __future__ import annotations

import gzip
import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import engine
from engine import Aabb, HalfSpace, Polyhedron, Pose, Relation, Sphere, Surface, collide
from tests.reference.collision import relation
from tests.reference.shapes import Solid, box, reversed_faces, tetrahedron, union_of

UNIT = box((0, 0, 0), (1, 1, 1))
BIG = box((0, 0, 0), (6, 6, 6))
HOLLOW = union_of(BIG, reversed_faces(box((2, 2, 2), (4, 4, 4))))
DOUBLED = union_of(UNIT, reversed_faces(UNIT))
FIN = union_of(BIG, box((5, 1, 1), (9, 2, 2)), box((6, 1, 1), (9, 2, 2)))  # the part beyond x = 6 cancels
NEEDLE = tetrahedron((1, 1, 1), (2, 2, 2), (3, 3, 3), (5, 5, 5))
SQUARE = {"type": "surface", "vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "faces": [[0, 1, 2], [0, 2, 3]]}


def moved(solid: Solid, *, scale: float = 1.0, by: tuple[float, float, float] = (0, 0, 0)) -> Solid:
    vertices = [[x * scale + d for x, d in zip(v, by, strict=True)] for v in solid["vertices"]]
    return {**solid, "vertices": vertices}


def made(solid: Solid) -> engine.Solid:
    if solid["type"] == "aabb":
        return Aabb(solid["min"], solid["max"])
    kind = Polyhedron if solid["type"] == "polyhedron" else Surface
    return kind(solid["vertices"], solid["faces"])


def flat(low: tuple[float, float, float], high: tuple[float, float, float]) -> Solid:
    return {"type": "aabb", "min": list(low), "max": list(high)}


CASES: list[tuple[str, Solid, Solid, str, dict[str, Any]]] = [
    ("beside", UNIT, moved(UNIT, by=(2, 0, 0)), "disjoint", {}),
    ("flush", UNIT, moved(UNIT, by=(1, 0, 0)), "touching", {"kind": "face_face", "piercing": False}),
    ("edge to edge", UNIT, moved(UNIT, by=(1, 1, 0)), "touching", {"kind": "edge_edge"}),
    ("corner to corner", UNIT, moved(UNIT, by=(1, 1, 1)), "touching", {"kind": "vertex_vertex"}),
    ("equal", UNIT, UNIT, "overlapping", {}),
    ("inside with a common face", UNIT, BIG, "overlapping", {}),
    ("inside", moved(UNIT, by=(1, 1, 1)), BIG, "first_inside_second", {"containing": "second", "first_face": 0}),
    ("around", BIG, moved(UNIT, by=(1, 1, 1)), "second_inside_first", {"containing": "first", "second_face": 0}),
    ("in the cavity", HOLLOW, moved(UNIT, by=(2.5, 2.5, 2.5)), "disjoint", {}),
    ("fills the cavity", HOLLOW, box((2, 2, 2), (4, 4, 4)), "touching", {"kind": "face_face"}),
    ("around the cavity", HOLLOW, box((1, 1, 1), (5, 5, 5)), "overlapping", {"kind": "containment"}),
    ("bar through, on a lattice", BIG, box((2, 2, -1), (4, 4, 7)), "overlapping", {}),
    ("bar flush inside", BIG, box((2, 2, 0), (4, 4, 6)), "overlapping", {}),
    ("cancelled body", DOUBLED, UNIT, "touching", {}),
    ("cancelled body around", DOUBLED, moved(UNIT, scale=0.5, by=(0.25, 0.25, 0.25)), "disjoint", {}),
    ("cancelled body inside", moved(DOUBLED, by=(1, 1, 1)), BIG, "first_inside_second", {}),
    ("cancelled through", moved(DOUBLED, by=(-0.5, 1, 1)), BIG, "touching", {"piercing": True}),
    ("cancelled fin pierces", FIN, moved(BIG, by=(6.5, 0, 0)), "touching", {"piercing": True}),
    ("in the cancelled fin", FIN, box((6.5, 1.25, 1.25), (7, 1.75, 1.75)), "disjoint", {}),
    ("needle in", NEEDLE, BIG, "first_inside_second", {}),
    ("needle through", moved(NEEDLE, scale=2), BIG, "touching", {"piercing": True}),
    ("needle on a face", moved(NEEDLE, by=(5, 5, 5)), BIG, "touching", {"piercing": False}),
    ("surface through", moved(SQUARE, scale=9, by=(-1, -1, 3)), BIG, "touching", {"piercing": True}),
    ("surface on a face", moved(SQUARE, by=(1, 1, 6)), BIG, "touching", {"piercing": False}),
    ("surface inside", moved(SQUARE, by=(1, 1, 3)), BIG, "first_inside_second", {}),
    ("surface hanging in from a face", moved(SQUARE, by=(0, 1, 3)), BIG, "touching", {"piercing": True}),
    ("surface outside, edge on a face", moved(SQUARE, by=(-1, 1, 3)), BIG, "touching", {"piercing": False}),
    ("surface around", BIG, moved({**BIG, "type": "surface"}, scale=3, by=(-1, -1, -1)), "disjoint", {}),
    ("two surfaces", SQUARE, {**UNIT, "type": "surface"}, "touching", {"piercing": False}),
    ("flat box through", flat((1, 1, 3), (9, 9, 3)), BIG, "touching", {"piercing": True}),
    ("flat box inside", flat((1, 1, 3), (2, 2, 3)), BIG, "first_inside_second", {}),
    ("segment box through", flat((1, 1, -1), (1, 1, 9)), BIG, "touching", {"piercing": True}),
    ("segment box along an edge", flat((0, 0, -1), (0, 0, 9)), BIG, "touching", {"piercing": False}),
    ("point box inside", flat((1, 1, 1), (1, 1, 1)), BIG, "first_inside_second", {}),
    ("point box on a corner", flat((6, 6, 6), (6, 6, 6)), BIG, "touching", {}),
    ("point boxes", flat((6, 6, 6), (6, 6, 6)), flat((6, 6, 6), (6, 6, 6)), "touching", {"kind": "vertex_vertex"}),
    ("boxes", flat((0, 0, 0), (1, 1, 1)), flat((0.5, 0.5, 0.5), (2, 2, 2)), "overlapping", {}),
]


@pytest.mark.parametrize(("first", "second", "expected", "witness"), [c[1:] for c in CASES], ids=[c[0] for c in CASES])
def test_by_hand(first: Solid, second: Solid, expected: str, witness: dict[str, Any]) -> None:
    found = collide(made(first), made(second))
    assert found.relation.label == expected
    assert (found.witness is None) == (expected == "disjoint")
    for name, value in witness.items():
        assert getattr(found.witness, name) == value, found
    assert collide(made(second), made(first)).relation == found.swapped().relation
    assert relation(first, second) == found.relation


def test_thousands_of_contacts_end_and_are_told() -> None:
    n = 24
    corners = np.stack(np.meshgrid(np.arange(n + 1), np.arange(n + 1), [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(corners)).reshape(n + 1, n + 1, 2)
    quads = []
    for i in range(n):
        for j in range(n):
            a, b, c, d = number[i, j], number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]
            quads += [[a[1], b[1], c[1], d[1]], [a[0], d[0], c[0], b[0]]]
    for k in range(n):
        for ends in ((number[k, 0], number[k + 1, 0]), (number[k + 1, n], number[k, n])):
            quads.append([ends[0][0], ends[1][0], ends[1][1], ends[0][1]])
        for ends in ((number[0, k + 1], number[0, k]), (number[n, k], number[n, k + 1])):
            quads.append([ends[0][0], ends[1][0], ends[1][1], ends[0][1]])
    lower, upper = Polyhedron(corners, quads), Polyhedron(np.add(corners, [0, 0, 1]), quads)
    off_plane_point = Polyhedron(np.add(corners, [0.25, 0.5, 1]), quads)
    for other in (upper, off_plane_point):  # more contacts than one turn of the search has room for
        assert collide(lower, other, deadline=60.0).relation == Relation.TOUCHING


def test_faces_of_a_box_are_numbered_by_axis() -> None:
    cube = Aabb([0, 0, 0], [1, 1, 1])
    for axis in range(3):
        step = np.eye(3)[axis]
        for side, sign in ((0, -1), (1, 1)):
            witness = collide(cube, Aabb(sign * step, sign * step + 1)).witness
            assert witness is not None
            assert witness.kind == "face_face"
            assert (witness.first_face, witness.second_face) == (2 * axis + side, 2 * axis + 1 - side)


def random_body(rng: np.random.Generator) -> Solid:
    """Return boxes, tetrahedra and octahedra on a small lattice, combined under even-odd; some as surfaces or flat."""
    n = 3
    parts = []
    for _ in range(rng.choice([1, 1, 2, 3])):
        if rng.random() < 0.5:
            low = rng.integers(0, n, 3)
            parts.append(box(low.tolist(), (low + rng.integers(1, 3, 3)).tolist()))
        else:
            corners = np.unique(rng.integers(0, n + 1, (8, 3)), axis=0)
            parts.append(tetrahedron(*rng.permutation(corners)[:4].tolist()))
    if rng.random() < 0.15:
        parts.append(parts[0])
    body = union_of(*parts)
    if rng.random() < 0.2:
        return {**body, "type": "surface", "faces": body["faces"][:: int(rng.integers(1, 4))]}
    if rng.random() < 0.1:
        low = rng.integers(0, n, 3)
        return flat(low.tolist(), (low + rng.integers(0, 2, 3)).tolist())
    return body


def random_pose(rng: np.random.Generator) -> Solid:
    u = rng.normal(size=4)
    w, x, y, z = u / np.linalg.norm(u)
    rotation = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return {"rotation": rotation, "translation": rng.choice([0.0, 0.1, 1.0], 3).tolist()}


def check_random(n_cases: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(n_cases):
        first, second = random_body(rng), random_body(rng)
        poses: list[Solid | None] = [None, None]
        if rng.random() < 0.3:  # one rotation for both, so that faces stay flush
            pose = random_pose(rng)
            poses = [pose, {**pose, "translation": (np.array(pose["translation"]) + rng.integers(0, 2, 3)).tolist()}]
            if rng.random() < 0.3:
                poses[0] = None
        a, b = (None if pose is None else Pose(pose["rotation"], pose["translation"]) for pose in poses)
        found = collide(made(first), made(second), first_pose=a, second_pose=b)
        assert found.relation == relation(first, second, *poses), (first, second, poses)


def test_random_bodies_equal_the_reference() -> None:
    check_random(8, 1)


@pytest.mark.full
def test_many_random_bodies_equal_the_reference() -> None:
    check_random(3000, 2)


HARD_NAMES = {
    "disjoint": Relation.DISJOINT,
    "A_in_B": Relation.FIRST_INSIDE_SECOND,
    "B_in_A": Relation.SECOND_INSIDE_FIRST,
    "overlapping": Relation.OVERLAPPING,
    "touching": Relation.TOUCHING,
}


def check_hard(data: Path, step: int) -> None:
    """Compare every `step`-th case of the hard set, both ways round, with its exact answer."""
    cases = json.loads(gzip.decompress((data / "hard_collision" / "cases.json.gz").read_bytes()))[::step]
    wrong = []
    for index, case in enumerate(cases):
        first, second = (made({"type": "polyhedron", **case[name]}) for name in ("first", "second"))
        found, mirrored = collide(first, second), collide(second, first)
        if found.relation != HARD_NAMES[case["relation"]] or mirrored.relation != found.swapped().relation:
            wrong.append((index * step, case["family"], case["relation"], found))
    assert len({case["family"] for case in cases}) >= 8
    assert not wrong


@pytest.mark.data
def test_hard_collision_sample(data: Path) -> None:
    check_hard(data, 7)


@pytest.mark.full
@pytest.mark.data
def test_hard_collision(data: Path) -> None:
    check_hard(data, 1)


def test_flush_stacks_under_one_rotation_touch() -> None:
    rng = np.random.default_rng(4)
    for _ in range(8):
        pose = random_pose(rng)
        common = Pose(pose["rotation"], pose["translation"])
        size = rng.uniform(0.1, 3, 3)
        gap = size[:2] * rng.uniform(0.1, 0.9, 2)
        lower = Aabb([0, 0, 0], size)
        upper = Aabb([*(gap - 1), size[2]], [*gap, size[2] + 1])
        assert collide(lower, upper, first_pose=common, second_pose=common).relation == Relation.TOUCHING
        # not the same object, and one body moved along the common face: no shortcut can apply
        cube = Aabb([-1, -1, -1], [1, 1, 1])
        turned = Pose(common.rotation, 2 * common.rotation[:, 0])  # exact: twice a column
        still = Pose(common.rotation, [0, 0, 0])
        assert collide(cube, cube, first_pose=still, second_pose=turned).relation == Relation.TOUCHING
        further = Pose(common.rotation, np.nextafter(2 * common.rotation[:, 0], np.inf * common.rotation[:, 0]))
        assert collide(cube, cube, first_pose=still, second_pose=further).relation == Relation.DISJOINT


def test_linked_rings() -> None:
    bars = [((-3, -3, -1), (3, -2, 1)), ((-3, 2, -1), (3, 3, 1)), ((-3, -2, -1), (-2, 2, 1)), ((2, -2, -1), (3, 2, 1))]
    ring = union_of(*(box(low, high) for low, high in bars))
    other = reversed_faces({**ring, "vertices": [[x + 2.5, z / 2, y] for x, y, z in ring["vertices"]]})
    for shift, expected in ((0, "disjoint"), (-1.5, "touching"), (-2, "overlapping"), (9, "disjoint")):
        assert collide(made(ring), made(moved(other, by=(shift, 0, 0)))).relation.label == expected


def as_json(pose: Pose) -> Solid:
    return {"rotation": pose.rotation.tolist(), "translation": pose.translation.tolist()}


def test_lattice_poses_need_no_rational_arithmetic() -> None:
    quarter_turn = Pose([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [6, 0, 6])
    _, accuracy = collide(made(HOLLOW), made(HOLLOW), second_pose=quarter_turn, report=True)
    assert (accuracy.n_rational, accuracy.n_beyond_filter) == (0, 1)
    for _, first, second, expected, _ in CASES:
        found = collide(made(first), made(second), first_pose=quarter_turn, second_pose=quarter_turn)
        assert found.relation.label == expected
        moved_away = Pose(quarter_turn.rotation, [6, 0, 7])
        assert collide(made(first), made(second), first_pose=quarter_turn, second_pose=moved_away).relation == relation(
            first, second, as_json(quarter_turn), as_json(moved_away)
        )


@pytest.mark.parametrize("scale", [2.0**-1060, 2.0**-500, 2.0**500, 2.0**1015])
def test_power_of_two_scales_change_nothing(scale: float) -> None:
    for _, first, second, expected, _ in CASES[:14]:
        a, b = made(moved(first, scale=scale)), made(moved(second, scale=scale))
        assert collide(a, b).relation.label == expected


def test_poses_at_the_ends_of_the_range() -> None:
    pose = random_pose(np.random.default_rng(7))
    for scale in (2.0**-1060, 2.0**1000):
        a, b = made(moved(UNIT, scale=scale)), made(moved(UNIT, scale=scale, by=(scale, 0, 0)))
        still = Pose(pose["rotation"], [0, 0, 0])
        other = Pose(pose["rotation"], [0, 0, scale])
        assert collide(a, b, first_pose=still, second_pose=still).relation.label == "touching"
        assert collide(a, b, first_pose=still, second_pose=other).relation == relation(
            moved(UNIT, scale=scale),
            moved(UNIT, scale=scale, by=(scale, 0, 0)),
            {"rotation": pose["rotation"], "translation": [0, 0, 0]},
            {"rotation": pose["rotation"], "translation": [0, 0, scale]},
        )


def test_order_of_faces_and_vertices_changes_nothing() -> None:
    rng = np.random.default_rng(9)
    for _, first, second, expected, _ in CASES:
        if "faces" not in first or "faces" not in second:
            continue
        shuffled = []
        for solid in (first, second):
            places = rng.permutation(len(solid["vertices"]))
            vertices = [solid["vertices"][k] for k in np.argsort(places)]
            faces = [np.roll([places[k] for k in face], rng.integers(3)).tolist() for face in solid["faces"]]
            shuffled.append(
                made({**solid, "vertices": vertices, "faces": [faces[k] for k in rng.permutation(len(faces))]})
            )
        assert collide(*shuffled).relation.label == expected


def test_polygonal_faces_name_the_callers_face() -> None:
    quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    cube = Polyhedron(UNIT["vertices"], quads)
    witness = collide(cube, Aabb([1, 0, 0], [2, 1, 1])).witness
    assert witness is not None
    assert (witness.first_face, witness.second_face, witness.kind) == (1, 0, "face_face")


def test_boolean_mode_only_tells_disjoint_from_the_rest() -> None:
    for _, first, second, expected, _ in CASES:
        found = collide(made(first), made(second), boolean=True)
        assert (found.relation == Relation.DISJOINT) == (expected == "disjoint")


def test_report_and_progress() -> None:
    seen: list[int] = []
    found, accuracy = collide(made(UNIT), made(moved(UNIT, by=(1, 0, 0))), report=True, progress=seen.append)
    assert found.relation == Relation.TOUCHING
    assert (accuracy.decisions, accuracy.n_items, accuracy.method, seen) == ("exact", 1, "polyhedron", [1])
    assert (accuracy.n_beyond_filter, accuracy.n_rational) == (1, 0)


def test_reports_count_pairs_not_decisions() -> None:
    tilted = Pose([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]], [0.0, 0.0, 1.0])  # on top, in many faces
    pairs = [(made(HOLLOW), None), (made(HOLLOW), tilted), (made(UNIT), Pose(np.eye(3), [99.0, 0.0, 0.0]))]
    _, one = collide(pairs[0][0], pairs[1][0], second_pose=tilted, report=True)
    _, many = engine.collide_scene([solid for solid, _ in pairs], [pose for _, pose in pairs], report=True)
    for accuracy in (one, many):
        assert accuracy.n_items == 1
        assert accuracy.n_rational <= accuracy.n_beyond_filter <= 1


def test_a_solid_is_pickled_without_its_mesh_body() -> None:
    cube = made(UNIT)
    collide(cube, cube)
    again = pickle.loads(pickle.dumps(cube))
    assert collide(again, cube).relation == Relation.OVERLAPPING


def test_errors() -> None:
    cube = made(UNIT)
    with pytest.raises(engine.WrongDimensionError, match="one dimension") as caught:
        collide(cube, Aabb([0, 0], [1, 1]))
    assert caught.value.where == ("second",)
    with pytest.raises(engine.UnsupportedPairError, match="half_space"):
        collide(cube, engine.Convex([[1, 0, 0, 1]]))
    with pytest.raises(engine.UnsupportedSolidError, match="ndarray"):
        collide(np.zeros(3), cube)  # type: ignore[call-overload]
    with pytest.raises(engine.WrongDimensionError, match="first_pose"):
        collide(cube, cube, first_pose=Pose.identity(2))
    with pytest.raises(engine.InvalidArrayError, match="second_pose"):
        collide(cube, cube, second_pose=np.eye(3))  # type: ignore[call-overload]
    with pytest.raises(engine.DeadlineExceededError):
        collide(cube, cube, deadline=0.0)
    switch = engine.Cancel()
    switch.set()
    with pytest.raises(engine.CancelledError):
        collide(cube, cube, cancel=switch)


@pytest.mark.parametrize("option", [{"witness": False}, {"boolean": True}])
@pytest.mark.parametrize("other", [Sphere([0, 0, 0], 1), HalfSpace([0, 0, 1], -0.5), Aabb([0, 0, 0], [2, 2, 2])])
def test_no_witness_where_none_is_asked_for(other: engine.Solid, option: dict[str, bool]) -> None:
    body = Polyhedron([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    for pose in (None, Pose(np.eye(3), [0.25, 0, 0])):
        for first, second in ((body, other), (other, body)):
            found = collide(first, second, first_pose=pose, **option)
            assert found.relation != Relation.DISJOINT
            assert found.witness is None


BOX = engine.Aabb((0, 0, 0), (1, 1, 1))
NO_BODIES = {
    "convex": engine.Convex([[1, 0, 0, 0], [-1, 0, 0, 1]]),
    "triangle": engine.Triangle([(0, 0, 0), (1, 0, 0), (0, 1, 0)]),
    "csg": engine.Csg("union", [BOX, BOX]),
    "implicit": engine.Implicit([{"powers": (0, 0, 0), "coefficient": 1}]),
}


@pytest.mark.parametrize("kind", NO_BODIES)
def test_what_is_no_body_is_refused_with_what_to_use(kind: str) -> None:
    solid, a = NO_BODIES[kind], "an" if kind[0] in "aeiou" else "a"
    with pytest.raises(
        engine.UnsupportedPairError, match=f"collision of an aabb with {a} {kind} in 3D.*; {a} {kind}: "
    ):
        engine.collide(BOX, solid)
    with pytest.raises(
        engine.UnsupportedPairError, match=f"distance of {a} {kind} and an aabb in 3D.*; {a} {kind}: "
    ) as e:
        engine.clearance(solid, BOX)
    assert e.value.where == ("first",)
    with pytest.raises(engine.UnsupportedPairError, match=rf"solids\[1\] is {a} {kind}; .*; {a} {kind}: "):
        engine.collide_scene([BOX, solid])


def test_the_surface_of_a_triangle_is_a_body() -> None:
    triangle = NO_BODIES["triangle"]
    assert engine.collide(BOX, engine.Surface(triangle.vertices, [[0, 1, 2]]))  # type: ignore[attr-defined]
