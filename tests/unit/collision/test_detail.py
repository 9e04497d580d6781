"""The eight relations of RCC-8: by hand, against the reference, in both orders, under poses."""

from __future__ import annotations

import numpy as np
import pytest

import engine
from engine import (
    Aabb,
    HalfSpace,
    Polygon,
    Polyhedron,
    Pose,
    Rcc8,
    Relation,
    Sphere,
    collide,
    collide_poses,
    collide_scene,
)
from tests.reference.collision import detail
from tests.reference.shapes import Solid, box, polygon, rectangle, reversed_faces, union_of
from tests.unit.collision.test_collide import (
    BIG,
    DOUBLED,
    FIN,
    HOLLOW,
    SQUARE,
    UNIT,
    flat,
    made,
    moved,
    random_body,
    random_pose,
)

CUT_OTHERWISE = {**UNIT, "faces": [[*f[1:], f[0]] for f in reversed_faces(UNIT)["faces"]]}
QUADS = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
OTHER_DIAGONALS = {**UNIT, "faces": [t for a, b, c, d in QUADS for t in ([b, c, d], [b, d, a])]}
HALVES = union_of(box((0, 0, 0), (0.5, 1, 1)), box((0.5, 0, 0), (1, 1, 1)))  # one wall within cancels
WALLED = union_of(BIG, moved(DOUBLED, by=(2, 2, 2)))
BEAM = union_of(box((0, 0, 0), (6, 6, 2)), box((0, 0, 4), (6, 6, 6)), box((0, 0, 2), (2, 6, 4)))  # a C
INVERTED = reversed_faces(UNIT)

CASES: list[tuple[str, Solid, Solid, str | None]] = [
    ("apart", UNIT, moved(UNIT, by=(2, 0, 0)), "DC"),
    ("flush", UNIT, moved(UNIT, by=(1, 0, 0)), "EC"),
    ("corner to corner", UNIT, moved(UNIT, by=(1, 1, 1)), "EC"),
    ("across", UNIT, moved(UNIT, by=(0.5, 0.5, 0.5)), "PO"),
    ("across, flush on four sides", UNIT, moved(UNIT, by=(0.5, 0, 0)), "PO"),
    ("same", UNIT, UNIT, "EQ"),
    ("same, faces in another order", UNIT, CUT_OTHERWISE, "EQ"),
    ("same, cut along other diagonals", UNIT, OTHER_DIAGONALS, "EQ"),
    ("same, inside out", UNIT, INVERTED, "EQ"),
    ("same, of two halves", UNIT, HALVES, "EQ"),
    ("same, as a box", UNIT, flat((0, 0, 0), (1, 1, 1)), "EQ"),
    ("in a corner", UNIT, BIG, "TPP"),
    ("on one face", moved(UNIT, by=(2, 2, 0)), BIG, "TPP"),
    ("on an edge only", moved(UNIT, by=(0, 2, 0)), BIG, "TPP"),
    ("within", moved(UNIT, by=(1, 1, 1)), BIG, "NTPP"),
    ("a vertex on a face", {**UNIT, "vertices": [*UNIT["vertices"][:7], [6, 3, 3]]}, moved(BIG, by=(0, -1, -1)), "TPP"),
    ("larger on one side", UNIT, box((0, 0, 0), (1, 1, 1.5)), "TPP"),
    ("one ulp larger", UNIT, box((0, 0, 0), (1, 1, float(np.nextafter(1, 2)))), "TPP"),
    ("one ulp around", UNIT, box((-5e-324,) * 3, (float(np.nextafter(1, 2)),) * 3), "NTPP"),
    ("in the cavity", HOLLOW, moved(UNIT, by=(2.5, 2.5, 2.5)), "DC"),
    ("fills the cavity", HOLLOW, box((2, 2, 2), (4, 4, 4)), "EC"),
    ("closes the cavity from within", HOLLOW, box((1, 1, 1), (5, 5, 5)), "PO"),
    ("the shell in its hull", HOLLOW, BIG, "TPP"),
    ("the shell strictly in a box", HOLLOW, box((-1, -1, -1), (7, 7, 7)), "NTPP"),
    ("a block in the wall", box((2, 2, 0), (4, 4, 2)), HOLLOW, "TPP"),
    ("a block within the wall", box((2, 2, 0.5), (4, 4, 1.5)), HOLLOW, "NTPP"),
    ("a smaller cavity", HOLLOW, union_of(BIG, reversed_faces(box((2, 2, 2), (4, 4, 3)))), "TPP"),
    ("a C in its hull", BEAM, BIG, "TPP"),
    ("a block in a leg of the C", box((3, 1, 0), (5, 5, 2)), BEAM, "TPP"),
    ("a block in the mouth of the C", box((2, 0, 2), (6, 6, 4)), BEAM, "EC"),
    ("a block across the mouth", box((2, 1, 1), (6, 5, 4)), BEAM, "PO"),
    ("a notch, and a fin that cancels", FIN, BIG, "TPP"),
    ("around a wall that cancels", box((1, 1, 1), (5, 5, 5)), WALLED, "NTPP"),
    ("cancelled", DOUBLED, UNIT, None),
    ("flat", flat((0, 0, 0), (1, 1, 0)), BIG, None),
]


