"""Base of all solids: immutable fields, a cache of prepared structures, pickling, memory.

A solid is checked once, in its constructor, and never changes; it is compared by value and may be shared between
threads. Structures that speed up queries are built lazily by `prepared` and are not pickled.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Any, ClassVar, Final, TypeVar, cast

import numpy as np

from engine.solids.columns import are_equal, key_of

T = TypeVar("T")

_WAIT: Final = 0.005
"""Seconds between two checks of a caller that waits while another thread builds a structure."""
_RUNTIME = ("__weakref__", "_lock", "_prepared")  # slots that are no part of a solid's value


def named(kind: str) -> str:
    """Return the name of a type with its article: a sphere, an aabb."""
    return f"{'an' if kind[:1] in 'aeiou' else 'a'} {kind}"


class Immutable:
    """Base of classes whose fields are set once, by the constructor; `type` is the class's name in messages."""

    __slots__ = ()

    type: ClassVar[str]

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{named(self.type)} is immutable: make a new one instead of setting {name!r}")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"{named(self.type)} is immutable: {name!r} cannot be deleted")


class Preparing:
    """Base of classes with a cache of structures that are built at first use; subclasses set `_lock`, an RLock, and
    `_prepared`, {}."""

    __slots__ = ()

    _lock: Any
    _prepared: dict[str, Any]

    def prepared(self, key: str, build: Callable[[], T], check: Callable[[], object] | None = None) -> T:
        """Return the structure cached under `key`, built at first use; other threads wait for a build in progress.

        build: called without arguments, at most once unless it raises (then nothing is cached and the next caller tries
        again). It may use other keys. Its result must not be changed afterwards. check: called every few milliseconds
        while another thread builds; what it raises ends the waiting.
        """
        try:
            structure: T = self._prepared[key]
            return structure
        except KeyError:
            pass
        if check is None:
            self._lock.acquire()
        else:
            while not self._lock.acquire(timeout=_WAIT):  # bound: the build ends, or check raises
                check()
        try:
            if key not in self._prepared:
                self._prepared[key] = build()
            return cast(T, self._prepared[key])
        finally:
            self._lock.release()

    def cached(self, key: str) -> Any:
        """Return the structure cached under `key`, or None."""
        return self._prepared.get(key)

    def drop(self, *keys: str) -> None:
        """Remove the structures under these keys from the cache."""
        with self._lock:
            for key in keys:
                self._prepared.pop(key, None)


class Solid(Preparing, Immutable):
    """Base of the ten solids.

    Attributes
    ----------
    type : str
        The name used in JSON.
    dimension : int
        2 or 3.
    """

    __slots__ = (*_RUNTIME, "dimension")

    dimension: int
    _pickled: ClassVar[tuple[str, ...]] = ()
    """Names of the fields in a pickle: the constructor's arguments, unless `restored` takes others."""

    def _set(self, **values: object) -> None:
        """Set the fields by name, once; called at the end of a constructor, after all checks."""
        if hasattr(self, "_prepared"):
            raise AttributeError(f"{named(self.type)} is immutable: make a new one instead of calling __init__ again")
        for name, value in values.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "_lock", threading.RLock())
        object.__setattr__(self, "_prepared", {})

    @property
    def memory(self) -> int:
        """Bytes of the solid's arrays: fields and prepared structures, shared arrays counted once."""
        sizes: dict[int, int] = {}
        _collect_arrays(self, sizes, set())
        return sum(sizes.values())

    @classmethod
    def _fields(cls) -> list[str]:
        """Return the names of the fields on which the value of a solid of this class depends."""
        names = [name for owner in cls.__mro__ for name in getattr(owner, "__slots__", ())]
        return [name for name in names if name not in _RUNTIME]

    def __reduce__(self) -> tuple[Callable[..., Solid], tuple[Any, ...]]:
        return type(self).restored, tuple(getattr(self, name) for name in self._pickled)

    @classmethod
    def restored(cls, *values: Any) -> Solid:
        """Return the solid from the values in a pickle, checked as by the constructor, since kernels trust offsets and
        indices."""
        return cls(*values)

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if type(self) is not type(other) or not self._pickled:
            return NotImplemented
        return all(are_equal(getattr(self, name), getattr(other, name)) for name in self._pickled)

    def __hash__(self) -> int:
        known = self._prepared.get("hash")
        if known is None:  # without the lock: whoever builds a structure may hold it for long, and all hash alike
            values = (getattr(self, name) for name in self._pickled or ("_lock",))
            known = self._prepared["hash"] = hash((self.type, *map(key_of, values)))
        return int(known)

    def __copy__(self) -> Solid:
        return self

    def __deepcopy__(self, _memo: object) -> Solid:
        return self


def _collect_arrays(start: object, sizes: dict[int, int], seen: set[int]) -> None:
    """Add to sizes, a dict from id to bytes, every array reachable from `start`; views count as their base. seen: ids
    of the objects visited."""
    waiting = [start]
    while waiting:  # bound: each object enters once, by its id
        value = waiting.pop()
        if id(value) in seen:
            continue
        seen.add(id(value))
        if isinstance(value, np.ndarray):
            owner = value
            while isinstance(owner.base, np.ndarray):
                owner = owner.base
            sizes[id(owner)] = owner.nbytes
        elif isinstance(value, Solid):
            waiting += [getattr(value, name) for name in value._fields()]
            waiting += list(value._prepared.values())
        elif isinstance(value, dict):
            waiting += list(value.values())
        elif isinstance(value, (tuple, list)):
            waiting += [item for item in value if not isinstance(item, (int, float, str))]
        elif is_dataclass(value) and not isinstance(value, type):
            waiting += [getattr(value, field.name) for field in fields(value)]
        elif isinstance(own := getattr(value, "memory", None), int):
            sizes[id(value)] = own
