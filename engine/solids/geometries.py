"""GeoJSON (RFC 7946) as dicts, or as objects have it under `__geo_interface__`: what geometries it holds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

from engine.errors import EngineError, InvalidArrayError, InvalidInputError
from engine.running.budget import note, polled

_PLAIN: Final = ("Point", "MultiPoint", "LineString", "MultiLineString", "Polygon", "MultiPolygon")
MEMBERS: Final = {"GeometryCollection": "geometries", "Feature": "geometry", "FeatureCollection": "features"}
"""Where collections have what they are made of."""
_DEEPEST: Final = 32
_MOST_REPEATED: Final = 1 << 20
"""Members that are walked of lists that were walked before: a few shared lists within each other have 2^31 of them."""
_NEVER: Final = frozenset({list, tuple, float, int, str, np.ndarray})


def geometry_of(value: Any) -> Mapping[str, Any] | None:
    """Return the GeoJSON object that a value is or has, None if there is none."""
    if type(value) in _NEVER:
        return None
    try:
        if not isinstance(value, Mapping):
            value = getattr(value, "__geo_interface__", None)
        kind = value.get("type") if isinstance(value, Mapping) else None
    except EngineError:
        raise
    except Exception as error:  # whatever a caller's property raises
        raise InvalidInputError(
            f"a {type(value).__name__} does not give its GeoJSON: {type(error).__name__}"
        ) from error
    return value if isinstance(kind, str) and (kind in _PLAIN or kind in MEMBERS) else None


Path = tuple[str | int, ...]


def geometries_in(value: Mapping[str, Any], where: Path = (), once: bool = False) -> Iterator[tuple[Path, Any]]:
    """Yield the plain geometries of a GeoJSON object with their paths, those within collections and features too, and
    None for each that is null. once: what is there several times is walked only once."""
    return _walked(value, where, _DEEPEST, dict[int, Any](), once)


def _walked(
    value: Mapping[str, Any], where: Path, depth: int, walked: dict[int, Any], once: bool
) -> Iterator[tuple[Path, Any]]:
    """Do the work of `geometries_in` below the path `where`. depth: of nesting so far. walked: lists of members already
    walked, by id, and under 0 how many members stood in lists that came again."""
    kind = value.get("type")
    if isinstance(kind, str) and kind in _PLAIN:
        yield where, value
        return
    if depth == 0 or not isinstance(kind, str) or kind not in MEMBERS:
        what = repr(kind[:60]) if isinstance(kind, str) else "no text"
        raise InvalidInputError(f"type is {what}: no geometry of GeoJSON that is taken here", (*where, "type"))
    member = MEMBERS[kind]
    inner: Any = value.get(member)
    if kind != "Feature" and not isinstance(inner, (list, tuple)):
        raise InvalidInputError(
            f"{member} of a {kind} must be GeoJSON, a list, got {type(inner).__name__}", (*where, member)
        )
    if kind != "Feature":
        if id(inner) in walked:
            walked[0] = walked.get(0, 0) + 1 + len(inner)
            if once:
                return
            if walked[0] > _MOST_REPEATED:
                raise InvalidInputError(
                    f"collections that are there several times have more than {_MOST_REPEATED} members together; "
                    "give each geometry once",
                    where,
                )
        walked[id(inner)] = inner
    for number, each in enumerate(polled([inner] if kind == "Feature" else inner)):
        place = (*where, member) if kind == "Feature" else (*where, member, number)
        if each is None:
            yield place, None
        elif isinstance(each, Mapping):
            yield from _walked(each, place, depth - 1, walked, once)
        else:
            raise InvalidInputError(f"{member} of a {kind} must be GeoJSON, got {type(each).__name__}", place)


def coordinates_of(geometry: Mapping[str, Any], where: Path = ()) -> Any:
    """Return the coordinates of a plain geometry. Raises: InvalidArrayError where they are no list."""
    return as_list(geometry.get("coordinates"), (*where, "coordinates"))


def as_list(value: Any, where: Path) -> Any:
    """Return a list, tuple or array of one axis or more. Raises: InvalidArrayError for anything else."""
    if not isinstance(value, (list, tuple)) and not (isinstance(value, np.ndarray) and value.ndim):
        got = "null" if value is None else f"a value of type {type(value).__name__}"
        raise InvalidArrayError(f"coordinates must be nested lists of positions, got {got}", where)
    return value


def note_altitude(name: str | int) -> None:
    """Say that the third numbers of an argument's positions were left out."""
    note(f"{name}: altitudes, the third numbers of GeoJSON's positions, are left out of a question of the plane")


def positions_in(value: Any) -> list[Any] | None:
    """Return the positions of GeoJSON points, or of a list of objects that are such; None for what is no GeoJSON."""
    return _gathered(value, "Point", "MultiPoint")


def lines_in(value: Any) -> list[Any] | None:
    """Return the lines of GeoJSON LineStrings, a list of positions each; None for what is no GeoJSON."""
    return _gathered(value, "LineString", "MultiLineString")


def _gathered(value: Any, one: str, many: str) -> list[Any] | None:
    listed = type(value) is list or type(value) is tuple
    if listed and (not value or type(value[0]) in _NEVER):
        return None
    if listed and geometry_of(value[0]) is not None:
        geometries: Iterator[tuple[Path, Any]] = (
            inner for k, each in enumerate(value) for inner in geometries_in(geometry_of(each) or {}, (k,))
        )
    else:
        geometry = geometry_of(value)
        if geometry is None:
            return None
        geometries = geometries_in(geometry)
    gathered: list[Any] = []
    for place, each in geometries:
        if each is None:
            raise InvalidInputError(f"a geometry is null where {one}s are expected; leave its row out", place)
        if each["type"] not in (one, many):
            raise InvalidInputError(f"a {each['type']} is given where {one}s are expected", (*place, "type"))
        at = coordinates_of(each, place)
        gathered += [at] if each["type"] == one else list(at)
    return gathered
