"""Batches of planar bodies: what single pairs say, on a lattice and at any place; what is not simple is left alone."""

from __future__ import annotations

import numpy as np
import pytest

import engine
from engine import Aabb, Polygon, Pose, Solid, Triangle, collide
from engine.collision import outline
from engine.collision.batches import SceneBatches, scene_bodies
from engine.collision.codes import UNSETTLED
from engine.collision.outline import (
    collide_outline_outline,
    collide_outlines,
    outline_parts,
    parts_by_arrangement,
)
from engine.collision.outline_batch import outline_pool
from engine.collision.result import Work
from engine.running.budget import Budget

SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4]]


@pytest.mark.parametrize(
    ("rings", "is_taken"),
    [
        ([SQUARE], True),
        ([SQUARE, [[1, 1], [2, 1], [2, 2]]], True),
        ([SQUARE, [[0, 0], [2, 1], [2, 2]]], False),  # rings that touch
        ([[[0, 0], [4, 0], [0, 4], [4, 4]]], False),  # crosses itself
        ([[[0, 0], [4, 0], [2, 0], [2, 4]]], False),  # runs back
        ([[[0, 0], [4, 0], [4, 0], [2, 4]]], False),  # an edge without length
        ([[[0, 0], [2, 0], [4, 0], [2, 4]]], True),  # a straight corner
    ],
)
def test_takes_rings_whose_edges_meet_only_in_their_vertices(rings: list[list[list[float]]], is_taken: bool) -> None:
    for turned in (rings, [ring[::-1] for ring in rings], [ring[1:] + ring[:1] for ring in rings]):
        pool, places = outline_pool([Aabb([0, 0], [1, 1]), Polygon(turned)])
        assert (pool.sides[pool.firsts[places]] != 0).tolist() == [True, is_taken]


@pytest.mark.parametrize("size", [1.0, 2.0**400, 2.0**-400])
@pytest.mark.parametrize("is_posed", [False, True])
def test_agrees_with_single_pairs_where_it_answers(is_posed: bool, size: float) -> None:
    rng = np.random.default_rng(3)
    solids: list[Solid] = [
        Polygon([np.array(SQUARE) * size, np.array([[1, 1], [3, 1], [3, 3], [1, 3]]) * size]),
        Triangle(np.array([[0, 0], [0.5, 0.2], [0.3, 0.6]]) * size),
        Polygon([np.array([[0, 0], [6, 1], [3, 2], [5, 5], [1, 4]]) * size]),
        Aabb([0, 0], [9 * size, 8 * size]),
        Polygon([np.array([[0, 0], [1, 0], [2, 1], [0, 1]]) * size]),
    ]
    scene = [solids[k % 5] for k in range(30)]
    angles = rng.uniform(0, 7, 30)
    poses = [
        Pose([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]], rng.integers(-4, 5, 2) * size) if is_posed else None
        for t in angles
    ]
    pairs = np.array([(i, j) for i in range(30) for j in range(i + 1, 30)])
    with Budget(None, None) as budget:
        found = SceneBatches(scene_bodies(scene, poses)).relations(pairs, False, False, budget, None)
    for (i, j), how in zip(pairs.tolist(), found.tolist()):
        if how != UNSETTLED:
            assert how == collide(scene[i], scene[j], first_pose=poses[i], second_pose=poses[j]).relation
    if is_posed and size == 1.0:
        assert (found != UNSETTLED).mean() > 0.9
        assert set(found.tolist()) >= {0, 1, 2, 3}


def test_single_pairs_are_what_the_arrangement_says_witnesses_too() -> None:
    rng = np.random.default_rng(5)
    shapes = [[SQUARE], [[[0, 0], [6, 1], [3, 2], [5, 5], [1, 4]]], [SQUARE, [[1, 1], [3, 1], [3, 3]]],
              [[[0, 0], [4, 0], [0, 4], [4, 4]]]]  # fmt: skip
    for _ in range(200):
        first, second = (
            Polygon([np.array(ring) * rng.choice([0.2, 1.0]) + rng.integers(-3, 4, 2) for ring in shapes[k]])
            for k in rng.integers(0, 4, 2)
        )
        angle = rng.choice([0.0, rng.uniform(0, 7)])
        pose = Pose([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]], rng.uniform(-1, 1, 2))
        for placed in (None, pose):
            work = Work(Budget(None, None))
            assert collide_outlines(first, second, (None, placed), work) == collide_outline_outline(
                first, second, (None, placed), work
            )


