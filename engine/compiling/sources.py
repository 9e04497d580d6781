"""Which sources compiled code is of: a digest of a module, of all engine modules below it, and of the tools.

Code of sources that cannot be read, that changed since they were imported, or whose bytecode is of other sources, is
not stored (kernel_cache.py): a line in the log says so.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import logging
import os
import platform
import re
import sys
from importlib.abc import InspectLoader
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from typing import Any

import numba
from numba import config as numba_config

log = logging.getLogger(__name__)

_ROOT = Path(__file__).resolve().parents[1]
PREFIX = __name__.removesuffix("engine.compiling.sources")
"""Prefix of our modules' names: nothing, or ``exact_geometry.`` if `engine` is another package's."""
_STORING = {"engine.compiling.kernel_cache", "engine.compiling.sources"}
"""Modules that decide how and where code is stored, which does not change it."""
_OPTIONS = (
    *("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "LLVM_REFPRUNE_PASS", "LLVM_REFPRUNE_FLAGS", "DEBUGINFO_DEFAULT"),
    *("BOUNDSCHECK", "EXTEND_VARIABLE_LIFETIMES", "USING_SVML", "LLVM_PASS_TIMINGS"),
)
"""Options of numba's configuration that change the code; the CPU is part of each kernel's key."""

_IMPORT = re.compile(
    r"^[ \t]*(?:from\s+engine([.\w]*)\s+import\s+(\([^)]*\)|[^\n]*)|import\s+engine([.\w]+))", re.MULTILINE
)


def _stamp(path: str) -> tuple[int, ...]:
    status = os.stat(path)
    return status.st_mtime_ns, status.st_ctime_ns, status.st_size, status.st_ino


def _stamps() -> dict[str, tuple[int, ...]]:
    """Return times, size and inode of each file of the engine, to detect later changes."""
    archive = getattr(__spec__.loader, "archive", None)  # a zip file
    folders = os.walk(os.path.dirname(os.path.dirname(__file__)))
    paths = (os.path.join(folder, name) for folder, _, names in folders for name in names if name.endswith(".py"))
    return {path: _stamp(path) for path in ([archive] if archive else paths)}


def _has_changed(spec: ModuleSpec) -> bool:
    """Return whether the file of a module has changed since the engine was imported, and may be imported so. Caller
    has read the source: what was imported before is of that source from now on."""
    if spec.name in _imported_as_read:
        return False
    path = getattr(spec.loader, "archive", None) or spec.origin or ""
    try:
        stamp = _stamp(path)
    except OSError:
        return path in _AT_IMPORT
    if _AT_IMPORT.setdefault(path, stamp) != stamp:
        return True
    if spec.name in sys.modules:
        _imported_as_read.add(spec.name)
    return False


_imported_as_read: set[str] = set()
_AT_IMPORT = _stamps()


@functools.cache
def _spec(module: str) -> ModuleSpec | None:
    """Return the spec of a module of the engine, or of one that has kernels of its own; None if there is none."""
    is_ours = module.partition(".")[0] == "engine"
    name = PREFIX * is_ours + module
    if name in sys.modules or not is_ours:
        return getattr(sys.modules.get(name), "__spec__", None)
    spec = PathFinder.find_spec(name, [str(_ROOT.joinpath(*module.split(".")[1:-1]))])
    return None if spec is None or spec.loader is None else spec


def source_of(spec: ModuleSpec) -> bytes | None:
    """Return the source of a module from its loader, None if it has none."""
    loader: Any = spec.loader
    try:
        if (spec.origin or "").endswith(".py"):
            return bytes(loader.get_data(spec.origin))
        text = loader.get_source(spec.name)
    except (AttributeError, ImportError, OSError):
        return None
    return None if text is None else text.encode()


@functools.cache
def read_source(module: str) -> tuple[bytes, set[str]] | None:
    """Return a hash of a module, and the engine modules that its import lines name, without `engine`; None if its
    source cannot be read."""
    spec = _spec(module)
    source = None if spec is None else source_of(spec)
    if source is None:
        return None
    if PREFIX:  # a wheel's imports
        source = source.replace(f"{PREFIX}engine".encode(), b"engine")
    named = set()
    for match in _IMPORT.finditer(source.decode("utf-8")):
        package = "engine" + (match[1] or match[3] or "")
        named.add(package)
        if getattr(_spec(package), "submodule_search_locations", None) is not None:
            names = re.findall(r"\w+", re.sub(r"#.*|\bas\s+\w+", "", match[2] or ""))
            named.update(f"{package}.{name}" for name in names)
    return hashlib.sha256(source).digest(), {name for name in named - {"engine"} if _spec(name) is not None}


@functools.cache
def tools() -> str:
    """Return the versions and options of the tools that compile kernels, without sources and CPU."""
    made_by = [
        f"numba {numba.__version__}, llvmlite {importlib.metadata.version('llvmlite')}",
        f"{sys.implementation.cache_tag}{getattr(sys, 'abiflags', '')} on {sys.platform} {platform.machine()}",
        *(f"{name}={getattr(numba_config, name, None)}" for name in _OPTIONS),
    ]
    return ", ".join(made_by)


def plain_name(name: str) -> str:
    """Return the name of something of the engine without the prefix that it may have here, others as they are."""
    return name.replace("exact_geometry.engine.", "engine.", 1)


def as_imported(plain: str) -> str:
    """Return the name under which a module of the engine is imported here, others as they are."""
    return PREFIX + plain if plain.startswith("engine.") else plain


@functools.cache
def source_digest(module: str) -> str | None:
    """Return a hash of `module`, of all engine modules below it, of `compiling`, and of `tools`; None if the running
    code may differ."""
    reached = _reached(module.removeprefix(PREFIX))
    if reached is None:
        return None
    digest = hashlib.sha256(tools().encode())
    for name in sorted(reached):
        digest.update(f"\0{name}\0".encode() + reached[name])
    return digest.hexdigest()[:20]


def _reached(module: str) -> dict[str, bytes] | None:
    """Return the hash of each module that the kernels of one depend on; None if one cannot be read, or changed since
    the import."""
    reached: dict[str, bytes] = {}
    waiting = {module, "engine.compiling.jit"}  # the compiler too
    while waiting:
        name = waiting.pop()
        spec, source = _spec(name), read_source(name)
        if spec is None or source is None:
            _uncached("a source cannot be read", name)
            return None
        if _has_changed(spec):
            _uncached("a source has changed since it was imported", name)
            return None
        reached[name] = source[0]
        waiting |= source[1] - reached.keys() - _STORING
    return reached


def matches_its_source(module: str) -> bool:
    """Return whether the bytecode of a module's kernels is that of their sources.

    Python accepts bytecode of any source of the same size and second.
    """
    return all(map(_has_own_bytecode, _reached(module.removeprefix(PREFIX)) or ()))


@functools.cache
def _has_own_bytecode(module: str) -> bool:
    spec: Any = _spec(module)
    get_code = getattr(spec.loader, "get_code", None)  # a loader that has none keeps no bytecode
    source, code = source_of(spec), get_code and get_code(spec.name)
    compiled = getattr(spec.loader, "source_to_code", InspectLoader.source_to_code)
    if source and code and compiled(source, code.co_filename) != code:
        _uncached("bytecode is not that of the source", module)
        return False
    return True


reported: set[object] = set()
"""Subjects of warnings that were logged, or are not to be."""


def warn_once(subject: object, text: str, *words: object) -> None:
    """Log a warning, unless `subject` is in `reported` already."""
    if subject not in reported:
        reported.add(subject)
        log.warning(text, *words)


def _uncached(reason: str, module: str) -> None:
    """Log once why kernels are not cached."""
    warn_once(reason, "kernels are compiled in each process again: %s (%s)", reason, module)
