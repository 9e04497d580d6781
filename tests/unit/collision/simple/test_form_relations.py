"""Relations of boxes and balls by closed forms."""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest

from engine import Aabb, Pose, Relation, Sphere, collide, collide_poses, collide_scene
from engine.collision.codes import UNSETTLED
from engine.collision.meshes.exact_body import classify_exact, exact_pair, kind_of_contact
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.meshes.mesh_mesh import mesh_mesh
from engine.collision.meshes.triangle_triangle import APART
from engine.collision.result import Work
from engine.collision.simple.closed_forms import form_of
from engine.collision.simple.form_relations import relate_box_pairs, relate_forms
from engine.solids.base import Solid
from engine.solids.pose import motion_of
from tests.reference.collision import relation
from tests.unit.collision.lattices import COUNTS, Maker, aabb, check_pairs

TURNS = [
    np.array(rows, float)[list(order)]
    for order in itertools.permutations(range(3))
    for rows in (np.diag(signs) for signs in itertools.product((1, -1), repeat=3))
    if np.linalg.det(rows[list(order)]) > 0
]
ULP = 2.0**-52


def told(first: Solid, second: Solid, poses: tuple[Pose | None, Pose | None] = (None, None)) -> int:
    d, forms = first.dimension, (form_of(first), form_of(second))
    assert forms[0] is not None
    code: int = relate_forms(forms[0], *motion_of(poses[0], d), forms[1], *motion_of(poses[1], d))
    return code if code == UNSETTLED else code & 7


def box(draw: np.random.Generator, scale: float) -> Aabb:
    low = draw.integers(0, 3, 3) * scale
    return Aabb(low, low + draw.integers(1, 4, 3) * scale)


def pose(draw: np.random.Generator, scale: float) -> Pose | None:
    kind = draw.integers(4)
    move = np.nextafter(draw.integers(-2, 3, 3) * scale, draw.choice([-9.0, 0.0, 9.0]) if kind > 1 else 0.0)
    return None if kind == 0 else Pose(TURNS[draw.integers(len(TURNS))], move)


@pytest.mark.parametrize("scale", [1.0, 0.1])
def test_boxes_that_poses_keep_boxes_equal_the_reference_and_name_true_witnesses(scale: float) -> None:
    draw, kinds = np.random.default_rng(3), set()
    for _ in range(60):
        first, second = box(draw, scale), box(draw, scale)
        poses = pose(draw, scale), pose(draw, scale)
        values = [{"type": "aabb", "min": b.min.tolist(), "max": b.max.tolist()} for b in (first, second)]
        placed = [p and {"rotation": p.rotation.tolist(), "translation": p.translation.tolist()} for p in poses]
        expected = relation(*values, *placed)
        assert told(first, second, poses) in (UNSETTLED, expected)
        found = collide(first, second, first_pose=poses[0], second_pose=poses[1])
        assert found.relation == expected
        if found.relation < Relation.OVERLAPPING:
            continue
        witness, bodies = found.witness, exact_pair(mesh_body_of(first), mesh_body_of(second), poses)
        assert witness is not None
        named = witness.first_face, witness.second_face
        own, their = (np.flatnonzero(body.mesh.faces == face).tolist() for body, face in zip(bodies, named))
        pairs = [(bodies[0].corners(i), bodies[1].corners(j)) for i in own for j in their]
        assert witness.kind in {kind_of_contact(*pair) for pair in pairs if classify_exact(*pair) != APART}
        kinds.add((found.relation, witness.kind))
    assert len(kinds) > 3


def test_bounds_that_round_alike_are_told_apart() -> None:
    for step, expected in (
        (0.0, Relation.TOUCHING),
        (-(2.0**-60), Relation.OVERLAPPING),
        (2.0**-60, Relation.DISJOINT),
    ):
        moved = Pose(np.eye(3), [1.0, 0.0, 0.0])
        other = Aabb([step, 0, 0], [3, 1, 1])  # 1 + step is rounded to 1
        assert told(Aabb([0, 0, 0], [1, 1, 1]), other, (None, moved)) == expected


