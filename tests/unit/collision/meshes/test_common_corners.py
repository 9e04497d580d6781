"""Faces reported to share a corner and nothing else do; where many meet in a point, the answer is that of all pairs."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Polyhedron, Pose, Relation, Surface, collide
from engine.collision.meshes.contact_kinds import common_corner
from engine.collision.meshes.dual_traversal import SEEK_OVERLAP
from engine.collision.meshes.exact_body import kind_of_contact
from engine.collision.meshes.mesh_arrays import STILL, mesh_body_of
from engine.collision.meshes.mesh_pair import N_CONTACTS, SPACE, new_contacts, relate
from engine.collision.meshes.triangle_triangle import Facet, with_pose
from engine.collision.result import Work
from engine.types import Point3
from tests.unit.collision.meshes.bodies import with_far_shell


def test_a_common_corner_is_all() -> None:
    draw = np.random.default_rng(1)
    n_told, poses = 0, np.zeros((1, 12))
    for _ in range(1500):
        first, second = draw.integers(0, 4, (2, 3, 3)).tolist()
        t, u = (Facet(*(Point3(*map(float, p)) for p in corners)) for corners in (first, second))
        common = common_corner(poses, t, u, with_pose(t), with_pose(u), 0.0)
        if common >= 0:
            n_told += 1
            assert first[common // 3] == second[common % 3]
            assert kind_of_contact(tuple(map(tuple, first)), tuple(map(tuple, second))) == "vertex_vertex"
    assert n_told > 20


def test_flat_faces_at_a_corner_are_parted_by_a_plane() -> None:
    draw, poses, n_told, n_all = np.random.default_rng(2), np.zeros((1, 12)), 0, 0
    for _ in range(1000):
        points = draw.integers(-3, 4, (2, 2, 2)) @ draw.integers(-3, 4, (2, 3))
        first, second = (np.vstack([[0, 0, 0], ends]).tolist() for ends in points)
        t, u = (Facet(*(Point3(*map(float, p)) for p in corners)) for corners in (first, second))
        common = common_corner(poses, t, u, with_pose(t), with_pose(u), 0.0)
        if not (np.cross(*points[0]).any() and np.cross(*points[1]).any()):
            continue
        is_all = kind_of_contact(tuple(map(tuple, first)), tuple(map(tuple, second))) == "vertex_vertex"
        n_told, n_all = n_told + (common >= 0), n_all + is_all
        assert is_all or common < 0
    assert n_told > 0.8 * n_all > 100


def fan(n: int, height: float, width: float) -> Polyhedron:
    """Return a cone of n sides with its apex in the origin."""
    angles = 2 * np.pi * np.arange(n) / n
    around = np.round(64 * width * np.stack([np.cos(angles), np.sin(angles)], 1))
    rim = np.column_stack([around, np.full(n, 64 * height)])
    i = np.arange(n)
    j = (i + 1) % n
    faces = np.concatenate([np.stack([0 * i, 1 + j, 1 + i], 1), np.stack([0 * i + n + 1, 1 + i, 1 + j], 1)])
    vertices = np.vstack([np.zeros((1, 3)), rim, [[0, 0, 65 * height]]])
    return Polyhedron(vertices, faces if height > 0 else faces[:, ::-1])


@pytest.mark.parametrize("pose", [None, Pose([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [0, 0, 0])])
def test_many_faces_at_one_point(pose: Pose | None) -> None:
    up, down = fan(30, 1, 0.5), fan(25, -1, 0.75)
    answer = collide(up, down, second_pose=pose)
    assert answer.relation == Relation.TOUCHING
    assert answer.witness is not None
    assert (answer.witness.kind, answer.witness.first_face, answer.witness.second_face) == ("vertex_vertex", 0, 0)
    assert collide(up, fan(25, 1, 0.25), second_pose=pose).relation == Relation.OVERLAPPING
    assert collide(up, Surface(down.vertices, down.triangles), second_pose=pose).relation == Relation.TOUCHING


def test_few_pairs_say_all(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SPACE, "contacts", new_contacts(256))
    a = mesh_body_of(with_far_shell(fan(30, 1, 0.5), (0, 0, -200)))
    b = mesh_body_of(fan(25, -1, 0.75))
    row, found = relate(a, b, (STILL, STILL), SEEK_OVERLAP, Work(witness=False))
    assert row[N_CONTACTS] <= 32 + 30 + 25
    assert len(np.unique(found.pairs[: row[N_CONTACTS], 0])) == 30
    assert len(np.unique(found.pairs[: row[N_CONTACTS], 1])) == 25
    assert len(SPACE.contacts.met) == 0
    assert len(new_contacts(4, 9).met) == 9
