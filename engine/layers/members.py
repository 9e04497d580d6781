"""What rows copy of GeoJSON features: properties, ids and the `crs`, written as JSON once; groups by properties."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final, NamedTuple, cast

import numpy as np

from engine.errors import InvalidInputError, NotFiniteError
from engine.layers.geojson import Collection, refused
from engine.layers.json_text import NotJsonError, key_of, text_of
from engine.layers.limits import Limits
from engine.layers.rows import NONE
from engine.running.budget import polled
from engine.types import IntArray

_NAME_BYTES: Final = 200
"""Bytes that a property name takes, with its entries in sets."""
_NOUNS: Final = {"properties": "a property", "id": "an id", "geometry": "a geometry"}


class _CopiedMembers(NamedTuple):
    """JSON texts that rows copy from n features: properties without the braces; ids: a comma and the member "id", or
    nothing; lengths (n + 1,) of both together, and of ids alone, the last 0 for feature -1 (none)."""

    properties: list[bytes]
    ids: list[bytes]
    n_bytes: IntArray
    id_bytes: IntArray


def crs_of(sides: list[Collection], limits: Limits) -> bytes | None:
    """Return the common member `crs` of the layers as JSON, None if none has it; raise if they differ."""
    there = [side for side in sides if side.crs is not None]
    with limits.budget() as budget:
        for side in there:
            try:
                text = text_of(side.crs)
            except NotJsonError as error:
                what = "holds infinity or NaN" if error.is_number else f"has no JSON ({error})"
                place = *side.where, "crs", *error.path
                raise _kind_of(error)(f"the crs of {side.where[0]} {what}; correct it", place) from None
            budget.take(len(text))
        if len(there) == 2 and key_of(there[0].crs) != key_of(there[1].crs):
            raise InvalidInputError("the crs of left and right differ; bring both layers into one", ("right", "crs"))
    return text_of(there[0].crs) if there else None


def _kind_of(error: NotJsonError) -> type[InvalidInputError]:
    return NotFiniteError if error.is_number else InvalidInputError


def texts_of(side: Collection, values: Iterable[Any], member: str, limits: Limits) -> list[bytes]:
    """Return values, one for each feature of a layer, as JSON texts. member: the member of the feature that they are of
    (properties, id, geometry), for messages."""
    texts: list[bytes] = []
    with limits.budget() as budget:
        for number, value in enumerate(values):
            budget.check()
            try:
                texts.append(text_of(value))
            except NotJsonError as error:
                why = "is infinite or NaN, which JSON cannot hold" if error.is_number else f"JSON cannot hold: {error}"
                path = error.path if member == "id" else (member, *error.path)
                raise refused(_kind_of(error), side, number, f"has {_NOUNS[member]} that {why}", path) from None
            budget.take(len(texts[-1]))
    return texts


def members_of(
    sides: list[Collection], names: tuple[str, ...], limits: Limits
) -> tuple[Callable[[int, int], bytes], Callable[[IntArray, IntArray], IntArray]]:
    """Return two functions of the pair of features (first, second) of a result row, -1 for none. The first returns the
    row's members besides type and geometry, as JSON; the second, for arrays of pairs, lower bounds on the lengths of
    these texts. names: of the members that say which features a row comes from."""
    columns: list[set[str]] = [set(), set()]
    with limits.budget() as budget:
        for side, column in zip(sides, columns):
            if "names" in side.kept:
                column.update(side.kept["names"])
                continue
            for each in polled(side.properties):
                n_before = len(column)
                column.update(each)
                budget.take(_NAME_BYTES * (len(column) - n_before))
            side.kept["names"] = column
        shared = columns[1] if sides[0].start is not None else columns[0] & columns[1]
        made: set[str] = set()
        twice: set[str] = set()
        for column, end in zip(columns, ("_1", "_2")):
            for name in polled(column):
                name += end * (name in shared)
                (twice if name in made else made).add(name)
    if twice:
        raise InvalidInputError(
            f"two properties would be named {min(twice)!r:.200}, as names that both layers have get _1 and _2; rename "
            "one",
            (),
        )
    nothing = Collection([], [], None, ())
    left, right = (_copied_members(side, shared, end, limits) for side, end in zip([*sides, nothing], ("_1", "_2")))
    first_number = sides[0].start or 0

    def members(first: int, second: int) -> bytes:
        inside, sources, ids = [], b"", b""
        for name, number, copied in zip(names, (first, second), (left, right)):
            if number != NONE:
                inside += [copied.properties[number]] if copied.properties[number] else []
                ids = copied.ids[number]
                shown_number = number + (first_number if copied is left else 0)
                sources += b',"%b":{"index":%d%b}' % (name.encode(), shown_number, ids)
        alone = ids[1:] + b"," if ids and NONE in (first, second) else b""
        return b'%b"properties":{%b}%b' % (alone, b",".join(inside), sources)

    def n_bytes(first: IntArray, second: IntArray) -> IntArray:
        alone = np.where((first == NONE) | (second == NONE), left.id_bytes[first] + right.id_bytes[second], 0)
        return alone + left.n_bytes[first] + right.n_bytes[second]

    return members, n_bytes


def _copied_members(side: Collection, shared: set[str], end: str, limits: Limits) -> _CopiedMembers:
    """Return the `_CopiedMembers` of a layer; property names in `shared` get the suffix `end`."""
    if (known := side.kept.get((end, *sorted(shared)))) is not None:
        return cast(_CopiedMembers, known)

    def renamed() -> Iterator[dict[str, Any]]:
        for each in side.properties:
            is_free = not shared or shared.isdisjoint(each)
            yield each if is_free else {name + end * (name in shared): value for name, value in each.items()}

    properties = [text[1:-1] for text in texts_of(side, renamed(), "properties", limits)]
    ids = texts_of(side, ({"id": each["id"]} if "id" in each else {} for each in side.features), "id", limits)
    ids = [b"," + text[1:-1] if len(text) > 2 else b"" for text in ids]
    id_bytes = np.array([*map(len, ids), 0], np.int64)
    n_bytes = np.array([*map(len, properties), 0], np.int64) + id_bytes
    made = side.kept[(end, *sorted(shared))] = _CopiedMembers(properties, ids, n_bytes, id_bytes)
    return made


def groups_of(side: Collection, names: list[str], limits: Limits) -> tuple[IntArray, list[dict[int, bytes]]]:
    """Return (groups, values): the group (n,) of each feature by its values of the properties `names`, and by group its
    values, as JSON by index in `names`, null ones left out. Groups are numbered in the order of their first features.
    """
    places = {name: place for place, name in enumerate(names)}
    order: dict[Any, int] = {} if names else {(): 0}
    values: list[dict[int, bytes]] = [] if names else [{}]
    groups = np.zeros(len(side.features), np.int64)
    with limits.budget() as budget:
        for number, each in enumerate(polled(side.properties if names else ())):
            few, many = (each, places) if len(each) < len(places) else (places, each)
            given = sorted((places[name], each[name]) for name in few if name in many and each[name] is not None)
            try:
                key = tuple((place, key_of(value)) for place, value in given)
            except (TypeError, RecursionError) as error:
                raise InvalidInputError(f"by compares a value that JSON cannot hold: {error}", ("by",)) from None
            groups[number] = order.setdefault(key, len(values))
            if groups[number] == len(values):
                values.append({place: text_of(value) for place, value in given})
                budget.take(_NAME_BYTES * (1 + len(given)) + sum(map(len, values[-1].values())))
    return groups, values