def name_of(found: engine.Collision) -> str | None:
    return None if found.detail is None else found.detail.label


@pytest.mark.parametrize(("first", "second", "expected"), [c[1:] for c in CASES], ids=[c[0] for c in CASES])
def test_by_hand(first: Solid, second: Solid, expected: str | None) -> None:
    found = collide(made(first), made(second), detail=True)
    assert name_of(found) == expected
    assert found.relation == collide(made(first), made(second)).relation
    assert collide(made(second), made(first), detail=True).detail == found.swapped().detail
    assert detail(first, second) == expected
    turn = Pose([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [0.1, 3, -2])
    assert collide(made(first), made(second), first_pose=turn, second_pose=turn, detail=True).detail == found.detail


def check_random(n_cases: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(n_cases):
        first, second = (random_body(rng) for _ in range(2))
        if "surface" in (first["type"], second["type"]):
            continue
        if rng.random() < 0.4 and "faces" in first and "faces" in second:
            second = first if rng.random() < 0.3 else union_of(first, second)
        if sum(len(body.get("faces", QUADS)) for body in (first, second)) > 32:  # the reference is slow
            continue
        poses: list[Solid | None] = [None, None]
        if rng.random() < 0.2:
            pose = random_pose(rng)
            poses = [pose, {**pose, "translation": (np.array(pose["translation"]) + rng.integers(0, 2, 3)).tolist()}]
        a, b = (None if pose is None else Pose(pose["rotation"], pose["translation"]) for pose in poses)
        found = collide(made(first), made(second), first_pose=a, second_pose=b, detail=True)
        assert name_of(found) == detail(first, second, *poses), (first, second, poses)


def test_random_bodies_equal_the_reference() -> None:
    check_random(16, 1)


@pytest.mark.full
def test_many_random_bodies_equal_the_reference() -> None:
    check_random(1000, 2)


def test_random_planar_bodies_equal_the_reference() -> None:
    rng = np.random.default_rng(3)
    seen = set()
    for _ in range(150):
        bodies = []
        for _ in range(2):
            rings = []
            for _ in range(int(rng.integers(1, 3))):
                low = rng.integers(0, 3, 2)
                rings += rectangle(low.tolist(), (low + rng.integers(1, 4, 2)).tolist())["rings"]
            bodies.append(polygon(*rings))
        first, second = bodies
        found = collide(Polygon(first["rings"]), Polygon(second["rings"]), detail=True)
        assert name_of(found) == detail(first, second), (first, second)
        seen.add(name_of(found))
    assert seen >= {"DC", "EC", "PO", "TPP", "TPPi"}


DISC = Sphere([0, 0, 0], 2)
SMOOTH: list[tuple[engine.Solid, engine.Solid, str | None]] = [
    (DISC, DISC, "EQ"),
    (DISC, Sphere([4, 0, 0], 2), "EC"),
    (DISC, Sphere([5, 0, 0], 2), "DC"),
    (Sphere([1, 0, 0], 1), DISC, "TPP"),
    (Sphere([0.5, 0, 0], 1), DISC, "NTPP"),
    (Sphere([1.5, 0, 0], 1), DISC, "PO"),
    (Sphere([0, 0, 0], 0), DISC, None),
    (HalfSpace([1, 0, 0], 1), HalfSpace([3, 0, 0], 3), "EQ"),
    (HalfSpace([1, 0, 0], 1), HalfSpace([1, 0, 0], 2), "NTPP"),
    (HalfSpace([1, 0, 0], 1), HalfSpace([-1, 0, 0], 2), "PO"),
    (HalfSpace([1, 0, 0], 1), HalfSpace([-1, 0, 0], -1), "EC"),
    (HalfSpace([1, 0, 0], 1), HalfSpace([1, 1, 0], 1), "PO"),
    (DISC, HalfSpace([0, 0, 3], 6), "TPP"),
    (DISC, HalfSpace([0, 0, 3], 7), "NTPP"),
    (DISC, HalfSpace([0, 0, 3], 5), "PO"),
    (DISC, HalfSpace([0, 0, 3], -6), "EC"),
    (made(BIG), HalfSpace([1, 0, 0], 0), "TPP"),
    (made(BIG), HalfSpace([1, 0, 0], 1), "NTPP"),
    (made(BIG), HalfSpace([1, 0, 0], -1), "PO"),
    (made(BIG), HalfSpace([1, 0, 0], -6), "EC"),
    (made(FIN), HalfSpace([-1, 0, 0], 6), "TPP"),  # beyond x = 6 all cancels
    (made(FIN), HalfSpace([-1, 0, 0], 5), "PO"),
    (Aabb([-2, -2, -2], [2, 2, 2]), DISC, "TPPi"),
    (Aabb([-3, -3, -3], [3, 3, 3]), DISC, "NTPPi"),
    (Aabb([-1, -1, -1], [1, 1, 1]), Sphere([0, 0, 0], 2), "NTPP"),
    (Aabb([-3, -4, 0], [3, 4, 1]), Sphere([0, 0, 0], 5), "PO"),
    (Aabb([-2, -1, -2], [2, 1, 2]), Sphere([0, 0, 0], 3), "TPP"),
    (made(moved(BIG, by=(-3, -3, -3))), Sphere([0, 0, 0], 3), "TPPi"),
    (made(HOLLOW), Sphere([3, 3, 3], 3), "PO"),
    (made(HOLLOW), Sphere([3, 3, 3], 1), "EC"),
    (made(HOLLOW), Sphere([3, 3, 1], 1), "TPPi"),
    (made(WALLED), Sphere([2.5, 2.5, 2.5], 2), "NTPPi"),
    (made(WALLED), Sphere([2.5, 2.5, 2.5], 0.75), "TPPi"),  # it meets the wall that cancels
    (Polygon([[[0, 0], [6, 0], [6, 6], [0, 6]]]), Sphere([3, 3], 3), "TPPi"),
    (Polygon([[[0, 0], [6, 0], [6, 6], [0, 6]]]), Sphere([3, 3], 2), "NTPPi"),
    (Polygon([[[0, 3], [3, 0], [6, 3], [3, 6]]]), Sphere([3, 3], 3), "TPP"),
    (Polygon([[[0, 0], [6, 0], [6, 6], [0, 6]]]), HalfSpace([0, 1], 0), "TPP"),
    (Polygon([[[0, 0], [6, 0], [6, 6], [0, 6]]]), HalfSpace([0, 1], -1), "PO"),
    (Aabb([0, 0], [1, 1]), engine.Triangle([[0, 0], [2, 0], [0, 2]]), "TPP"),
]


@pytest.mark.parametrize(("first", "second", "expected"), SMOOTH)
def test_spheres_and_half_spaces(first: engine.Solid, second: engine.Solid, expected: str | None) -> None:
    found = collide(first, second, detail=True)
    assert name_of(found) == expected
    assert collide(second, first, detail=True).detail == found.swapped().detail


def code_of(found: engine.Collision) -> int:
    return -1 if found.detail is None else int(found.detail)


def test_poses_are_one_by_one_and_equal_the_reference() -> None:
    eye, turn = np.eye(3).tolist(), [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]
    rotations = [eye, eye, [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], turn, eye]
    translations = [[0.0, 0.0, 0.0], [2.0, 2.0, 2.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [6.0, 0.0, 0.0]]
    seen: set[str | None] = set()
    for first, second in ((BIG, UNIT), (UNIT, OTHER_DIAGONALS), (BEAM, UNIT), (UNIT, BIG), (BIG, DOUBLED)):
        relations, codes = collide_poses(made(first), made(second), rotations, translations, detail=True)
        for turned, by, relation, code in zip(rotations, translations, relations, codes, strict=True):
            found = collide(made(first), made(second), second_pose=Pose(turned, by), detail=True)
            assert (relation, code) == (found.relation, code_of(found))
            seen.add(name_of(found))
            if first is BIG and second is UNIT:  # the reference is slow
                assert name_of(found) == detail(first, second, None, {"rotation": turned, "translation": by})
        with_both = collide_poses(made(first), made(second), rotations, translations, witnesses=True, detail=True)
        assert [len(part) for part in with_both] == [5, 5, 5]
        assert with_both[2].tolist() == codes.tolist()
    assert seen == {"DC", "EC", "PO", "EQ", "TPP", "TPPi", "NTPPi", None}


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_scene_is_every_pair(dimension: int) -> None:
    low = [[0.0] * dimension, [1.0] * dimension, [2.0] * dimension]
    solids: list[engine.Solid] = [Aabb(a, [x + side for x in a]) for a in low for side in (0.0, 1.0, 2.0, 3.0)]
    solids += [Sphere([2.0] * dimension, radius) for radius in (0.0, 1.0, 2.0)]
    solids += [Aabb(low[1], low[2]), HalfSpace([1.0] + [0.0] * (dimension - 1), -1.0)]
    if dimension == 3:
        solids += [made(body) for body in (BIG, HOLLOW, DOUBLED, BEAM)]
    else:
        solids += [Polygon([[[0, 0], [3, 0], [3, 3], [0, 3]]]), engine.Triangle([[0, 0], [2, 0], [0, 2]])]
    turn = Pose([[0.0, -1.0], [1.0, 0.0]], [3, 0]) if dimension == 2 else Pose(np.eye(3)[[1, 0, 2]] * -1.0, [3, 3, 0])
    poses = [turn if i % 5 == 4 else None for i in range(len(solids))]
    pairs = collide_scene(solids, poses, detail=True)
    assert pairs.detail is not None
    plain = collide_scene(solids, poses, witnesses=True)
    assert plain.detail is None
    assert (plain.first.tolist(), plain.relation.tolist()) == (pairs.first.tolist(), pairs.relation.tolist())
    named = collide_scene(solids, poses, witnesses=True, detail=True)
    assert (named.witnesses, named.detail.tolist()) == (plain.witnesses, pairs.detail.tolist())
    for i, j, code in zip(pairs.first.tolist(), pairs.second.tolist(), pairs.detail.tolist()):
        found = collide(solids[i], solids[j], first_pose=poses[i], second_pose=poses[j], detail=True)
        assert code == code_of(found), (i, j)
    assert set(pairs.detail.tolist()) >= {-1, Rcc8.EC, Rcc8.PO, Rcc8.EQ, Rcc8.TPP, Rcc8.NTPP, Rcc8.TPPI, Rcc8.NTPPI}


def test_names_and_codes() -> None:
    assert [code.label for code in Rcc8] == ["DC", "EC", "PO", "EQ", "TPP", "NTPP", "TPPi", "NTPPi"]
    assert collide(made(UNIT), made(BIG)).detail is None
    assert collide(made(UNIT), made(BIG), detail=True).relation == Relation.OVERLAPPING


def test_a_sphere_of_many_faces_in_itself_and_grown() -> None:
    n = 12
    around, up = np.meshgrid(np.arange(2 * n) * np.pi / n, np.arange(1, n) * np.pi / n)
    ring = np.stack([np.cos(around) * np.sin(up), np.sin(around) * np.sin(up), np.cos(up)], axis=-1).reshape(-1, 3)
    vertices = np.concatenate([ring, [[0, 0, 1], [0, 0, -1]]])
    faces = []
    for j in range(2 * n):
        k, top, low = (j + 1) % (2 * n), len(ring), 2 * n * (n - 2)
        faces += [[top, j, k], [top + 1, low + k, low + j]]
        for i in range(0, low, 2 * n):
            faces += [[i + j, i + 2 * n + j, i + k], [i + k, i + 2 * n + j, i + 2 * n + k]]
    ball = Polyhedron(vertices, faces)
    other = vertices.copy()
    assert name_of(collide(ball, Polyhedron(vertices, faces[::-1]), detail=True)) == "EQ"
    other[5] *= 1.25
    assert name_of(collide(ball, Polyhedron(other, faces), detail=True)) == "TPP"
    assert name_of(collide(ball, Polyhedron(2 * vertices, faces), detail=True)) == "NTPP"
    other[200] *= 0.75
    assert name_of(collide(ball, Polyhedron(other, faces), detail=True)) == "PO"


def test_what_has_no_detail_is_refused() -> None:
    with pytest.raises(engine.UnsupportedSolidError, match="no interior") as caught:
        collide(made(UNIT), made(SQUARE), detail=True)
    assert caught.value.where == ("second",)
    with pytest.raises(engine.InvalidInputError, match="boolean"):
        collide(made(UNIT), made(BIG), detail=True, boolean=True)
    with pytest.raises(engine.UnsupportedSolidError, match="no interior") as caught:
        collide_poses(made(UNIT), made(SQUARE), [np.eye(3)], [[0, 0, 0]], detail=True)
    assert caught.value.where == ("second",)
    with pytest.raises(engine.UnsupportedSolidError, match="no interior") as caught:
        collide_scene([made(UNIT), made(SQUARE)], detail=True)
    assert caught.value.where == ("solids", 1)
    with pytest.raises(engine.InvalidInputError, match="boolean"):
        collide_scene([made(UNIT)], detail=True, boolean=True)
