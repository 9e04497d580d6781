"""Content-addressed store of solids between requests; the least recently used are evicted when the budget is used up.

The store holds engine objects, so structures prepared for one request serve the next. The name of a solid is a hash
over a version tag, its type and its arrays as little-endian bytes, each with its shape: equal input has equal names in
every process, so replicas agree without talking. -0.0 is 0.0 (the engine made it so), a CSG tree hashes the names of
its operands, a scene those of its solids, and the poses of its bodies.

With a folder, which replicas may share over a common volume, the memory holds what was used last, and the folder more.
A file is named by its solid and written under another name first, so that a name never leads to half a file; one that
is damaged all the same is detected when it is read, since its name is a hash of the content: it is not served, but
deleted. The least recently used files are evicted when the folder grows beyond its budget. Errors of the system become
`store_full` or `store_unavailable`; what is no file, a pipe for example, is never waited for.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import io
import json
import logging
import os
import re
import stat
import tempfile
import threading
import time
from collections import OrderedDict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np

import engine
from engine import Scene, Solid
from service.errors import ServiceError
from service.metrics import Metrics

log = logging.getLogger("service")

_NAME: Final = re.compile(r"[0-9a-f]{64}")
_PARTIAL: Final = ".part"
_STALE_SECONDS: Final = 3600.0
"""Age from which a partial file is abandoned."""

_FULL: Final = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_READ: Final = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)


@contextlib.contextmanager
def _as_store_errors(path: Path) -> Iterator[None]:
    """Convert errors of the system to those of the service."""
    try:
        yield
    except OSError as error:
        log.error("the store folder %s: %s", path, error)
        reason = error.strerror or type(error).__name__
        if error.errno in _FULL:
            detail = f"the store folder has no room ({reason}); send the solid with each request, or try again later"
            raise ServiceError("store_full", detail) from None
        detail = f"the store folder cannot be used ({reason}); send the solid with the request, or try again later"
        raise ServiceError("store_unavailable", detail) from None


class Folder:
    """Writes, reads and evicts files of solids; safe to share between threads and processes."""

    def __init__(self, path: Path, budget: int) -> None:
        self._path = path
        self._budget = budget
        self._written = 0  # bytes since the folder was last looked through
        self._lock = threading.Lock()
        path.mkdir(parents=True, exist_ok=True)
        self._shrink()

    def put(self, name: str, solid: Solid | Scene) -> bool:
        """Write `solid` unless it is there; return whether it is new. It is on the disk when this returns.

        Raises: `store_full`, `store_unavailable`.
        """
        final = self._path / name
        with _as_store_errors(self._path):
            if self._touch(final):
                return False
            octets = to_octets(solid)
            handle, partial = tempfile.mkstemp(_PARTIAL, name[:8], self._path)
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(octets)
                    file.flush()
                    os.fsync(file.fileno())
                os.replace(partial, final)
            except BaseException:
                with contextlib.suppress(OSError):
                    os.unlink(partial)
                raise
            self._sync()
        with self._lock:
            self._written += len(octets)
            is_time = self._written > self._budget // 16
        if is_time:
            with _as_store_errors(self._path):
                self._shrink()
        return True

    def get(self, name: str) -> Solid | Scene | None:
        """Return the solid called `name`, or None if no file has it.

        Raises: `store_unavailable`, `unsupported_solid`.
        """
        if _NAME.fullmatch(name) is None:
            return None
        path = self._path / name
        with _as_store_errors(path):
            octets = _content(path)
        if octets is None:
            return None
        try:
            solid = from_octets(octets)
        except ServiceError:  # a file of a later version: other processes of the volume read it
            raise
        except Exception as error:  # whatever damaged bytes lead to
            solid, reason = None, f"{type(error).__name__}: {error}"
        if solid is None or solid_id(solid) != name:
            log.warning(
                "the file %s is damaged (%s) and taken away", path, reason if solid is None else "another solid"
            )
            with contextlib.suppress(OSError):  # another user's
                path.unlink(missing_ok=True)
            return None
        self._touch(path)
        return solid

    def _touch(self, path: Path) -> bool:
        """Mark the file as used now; return whether it is there."""
        try:
            if not stat.S_ISREG(path.lstat().st_mode):
                return False
            with contextlib.suppress(PermissionError):  # another user's file on a shared volume
                os.utime(path)
        except FileNotFoundError:
            return False
        return True

    def _sync(self) -> None:
        """Flush the folder entry, if a folder can be opened (not on Windows)."""
        with contextlib.suppress(OSError):
            handle = os.open(self._path, os.O_RDONLY)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)

    def _shrink(self) -> None:
        """Delete abandoned partial files, and the least recently used files beyond the budget."""
        with self._lock:
            self._written = 0
        result = []
        for entry in os.scandir(self._path):
            with contextlib.suppress(OSError):  # another process took it away
                status = entry.stat()
                if entry.name.endswith(_PARTIAL) and time.time() - status.st_mtime > _STALE_SECONDS:
                    os.unlink(entry.path)
                elif _NAME.fullmatch(entry.name):
                    result.append((status.st_mtime, status.st_size, entry.path))
        total = sum(size for _, size, _ in result)
        for _, size, path in sorted(result):
            if total <= self._budget:
                break
            with contextlib.suppress(OSError):
                os.unlink(path)
            total -= size


def _content(path: Path) -> bytes | None:
    """Return the content of a file, None if there is none, or something else in its place."""
    try:
        handle = os.open(path, _READ)
    except FileNotFoundError:
        return None
    except OSError as error:
        if error.errno in (errno.ELOOP, errno.ENXIO):  # a link, a socket
            return None
        raise
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        return None
    with os.fdopen(handle, "rb") as file:
        return file.read()


def to_octets(solid: Solid | Scene) -> bytes:
    """Return the file of `solid`: an npz archive of its arrays, and once of each solid it consists of, operands
    first."""
    arrays: dict[str, Any] = {}
    nodes: list[dict[str, Any]] = []
    _add_node(solid, nodes, arrays, {})
    file = io.BytesIO()
    np.savez(file, nodes=np.frombuffer(json.dumps(nodes).encode(), np.uint8), **arrays)
    return file.getvalue()


def _add_node(solid: Any, nodes: list[dict[str, Any]], arrays: dict[str, Any], places: dict[int, int]) -> int:
    """Add `solid` to the nodes, unless it is there; return its place. places: by `id`. Depth: capped by the engine."""
    if id(solid) in places:
        return places[id(solid)]
    node: dict[str, Any] = {"type": solid.type}
    if solid.type == "csg":
        operands = [_add_node(operand, nodes, arrays, places) for operand in solid.operands]
        node |= {"operation": solid.operation, "operands": operands}
    elif solid.type == "scene":
        node |= {"solids": [_add_node(body, nodes, arrays, places) for body in solid.solids], "poses": "poses"}
        arrays["poses"] = pose_rows(solid)
    else:
        for field in stored(solid.type)[1]:
            node[field] = f"array_{len(arrays)}"
            arrays[node[field]] = np.asarray(getattr(solid, field))
    nodes.append(node)
    places[id(solid)] = len(nodes) - 1
    return len(nodes) - 1


def pose_rows(scene: Scene) -> Any:
    """Return rotation and translation of each body, the identity's for a body without a pose."""
    dimension = scene.solids[0].dimension
    none = np.concatenate([np.eye(dimension).ravel(), np.zeros(dimension)])
    rows = [none if pose is None else [*pose.rotation.ravel(), *pose.translation] for pose in scene.poses]
    return np.array(rows).reshape(len(scene), -1)


