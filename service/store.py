"""Solids kept between requests, named by their content; the least recently used leave when the budget is used up.

The store holds engine objects, so structures prepared for one request serve the next. The name of a solid is a hash
over a version tag, its type and its arrays as little-endian bytes, each with its shape: equal input has equal names in
every process, so replicas agree without talking. -0.0 is 0.0 (the engine made it so), a CSG tree hashes the names of
its operands, a scene
those of its solids, and the poses of its bodies.

With a folder (disk.py) the memory holds what was used last, and the folder more, for other processes and after a start.
"""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from engine import Scene, Solid
from service.disk import Folder, pose_rows, stored
from service.errors import ServiceError
from service.metrics import Metrics

VERSION: Final = b"exact-geometry/1"
"""Changes when the meaning of any stored field does."""


Kept = Solid | Scene


def solid_id(solid: Kept, known: dict[int, str] | None = None) -> str:
    """Return the name of `solid`: 64 hexadecimal digits.

    known: names by `id` of the solids in the tree: each is hashed once, however often it stands there.
    """
    known = {} if known is None else known
    if id(solid) not in known:
        digest = hashlib.sha256()
        for part in _parts(solid, known):
            digest.update(len(part).to_bytes(8, "little"))
            digest.update(part)
        known[id(solid)] = digest.hexdigest()
    return known[id(solid)]


def _parts(solid: Any, known: dict[int, str]) -> Iterator[Any]:
    yield VERSION
    yield solid.type.encode()
    if solid.type == "scene":
        yield from (solid_id(body, known).encode() for body in solid.solids)
        yield np.ascontiguousarray(pose_rows(solid), "<f8").tobytes()
        return
    if solid.type == "csg":
        yield solid.operation.encode()
        yield from (solid_id(operand, known).encode() for operand in solid.operands)  # depth: capped by the engine
        return
    for name in stored(solid.type)[1]:
        array = np.asarray(getattr(solid, name))
        little = np.ascontiguousarray(array, "<f8" if array.dtype.kind == "f" else "<i8")
        yield f"{name}:{little.dtype.str}:{array.shape}".encode()
        yield little.reshape(-1).view(np.uint8).data


class Store:
    """A dictionary of solids and scenes by name with a budget of bytes; safe to share between threads."""

    def __init__(
        self, budget: int, folder: Path | None = None, folder_budget: int = 2**40, metrics: Metrics | None = None
    ) -> None:
        self._budget = budget
        self._metrics = metrics or Metrics()
        self._folder = None if folder is None else Folder(folder, folder_budget, solid_id)
        self._solids: OrderedDict[str, Kept] = OrderedDict()
        self._sizes: dict[str, int] = {}
        self._looked: dict[str, int] = {}
        self._total = 0
        self._lock = threading.Lock()

    def put(self, solid: Kept) -> tuple[str, bool]:
        """Keep `solid`, which may be a scene; return its name and whether it is new. Those used longest ago leave if
        there is no room."""
        name, size = solid_id(solid), solid.memory
        if size > self._budget:
            raise ServiceError(
                "limit_exceeded",
                f"the {'scene' if isinstance(solid, Scene) else 'solid'} takes {size} bytes and the whole store "
                f"{self._budget}; raise GEOMETRY_STORE_BYTES",
            )
        is_new_file = self._folder is not None and self._folder.put(name, solid)
        _, is_new_here = self._keep(name, solid)
        return name, is_new_here if self._folder is None else is_new_file

    def get(self, name: str) -> Solid:
        """Return the solid called `name`; `unknown_solid` if it is not here (any more)."""
        found = self._get(name)
        if isinstance(found, Solid):
            return found
        raise ServiceError("unknown_solid", f"no solid {name[:64]!r} is stored here; put it again: POST /v1/solids")

    def get_scene(self, name: str) -> Scene:
        """Return the scene called `name`; `unknown_scene` if it is not here (any more)."""
        found = self._get(name)
        if isinstance(found, Scene):
            return found
        raise ServiceError("unknown_scene", f"no scene {name[:64]!r} is stored here; put it again: POST /v1/scenes")

    def _get(self, name: str) -> Kept | None:
        with self._lock:
            found = self._solids.get(name)
            if found is not None:
                self._use(name, self._size_now(name, found))
                self._metrics.hits["memory"].inc()
                return found
        found = None if self._folder is None else self._folder.get(name)
        self._metrics.hits["nowhere" if found is None else "folder"].inc()
        return None if found is None else self._keep(name, found)[0]

    def _size_now(self, name: str, found: Kept) -> int:
        """Return the bytes of what is kept, structures that have been prepared since included. To count those of a
        scene takes a microsecond a body, so it is done at its first, second, fourth, ... use."""
        if isinstance(found, Solid):
            return found.memory
        uses = self._looked[name] = self._looked.get(name, 0) + 1
        return self._sizes[name] if uses & (uses - 1) else found.memory

    def _keep(self, name: str, solid: Kept) -> tuple[Kept, bool]:
        """Return the one object called `name` that all threads share, and whether it is `solid`, new here."""
        with self._lock:
            is_new = name not in self._solids
            kept = self._solids.setdefault(name, solid)
            self._use(name, kept.memory)
            return kept, is_new

    def _use(self, name: str, size: int) -> None:
        """Count `size` for `name`, make it the last to leave, and let others go while there are too many bytes."""
        self._solids.move_to_end(name)
        self._total += size - self._sizes.get(name, 0)
        self._sizes[name] = size
        while self._total > self._budget and len(self._solids) > 1:
            oldest, _ = self._solids.popitem(last=False)
            self._total -= self._sizes.pop(oldest)
            self._looked.pop(oldest, None)
            self._metrics.evicted.inc()
        self._metrics.stored.set(len(self._solids))
        self._metrics.stored_bytes.set(self._total)
