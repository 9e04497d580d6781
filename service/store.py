"""Solids kept between requests, named by their content; the least recently used leave when the budget is used up.

The store holds engine objects, so structures prepared for one request serve the next. The name of a solid is a hash
over a version tag, its type and its arrays as little-endian bytes, each with its shape: equal input has equal names in
every process, so replicas agree without talking. -0.0 is 0.0 (the engine made it so), a CSG tree hashes the names of
its operands.
"""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict
from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from engine import Solid
from service.errors import ServiceError

VERSION: Final = b"exact-geometry/1"
"""Changes when the meaning of any stored field does."""

_FIELDS: Final[dict[str, tuple[str, ...]]] = {
    "half_space": ("normal", "offset"),
    "sphere": ("center", "radius"),
    "aabb": ("min", "max"),
    "convex": ("planes",),
    "triangle": ("vertices",),
    "polygon": ("vertices", "ring_offsets"),
    "polyhedron": ("vertices", "face_offsets", "face_indices"),
    "surface": ("vertices", "face_offsets", "face_indices"),
    "implicit": ("powers", "coefficients"),
}


def solid_id(solid: Solid) -> str:
    """Return the name of `solid`: 64 hexadecimal digits."""
    digest = hashlib.sha256()
    for part in _parts(solid):
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return digest.hexdigest()


def _parts(solid: Any) -> Iterator[Any]:
    yield VERSION
    yield solid.type.encode()
    if solid.type == "csg":
        yield solid.operation.encode()
        yield from (solid_id(operand).encode() for operand in solid.operands)  # depth: capped by the engine
        return
    for name in _FIELDS[solid.type]:
        array = np.asarray(getattr(solid, name))
        little = np.ascontiguousarray(array, "<f8" if array.dtype.kind == "f" else "<i8")
        yield f"{name}:{little.dtype.str}:{array.shape}".encode()
        yield little.reshape(-1).view(np.uint8).data


class Store:
    """A dictionary of solids by name with a budget of bytes; safe to share between threads."""

    def __init__(self, budget: int) -> None:
        self._budget = budget
        self._solids: OrderedDict[str, Solid] = OrderedDict()
        self._sizes: dict[str, int] = {}
        self._total = 0
        self._lock = threading.Lock()

    def put(self, solid: Solid) -> tuple[str, bool]:
        """Keep `solid`; return its name and whether it is new. Those used longest ago leave if there is no room."""
        name, size = solid_id(solid), solid.memory
        if size > self._budget:
            raise ServiceError(
                "limit_exceeded",
                f"the solid takes {size} bytes and the whole store {self._budget}; raise GEOMETRY_STORE_BYTES",
            )
        with self._lock:
            is_new = name not in self._solids
            if is_new:
                self._solids[name] = solid
            self._use(name, size)
        return name, is_new

    def get(self, name: str) -> Solid:
        """Return the solid called `name`; `unknown_solid` if it is not here (any more)."""
        with self._lock:
            solid = self._solids.get(name)
            if solid is None:
                raise ServiceError(
                    "unknown_solid", f"no solid {name[:64]!r} is stored here; put it again: POST /v1/solids"
                )
            self._use(name, solid.memory)  # structures may have been prepared since
            return solid

    def _use(self, name: str, size: int) -> None:
        """Count `size` for `name`, make it the last to leave, and let others go while there are too many bytes."""
        self._solids.move_to_end(name)
        self._total += size - self._sizes.get(name, 0)
        self._sizes[name] = size
        while self._total > self._budget and len(self._solids) > 1:
            oldest, _ = self._solids.popitem(last=False)
            self._total -= self._sizes.pop(oldest)
