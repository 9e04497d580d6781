"""CSG trees: operations, operands, depth."""

from __future__ import annotations

import pickle
from typing import Any

import pytest

import engine

BALL, DISK = engine.Sphere([0, 0, 0], 1), engine.Sphere([0, 0], 1)
SURFACE = engine.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def test_trees() -> None:
    inner = engine.Csg("difference", [BALL, engine.HalfSpace([1, 0, 0], 0)])
    tree = engine.Csg("union", (inner, BALL, BALL))
    assert (tree.type, tree.dimension, tree.depth, tree.n_leaves) == ("csg", 3, 2, 4)
    assert tree.operands == (inner, BALL, BALL)
    assert engine.Csg("intersection", [DISK]).dimension == 2


@pytest.mark.parametrize(
    ("operation", "operands", "error", "where", "words"),
    [
        ("xor", [BALL], engine.InvalidOperationError, ("operation",), "'xor'"),
        (None, [BALL], engine.InvalidOperationError, ("operation",), "union, intersection, difference"),
        (["union"], [BALL], engine.InvalidOperationError, ("operation",), "union"),
        ("union", [], engine.EmptyGeometryError, ("operands",), "at least one solid"),
        ("union", BALL, engine.InvalidArrayError, ("operands",), "Sphere"),
        ("union", [BALL, [0, 0]], engine.InvalidArrayError, ("operands", 1), "list"),
        ("union", [BALL, DISK], engine.WrongDimensionError, ("operands", 1), "operands[1] is 2D"),
        ("union", [BALL, SURFACE], engine.UnsupportedSolidError, ("operands", 1), "close it"),
        ("difference", [BALL], engine.InvalidOperationError, ("operands",), "exactly two"),
        ("difference", [BALL] * 3, engine.InvalidOperationError, ("operands",), "got 3"),
    ],
)
def test_refusals(operation: Any, operands: Any, error: Any, where: tuple[Any, ...], words: str) -> None:
    with pytest.raises(error) as info:
        engine.Csg(operation, operands)
    assert info.value.where == where
    assert words in str(info.value)


def test_depth_is_limited_and_the_deepest_tree_pickles() -> None:
    tree: engine.Solid = BALL
    for _ in range(100):
        tree = engine.Csg("union", [tree])
    assert pickle.loads(pickle.dumps(tree)).depth == 100
    assert tree.memory == 24
    with pytest.raises(engine.TooDeepError, match="101") as info:
        engine.Csg("union", [tree])
    assert info.value.where == ("operands",)


def test_shared_operands_cannot_double_without_end() -> None:
    tree: engine.Solid = BALL
    for _ in range(19):
        tree = engine.Csg("union", [tree, tree])
    assert isinstance(tree, engine.Csg)
    assert tree.n_leaves == 2**19
    with pytest.raises(engine.TooComplexError, match="1048576 leaves, the limit is 1000000"):
        engine.Csg("union", [tree, tree])


def test_trees_that_share_operands_are_compared_in_linear_time() -> None:
    def doubled(radius: float) -> engine.Solid:
        tree: engine.Solid = engine.Sphere((0, 0), radius)
        for _ in range(16):
            tree = engine.Csg("union", [tree, tree])
        return tree

    assert doubled(1.0) == doubled(1.0)
    assert doubled(1.0) != doubled(2.0)
    assert doubled(1.0) != engine.Sphere((0, 0), 1.0)
    assert hash(doubled(1.0)) == hash(doubled(1.0))
