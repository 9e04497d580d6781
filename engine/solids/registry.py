"""The table of solids: one `Row` for each type, from which every other table is derived. `engine/registry.py` fills it.
A row has the functions of higher modules that implement an operation for the type; generic code looks up the function
that it needs. An empty field is an error that names the type (`refused`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np

from engine.errors import UnsupportedSolidError
from engine.solids.base import Solid, named
from engine.solids.mesh import Mesh
from engine.types import FloatArray

Where = tuple[str | int, ...]
Box = tuple[FloatArray, FloatArray, float]
"""(low (d,), high (d,), reach): of a ball low and high are its centre; reach: largest distance of a point of the solid
(of a ball: its centre) from (low + high) / 2."""


class BodyKind(IntEnum):
    """The table of a scene in which kernels find a body."""

    UNREADY = -1
    """In no table yet."""
    OTHER = 0
    """In no table: the exact fallback, or the solid's own locator, decides."""
    BALL = 1
    ROWS = 2
    MESH = 3
    BOX = 4
    """Its planes are also in the table of rows, for segment clipping."""
    RINGS = 5
    """A polygon or planar triangle."""


class Field(NamedTuple):
    """A field of a solid in JSON and files, named as in the constructor."""

    kind: str
    """Type of the value: number, position, rows, vertices, three, faces, rings, terms."""
    about: str
    """Meaning, as a sentence of the API's description."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What is known of one type of solid. Fields from `exact` on are functions; None: the operation refuses it."""

    solid: type[Solid]
    about: str
    """Definition of the point set, a sentence of the API's description."""
    fields: Mapping[str, Field] = field(default_factory=dict)
    """The fields in JSON, by name; none for a solid that is made of other solids."""
    example: Mapping[str, Any] | None = None
    stored: tuple[str, ...] = ()
    """The attributes that files store, in the order in which `solid.restored` takes them."""
    exact: Callable[[Any, Any, Any], int] | None = None
    """(point, solid, check) -> Location; point: exact numbers, in the solid's coordinates."""
    exact_posed: Callable[[Any, Any, Any, Any], int] | None = None
    """(point, solid, pose, check) -> Location, instead of `exact` where a pose does not map the point set: a ball keeps
    its radius."""
    locator: Callable[[Any], Any] | None = None
    """(solid) -> Locator; without it `exact` decides each point."""
    posed: Callable[[Any, Any], Any] | None = None
    """(solid, pose) -> Locator; without it `exact` decides each point."""
    box: Callable[[Any, Any], Box] | None = None
    """(solid, check) -> `Box`, from which boxes under poses are made; without it the solid counts as unbounded."""
    bounds: Callable[[Any, Any], Any] | None = None
    """(solid, budget) -> (Bounds, Accuracy)."""
    profile: Callable[[Any, Any], Any] | None = None
    """(line, solid) -> exact profile of a segment in the solid: `segment_clipping/profiles.py`."""
    n_faces: Callable[[Any], int] = lambda _: 1
    """(solid) -> number of faces, to which `SegmentPieces.faces` refers."""
    clip: Callable[[Any], Any] | None = None
    """(solid) -> the clipping `Plan`; without it `clip_segments` refuses the type."""
    hits: Callable[[Any, Any], Any] | None = None
    """(solid, budget) -> what `hits` needs of a mesh; without it `hits` refuses the type."""
    planes: Callable[[Any, Any], Any] | None = None
    """(solid, check) -> integer plane rows, to which polygons are clipped."""
    measure: Callable[[Any, Any], Any] | None = None
    """(solid, pose) -> `distance.point_measures.Measure`: distances of points."""
    volumes: Any = None
    """`Measures`: the functions for its volume, area and centroid."""
    kind: BodyKind = BodyKind.OTHER
    """The table of a scene in which kernels find a body of this type."""
    meets: Mapping[int, str] = field(default_factory=dict)
    """By dimension, how the solid takes part in collision: as a mesh (a `Mesh`), an outline (with vertices and
    ring_offsets), a box, sphere or half_space."""

    @property
    def name(self) -> str:
        """Name of the type in JSON and messages."""
        return self.solid.type

    @property
    def is_convex(self) -> bool:
        """Whether the type guarantees that a segment has at most one piece in a solid."""
        return self.kind in (BodyKind.BALL, BodyKind.ROWS, BodyKind.BOX)


_ROWS: Final[dict[str, Row]] = {}
solid_types: Final[Mapping[str, Row]] = MappingProxyType(_ROWS)
"""The rows by type name, in the order of messages."""
_BY_CLASS: Final[dict[type, Row]] = {}


def register(row: Row) -> None:
    """Add a row to the table. Raises: ValueError if its name or its class is there already."""
    if row.name in _ROWS or row.solid in _BY_CLASS:
        raise ValueError(f"there is a row for {row.name} already")
    if "mesh" in row.meets.values() and not issubclass(row.solid, Mesh):
        raise ValueError(f"a {row.name} meets others as a mesh, so its class must be a Mesh")
    _ROWS[row.name] = _BY_CLASS[row.solid] = row


def row_of(solid: object) -> Row:
    """Return the row of an object's class or of a base class; a row without functions for other objects."""
    rows = (_BY_CLASS[kind] for kind in type(solid).__mro__ if kind in _BY_CLASS)
    return _BY_CLASS.get(type(solid)) or next(rows, _NO_ROW)


def names(takes: Callable[[Row], object]) -> str:
    """Return the names of the types for whose row `takes` is true, joined by commas and "or"."""
    taken = [row.name for row in _ROWS.values() if takes(row)]
    return f"{', '.join(taken[:-1])} or {taken[-1]}" if len(taken) > 1 else "".join(taken)


def kind_of(solid: object) -> str:
    """Return the type name of a solid, or a phrase for an object that is no solid, for messages."""
    return solid.type if isinstance(solid, Solid) else f"{type(solid).__name__}, which is no solid"


def refused(
    solid: object, what: str, takes: Callable[[Row], object], more: str = "", where: Where = ()
) -> UnsupportedSolidError:
    """Return the error for a solid that an operation does not take: "<what> a <type>; give a <types whose rows it
    takes><more>". where: the path of the argument."""
    return UnsupportedSolidError(f"{what} {named(kind_of(solid))}; give {named(names(takes))}{more}", where)


def own_box(solid: Solid, check: Callable[[], object] | None = None) -> Box:
    """Return the `Box` of a solid that is not moved, infinite if it may be unbounded; check: see `Solid.prepared`."""
    box = row_of(solid).box
    return unbounded(solid) if box is None else box(solid, check)


def unbounded(solid: Solid) -> Box:
    """Return an infinite `Box` of the solid's dimension."""
    return np.full(solid.dimension, -np.inf), np.full(solid.dimension, np.inf), np.inf


_NO_ROW: Final = Row(solid=Solid, about="")
