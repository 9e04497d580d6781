"""GeoJSON (RFC 7946) in a question: as a solid, and in place of points, segments, lines and polygons."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Final, Literal, NamedTuple

from pydantic import ConfigDict, Field, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationError, WithJsonSchema
from pydantic_core import PydanticCustomError, core_schema

from service.errors import faults_of_validation
from service.schemas.arrays import Fault, Path, limit_sentence
from service.schemas.base import Schema, optional, with_example

_MEMBERS: Final = {"GeometryCollection": "geometries", "FeatureCollection": "features"}
_DEEPEST: Final = 32
ALSO: Final = "x-also-accepts"
"""In a schema or a body: what may stand in its place."""
_RING: Final = [[0, 0], [4, 0], [4, 3], [0, 3], [0, 0]]


class FromGeoJson(NamedTuple):
    """What a field holds where the question had GeoJSON in its place; a third number of a position is an altitude."""

    value: Any
    name: str = ""


class GeoJsonSolid(Schema):
    """GeoJSON: a Polygon, a MultiPolygon, or a Feature or collection of these; all parts are united, and altitudes (the
    third numbers of positions) are left out, which `accuracy` says."""

    model_config = ConfigDict(**{**with_example({"type": "MultiPolygon", "coordinates": [[_RING]]}), "extra": "allow"})

    type: Literal["Polygon", "MultiPolygon", "GeometryCollection", "Feature", "FeatureCollection"] = Field(
        description="Which of GeoJSON's objects it is; the others have their members beside it."
    )
    coordinates: Annotated[Any, WithJsonSchema({"type": "array", "items": {}})] = optional(
        "Of a Polygon its rings, of a MultiPolygon lists of rings, as RFC 7946 has them.", [[_RING]]
    )

    def sent(self) -> dict[str, Any]:
        """Return the object as it was sent."""
        return {name: value for name, value in self if value is not None}


def _or_geojson(array: dict[str, Any], *own: str) -> dict[str, Any]:
    """Return the schema of an array that has the schema of what may stand in its place. A union of the two would take
    the array from clients that openapi-generator makes: in TypeScript an object alone is left."""
    kinds = {"type": "string", "enum": [*own, *_MEMBERS, *(["Feature"] if own else [])]}
    text = f"GeoJSON (RFC 7946): {' or '.join(own) or 'a collection with a polygon a member'}."
    return {**array, ALSO: {"type": "object", "description": text, "properties": {"type": kinds}, "required": ["type"]}}


class OrGeoJson:
    """Annotation of a field that GeoJSON of two types, or a collection of these, may stand for: Point and MultiPoint
    for positions, and so on."""

    def __init__(self, one: str) -> None:
        self._one = one

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        read = _read_polygons if self._one == "Polygon" else self._read
        return core_schema.with_info_wrap_validator_function(read, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        if self._one == "Polygon":
            return _or_geojson(handler(schema))
        return _or_geojson(handler(schema), self._one, f"Multi{self._one}")

    def _read(
        self, value: Any, handler: core_schema.ValidatorFunctionWrapHandler, info: core_schema.ValidationInfo
    ) -> Any:
        if not isinstance(value, dict):
            return handler(value)
        gathered: list[Any] = []
        places: list[Path] = []
        for place, geometry in _geometries(value, (), _DEEPEST):
            if info.context is not None:
                info.context.remaining()
            kind, own = geometry.get("type"), (*place, "coordinates")
            if kind not in (self._one, f"Multi{self._one}"):
                found = f"{kind!r:.60}" if isinstance(kind, str) else "no type of GeoJSON"
                raise _fault((*place, "type"), f"expected GeoJSON of type {self._one} or Multi{self._one}, got {found}")
            at: Any = geometry.get("coordinates")
            at = at.tolist() if hasattr(at, "tolist") else at
            if not isinstance(at, list):
                raise _fault(own, "expected the coordinates of GeoJSON, a list")
            gathered += [at] if kind == self._one else at
            places += [own] if kind == self._one else [(*own, number) for number in range(len(at))]
        try:
            lists = [each.tolist() if hasattr(each, "tolist") else each for each in gathered]
            return FromGeoJson(handler(lists), "points" if self._one == "Point" else "lines")
        except ValidationError as error:
            faults = [
                each._replace(path=(*places[int(each.path[0])], *each.path[1:])) if each.path else each
                for each in error.errors()[0]["ctx"]["faults"]
            ]
            raise PydanticCustomError("numbers", "{detail}", {"detail": faults[0].detail, "faults": faults}) from None


def _geometries(value: dict[str, Any], where: Path, depth: int) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Yield the geometries of a GeoJSON object with their paths."""
    kind = value.get("type")
    if not isinstance(kind, str) or kind not in (*_MEMBERS, "Feature"):
        yield where, value
        return
    if depth == 0:
        raise _fault((*where, "type"), f"GeoJSON is nested more than {_DEEPEST} levels deep here; flatten it")
    member = _MEMBERS.get(kind, "geometry")
    inner = value.get(member)
    if kind != "Feature" and not isinstance(inner, list):
        raise _fault((*where, member), f"{member} of a {kind} must be a list")
    for number, each in enumerate([inner] if kind == "Feature" else inner or ()):
        place = (*where, member) if kind == "Feature" else (*where, member, number)
        if not isinstance(each, dict):
            raise _fault(place, f"expected an object of GeoJSON in {member} of a {kind}; leave an empty one out")
        yield from _geometries(each, place, depth - 1)


