"""Public: compares the exact answer with the textbook's plain float64 one, on the caller's own data."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from engine.collision.collide import collide
from engine.containment.locate import locate
from engine.errors import (
    InvalidInputError,
    InvalidOperationError,
    TooComplexError,
    UnsupportedSolidError,
    WrongDimensionError,
)
from engine.polygon_clipping.clip_polygons import clip_polygons
from engine.running.budget import Budget, Cancel
from engine.segment_clipping.clip_segments import clip_segments
from engine.solids.base import Solid
from engine.solids.checks import as_floats, shown
from engine.types import Accuracy, BoolArray, FloatArray, IntArray, Relation

Compared = Literal["contains", "collide", "clip_segments", "clip_polygons"]
STEPS: Final = 1 << 19
"""Steps of the textbook's method between two polls of the deadline: some milliseconds."""
MOST_STEPS: Final = 1 << 24
"""Largest number of steps for one item, which nothing interrupts: a second or so."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """Both answers, the time of each, and where they differ.

    Attributes
    ----------
    method : str
        The textbook's method.
    methods : tuple of str
        All methods that the textbook has for this question.
    exact : ndarray
        For each item whether it is contained, collides or is left; of segments rows of both ends, NaN where removed.
    plain : ndarray
        The same in plain float64.
    differing : ndarray of int64
        Items that plain float64 decides wrongly, ascending.
    inexact : ndarray of int64
        Items decided rightly, with a coordinate that is not the double nearest to the exact one, ascending.
    seconds_exact, seconds_plain : float
        For all items.
    accuracy : Accuracy
        Of the exact answer.
    """

    method: str
    methods: tuple[str, ...]
    exact: BoolArray | FloatArray
    plain: BoolArray | FloatArray
    differing: IntArray
    inexact: IntArray
    seconds_exact: float
    seconds_plain: float
    accuracy: Accuracy

    def __repr__(self) -> str:
        wrong, off = len(self.differing), len(self.inexact)
        return f"<Comparison: {self.method}, {wrong:,} of {len(self.exact):,} wrong, {off:,} inexact>"


def compare(
    operation: Compared,
    *arguments: Any,
    method: str | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
) -> Comparison:
    """Answer a question exactly and by the textbook's plain float64 method.

    Parameters
    ----------
    operation : {"contains", "collide", "clip_segments", "clip_polygons"}
        "contains" (points, solid), "collide" (first, second), "clip_segments" (segments, region) or "clip_polygons" (an
        ``(n, size, dim)`` array of polygons of one ring, region).
    *arguments
        Those of the engine's function of that name.
    method : str, optional
        One of the textbook's methods for this question; the first by default. A wrong name lists them.
    deadline, cancel
        As for `locate`. One pair of bodies is not interrupted, but refused if it is too large.

    Returns
    -------
    Comparison
        Both answers, the time of each, and the items on which they differ.

    Raises
    ------
    InvalidOperationError, UnsupportedSolidError, WrongDimensionError, TooComplexError
        The question, solid or size is not taken.
    EngineError
        As the engine's function.

    Notes
    -----
    Both are asked about one item before, so that kernels are loaded, and then timed on all.

    Boundary: what is on the boundary is contained, bodies that touch collide, a segment that touches is kept.

    Degenerate input: as the engine's function takes it; the textbook's methods give whatever they give.

    Accuracy: the exact answer is exact, coordinates correctly rounded; the other has no bound at all.

    Cost: that of both methods; those of the textbook pass over all faces for every point.

    References
    ----------
    The textbook, section 22.4, file by file in `engine.textbook`.

    Examples
    --------
    >>> from engine import HalfSpace, compare
    >>> both = compare("contains", [[0.1, 0.3], [0.1, 0.2]], HalfSpace([3.0, -1.0], 0.0))
    >>> both.method, both.exact.tolist(), both.plain.tolist(), both.differing.tolist()
    ('half-space', [True, True], [True, True], [])
    """
    if not isinstance(operation, str) or operation not in OPERATIONS:
        raise InvalidOperationError(
            f"cannot compare {shown(operation)}; one of {', '.join(OPERATIONS)}", ("operation",)
        )
    from engine.textbook import methods as textbook  # whoever compares nothing does not load it

    exactly, of = OPERATIONS[operation]
    deadline = Budget(deadline, cancel).deadline  # checks both
    if len(arguments) != 2:
        raise InvalidInputError(f"compare takes two arguments for {operation}, got {len(arguments)}", ("arguments",))
    items, second = arguments
    for solid in arguments if operation == "collide" else arguments[1:]:
        if not isinstance(solid, Solid):
            raise InvalidInputError(f"{operation} takes a solid here, got {shown(solid)}", ("arguments",))
    methods = textbook.of_pairs(items, second) if operation == "collide" else getattr(textbook, of)(second)
    if not methods:
        place = {"contains": "solid", "collide": "second"}.get(operation, "region")
        raise UnsupportedSolidError(f"the textbook has no method for {operation} with {second.type}", (place,))
    name = next(iter(methods)) if method is None else method
    if not isinstance(name, str) or name not in methods:
        raise InvalidOperationError(f"no method {shown(name)} here; one of {', '.join(methods)}", ("method",))
    ask, n_steps = methods[name]
    if n_steps > MOST_STEPS:
        raise TooComplexError(f"{n_steps:,} steps for the textbook's method; at most {MOST_STEPS:,}", ("second",))
    end = None if deadline is None else time.monotonic() + deadline

    def limits() -> dict[str, Any]:
        return {"report": True, "cancel": cancel, "deadline": None if end is None else end - time.monotonic()}

    with Budget(deadline, cancel) as budget:
        if operation == "collide":
            ask()
            plainly: Callable[[], Any] = lambda: np.array([ask()])  # noqa: E731
        else:
            items = _as_items(items, second.dimension, 2 if operation == "contains" else 3)
            exactly(items[:1], second, limits())
            ask(items[:1])
            plainly = lambda: _in_parts(ask, n_steps, budget, items)  # noqa: E731
        started = time.perf_counter()
        exact, accuracy = exactly(items, second, limits())
        middle = time.perf_counter()
        plain = plainly()
        ended = time.perf_counter()
    differing, inexact = _differences(exact, plain)
    return Comparison(
        name, tuple(methods), exact, plain, differing, inexact, middle - started, ended - middle, accuracy
    )


def _as_items(items: Any, dimension: int, n_axes: int) -> FloatArray:
    array = as_floats(items, n_axes, ("items",))
    if array.shape[-1] != dimension:
        wanted = "(n, dim)" if n_axes == 2 else "(n, size, dim)"
        raise WrongDimensionError(f"expected {wanted} with dim = {dimension}, got shape {array.shape}")
    return array


def _in_parts(ask: Callable[..., Any], n_steps: int, budget: Budget, items: FloatArray) -> Any:
    """Return the concatenated answers of `ask` for consecutive parts of items (n, ...); the deadline is polled in
    between. n_steps: steps that `ask` takes for one item, which decides the size of the parts."""
    size, answers = max(1, STEPS // max(n_steps, 1)), []
    for start in range(0, max(len(items), 1), size):
        budget.check()
        answers.append(ask(items[start : start + size]))
    return np.concatenate(answers)


def _differences(exact: Any, plain: Any) -> tuple[IntArray, IntArray]:
    """Return the indices of items whose decisions differ between two answers, and of those where only coordinates
    differ. exact, plain: decisions (n,), which have no coordinates; or coordinates (n, k), where a row with NaN means
    that nothing is left."""
    if exact.ndim == 1:
        return np.flatnonzero(exact != plain), np.empty(0, np.int64)
    is_left, as_plain = ~np.isnan(exact).any(axis=1), ~np.isnan(plain).any(axis=1)
    return np.flatnonzero(is_left != as_plain), np.flatnonzero(is_left & as_plain & (exact != plain).any(axis=1))


def _contains(points: Any, solid: Solid, limits: dict[str, Any]) -> tuple[Any, Accuracy]:
    locations, accuracy = locate(points, solid, **limits)
    return locations >= 0, accuracy


def _collide(first: Solid, second: Solid, limits: dict[str, Any]) -> tuple[Any, Accuracy]:
    result, accuracy = collide(first, second, boolean=True, **limits)
    return np.array([result.relation != Relation.DISJOINT]), accuracy


def _clip_segments(segments: Any, region: Solid, limits: dict[str, Any]) -> tuple[Any, Accuracy]:
    pieces, accuracy = clip_segments(segments, region, **limits)
    rows = np.full((len(segments), 2 * region.dimension), np.nan)
    rows[pieces.source] = np.hstack([pieces.start, pieces.end])
    return rows, accuracy


def _clip_polygons(polygons: Any, region: Solid, limits: dict[str, Any]) -> tuple[Any, Accuracy]:
    clipped, accuracy = clip_polygons(polygons, region, **limits)
    return np.diff(clipped.polygon_offsets) > 0, accuracy


OPERATIONS: Final[dict[str, tuple[Callable[..., tuple[Any, Accuracy]], str]]] = {
    "contains": (_contains, "of_points"),
    "collide": (_collide, "of_pairs"),
    "clip_segments": (_clip_segments, "of_segments"),
    "clip_polygons": (_clip_polygons, "of_polygons"),
}
"""By operation: the exact function, and the name of the function of `engine.textbook.methods`."""