def _posed(row: Any, dimension: int) -> engine.Pose | None:
    pose = engine.Pose(row[: dimension**2].reshape(dimension, dimension), row[dimension**2 :])
    return None if pose.is_identity else pose


def from_octets(octets: bytes) -> Solid | Scene:
    """Return the solid or scene in a file; raises any error if it is damaged."""
    made: list[Any] = []
    with np.load(io.BytesIO(octets), allow_pickle=False) as arrays:
        for node in json.loads(arrays["nodes"].tobytes()):
            if node["type"] == "csg":
                made.append(engine.Csg(node["operation"], [made[place] for place in node["operands"]]))
            elif node["type"] == "scene":
                solids = [made[place] for place in node["solids"]]
                poses = [_posed(row, solids[0].dimension) for row in arrays[node["poses"]]]
                return Scene(solids, poses)
            else:
                kind, names = stored(node["type"])
                values = [arrays[node[name]] for name in names]
                made.append(kind.restored(*(value if value.ndim else value.item() for value in values)))
    result: Solid = made[-1]
    return result


def stored(kind: str) -> tuple[type[Solid], tuple[str, ...]]:
    """Return the class of a type and its stored attributes; `unsupported_solid` if it has none.

    Csg and scenes consist of solids.
    """
    row = engine.solid_types.get(kind)
    if row is not None and row.stored:
        return row.solid, row.stored
    raise ServiceError(
        "unsupported_solid",
        f"this version of the service stores no solid of type {kind[:64]!r}; send it with each request, or let every "
        "service of the store folder run the version that wrote it",
    )