def test_balls_that_touch_an_ulp_apart() -> None:
    found = set()
    for factor, size in itertools.product((1.0, 1.0 + ULP, 1.0 - ULP), (1.0, 3.0, 0.1)):
        a, b = Sphere([0, 0, 0], 2 * size), Sphere(np.array([3.0, 4.0, 0.0]) * size * factor, 3 * size)
        square, both = sum(Fraction(x) ** 2 for x in b.center.tolist()), Fraction(a.radius) + Fraction(b.radius)
        order = (square > both**2) - (square < both**2)
        assert told(a, b) == {1: Relation.DISJOINT, 0: Relation.TOUCHING, -1: Relation.OVERLAPPING}[order]
        found.add(order)
    assert found == {-1, 0, 1}


def test_what_is_out_of_range_is_not_told() -> None:
    turned = Pose([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]], [0, 0, 0])
    cube = Aabb([0, 0, 0], [1, 1, 1])
    assert told(cube, cube, (None, turned)) == UNSETTLED
    assert told(Sphere([0, 0, 0], 1e-300), Sphere([1, 0, 0], 1.0)) == UNSETTLED
    assert told(Aabb([-1e308] * 3, [1e308] * 3), cube, (Pose(np.eye(3), [1.7e308, 0, 0]), None)) == UNSETTLED


def test_boxes_across_a_direction_that_underflows() -> None:
    tiny, big = 2.0**-1074, 2.0**100
    turn = [[1, 0, 0], [tiny, 0.28, -0.96], [0, 0.96, 0.28]]  # the first axes of both leave (0, 0, tiny) between them
    long = Aabb([-big / 100, -big / 100, -big], [big / 100, big / 100, big])
    away = Pose(turn, [0, 0.672 * big, -0.196 * big])
    assert told(Aabb([-1] * 3, [1] * 3), long, (None, away)) == UNSETTLED
    assert collide(Aabb([-1] * 3, [1] * 3), long, second_pose=away).relation == Relation.FIRST_INSIDE_SECOND


# --- Boxes against boxes: the reference, many at a time ---


@pytest.mark.parametrize(("d", "first", "second"), [(2, aabb, aabb), (3, aabb, aabb)])
@COUNTS
def test_agrees_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)


@pytest.mark.parametrize(("z", "piercing"), [(0.5, True), (1.0, False)])
def test_a_flat_box_touches_and_may_pierce(z: float, piercing: bool) -> None:
    found = collide(Aabb([0, 0, 0], [1, 1, 1]), Aabb([0, 0, z], [1, 1, z]))
    assert found.relation.label == "touching"
    assert found.witness is not None
    assert found.witness.piercing == piercing


def test_witnesses_of_touching_boxes_are_those_of_their_meshes() -> None:
    spans = [(0.0, 2.0), (1.0, 2.0), (-1.0, 1.0), (-1.0, 3.0), (2.0, 3.0), (-2.0, 0.0)]
    box = Aabb([0, 0, 0], [2, 2, 2])
    kinds = set()
    for spots in itertools.product(spans, repeat=3):
        other = Aabb(*zip(*spots))
        found = collide(box, other)
        if found.relation.label == "touching":
            assert found == mesh_mesh(box, other, (None, None), Work())
            kinds.add(found.witness and found.witness.kind)
    assert kinds == {"face_face", "edge_edge", "vertex_vertex"}


@pytest.mark.parametrize("d", [2, 3])
def test_agrees_with_single_pairs_flat_ones_too(d: int) -> None:
    corners = np.sort(np.random.default_rng(d).integers(0, 4, (40, 2, d)), axis=1).astype(float)
    low, high, is_box = corners[:, 0].copy(), corners[:, 1].copy(), np.arange(40) != 7
    pairs = np.array([(i, j) for i in range(40) for j in range(i)])
    found = np.full(len(pairs), UNSETTLED, np.int8)
    relate_box_pairs(low, high, is_box, pairs, found)
    for (i, j), how in zip(pairs.tolist(), found.tolist()):
        expected = collide(Aabb(low[i], high[i]), Aabb(low[j], high[j])).relation
        assert how == (UNSETTLED if 7 in (i, j) else expected)


