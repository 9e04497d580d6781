"""Two triangles in space."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np
import pytest

from engine.collision.codes import UNSETTLED
from engine.collision.meshes.exact_body import classify_exact, kind_of_contact
from engine.collision.meshes.triangle_triangle import (
    APART,
    COMMON_AREA,
    CONTACT,
    COPLANAR,
    CROSSING,
    Facet,
    classify,
    with_pose,
)
from engine.collision.triangles import relate_triangles_3d
from engine.compiling.jit import allocating_kernel, kernel
from engine.predicates.posed import orient3d_rounded
from engine.predicates.vectors import as_point3
from engine.types import UNDECIDED
from tests.reference.contact import triangles_meet
from tests.reference.exact import Vector, vector

Corners = tuple[tuple[int, int, int], ...]


@allocating_kernel
def classify_batch(first: Any, second: Any, axes: Any, kinds: Any) -> None:
    poses = np.zeros((1, 12))
    for item in range(kinds.shape[0]):
        a, b = first[item], second[item]
        t1 = Facet(as_point3(a, 0), as_point3(a, 1), as_point3(a, 2))
        t2 = Facet(as_point3(b, 0), as_point3(b, 1), as_point3(b, 2))
        kinds[item] = classify(poses, with_pose(t1), with_pose(t2), axes[item], 0.0)


@kernel
def near_batch(points: Any, error: float, sides: Any) -> None:
    for item in range(sides.shape[0]):
        p = points[item]
        sides[item] = orient3d_rounded(as_point3(p, 0), as_point3(p, 1), as_point3(p, 2), as_point3(p, 3), error)


def axes_of(triangles: np.ndarray) -> np.ndarray:
    normals = np.abs(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]))
    return np.where(normals.any(axis=1), normals.argmax(axis=1), -1)


def lattice_pairs(n_pairs: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    first, second = rng.integers(0, 4, (2, n_pairs, 3, 3)).astype(float)
    is_flat = rng.random(n_pairs) < 0.3
    second[is_flat, :, 2] = 1
    first[is_flat & (rng.random(n_pairs) < 0.5), :, 2] = 1
    return first, second


def as_corners(triangle: np.ndarray) -> Corners:
    return tuple(tuple(int(value) for value in corner) for corner in triangle)


def as_reference(triangle: Corners) -> tuple[Vector, Vector, Vector]:
    a, b, c = (vector(corner) for corner in triangle)
    return a, b, c


def test_compiled_exact_and_reference_agree_on_a_lattice() -> None:
    first, second = lattice_pairs(1500, 1)
    axes = axes_of(first)
    have_area = (axes >= 0) & (axes_of(second) >= 0)
    kinds = np.full(len(first), UNDECIDED, np.int8)
    compiled = np.empty(int(have_area.sum()), np.int8)
    classify_batch(first[have_area], second[have_area], axes[have_area], compiled)
    kinds[have_area] = compiled
    for a, b, kind, area in zip(first, second, kinds, have_area, strict=True):
        t1, t2 = as_corners(a), as_corners(b)
        exact = classify_exact(t1, t2)
        assert (exact != APART) == triangles_meet(as_reference(t1), as_reference(t2))
        if area:
            assert kind == exact
        if exact != APART:
            assert kind_of_contact(t1, t2) == kind_of_contact(t2, t1)


def test_class_does_not_depend_on_the_order_of_vertices_or_triangles() -> None:
    first, second = lattice_pairs(60, 2)
    for a, b in zip(first, second, strict=True):
        t1, t2 = as_corners(a), as_corners(b)
        found = {classify_exact(tuple(p), tuple(q)) for p in permutations(t1) for q in permutations(t2)}
        assert len(found | {classify_exact(t2, t1)}) == 1


BASE = ((0, 0, 0), (4, 0, 0), (0, 4, 0))


@pytest.mark.parametrize(
    ("other", "kind", "contact"),
    [
        (((1, 1, -1), (1, 1, 1), (9, 9, 1)), CROSSING, "edge_face"),
        (((1, 1, 0), (1, 1, 1), (2, 2, 1)), CONTACT, "vertex_face"),
        (((2, 0, 0), (1, -1, 1), (2, -2, 1)), CONTACT, "vertex_edge"),
        (((0, 0, 0), (0, -1, 1), (2, -2, 1)), CONTACT, "vertex_vertex"),
        (((2, -1, -1), (2, 1, 1), (2, -9, 1)), CONTACT, "edge_edge"),
        (((2, 0, -1), (2, 0, 1), (2, -9, 1)), CONTACT, "edge_edge"),
        (((1, 1, 0), (2, 1, 0), (1, 1, 1)), CONTACT, "edge_face"),
        (((1, 1, 0), (2, 1, 0), (1, 2, 0)), COMMON_AREA, "face_face"),
        (((0, 0, 0), (4, 0, 0), (0, -4, 0)), COPLANAR, "edge_edge"),
        (((1, 1, 0), (1, 1, 0), (1, 1, 0)), CONTACT, "vertex_face"),
        (((1, 1, -1), (1, 1, 0), (1, 1, 1)), CONTACT, "edge_face"),
        (((1, 1, 1), (2, 1, 1), (1, 2, 1)), APART, None),
        (((5, 5, 0), (6, 5, 0), (5, 6, 0)), APART, None),
    ],
)
def test_named_cases(other: Corners, kind: int, contact: str | None) -> None:
    assert classify_exact(BASE, other) == kind
    assert classify_exact(other, BASE) == kind
    if contact is not None:
        assert kind_of_contact(BASE, other) == contact


def test_signs_near_zero_are_left_open_and_others_survive_the_error() -> None:
    rng = np.random.default_rng(3)
    points = rng.uniform(-1, 1, (2000, 4, 3))
    points[:1000, 3] = points[:1000, :3].mean(axis=1) + rng.uniform(-1, 1, (1000, 3)) * 1e-12
    error = 1e-12
    sides = np.empty(len(points), np.int8)
    near_batch(points, error, sides)
    assert 500 < (sides == UNDECIDED).sum() < 1100
    for _ in range(20):  # any coordinates within the error have the sign that was claimed
        moved = points + rng.choice([-error, error], points.shape)
        u, v, w = (moved[:, k] - moved[:, 0] for k in (1, 2, 3))
        determinant = (np.cross(u, v) * w).sum(axis=1)
        claimed = sides != UNDECIDED
        assert (np.sign(determinant[claimed]) == sides[claimed]).all()


# --- The kernel for pairs of triangles of space: right, or UNSETTLED where one has no area ---


def test_agrees_with_the_reference_on_a_lattice() -> None:
    first, second = np.random.default_rng(8).integers(0, 3, (2, 400, 3, 3)).astype(float)
    found = np.empty(400, np.int8)
    relate_triangles_3d(first, second, found)
    for t, u, how in zip(first, second, found.tolist()):
        if how == UNSETTLED:
            areas = [np.cross(v[1] - v[0], v[2] - v[0]).any() for v in (t, u)]
            assert not all(areas)
            continue
        one, other = (tuple(vector(p) for p in v.tolist()) for v in (t, u))
        if all(np.cross(v[1] - v[0], v[2] - v[0]).any() for v in (t, u)):
            assert (how != 0) == triangles_meet(one, other)
    assert (found == UNSETTLED).mean() < 0.3
