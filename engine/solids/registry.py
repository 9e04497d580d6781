"""The one table of solids: a row for each type. `engine/registry.py` fills it; every other table is derived from it.

A row names the functions of floors above that implement an operation for the type; generic code looks up the cell that
it needs. An empty cell is an error that names the type (`refused`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np

from engine.errors import UnsupportedSolidError
from engine.solids.base import Solid
from engine.solids.mesh import Mesh
from engine.types import FloatArray

Where = tuple[str | int, ...]
Box = tuple[FloatArray, FloatArray, float]
"""Low and high (d,), of a ball those of its centre, and the largest distance of a point from the computed middle."""


class BodyKind(IntEnum):
    """The table of a scene in which kernels look up a body."""

    UNREADY = -1
    """Not prepared yet."""
    OTHER = 0
    """No table: the exact fallback, or its own locator, decides."""
    BALL = 1
    ROWS = 2
    MESH = 3
    BOX = 4
    """Its planes are also rows, for segment clipping."""
    RINGS = 5
    """In 2D."""


class Field(NamedTuple):
    """A field of a solid, as its constructor, JSON and files name it."""

    kind: str
    """Type of the value: number, position, rows, vertices, three, faces, rings, terms."""
    about: str
    """Meaning, as a sentence of the API's description."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What is known of one type of solid. Cells from `exact` on are functions, None if the operation refuses the
    type."""

    solid: type[Solid]
    about: str
    """The set of points that it is, in a sentence of the API's description."""
    fields: Mapping[str, Field] = field(default_factory=dict)
    """What JSON writes, by name; none where the solid is made of other solids."""
    example: Mapping[str, Any] | None = None
    stored: tuple[str, ...] = ()
    """The attributes whose values, in this order, `solid.restored` takes back: what files hold."""
    exact: Callable[[Any, Any, Any], int] | None = None
    """(point, solid, check) -> Location; point: exact numbers, in the solid's own frame."""
    exact_posed: Callable[[Any, Any, Any, Any], int] | None = None
    """(point, solid, pose, check) -> Location, where a pose does not map the set: a ball keeps its radius."""
    locator: Callable[[Any], Any] | None = None
    """(solid) -> Locator; without it `exact` decides each point."""
    posed: Callable[[Any, Any], Any] | None = None
    """(solid, pose) -> Locator; without it `exact` decides each point."""
    box: Callable[[Any, Any], Box] | None = None
    """(solid, check) -> the box that poses move; without it the solid counts as unbounded."""
    bounds: Callable[[Any, Any], Any] | None = None
    """(solid, budget) -> (Bounds, Accuracy)."""
    profile: Callable[[Any, Any], Any] | None = None
    """(line, solid) -> profile of a segment in the solid, exactly: `segment_clipping/profiles.py`."""
    n_faces: Callable[[Any], int] = lambda _: 1
    """(solid) -> number of faces that pieces of segments may name."""
    clip: Callable[[Any], Any] | None = None
    """(solid) -> the clipping `Plan`; without it `clip_segments` refuses the type."""
    planes: Callable[[Any, Any], Any] | None = None
    """(solid, check) -> the integer plane rows to which polygons are clipped."""
    kind: BodyKind = BodyKind.OTHER
    """The table of scenes that it is in."""
    meets: Mapping[int, str] = field(default_factory=dict)
    """By dimension, as what it meets others: mesh (a `Mesh`), outline (with vertices and ring_offsets, as a polygon),
    box, sphere or half_space."""

    @property
    def name(self) -> str:
        """Name of the type in JSON and messages."""
        return self.solid.type

    @property
    def is_convex(self) -> bool:
        """Whether a segment has at most one piece for certain."""
        return self.kind in (BodyKind.BALL, BodyKind.ROWS, BodyKind.BOX)


_ROWS: Final[dict[str, Row]] = {}
solid_types: Final[Mapping[str, Row]] = MappingProxyType(_ROWS)
"""The rows by the name of their type, in the order of messages."""
_BY_CLASS: Final[dict[type, Row]] = {}


def register(row: Row) -> None:
    """Add a row. Raises: ValueError where its name or its class has one."""
    if row.name in _ROWS or row.solid in _BY_CLASS:
        raise ValueError(f"there is a row for {row.name} already")
    if "mesh" in row.meets.values() and not issubclass(row.solid, Mesh):
        raise ValueError(f"a {row.name} meets others as a mesh, so its class must be a Mesh")
    _ROWS[row.name] = _BY_CLASS[row.solid] = row


def row_of(solid: object) -> Row:
    """Return the row of a solid's class or of the class it inherits from; an empty row for others."""
    rows = (_BY_CLASS[kind] for kind in type(solid).__mro__ if kind in _BY_CLASS)
    return _BY_CLASS.get(type(solid)) or next(rows, _NO_ROW)


def names(takes: Callable[[Row], object]) -> str:
    """Return the names of the types whose row has a cell, as a sentence lists them."""
    taken = [row.name for row in _ROWS.values() if takes(row)]
    return f"{', '.join(taken[:-1])} or {taken[-1]}" if len(taken) > 1 else "".join(taken)


def kind_of(solid: object) -> str:
    """Return the name of a solid's type, or of a value given in its place, for messages."""
    return solid.type if isinstance(solid, Solid) else f"{type(solid).__name__}, which is no solid"


def refused(
    solid: object, what: str, takes: Callable[[Row], object], more: str = "", where: Where = ()
) -> UnsupportedSolidError:
    """Return the error for a solid that an operation refuses; what: the sentence up to the solid."""
    kind = kind_of(solid)
    article = "an" if kind[0] in "aeiou" else "a"
    return UnsupportedSolidError(f"{what} {article} {kind}; give a {names(takes)}{more}", where)


def own_box(solid: Solid, check: Callable[[], object] | None = None) -> Box:
    """Return the box of a solid without a pose, infinite if it may be unbounded; check: as for `Solid.prepared`."""
    box = row_of(solid).box
    return unbounded(solid) if box is None else box(solid, check)


def unbounded(solid: Solid) -> Box:
    """Return an infinite box."""
    return np.full(solid.dimension, -np.inf), np.full(solid.dimension, np.inf), np.inf


_NO_ROW: Final = Row(solid=Solid, about="")
