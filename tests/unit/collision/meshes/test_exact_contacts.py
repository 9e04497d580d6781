"""Two faces on integers: whether they meet, as the reference says, whatever their shape; the kind of a contact."""

from __future__ import annotations

import numpy as np
import pytest

from engine.collision.meshes.exact_body import Corners, as_simplex, classify_exact, kind_of_contact
from engine.collision.meshes.triangle_triangle import APART
from tests.reference.contact import triangles_meet
from tests.reference.exact import vector

FACE: Corners = ((0, 0, 0), (6, 0, 0), (0, 6, 0))


def test_degenerate_ones_agree_with_proper_ones_moved_to_them() -> None:
    rng = np.random.default_rng(4)
    for rows in rng.integers(0, 3, (300, 6, 3)).tolist():
        t, u = tuple(map(tuple, rows[:3])), tuple(map(tuple, rows[3:]))
        how = classify_exact(t, u)
        assert (how == APART) == (classify_exact(u, t) == APART)
        if len(as_simplex(t)) == len(as_simplex(u)) == 3:
            reference = [tuple(vector(p) for p in triangle) for triangle in (t, u)]
            assert (how != APART) == triangles_meet(*reference)


@pytest.mark.parametrize(
    ("other", "kind"),
    [
        (((1, 1, 0), (2, 1, 0), (1, 2, 0)), "face_face"),
        (((1, 1, 1), (1, 1, -1), (9, 9, 9)), "edge_face"),
        (((1, 1, 0), (1, 1, 9), (2, 1, 9)), "vertex_face"),
        (((3, -1, 1), (3, 1, -1), (3, -9, -9)), "edge_edge"),
        (((3, 0, 0), (3, -1, 9), (3, -2, 9)), "vertex_edge"),
        (((0, 0, 0), (-1, 0, 9), (0, -1, 9)), "vertex_vertex"),
    ],
)
def test_kinds(other: Corners, kind: str) -> None:
    assert kind_of_contact(FACE, other) == kind
    assert kind_of_contact(other, FACE) == kind