def test_collinear_edges_that_are_apart_are_no_contact() -> None:
    tilted = np.array([[0.0, 0.0], [3.0, 4.0], [-1.0, 7.0], [-4.0, 3.0]])
    first, second = Polygon([tilted]), Polygon([tilted + np.array([3.75, 5.0])])  # their sides lie on one line
    assert collide(first, second).relation.label == "disjoint"
    assert SceneBatches(scene_bodies([first, second], [None, None])).relations(
        np.array([[0, 1]]), False, False, Budget(None, None), None
    ).tolist() == [0]


IN_CONTACT = [
    [SQUARE],
    [SQUARE, [[1, 1], [3, 1], [3, 3], [1, 3]]],
    [[[0, 0], [6, 1], [3, 2], [5, 5], [1, 4]]],
    [[[0, 0], [2, 0], [4, 0], [4, 4], [2, 2], [0, 4]]],  # a straight corner and a reflex one
    [SQUARE, [[1, 1], [3, 1], [2, 3]], [[6, 0], [8, 0], [8, 4]]],  # a hole, and a part beside it
    [[[-4, -4], [8, -4], [8, 8], [-4, 8]], [[-2, -2], [6, -2], [6, 6], [-2, 6]], [[1, 1], [3, 1], [3, 3], [1, 3]]],
    [[[0, 0], [2, -2], [4, 0], [2, 2]]],
]


@pytest.mark.some(1)
@pytest.mark.parametrize("unit", [1.0, 0.1, 2.0**300])
def test_contacts_are_decided_without_an_arrangement(unit: float, monkeypatch: pytest.MonkeyPatch) -> None:
    rng, relations = np.random.default_rng(8), []
    quarter = Pose([[0, -1], [1, 0]], [3.0 * unit, 1.0 * unit])
    for _ in range(400):
        bodies = []
        for k in rng.integers(0, len(IN_CONTACT), 2):
            rings = [np.array(ring)[:: rng.choice([-1, 1])] for ring in IN_CONTACT[k]]
            step, size = rng.integers(-4, 5, 2), rng.choice([0.5, 1.0, 1.0, 3.0])
            bodies.append(Polygon([np.roll(ring * size + step, rng.integers(9), axis=0) * unit for ring in rings]))
        first, second = bodies
        work, poses = Work(Budget(None, None)), (None, quarter if unit != 0.1 and rng.integers(2) else None)
        answer = collide_outline_outline(first, second, poses, work)
        parts = parts_by_arrangement(first, second, poses, work)
        with monkeypatch.context() as patch:
            if answer.relation != answer.relation.OVERLAPPING or answer.witness.kind != "containment":
                patch.setattr(outline, "collide_outline_outline", None)
            patch.setattr(outline, "parts_by_arrangement", None)
            assert collide_outlines(first, second, poses, work) == answer
            assert outline_parts(first, second, poses, work) == parts
        batches = SceneBatches(scene_bodies(bodies, list(poses)))
        for detail in (False, True):
            (how,) = batches.relations(np.array([[0, 1]]), False, detail, Budget(), None).tolist()
            is_left = detail and answer.relation == answer.relation.OVERLAPPING and not (parts.first and parts.second)
            assert how == (UNSETTLED if is_left else answer.relation)
        relations.append(answer.relation.label)
    assert set(relations) >= {"touching", "overlapping", "first_inside_second", "second_inside_first", "disjoint"}
    assert relations.count("touching") > 20


def test_contacts_beyond_the_range_of_signs_are_left_to_the_arrangement() -> None:
    tiny, large = 2.0**-1000, 2.0**1000
    first = Polygon([[[0, 0], [large, 0], [large, tiny], [0, large]]])
    for step in (0.0, -large):
        second = Polygon([np.array([[step, 0], [step + large, 0], [step + large, tiny], [step, large]])])
        work = Work(Budget(None, None))
        assert collide_outlines(first, second, (None, None), work) == collide_outline_outline(
            first, second, (None, None), work
        )


PIVOTS = [
    [[[0, 0], [4, 1], [3, 3], [1, 4]]],
    [[[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]]],
    [[[-1, -2], [3, 1], [5, 7], [-4, 4]], [[0, 0], [1, 1], [0, 2]]],
    [[[0, 0], [2, 0], [2, 2], [0, 2]], [[3, 0], [5, 0], [5, 2], [3, 2]]],
    [[[-2, 0], [2, 0], [1, 3]]],  # the pivot is in the middle of a side
]


