"""Checks of meshes: closed, oriented, convex."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from engine import DeadlineExceededError, InconsistentOrientationError, NotClosedError, Polyhedron
from engine.compiling.jit import entry_of
from engine.solids import mesh_checks
from engine.solids.checks import frozen
from engine.solids.convexity import convexity
from engine.solids.mesh import first_equal
from engine.solids.mesh_checks import check_topology

STILL = np.zeros(1, np.uint8)


def looked_over(points: Any, offsets: Any, indices: Any, flag: Any = STILL) -> tuple[Any, list[int], Any]:
    merged, named, bits = np.array(indices), np.full((3, 5), -1), frozen(points).view(np.uint64)
    found = entry_of(check_topology)(bits, np.asarray(offsets), np.asarray(indices), True, merged, named, flag)
    return found, merged.tolist(), named


def test_equal_rows() -> None:
    points = np.random.default_rng(0).integers(0, 3, (200, 3)).astype(float)
    expected = [points.tolist().index(point) for point in points.tolist()]
    found = first_equal(frozen(points))
    assert found is not None
    assert found.tolist() == expected
    assert first_equal(frozen(points[sorted(set(expected))])) is None


def test_rows_that_share_a_slot_are_told_apart() -> None:
    points = np.random.default_rng(1).uniform(-1, 1, (3_000, 3))
    points[1_500:] = points[:1_500]
    bits, first = points.view(np.uint64), np.empty(3_000, np.int64)
    inner = mesh_checks._find_equal_rows
    plain = getattr(inner, "py_func", inner)
    one_slot = type(plain)(plain.__code__, {**vars(mesh_checks), "_mixed": lambda bits, row: np.uint64(2**64 - 1)})
    with np.errstate(over="ignore"):
        assert one_slot(bits[::10], first[:300], STILL) == 150
    assert first[:300].tolist() == [k % 150 for k in range(300)]


def test_edges_against_a_count() -> None:
    random = np.random.default_rng(2)
    for _ in range(200):
        n_vertices = int(random.integers(5, 12))
        sizes = random.integers(3, 5, int(random.integers(1, 4)))
        offsets = np.append(0, np.cumsum(sizes))
        indices = random.integers(0, n_vertices, offsets[-1])
        faces = [indices[a:b].tolist() for a, b in pairwise(offsets)]
        points = random.integers(0, 3, (n_vertices, 3)).astype(float)
        first = [points.tolist().index(point) for point in points.tolist()]
        repeated = [len(set(face)) < len(face) for face in faces]
        corners = [[first[corner] for corner in face] for face in faces]
        uses = Counter(edge for face in corners for edge in zip(face, face[1:] + face[:1]) if edge[0] != edge[1])
        balance = {(a, b): uses[a, b] - uses[b, a] for a in range(n_vertices) for b in range(a + 1, n_vertices)}
        found, merged, named = looked_over(points, offsets, indices)
        if any(repeated):
            assert found == (repeated.index(True), n_vertices, 0, 0)
            continue
        n_odd = sum(net % 2 for net in balance.values())
        assert found == (-1, len(set(first)), n_odd, sum(net != 0 for net in balance.values()) - n_odd)
        assert merged == [corner for face in corners for corner in face]
        kept = dict.fromkeys(
            (min(edge), max(edge))
            for edge in uses
            if (balance[min(edge), max(edge)] % 2 if n_odd else balance[min(edge), max(edge)])
        )
        assert [(min(edge), max(edge)) for edge in edges_of(named, merged)] == list(kept)[:3]
        for edge, (forth, back) in edges_of(named, merged).items():
            assert (uses[edge], uses[edge[::-1]]) == (forth, back)


def edges_of(named: Any, merged: list[int]) -> dict[tuple[int, int], tuple[int, int]]:
    return {(merged[a], merged[b]): (forth, back) for face, a, b, forth, back in named.tolist() if face >= 0}


def test_a_raised_flag_ends_every_kernel() -> None:
    raised, offsets, indices = np.ones(1, np.uint8), np.array([0, 3, 6]), np.array([0, 1, 0, 0, 1, 2])
    found, merged, named = looked_over(np.zeros((3, 3)), offsets, indices, raised)
    assert (found, merged) == ((-1, 3, 0, 0), indices.tolist())
    assert (named == -1).all()


def test_faults_far_inside_a_large_mesh_are_named() -> None:
    n = 400
    a = np.arange(n - 1)[:, None] * n + np.arange(n - 1)
    quads = np.stack([a, a + 1, a + n + 1, a + n], axis=2).reshape(-1, 4)
    places = np.stack([*np.meshgrid(np.arange(n), np.arange(n)), np.zeros((n, n))], axis=2).reshape(-1, 3)
    both = np.concatenate([quads, quads[:, ::-1]])
    assert Polyhedron(places, both).n_faces == len(both)
    with pytest.raises(NotClosedError, match="4 edges are open: edge 1204-1203 of face 801, from") as info:
        Polyhedron(places, np.delete(both, len(quads) + 1_200, axis=0))
    assert info.value.where == ("faces", 801)  # the first of four faces around: its upper side
    turned = both.copy()
    turned[-1] = turned[-1, ::-1]
    with pytest.raises(InconsistentOrientationError, match="4 edges are not used equally often"):
        Polyhedron(places, turned)
    with pytest.raises(DeadlineExceededError):
        Polyhedron(places.tolist(), both.tolist(), deadline=1e-3)


# --- The certificate accepts convex solids, however cut and turned, and nothing else ---


CUBE = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], float)


def prism(ring: np.ndarray) -> Polyhedron:
    n = len(ring)
    vertices = np.concatenate([np.column_stack([ring, np.full(n, z)]) for z in (0.0, 1.0)])
    sides = [[k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n)]
    return Polyhedron(vertices, [list(range(n))[::-1], list(range(n, 2 * n)), *sides])


@pytest.mark.parametrize("scale", [1.0, 1e-150, 1e100])
def test_a_cube_is_convex_either_way_round(scale: float) -> None:
    outward = convexity(Polyhedron(CORNERS * scale, CUBE))
    inward = convexity(Polyhedron(CORNERS * scale, [face[::-1] for face in CUBE]))
    assert outward is not None
    assert outward.is_outward
    assert inward is not None
    assert not inward.is_outward


def test_faces_cut_into_coplanar_triangles_are_convex() -> None:
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    regular = np.round(np.column_stack([np.cos(turn), np.sin(turn)]) * 2.0**20)
    assert convexity(prism(regular)) is not None


def test_a_dent_as_small_as_2_to_the_minus_60_is_seen() -> None:
    square = [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    assert convexity(prism(np.array(square))) is not None
    square[1][1] = 2.0**-60
    assert convexity(prism(np.array(square))) is None
    square[1][1] = -(2.0**-60)
    assert convexity(prism(np.array(square))) is not None


def test_bodies_that_look_convex_at_every_edge_are_not_taken() -> None:
    faces = [[v + 8 * k for v in face] for k in range(2) for face in CUBE]
    two = Polyhedron(np.concatenate([CORNERS, CORNERS + 3.0]), faces)
    nested = Polyhedron(np.concatenate([CORNERS, CORNERS * 0.5 + 0.25]), faces)
    same = Polyhedron(CORNERS, CUBE + CUBE)
    assert convexity(two) is convexity(nested) is convexity(same) is None


def test_a_star_that_winds_twice_around_its_axis_is_not_taken() -> None:
    turn = np.arange(5) * 4 * np.pi / 5
    vertices = np.array([*np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]), [0, 0, 1], [0, 0, -1]])
    faces = [f for k in range(5) for f in ([k, (k + 1) % 5, 5], [(k + 1) % 5, k, 6])]
    assert convexity(Polyhedron(vertices, faces)) is None
