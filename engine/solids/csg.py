"""Boolean combinations of solids: union, intersection, difference."""

from __future__ import annotations

from typing import ClassVar, Final

from engine.errors import (
    InvalidArrayError,
    InvalidOperationError,
    TooComplexError,
    TooDeepError,
    UnsupportedSolidError,
    WrongDimensionError,
)
from engine.solids.base import Solid
from engine.solids.checks import check_not_empty, shown

OPERATIONS: Final = ("union", "intersection", "difference")
MAX_DEPTH: Final = 100
"""Largest number of nested `Csg` solids."""
MAX_LEAVES: Final = 1_000_000
"""Largest number of leaves, a shared one counted once for each path to it: sharing could double them at every level."""


class Csg(Solid):
    """A Boolean combination of solids, three-valued.

    Parameters
    ----------
    operation : {"union", "intersection", "difference"}
        Union is the max of its operands, intersection the min, difference ``min(A, -B)``.
    operands : sequence of Solid
        One or more of one dimension, for "difference" exactly two: A and what is taken away from it. Any solid but a
        surface, Csg too, up to 100 deep.

    Raises
    ------
    InvalidArrayError, InvalidOperationError, EmptyGeometryError, WrongDimensionError, UnsupportedSolidError,
    TooDeepError
        For arguments that break a rule.
    TooComplexError
        The tree has too many leaves.

    Notes
    -----
    Boundary: a label, not necessarily the topological boundary: where a point lies on the boundary of two operands it
    is BOUNDARY, even if the combination is solid or void all around it.

    Examples
    --------
    >>> from engine.solids.primitives import Sphere
    >>> Csg("difference", [Sphere([0, 0], 2), Sphere([0, 0], 1)])
    Csg('difference', 2 operands, 2D)
    """

    __slots__ = ("depth", "n_leaves", "operands", "operation")

    type: ClassVar[str] = "csg"
    _pickled: ClassVar[tuple[str, ...]] = ("operation", "operands")
    operation: str
    operands: tuple[Solid, ...]
    depth: int
    """Number of nested `Csg` solids, this one included."""
    n_leaves: int
    """Number of leaves, a shared one counted once for each path to it."""

    def __init__(self, operation: str, operands: object) -> None:
        if not isinstance(operation, str) or operation not in OPERATIONS:
            raise InvalidOperationError(
                f"operation must be one of {', '.join(OPERATIONS)}, got {shown(operation)}", ("operation",)
            )
        if not isinstance(operands, (list, tuple)):
            raise InvalidArrayError(f"operands must be a list of solids, got {type(operands).__name__}", ("operands",))
        check_not_empty(len(operands), "solid", ("operands",))
        if operation == "difference" and len(operands) != 2:
            raise InvalidOperationError(
                f"difference takes exactly two operands, A and what is taken away, got {len(operands)}; "
                "unite what is to be taken away",
                ("operands",),
            )
        for i_operand, operand in enumerate(operands):
            _check_operand(i_operand, operand, operands[0])
        depth = 1 + max(operand.depth if isinstance(operand, Csg) else 0 for operand in operands)
        if depth > MAX_DEPTH:
            raise TooDeepError(
                f"the tree is {depth} Csg levels deep, the limit is {MAX_DEPTH}; flatten it", ("operands",)
            )
        n_leaves = sum(operand.n_leaves if isinstance(operand, Csg) else 1 for operand in operands)
        if n_leaves > MAX_LEAVES:
            raise TooComplexError(f"the tree has {n_leaves} leaves, the limit is {MAX_LEAVES}; split it", ("operands",))
        self._set(
            dimension=operands[0].dimension,
            operation=str(operation),
            operands=tuple(operands),
            depth=depth,
            n_leaves=n_leaves,
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Csg):
            return NotImplemented
        waiting: list[tuple[Solid, Solid]] = [(self, other)]
        seen: set[tuple[int, int]] = set()  # operands may be shared: each pair is compared once
        while waiting:
            one, another = waiting.pop()
            if one is another or (id(one), id(another)) in seen:
                continue
            seen.add((id(one), id(another)))
            if isinstance(one, Csg) and isinstance(another, Csg):
                if one.operation != another.operation or len(one.operands) != len(another.operands):
                    return False
                waiting += zip(one.operands, another.operands)
            elif one != another:
                return False
        return True

    __hash__ = Solid.__hash__

    def __repr__(self) -> str:
        return f"Csg({self.operation!r}, {len(self.operands)} operands, {self.dimension}D)"


def _check_operand(i_operand: int, operand: object, first: Solid) -> None:
    """Raise unless `operand` is a solid with an interior, of the dimension of `first`."""
    where = ("operands", i_operand)
    if not isinstance(operand, Solid):
        raise InvalidArrayError(f"operands[{i_operand}] must be a solid, got {type(operand).__name__}", where)
    if operand.type == "surface":
        raise UnsupportedSolidError(
            f"operands[{i_operand}] is a surface, which has no inside; close it and use a polyhedron", where
        )
    if operand.dimension != first.dimension:
        raise WrongDimensionError(
            f"operands[{i_operand}] is {operand.dimension}D, operands[0] {first.dimension}D; use one dimension", where
        )
