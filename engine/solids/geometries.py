"""GeoJSON (RFC 7946) as dicts, or as objects have it under `__geo_interface__`: what geometries it holds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from engine.errors import InvalidArrayError, InvalidInputError

_PLAIN: Final = ("Point", "MultiPoint", "LineString", "MultiLineString", "Polygon", "MultiPolygon")
_MEMBERS: Final = {"GeometryCollection": "geometries", "Feature": "geometry", "FeatureCollection": "features"}
"""Where collections have what they are made of."""
_DEEPEST: Final = 32


def geometry_of(value: Any) -> Mapping[str, Any] | None:
    """Return the GeoJSON object that a value is or has, None if there is none."""
    if not isinstance(value, Mapping):
        value = getattr(value, "__geo_interface__", None)
    kind = value.get("type") if isinstance(value, Mapping) else None
    return value if isinstance(kind, str) and (kind in _PLAIN or kind in _MEMBERS) else None


def geometries_in(value: Mapping[str, Any], depth: int = _DEEPEST) -> Iterator[Mapping[str, Any]]:
    """Yield the plain geometries of a GeoJSON object, those within collections and features too, null left out."""
    kind = value.get("type")
    if not isinstance(kind, str) or kind not in (*_PLAIN, *_MEMBERS) or not depth:
        raise InvalidInputError(f"{kind!r:.60} is no geometry of GeoJSON that is accepted here", ("type",))
    if kind in _PLAIN:
        yield value
        return
    member = _MEMBERS[kind]
    inner = value.get(member)
    for each in [inner] if kind == "Feature" else inner if isinstance(inner, (list, tuple)) else [value]:
        if each is not None:
            if not isinstance(each, Mapping) or each is value:
                raise InvalidInputError(f"{member} of a {kind} must be GeoJSON, got {type(inner).__name__}", (member,))
            yield from geometries_in(each, depth - 1)


def coordinates_of(geometry: Mapping[str, Any]) -> Any:
    """Return the coordinates of a plain geometry. Raises: InvalidArrayError where they are no list."""
    at = geometry.get("coordinates")
    if not hasattr(at, "__len__") or isinstance(at, (str, bytes, Mapping)):
        raise InvalidArrayError(
            f"coordinates must be nested lists of positions, got {type(at).__name__}", ("coordinates",)
        )
    return at


def positions_in(value: Any) -> list[Any] | None:
    """Return the positions of GeoJSON points, or of a list of objects that are such; None for what is no GeoJSON."""
    return _gathered(value, "Point", "MultiPoint")


def lines_in(value: Any) -> list[Any] | None:
    """Return the lines of GeoJSON LineStrings, a list of positions each; None for what is no GeoJSON."""
    return _gathered(value, "LineString", "MultiLineString")


def _gathered(value: Any, one: str, many: str) -> list[Any] | None:
    if isinstance(value, (list, tuple)) and len(value) and geometry_of(value[0]) is not None:
        value = {"type": "GeometryCollection", "geometries": [geometry_of(each) or {} for each in value]}
    geometry = geometry_of(value)
    if geometry is None:
        return None
    gathered: list[Any] = []
    for each in geometries_in(geometry):
        if each["type"] not in (one, many):
            raise InvalidInputError(f"a {each['type']} is given where {one}s are expected", ("type",))
        at = coordinates_of(each)
        gathered += [at] if each["type"] == one else list(at)
    return gathered
