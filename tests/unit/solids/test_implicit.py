"""Implicit solids: terms, arrays, callables, limits."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

import engine


def first_coordinate(points: np.ndarray) -> np.ndarray:
    return points[:, 0]


def term(powers: object, coefficient: object = 1.0) -> dict[str, object]:
    return {"powers": powers, "coefficient": coefficient}


def test_terms_and_arrays_are_the_same() -> None:
    by_terms = engine.Implicit([term([2, 0, 1], -1), term((0, 0, 0), 4.5)])
    by_arrays = engine.Implicit(powers=np.array([[2, 0, 1], [0, 0, 0]], np.uint8), coefficients=[-1, 4.5])
    for solid in (by_terms, by_arrays):
        assert (solid.type, solid.dimension, solid.function) == ("implicit", 3, None)
        assert solid.powers.tolist() == [[2, 0, 1], [0, 0, 0]]
        assert solid.coefficients.tolist() == [-1.0, 4.5]
        assert solid.powers.dtype == np.int64


def test_limits_are_taken() -> None:
    assert engine.Implicit([term([16, 0]), term([0, 0], 0)]).dimension == 2
    assert len(engine.Implicit([term([1, 1])] * 1000).powers) == 1000


@pytest.mark.parametrize(
    ("terms", "error", "where", "words"),
    [
        ([], engine.EmptyGeometryError, ("terms",), "at least one term"),
        ("x", engine.InvalidArrayError, ("terms",), "str"),
        ([5], engine.InvalidArrayError, ("terms", 0), "terms[0] must be"),
        ([{"powers": [1, 0]}], engine.InvalidArrayError, ("terms", 0), "coefficient"),
        ([term([1, 0]), {**term([1, 0]), "name": 1}], engine.InvalidArrayError, ("terms", 1), "terms[1]"),
        ([term([1, 0], "2")], engine.InvalidArrayError, ("terms", 0, "coefficient"), "'2'"),
        ([term([1, 0], float("nan"))], engine.NotFiniteError, ("terms", 0, "coefficient"), "nan"),
        ([term([1.0, 0])], engine.InvalidPolynomialError, ("terms", 0, "powers"), "whole numbers"),
        ([term([True, False])], engine.InvalidPolynomialError, ("terms", 0, "powers"), "whole numbers"),
        ([term([1, "0"])], engine.InvalidPolynomialError, ("terms", 0, "powers"), "whole numbers"),
        ([term(5)], engine.InvalidPolynomialError, ("terms", 0, "powers"), "whole numbers"),
        ([term(None)], engine.InvalidPolynomialError, ("terms", 0, "powers"), "whole numbers"),
        ([term([10**30, 0])], engine.InvalidPolynomialError, ("terms", 0, "powers"), "whole numbers"),
        ([term([1, -1])], engine.InvalidPolynomialError, ("terms", 0, "powers"), "[1, -1]"),
        ([term([1, 0]), term([9, 8])], engine.InvalidPolynomialError, ("terms", 1, "powers"), "at most 16"),
        ([term([2**63, 2**63])], engine.InvalidPolynomialError, ("terms", 0, "powers"), "at most 16"),
        ([term([1])], engine.WrongDimensionError, ("terms", 0, "powers"), "got 1"),
        ([term([1, 0, 0, 0])], engine.WrongDimensionError, ("terms", 0, "powers"), "got 4"),
        ([term([1, 0]), term([1, 0, 0])], engine.WrongDimensionError, ("terms", 1, "powers"), "terms[1].powers has 3"),
        ([term([1, 0])] * 1001, engine.InvalidPolynomialError, ("terms",), "1001"),
    ],
)
def test_refusals(terms: Any, error: Any, where: tuple[Any, ...], words: str) -> None:
    with pytest.raises(error) as info:
        engine.Implicit(terms)
    assert info.value.where == where
    assert words in str(info.value)


def test_array_refusals() -> None:
    with pytest.raises(engine.InvalidPolynomialError, match="2 rows of powers and 1"):
        engine.Implicit(powers=[[1, 0], [0, 1]], coefficients=[1])
    with pytest.raises(engine.InvalidPolynomialError, match="powers must be rows"):
        engine.Implicit(powers=[[1, 0], [0]], coefficients=[1, 1])
    with pytest.raises(engine.InvalidPolynomialError, match="not both"):
        engine.Implicit([term([1, 0])], powers=[[1, 0]], coefficients=[1])
    with pytest.raises(engine.InvalidPolynomialError):
        engine.Implicit()
    with pytest.raises(engine.EmptyGeometryError):
        engine.Implicit(powers=np.zeros((0, 2), int), coefficients=[])


def test_callables() -> None:
    solid = engine.Implicit.from_callable(first_coordinate, 3)
    assert (solid.dimension, solid.function) == (3, first_coordinate)
    assert (solid.powers.shape, solid.coefficients.shape) == ((0, 3), (0,))
    assert pickle.loads(pickle.dumps(solid)).function is first_coordinate
    with pytest.raises(engine.InvalidArrayError, match="callable"):
        engine.Implicit.from_callable(5, 3)  # type: ignore[arg-type]
    for dimension in (1, 4, True, "2"):
        with pytest.raises(engine.WrongDimensionError):
            engine.Implicit.from_callable(first_coordinate, dimension)  # type: ignore[arg-type]