class OrMembers:
    """Annotation of a list of solids that a FeatureCollection or GeometryCollection may stand for."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.with_info_wrap_validator_function(self._read, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return _or_geojson(handler(schema))

    def _read(
        self, value: Any, handler: core_schema.ValidatorFunctionWrapHandler, info: core_schema.ValidationInfo
    ) -> Any:
        if not isinstance(value, dict):
            return handler(value)
        member = _MEMBERS.get(str(value.get("type")), "")
        if not isinstance(value.get(member), list):
            raise _fault((), "expected a list of polygons, or a FeatureCollection or GeometryCollection of GeoJSON")
        try:
            return FromGeoJson(handler(value[member]), member)
        except ValidationError as error:
            raise _at(error, value[member], (member,)) from None


def _read_polygons(
    value: Any, handler: core_schema.ValidatorFunctionWrapHandler, info: core_schema.ValidationInfo
) -> Any:
    """Return the members of a collection, or of a list of which some are GeoJSON, with their paths."""
    items: Any
    path: Path
    if isinstance(value, dict) and "type" in value:
        member = _MEMBERS.get(str(value["type"]), "")
        items, path = value.get(member), (member,)
    elif isinstance(value, list) and dict in map(type, value):
        items, path = value, ()
    else:
        return handler(value)
    if not isinstance(items, list):
        raise _fault((), "expected a list of polygons, or a FeatureCollection or GeometryCollection of GeoJSON")
    limit = len(items) if info.context is None else info.context.settings.max_polygons
    if len(items) > limit:
        raise _fault((), limit_sentence("max_polygons", limit, len(items)), "limit_exceeded")
    made = []
    for number, each in enumerate(items):
        place = (*path, number)
        try:
            made.append((place, each if isinstance(each, dict) else handler([each])[0]))
        except ValidationError as error:
            raise _at(error, [each], place, n_left_out=1) from None
    return FromGeoJson(made)


def _at(error: ValidationError, value: Any, place: Path, n_left_out: int = 0) -> PydanticCustomError:
    """Return the error of a part of the request, with the part's place. value: what was checked; n_left_out: parts of
    its paths, the first ones, that the place stands for."""
    faults = [fault._replace(path=(*place, *fault.path[n_left_out:])) for fault in faults_of_validation(error, value)]
    return PydanticCustomError("numbers", "{detail}", {"detail": faults[0].detail, "faults": faults})


def _fault(path: Path, detail: str, code: str = "invalid_array") -> PydanticCustomError:
    return PydanticCustomError("numbers", "{detail}", {"detail": detail, "faults": [Fault(path, code, detail)]})
