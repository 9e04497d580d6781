"""The set where a polynomial is not negative; in process also where a caller's function is not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from engine.errors import InvalidArrayError, InvalidPolynomialError, WrongDimensionError
from engine.predicates.polynomial import MAX_DEGREE, MAX_TERMS
from engine.solids.base import Solid
from engine.solids.checks import as_floats, as_number, check_given_dimension, check_not_empty, frozen, shown, spell
from engine.types import FloatArray, IntArray, read_only

PointFunction = Callable[[FloatArray], npt.ArrayLike]
"""Takes points ``(n, dimension)`` float64 and returns n numbers, not negative inside."""


class Implicit(Solid):
    """All points where ``f(p) >= 0``, f a polynomial with exact sign, in 2D or 3D.

    Parameters
    ----------
    terms : list of dict, optional
        ``{"powers": [i, j, k], "coefficient": c}`` for the sum of c x^i y^j z^k (2D: two powers). Terms with equal
        powers add up; at most 1,000 terms of total degree at most 16.
    powers : array_like of int, shape (n, dimension), optional
        In place of terms: >= 0.
    coefficients : array_like, shape (n,), optional
        With `powers`.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError, EmptyGeometryError, InvalidPolynomialError
        For terms that break a rule.

    Notes
    -----
    Boundary: the points where f is exactly zero (all points, if f is zero).

    Examples
    --------
    >>> Implicit([{"powers": [2, 0], "coefficient": -1}, {"powers": [0, 0], "coefficient": 4}])  # 4 - x^2 >= 0
    Implicit(2 terms, 2D)
    """

    __slots__ = ("coefficients", "function", "powers")

    type: ClassVar[str] = "implicit"
    _pickled: ClassVar[tuple[str, ...]] = ("powers", "coefficients", "function")
    powers: IntArray
    """``(n, dimension)``: the exponents of each term; no rows if there is a `function`."""
    coefficients: FloatArray
    """``(n,)``: of each term."""
    function: PointFunction | None
    """The caller's function, None for a polynomial."""

    def __init__(self, terms: object = None, *, powers: object = None, coefficients: object = None) -> None:
        if terms is not None:
            if powers is not None or coefficients is not None:
                raise InvalidPolynomialError("give either terms, or powers and coefficients, not both", ("terms",))
            exponents, factors = _from_terms(terms)
        else:
            exponents = _as_powers(powers, ("powers",))
            factors = as_floats(coefficients, 1, ("coefficients",))
        check_not_empty(len(exponents), "term", ("terms",))
        if len(exponents) != len(factors):
            raise InvalidPolynomialError(
                f"there are {len(exponents)} rows of powers and {len(factors)} coefficients; give one of each a term",
                ("coefficients",),
            )
        _check_powers(exponents)
        self._set(
            dimension=exponents.shape[1],
            powers=read_only(exponents.astype(np.int64)),
            coefficients=frozen(factors),
            function=None,
        )

    @classmethod
    def from_callable(cls, function: PointFunction, dimension: int) -> Implicit:
        """Return the solid where ``function(points) >= 0``, decided in float64 as the function computes it.

        Parameters
        ----------
        function : callable
            Vectorised: points ``(n, dimension)`` float64 to n numbers; called from several threads at once.
        dimension : int
            2 or 3.

        Returns
        -------
        Implicit
            Its accuracy is that of the function; `Accuracy.decisions` is "float64". Pickles if the function does.

        Examples
        --------
        >>> Implicit.from_callable(lambda p: 1.0 - p[:, 0] ** 2 - p[:, 1] ** 4, dimension=2)
        Implicit(callable, 2D)
        """
        if not callable(function):
            raise InvalidArrayError(f"function must be callable, got {type(function).__name__}", ("function",))
        check_given_dimension(dimension)
        solid = object.__new__(cls)
        powers, coefficients = read_only(np.zeros((0, dimension), np.int64)), frozen(np.zeros(0))
        solid._set(dimension=int(dimension), powers=powers, coefficients=coefficients, function=function)
        return solid

    @classmethod
    def restored(cls, *values: Any) -> Implicit:
        powers, coefficients, *more = values
        if more and (function := more[0]) is not None:
            return cls.from_callable(function, np.shape(powers)[-1])
        return cls(powers=powers, coefficients=coefficients)

    def __repr__(self) -> str:
        what = "callable" if self.function is not None else f"{len(self.powers)} terms"
        return f"Implicit({what}, {self.dimension}D)"


def _from_terms(terms: object) -> tuple[npt.NDArray[Any], FloatArray]:
    """Return powers (n, dimension) and coefficients (n,) from a list of mappings with these two names."""
    if not isinstance(terms, (list, tuple)):
        raise InvalidArrayError(f"terms must be a list of terms, got {type(terms).__name__}", ("terms",))
    check_not_empty(len(terms), "term", ("terms",))
    powers: list[npt.NDArray[Any]] = []
    coefficients: list[float] = []
    for i_term, term in enumerate(terms):
        if not isinstance(term, Mapping) or set(term) != {"powers", "coefficient"}:
            raise InvalidArrayError(
                f'terms[{i_term}] must be {{"powers": [...], "coefficient": number}}, got {shown(term, 80)}',
                ("terms", i_term),
            )
        row = _as_powers([term["powers"]], ("terms", i_term, "powers"), one=True)[0]
        if powers and len(row) != len(powers[0]):
            raise WrongDimensionError(
                f"terms[{i_term}].powers has {len(row)} powers, terms[0].powers {len(powers[0])}; use one dimension",
                ("terms", i_term, "powers"),
            )
        powers.append(row)
        coefficients.append(as_number(term["coefficient"], ("terms", i_term, "coefficient")))
    return np.array(powers), np.array(coefficients, np.float64)


def _as_powers(powers: object, where: tuple[str | int, ...], *, one: bool = False) -> npt.NDArray[Any]:
    """Return powers as an integer array ``(n, dimension)``; raise for other types or dimensions. one: the powers of a
    single term are given."""
    try:
        array = np.asarray(powers)
    except ValueError:  # ragged
        array = np.zeros(0, object)
    is_masked = isinstance(powers, np.ma.MaskedArray)
    if array.ndim != 2 or array.dtype.kind not in "iu" or is_masked or _holds_bool(powers):
        shape = "a row" if one else "rows"
        raise InvalidPolynomialError(
            f"{spell(where)} must be {shape} of 2 or 3 whole numbers from 0 to {MAX_DEGREE}, got {shown(powers, 80)}",
            where,
        )
    if array.shape[1] not in (2, 3):
        raise WrongDimensionError(f"{spell(where)} must have 2 or 3 powers, got {array.shape[1]}", where)
    return array


def _holds_bool(powers: object) -> bool:
    """Return whether a nested list contains True or False, which numpy would convert to 1 and 0."""
    if isinstance(powers, (list, tuple)):
        return any(_holds_bool(item) for item in powers)
    return isinstance(powers, (bool, np.bool_))


def _check_powers(powers: npt.NDArray[Any]) -> None:
    """Raise for a power below 0, a total degree above `MAX_DEGREE`, or more than `MAX_TERMS` terms."""
    if len(powers) > MAX_TERMS:
        raise InvalidPolynomialError(f"there are {len(powers)} terms; at most {MAX_TERMS} are taken", ("terms",))
    for i_term, row in enumerate(powers.tolist()):
        if min(row) < 0 or sum(row) > MAX_DEGREE:
            raise InvalidPolynomialError(
                f"terms[{i_term}].powers = {row}; each must be 0 or more and their sum at most {MAX_DEGREE}",
                ("terms", i_term, "powers"),
            )