@pytest.mark.some(1)
@pytest.mark.parametrize("unit", [1.0, 0.1, 1e-60, 1e70])
def test_posed_contacts_are_decided_without_an_arrangement(unit: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """One vertex of each lies exactly where a pose takes it, on a vertex or a side of the other; or nearly so."""
    rng, relations = np.random.default_rng(12), []
    for _ in range(300):
        bodies = [Polygon([np.array(ring) * unit for ring in PIVOTS[k]]) for k in rng.integers(0, len(PIVOTS), 2)]
        angles = rng.choice([0.0, 0.3, 1.0, 2.5, 4.0], 2)
        steps = rng.choice([0.0, 0.1, 1.0, 3.0], (2, 2)) * unit
        poses = [
            Pose([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]], step) if rng.integers(3) else None
            for t, step in zip(angles, steps)
        ]
        first, second = bodies
        work = Work(Budget(None, None))
        answer = collide_outline_outline(first, second, (poses[0], poses[1]), work)
        parts = parts_by_arrangement(first, second, (poses[0], poses[1]), work)
        with monkeypatch.context() as patch:
            if answer.relation != answer.relation.OVERLAPPING or answer.witness.kind != "containment":
                patch.setattr(outline, "collide_outline_outline", None)
            patch.setattr(outline, "parts_by_arrangement", None)
            assert collide_outlines(first, second, (poses[0], poses[1]), work) == answer
            assert outline_parts(first, second, (poses[0], poses[1]), work) == parts
            for boolean in (False, True):
                (how,) = SceneBatches(scene_bodies(bodies, poses)).relations(
                    np.array([[0, 1]]), boolean, False, Budget(), None
                )
                assert (how != 0) == answer.collides
                assert boolean or how == answer.relation
        relations.append(answer.relation.label)
    assert relations.count("touching") > 5
    assert set(relations) >= {"touching", "overlapping", "disjoint"}


def ring(n: int, radius: float = 1.0) -> np.ndarray:
    t = np.arange(n) * 2 * np.pi / n
    return np.stack([np.cos(t), np.sin(t)], 1) * radius


@pytest.mark.parametrize("n", [40, 100])
def test_many_edges_are_related_as_by_the_arrangement(n: int) -> None:
    """A tree of several levels; rings of one coil, in each other's holes, equal, an ulp apart, beside each other."""
    disc = Polygon([ring(n)])
    frame = Polygon([ring(n, 2.0), ring(n, 1.0)])
    bodies = [disc, frame, Polygon([ring(n, 0.5)]), Polygon([np.nextafter(ring(n), 5)]), Polygon([ring(n // 3, 2.0)])]
    for radius, step in ((1.0, [2, 0]), (0.25, [0.5, 0]), (1.0, [1.5, 1.25])):
        bodies.append(Polygon([ring(n, radius) + np.array(step)]))
    seen = set()
    for first in bodies:
        for second in bodies:
            work = Work(Budget(None, None))
            answer = collide_outlines(first, second, (None, None), work)
            assert answer == collide_outline_outline(first, second, (None, None), work)
            meets = collide_outlines(first, second, (None, None), Work(Budget(None, None), witness=False, boolean=True))
            assert meets.collides == answer.collides
            seen.add(answer.relation.label)
    assert seen == {"disjoint", "touching", "overlapping", "first_inside_second", "second_inside_first"}


def test_witnesses_of_scenes_and_poses_are_those_of_pairs() -> None:
    square, bow = np.array(SQUARE, float), np.array([[0, 0], [2, 2], [4, 0], [4, 4], [2, 2], [0, 4]], float)
    solids: list[Solid] = [Polygon([square + np.array([4 * i, 3 * j])]) for i in range(3) for j in range(3)]
    solids += [
        Polygon([bow + np.array([2, 1])]),
        Polygon([square / 4 + [1, 1]]),
        Aabb([0, 0], [4, 4]),
        Aabb([1, 1], [2, 2]),
    ]
    pairs = engine.collide_scene(solids, witnesses=True)
    singles = [collide(solids[i], solids[j]) for i, j, _ in pairs]
    assert pairs.relation.tolist() == [one.relation for one in singles]
    assert list(pairs.witnesses or ()) == [one.witness for one in singles]
    turns, moves = np.repeat(np.eye(2)[None], 81, 0), np.array([[x, y] for x in range(9) for y in range(9)], float) - 4
    relations, witnesses = engine.collide_poses(solids[0], solids[1], turns, moves, witnesses=True)
    for relation, witness, move in zip(relations.tolist(), witnesses, moves):
        one = collide(solids[0], solids[1], second_pose=Pose(np.eye(2), move))
        assert (relation, witness) == (one.relation, one.witness)


def test_of_boundaries_that_are_not_simple_the_kernel_says_whether_they_meet() -> None:
    bow = Polygon([[[0, 0], [2, 2], [4, 0], [4, 4], [2, 2], [0, 4]]])
    for step, meets in (((4, 0), True), ((4.5, 0), False), ((1.5, 1), True), ((0.25, 2), True)):
        other = Polygon([np.array(SQUARE) / 8 + step])
        work = Work(Budget(None, None), witness=False, boolean=True)
        assert collide_outlines(bow, other, (None, None), work).collides == meets
        assert collide(bow, other).collides == meets
