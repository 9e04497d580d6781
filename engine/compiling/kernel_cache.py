"""Folder of the kernel cache, its seeds, and which of their files are trusted.

numba looks at the file of the kernel only, so a cached kernel would not notice that a helper in another file changed.
Each module therefore caches into a folder named by a hash of its own source and of every engine module it imports,
directly or not, and of the tools and options that make the code. The folder is in the first of these that can be
written:

1. ``ENGINE_CACHE_DIR``;
2. ``XDG_CACHE_HOME`` or ``~/.cache``, then ``exact-geometry``;
3. a private folder of this user under the system's temporary folder.

Where none can be written, kernels are compiled in each process again; so are those of sources that cannot be read, that
changed since they were imported, or whose bytecode is of other sources: a line in the log says so.

**Seeds.** ``ENGINE_CACHE_SEED`` names a folder or a .tar.xz that ``python -m engine warm --into`` has written, maybe on
another machine; where it is not set, a wheel's own is used, ``kernels/`` beside this package, a folder for each set of
tools. What the cache lacks is looked up there, read in place and never written.

**Trust.** Each file begins with the sha256 of its name and the rest: one that differs is not run, nor one that another
user owns or can write (other than root and the owner of these sources), or in such a folder, nor a seed that other
tools made; one line in the log says so, and the kernels are compiled.
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
import tempfile
import time
import uuid
from collections.abc import Iterator
from contextlib import suppress
from importlib.abc import InspectLoader
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from typing import Any

import numba
from numba import config as numba_config

log = logging.getLogger(__name__)

COMPLETE = "complete"
"""Prefix of the empty file that marks a complete cache for a CPU (cold_start.py)."""

_ROOT = Path(__file__).resolve().parents[1]
_PREFIX = __name__.removesuffix("engine.compiling.kernel_cache")
"""Prefix of our modules' names: nothing, or ``exact_geometry.`` if `engine` is another package's."""
_OWN_SEEDS = _ROOT / "kernels"
"""The seeds of a wheel, a folder for each set of `tools`."""
_MADE_BY = "MADE_BY"
"""The file of a seed that names its `tools`."""
_SECONDS = {
    "containment": 9, "collision": 30, "segment_clipping": 8, "polygon_clipping": 14, "polygon_overlay": 30,
    "scenes": 20, "distance": 12, "solids": 4, "bounding": 4, "arrangement": 2, "textbook": 2, "warmup": 280,
}  # fmt: skip
"""Seconds that the compiler works before the first answer by a part of the engine; "warmup": for all kernels."""
_REFERENCE = 0.006
"""Seconds that `_slowness` took on the machine of `_SECONDS`."""
_LARGEST_SEED = 1 << 28  # bytes, unpacked; all kernels for one CPU are 5 MB
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
    """Return whether the file of a module has changed since the engine was imported."""
    path = getattr(spec.loader, "archive", None) or spec.origin or ""
    try:
        stamp = _stamp(path)
    except OSError:
        return path in _AT_IMPORT
    return _AT_IMPORT.setdefault(path, stamp) != stamp


_AT_IMPORT = _stamps()


@functools.cache
def _spec(module: str) -> ModuleSpec | None:
    """Return the spec of a module of the engine, or of one that has kernels of its own; None if there is none."""
    is_ours = module.partition(".")[0] == "engine"
    name = _PREFIX * is_ours + module
    if name in sys.modules or not is_ours:
        return getattr(sys.modules.get(name), "__spec__", None)
    spec = PathFinder.find_spec(name, [str(_ROOT.joinpath(*module.split(".")[1:-1]))])
    return None if spec is None or spec.loader is None else spec


def _source(spec: ModuleSpec) -> bytes | None:
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
    source = None if spec is None else _source(spec)
    if source is None:
        return None
    if _PREFIX:  # a wheel's imports
        source = source.replace(f"{_PREFIX}engine".encode(), b"engine")
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


def as_imported(module: str) -> str:
    """Return the name under which a module of the engine is imported here, others as they are."""
    plain = module.removeprefix("exact_geometry.")
    return _PREFIX + plain if plain.partition(".")[0] == "engine" else module


@functools.cache
def source_digest(module: str) -> str | None:
    """Return a hash of `module`, of all engine modules below it, of `compiling`, and of `tools`; None if the running
    code may differ."""
    reached = _reached(module.removeprefix(_PREFIX))
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
        waiting |= source[1] - reached.keys() - {"engine.compiling.kernel_cache"}  # how code is stored changes no code
    return reached


def matches_its_source(module: str) -> bool:
    """Return whether the bytecode of a module's kernels is that of their sources.

    Python accepts bytecode of any source of the same size and second.
    """
    return all(map(_has_own_bytecode, _reached(module.removeprefix(_PREFIX)) or ()))


@functools.cache
def _has_own_bytecode(module: str) -> bool:
    spec: Any = _spec(module)
    get_code = getattr(spec.loader, "get_code", None)  # a loader that has none keeps no bytecode
    source, code = _source(spec), get_code and get_code(spec.name)
    compiled = getattr(spec.loader, "source_to_code", InspectLoader.source_to_code)
    if source and code and compiled(source, code.co_filename) != code:
        _uncached("bytecode is not that of the source", module)
        return False
    return True


_reported: set[object] = set()


def _warn_once(subject: object, text: str, *words: object) -> None:
    if subject not in _reported:
        _reported.add(subject)
        log.warning(text, *words)


def _uncached(reason: str, module: str) -> None:
    """Log once why kernels are not cached."""
    _warn_once(reason, "kernels are compiled in each process again: %s (%s)", reason, module)


def warn_of_compiling(module: str, processes: float = 1) -> None:
    """Log, once a process, that kernels are compiled now, about how long that takes here, and how to avoid it."""
    part = module.removeprefix(f"{_PREFIX}engine.").partition(".")[0]
    if part in _SECONDS and warn_of_compiling not in _reported:
        _warn_once(
            warn_of_compiling,
            "no compiled kernels for %s yet: compiling them takes about %d s here, %s. Beforehand: engine.warm() or "
            "python -m engine warm; never: a wheel with kernels for this Python and numba (docs/running.md)",
            "all operations" if part == "warmup" else part.replace("_", " "),
            max(1, round(_SECONDS[part] * _slowness() / processes)),
            "in each process" if cache_folder() is None else "once",
        )


def expect_compiling() -> None:
    """Leave `warn_of_compiling` out from now on: the caller shows the progress."""
    _reported.add(warn_of_compiling)


def _slowness() -> float:
    """Return how many times as long as where `_SECONDS` were measured Python's compiler works here."""
    source, seconds = _source(__spec__) or b"", []
    for _ in range(3):
        start = time.perf_counter()
        compile(source, "", "exec", dont_inherit=True)
        seconds.append(time.perf_counter() - start)
    return min(seconds) / _REFERENCE


