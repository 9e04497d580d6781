"""Equal rows, repeated indices and open edges, against a count of everything; and the polls of large meshes."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from engine import DeadlineExceededError, InconsistentOrientationError, NotClosedError, Polyhedron
from engine.direct import entry_of
from engine.solids import mesh_checks
from engine.solids.checks import frozen
from engine.solids.mesh import first_equal
from engine.solids.mesh_checks import look_over

STILL = np.zeros(1, np.uint8)


def looked_over(points: Any, offsets: Any, indices: Any, flag: Any = STILL) -> tuple[Any, list[int], Any]:
    merged, named, bits = np.array(indices), np.full((3, 5), -1), frozen(points).view(np.uint64)
    found = entry_of(look_over)(bits, np.asarray(offsets), np.asarray(indices), True, merged, named, flag)
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
