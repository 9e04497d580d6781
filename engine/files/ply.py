"""Reads PLY: text, or binary of either order of bytes. Source: G. Turk, The PLY polygon file format, 1994."""

from __future__ import annotations

import re
import struct
from typing import IO, Any, Final, NamedTuple

import numpy as np

from engine.running.budget import polled
from engine.types import FloatArray

_TYPES: Final = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}  # fmt: skip
_ORDERS: Final = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_LISTS: Final = ("vertex_indices", "vertex_index")


class _Property(NamedTuple):
    name: str
    kind: str
    length: str
    """Type of the number of items of a list, empty for a single value."""


def read_ply(file: IO[bytes]) -> tuple[FloatArray, Any]:
    """Return vertices and faces of a PLY file; other elements and properties are passed over."""
    octets = file.read()
    head = re.match(rb"ply\s.*?^end_header[ \t]*\r?\n", octets, re.DOTALL | re.MULTILINE)
    if head is None:
        raise ValueError("it has no header from ply to end_header")
    words = [line.split() for line in head[0].decode("ascii", "replace").splitlines()]
    order = next((_ORDERS[each[1]] for each in words if each[:1] == ["format"] and each[1] in _ORDERS), None)
    elements: list[tuple[str, int, list[_Property]]] = []
    for line in words:
        if line[:1] == ["element"]:
            elements.append((line[1], int(line[2]), []))
        elif line[:2] == ["property", "list"]:
            if _TYPES[line[2]][0] == "f":
                raise ValueError(f"the number of items of {line[4]} must be of a type of whole numbers")
            elements[-1][2].append(_Property(line[4], _TYPES[line[3]], _TYPES[line[2]]))
        elif line[:1] == ["property"]:
            elements[-1][2].append(_Property(line[2], _TYPES[line[1]], ""))
    body, at = octets[head.end() :], 0
    lines = body.split(b"\n") if order == "" else []
    if order == "" and b"_" in body:
        raise ValueError("its text has more than numbers")
    elements_by_name: dict[str, dict[str, Any]] = {}
    for name, n, properties in elements:
        if n < 0 or n > len(body) or order is None:
            raise ValueError(f"{n} items of {name} are more than the file has, or its format is unknown")
        if order == "":
            elements_by_name[name] = _from_text(lines[at : at + n], n, properties)
            at += n
        else:
            elements_by_name[name], at = _from_octets(body, at, n, properties, order)
    vertices, faces = elements_by_name.get("vertex", {}), elements_by_name.get("face", {})
    if not {*"xyz"} <= vertices.keys():
        raise ValueError("it has no element vertex with the properties x, y and z")
    lists = {
        each.name: each for name, _, properties in elements if name == "face" for each in properties if each.length
    }
    corners = next((lists[name] for name in (*_LISTS, *lists) if name in lists), None)
    if corners is not None and corners.kind[0] == "f":
        raise ValueError(f"the corners of faces, {corners.name}, must be of a type of whole numbers")
    made = [] if corners is None else faces[corners.name]
    return np.column_stack([vertices[axis] for axis in "xyz"]).astype(np.float64), made


def _from_text(lines: list[bytes], n: int, properties: list[_Property]) -> dict[str, Any]:
    """Return the properties of the items of an element, one a line."""
    rows = [line.split() for line in polled(lines)]
    if len(rows) < n:
        raise ValueError(f"{n} items announced, {len(rows)} there")
    if not any(each.length for each in properties):
        table = np.array([row[: len(properties)] for row in rows], np.bytes_).reshape(n, len(properties))
        return {each.name: table[:, k].astype(np.float64) for k, each in enumerate(properties)}
    made: dict[str, Any] = {each.name: [] for each in properties}
    for row in polled(rows):
        at = 0
        for each in properties:
            size = int(row[at]) if each.length else 1
            at += bool(each.length)
            if at + size > len(row) or size < 0:
                raise ValueError(f"a line ends before its {each.name}")
            number = float if each.kind[0] == "f" else int
            values = [number(word) for word in row[at : at + size]]
            made[each.name].append(values if each.length else values[0])
            at += size
    return {each.name: made[each.name] if each.length else np.array(made[each.name]) for each in properties}


def _from_octets(body: bytes, at: int, n: int, properties: list[_Property], order: str) -> tuple[dict[str, Any], int]:
    """Return the properties of the items of an element that begins at a byte, and where the next one does."""
    sizes = [0] * len(properties)
    place = at
    for k, each in enumerate(properties):  # of the first item: mostly all lists are as long as its
        if each.length and n:
            sizes[k] = int(np.frombuffer(body, order + each.length, 1, place)[0])
            place += np.dtype(each.length).itemsize
        place += np.dtype(each.kind).itemsize * (sizes[k] if each.length else 1)
    fields: list[Any] = []
    for k, each in enumerate(properties):
        fields += [(f"n{k}", order + each.length)] if each.length else []
        fields.append((f"v{k}", order + each.kind, (sizes[k],)) if each.length else (f"v{k}", order + each.kind))
    kind = np.dtype(fields)
    if at + n * kind.itemsize <= len(body):
        table = np.frombuffer(body, kind, n, at)
        if all((table[f"n{k}"] == sizes[k]).all() for k, each in enumerate(properties) if each.length):
            made = {each.name: table[f"v{k}"] for k, each in enumerate(properties)}
            return {name: rows.astype(np.int64) if rows.ndim == 2 else rows for name, rows in made.items()}, (
                at + n * kind.itemsize
            )
    codes = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}
    lists: dict[str, list[Any]] = {each.name: [] for each in properties}
    for _ in polled(range(n)):
        for each in properties:
            size = 1
            if each.length:
                (size,) = struct.unpack_from(order + codes[each.length], body, at)
                at += np.dtype(each.length).itemsize
            if size < 0 or size > len(body):
                raise ValueError(f"a list of {size} items")
            values = struct.unpack_from(f"{order}{size}{codes[each.kind]}", body, at)
            at += struct.calcsize(f"{order}{size}{codes[each.kind]}")
            lists[each.name].append(list(values) if each.length else values[0])
    return {each.name: lists[each.name] if each.length else np.array(lists[each.name]) for each in properties}, at