def _is_writable(folder: Path) -> bool:
    """Return whether `folder` belongs to this user and is writable; make it if it is missing."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not _is_trusted(folder):
            return False
        with tempfile.TemporaryFile(dir=folder):
            return True
    except (OSError, RuntimeError):
        return False


def _candidates() -> Iterator[Path]:
    if named := os.environ.get("ENGINE_CACHE_DIR"):
        yield Path(named)
    with suppress(RuntimeError):  # no home folder at all
        yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "exact-geometry"
    user = os.getuid() if hasattr(os, "getuid") else "user"
    yield Path(tempfile.gettempdir()) / f"exact-geometry-{user}"


@functools.cache
def cache_folder() -> Path | None:
    """Return the folder of compiled code, None if none can be written."""
    return next((folder for folder in _candidates() if _is_writable(folder)), None)


def write_cached(name: str, content: bytes) -> None:
    """Write the file `name` of the cache atomically, after its seal; skip it if the disk is full."""
    folder = cache_folder()
    if folder is None:
        return
    part = folder / f"{name}.{uuid.uuid4().hex}"
    with suppress(OSError):
        try:
            part.parent.mkdir(mode=0o755, exist_ok=True)  # also where what is new is the group's to write; a seed's
            part.touch(mode=0o644)  # users read it
            part.write_bytes(_seal_of(name, content) + content)
            part.replace(folder / name)
        finally:
            part.unlink(missing_ok=True)


def read_cached(name: str) -> bytes | None:
    """Return the file `name` of the cache, else of the seed; None if neither has it with a valid seal."""
    for folder in (cache_folder(), seed()):
        if folder is not None:
            try:
                if not (folder / name).is_file():
                    continue
                check_owner((folder / name).parent)
                check_owner(folder / name)
                written = (folder / name).read_bytes()
                if _seal_of(name, written[32:]) == written[:32]:
                    return written[32:]
                raise ValueError("it is damaged, or another file")
            except (OSError, ValueError) as error:
                _warn_once(
                    (folder, str(error).partition("belongs")[2]),
                    "%s in %s is not used, nor others of which the same is true: %s", name, folder, error,
                )  # fmt: skip
    return None


def _seal_of(name: str, content: bytes) -> bytes:
    """Return the sha256 that binds a file to its name."""
    return hashlib.sha256(f"{name}\0".encode() + content).digest()


def _is_trusted(folder: Path) -> bool:
    """Return whether only this user or root can write to a folder; log once if not."""
    try:
        check_owner(folder)
    except ValueError as error:
        _warn_once(folder, "compiled kernels in %s are not used: %s", folder, error)
        return False
    return True


@functools.cache
def seed() -> Path | None:
    """Return the folder that ``ENGINE_CACHE_SEED`` names, else that of this package for these tools; None if there is
    none, or it is not trusted."""
    named = os.environ.get("ENGINE_CACHE_SEED")
    try:
        named = _own_seed() if named is None else named
        if not named:
            return None
        check_owner(Path(named))
        folder = Path(named) if Path(named).is_dir() else _unpacked(Path(named))
        check_owner(folder / _MADE_BY)
        if (made_by := (folder / _MADE_BY).read_text("utf-8")) != tools():
            there, here = made_by.split(", "), tools().split(", ")
            theirs, ours = ([item for item in a if item not in b] for a, b in ((there, here), (here, there)))
            raise ValueError(f"made with {', '.join(theirs)[:500]}; here is {', '.join(ours)}")
        return folder
    except Exception as error:  # torn in any way
        log.warning("the kernel seed %s is not used: %s", named, error)
        return None


def _own_seed() -> str:
    """Return the folder of this package's kernels for these tools, else any of them, else an empty text."""
    made_by = {each.parent: each.read_text("utf-8").split(", ") for each in _OWN_SEEDS.glob(f"*/{_MADE_BY}")}
    here = tools().split(", ")
    return str(max(sorted(made_by), default="", key=lambda each: sum(map(made_by[each].__contains__, here))))