def _forms_and_poses(d: int, draw: np.random.Generator) -> tuple[list[Solid], list[Pose | None]]:
    """Return boxes, some flat, and balls, some points, on a lattice, under lattice and free poses and none."""
    bodies: list[Solid] = []
    for k in range(6):
        low = draw.integers(-2, 3, d) / 2
        size = draw.integers(0 if k == 0 else 1, 4, d) / 2
        bodies.append(Aabb(low, low + size) if k % 2 == 0 else Sphere(low, 0.0 if k == 1 else float(size[0])))
    turns = [np.eye(d), np.array(TURNS[5]) if d == 3 else np.array([[0.0, -1.0], [1.0, 0.0]])]
    free = np.eye(d)
    free[:2, :2] = [[0.6, -0.8], [0.8, 0.6]]
    poses = [
        None if draw.random() < 0.3 else Pose([*turns, free][draw.integers(3)], draw.integers(-3, 4, d) / 2)
        for _ in range(70)
    ]
    return [bodies[k] for k in draw.integers(0, len(bodies), len(poses))], poses


@pytest.mark.parametrize("detail", [False, True])
@pytest.mark.parametrize(("d", "seed"), [(2, 0), (2, 1), (3, 0), (3, 1)])
def test_scenes_of_boxes_and_balls_are_answered_as_pair_by_pair(d: int, seed: int, detail: bool) -> None:
    bodies, poses = _forms_and_poses(d, np.random.default_rng([d, seed]))
    poses[1] = poses[0]
    pairs = collide_scene(bodies, poses, witnesses=True, detail=detail)
    assert len(pairs) > 250
    without = collide_scene(bodies, poses, detail=detail)
    assert without.relation.tolist() == pairs.relation.tolist()
    kinds = set()
    for (i, j, how), witness in zip(pairs, pairs.witnesses or ()):
        alone = collide(bodies[i], bodies[j], first_pose=poses[i], second_pose=poses[j], detail=detail)
        assert how == alone.relation
        if not detail or how != Relation.OVERLAPPING:  # then it may be any crossing
            assert witness == alone.witness
        kinds.add((bodies[i].type, bodies[j].type, how))
    assert np.array_equal(np.array(pairs.detail), np.array(without.detail))
    assert len(kinds) >= 8


@pytest.mark.parametrize(("first", "second"), [(0, 1), (1, 0), (0, 0), (1, 1)])
@pytest.mark.parametrize("d", [2, 3])
def test_witnesses_do_not_change_the_detail_of_many_poses(d: int, first: int, second: int) -> None:
    """A ball within a box was answered as partly overlapping where witnesses were asked for as well."""
    draw = np.random.default_rng(5)
    solids: list[Solid] = [Aabb([-0.5] * d, [1.0] * (d - 1) + [1.5]), Sphere([0.5] + [0.0] * (d - 1), 0.5)]
    turns = np.broadcast_to(np.eye(d), (200, d, d))
    moves = draw.integers(-4, 5, (200, d)) / 4
    codes, _, details = collide_poses(solids[first], solids[second], turns, moves, witnesses=True, detail=True)
    singles = [
        collide(solids[first], solids[second], second_pose=Pose(turns[k], moves[k]), detail=True) for k in range(200)
    ]
    assert codes.tolist() == [answer.relation for answer in singles]
    assert details.tolist() == [answer.detail for answer in singles]
    assert len(set(details.tolist())) >= 2


def test_forms_beyond_expansions_are_left_open() -> None:
    far = [Sphere([2.0**600 * k, 0.0, 0.0], 2.0**599) for k in range(3)]
    pairs = collide_scene(far * 4, witnesses=True)
    for (i, j, how), witness in zip(pairs, pairs.witnesses or ()):
        alone = collide((far * 4)[i], (far * 4)[j])
        assert (how, witness) == (alone.relation, alone.witness)
    assert set(pairs.relation.tolist()) == {Relation.OVERLAPPING, Relation.TOUCHING}
