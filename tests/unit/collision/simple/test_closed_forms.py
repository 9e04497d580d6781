"""Boxes against boxes: the reference, many at a time, and a witness that says whether a flat one pierces."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from engine import Aabb, collide
from engine.collision.codes import UNSETTLED
from engine.collision.meshes.mesh_mesh import mesh_mesh
from engine.collision.result import Work
from engine.collision.simple.form_relations import relate_box_pairs
from tests.unit.collision.lattices import COUNTS, Maker, aabb, check_pairs


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