def check_owner(path: Path) -> None:
    """Raise for a file that others may write, and that is not as safe as these sources: compiled code is executed."""
    if hasattr(os, "getuid"):
        status, sources = path.stat(), _ROOT.stat() if _ROOT.is_dir() else None  # None: in a zip file
        owners = {0, os.getuid()} | ({sources.st_uid} if sources else set())
        others = 0o022 & ~(sources.st_mode if sources and path.is_relative_to(_OWN_SEEDS) else 0)
        if status.st_uid not in owners or status.st_mode & others:
            raise ValueError(
                f"{path.name} belongs to user {status.st_uid}, mode {status.st_mode & 0o777:o}; it must be this user's "
                "or root's, and nobody else's to write: chmod go-w"
            )


def _unpacked(archive: Path) -> Path:
    """Return the folder with the files of `archive`, unpacked once."""
    import io
    import tarfile

    content, folder = archive.read_bytes(), cache_folder()
    if folder is None:
        raise OSError("there is no folder to unpack it in")
    target = folder / f"seed-{hashlib.sha256(content).hexdigest()[:20]}"
    if not target.exists():
        with (
            tarfile.open(fileobj=io.BytesIO(content), mode="r:xz") as tar,
            tempfile.TemporaryDirectory(dir=folder) as room,
        ):
            if sum(member.size for member in tar.getmembers()) > _LARGEST_SEED:
                raise ValueError("it is too large")
            tar.extractall(f"{room}/seed", filter="data")
            for part in [Path(room, "seed"), *filter(Path.is_dir, Path(room, "seed").rglob("*"))]:
                part.chmod(0o755)
            with suppress(OSError):  # another process was faster
                Path(room, "seed").rename(target)
    return target


def seal(folder: Path, archive: Path | None = None) -> None:
    """Make a seed of `folder`: add the file that names its tools; write it to `archive` (.tar.xz) if given.

    The same files make the same archive.
    """
    (folder / _MADE_BY).touch(mode=0o644)
    (folder / _MADE_BY).write_text(tools(), "utf-8")
    if archive is not None:
        import tarfile

        with tarfile.open(archive, "w:xz") as tar:
            tar.add(folder, ".", filter=_plain)


def _plain(member: Any) -> Any:
    """Return a member of a .tar file without what differs between equal files."""
    return member.replace(mtime=0, uid=0, gid=0, uname="", gname="", deep=False)