VERSION: Final = b"exact-geometry/1"
"""Changes when the meaning of any stored field does."""

Stored = Solid | Scene
K = TypeVar("K", Solid, Scene)


def solid_id(solid: Stored, known: dict[int, str] | None = None) -> str:
    """Return the name of `solid`: 64 hexadecimal digits.

    known: names by `id` of the solids in the tree: each is hashed once, however often it occurs.
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
    """A dictionary of solids and scenes by name with a budget of bytes; thread-safe."""

    def __init__(
        self, budget: int, folder: Path | None = None, folder_budget: int = 2**40, metrics: Metrics | None = None
    ) -> None:
        self._budget = budget
        self._metrics = metrics or Metrics()
        self._folder = None if folder is None else Folder(folder, folder_budget)
        self._solids: OrderedDict[str, Stored] = OrderedDict()
        self._sizes: dict[str, int] = {}
        self._looked: dict[str, int] = {}
        self._total = 0
        self._lock = threading.Lock()

    def put(self, solid: Stored) -> tuple[str, bool]:
        """Store `solid`, which may be a scene; return its name and whether it is new. May evict the least recently
        used."""
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
        return self._of_kind(name, Solid, "solid")

    def get_scene(self, name: str) -> Scene:
        """Return the scene called `name`; `unknown_scene` if it is not here (any more)."""
        return self._of_kind(name, Scene, "scene")

    def _of_kind(self, name: str, kind: type[K], what: str) -> K:
        if isinstance(result := self._get(name), kind):
            return result
        detail = f"no {what} {name[:64]!r} is stored here; put it again: POST /v1/{what}s"
        raise ServiceError(f"unknown_{what}", detail)

    def _get(self, name: str) -> Stored | None:
        with self._lock:
            entry = self._solids.get(name)
            if entry is not None:
                self._use(name, self._size_now(name, entry))
                self._metrics.hits["memory"].inc()
                return entry
        entry = None if self._folder is None else self._folder.get(name)
        self._metrics.hits["nowhere" if entry is None else "folder"].inc()
        return None if entry is None else self._keep(name, entry)[0]

    def _size_now(self, name: str, entry: Stored) -> int:
        """Return the bytes of an entry, with the structures prepared since.

        Counting those of a scene takes a microsecond a body, so it is done at its first, second, fourth, ... use.
        """
        if isinstance(entry, Solid):
            return entry.memory
        uses = self._looked[name] = self._looked.get(name, 0) + 1
        return self._sizes[name] if uses & (uses - 1) else entry.memory

    def _keep(self, name: str, solid: Stored) -> tuple[Stored, bool]:
        """Return the one object called `name` that all threads share, and whether it is `solid`, new here."""
        with self._lock:
            is_new = name not in self._solids
            stored = self._solids.setdefault(name, solid)
            self._use(name, stored.memory)
            return stored, is_new

    def _use(self, name: str, size: int) -> None:
        """Count `size` for `name`, mark it most recently used, and evict others while there are too many bytes."""
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
