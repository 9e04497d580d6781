"""The sides that floats tell of the vertices of a mesh are those of rational arithmetic, and what is named is first."""

from __future__ import annotations

import numpy as np
import pytest

from engine import HalfSpace, Polygon, Polyhedron, Pose, Relation, Solid, Surface
from engine.collision.exact_images import as_vector, image_half_space, value_at
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.result import Work
from engine.collision.simple import closed_forms
from engine.collision.simple.boundary import first_triangle_at, pulled_back
from engine.collision.simple.closed_forms import _by_scan, _function_in_frame, collide_half_space_body, scan_sides
from engine.predicates.rational import sign_of

FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
TURN = Pose([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]], [1, -2, 3])


def _mesh(draw: np.random.Generator, n: int, scale: float, solid: type[Solid]) -> Solid:
    """Return n tetrahedra, that share nothing, on a lattice."""
    corners = draw.integers(-4, 5, (n, 1, 3)) + np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = (4 * np.arange(n)[:, None, None] + np.array(FACES)).reshape(-1, 3)
    return solid(corners.reshape(-1, 3) * scale, faces)


@pytest.mark.some(8)
@pytest.mark.parametrize("scale", [1.0, 2.0**-500, 2.0**-1060, 2.0**400, 2.0**1020])
@pytest.mark.parametrize("poses", [(None, None), (None, TURN), (TURN, None), (TURN, TURN)])
def test_agrees_with_rationals(scale: float, poses: tuple[Pose | None, Pose | None]) -> None:
    draw = np.random.default_rng(7)
    poses = tuple(p and Pose(p.rotation, p.translation * scale) for p in poses)
    for n in (1, 20, 90):
        body = _mesh(draw, n, scale, Polyhedron)
        mesh = mesh_body_of(body)
        for _ in range(12):
            space = HalfSpace(
                draw.integers(-3, 4, 3) + np.array([0, 0, 0.5]), float(draw.integers(-12, 13)) * scale / 2
            )
            exact, _, _ = pulled_back(image_half_space(space, poses[0]), poses[1])
            signs = [sign_of(value_at(exact, as_vector(p))) for p in mesh.arrays.vertices.tolist()]
            unsure = np.empty(400, np.int64)
            normal, sizes, offset, size = _function_in_frame(space, poses)
            plane = np.array([normal, sizes, [offset, size, 0.0]])
            beyond, before, n_unsure = scan_sides(mesh.arrays, plane, unsure, Work().budget.flag)
            assert beyond < 0 or (signs[beyond] > 0 and set(range(beyond)) & _at(signs, 1) <= set(unsure[:n_unsure]))
            assert before < 0 or (signs[before] < 0 and set(range(before)) & _at(signs, -1) <= set(unsure[:n_unsure]))
            assert beyond >= 0 or _at(signs, 1) <= set(unsure[:n_unsure].tolist())
            assert before >= 0 or _at(signs, -1) <= set(unsure[:n_unsure].tolist())


def _at(signs: list[int], sign: int) -> set[int]:
    return {vertex for vertex, found in enumerate(signs) if found == sign}


@pytest.mark.parametrize("solid", [Polyhedron, Surface])
@pytest.mark.parametrize("poses", [(None, None), (None, TURN)])
def test_answers_as_without_the_scan(
    solid: type[Solid], poses: tuple[Pose | None, Pose | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    draw = np.random.default_rng(3)
    questions = []
    for _ in range(60):
        space = HalfSpace(draw.integers(-2, 3, 3) + np.array([0, 0, 0.5]), float(draw.integers(-10, 11)) / 2)
        questions.append((space, _mesh(draw, int(draw.integers(1, 9)), 1.0, solid)))
    answers = [collide_half_space_body(*question, poses, Work()) for question in questions]
    n_told = sum(
        _by_scan(_function_in_frame(question[0], poses), *question, poses, Work()) is not None for question in questions
    )
    monkeypatch.setattr(closed_forms, "_by_scan", lambda *_: None)
    assert answers == [collide_half_space_body(*question, poses, Work()) for question in questions]
    assert n_told > 40


def test_the_first_first_triangle_at_a_vertex() -> None:
    mesh = mesh_body_of(_mesh(np.random.default_rng(1), 5, 1.0, Polyhedron)).arrays
    for vertex in range(len(mesh.vertices)):
        assert first_triangle_at(mesh, vertex) == int(np.argmax((mesh.triangles == vertex).any(axis=1)))
    assert first_triangle_at(mesh, len(mesh.vertices)) == -1


@pytest.mark.parametrize("is_own", [False, True])
@pytest.mark.parametrize("scale", [1.0, 2.0**-400, 2.0**900])
def test_a_body_far_from_the_plane_is_told_by_its_box(
    scale: float, is_own: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr(closed_forms, "boundary_of", refuse)
    monkeypatch.setattr(closed_forms, "_by_scan", refuse)
    flat, solid = Pose([[0.6, -0.8], [0.8, 0.6]], [scale, 0]), Pose(TURN.rotation, TURN.translation * scale)
    bodies = [(flat, [0, 1], Polygon([np.array([[0, 0], [4, 0], [1, 1], [0, 4]]) * scale]))]
    bodies.append((solid, [0, 0, 1], Polyhedron(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * scale, FACES)))
    for pose, normal, body in bodies:
        for offset, relation in ((-90.0, Relation.DISJOINT), (90.0, Relation.SECOND_INSIDE_FIRST)):
            poses = (pose, None) if is_own else (None, pose)
            found = collide_half_space_body(HalfSpace(normal, offset * scale), body, poses, Work())
            assert found.relation == relation
