"""Where compiled code is kept, and what may be taken from there.

numba looks at the file of the kernel only, so a cached kernel would not notice that a helper in another file changed.
Each module therefore caches into a folder named by a hash of its own source and of every engine module it imports,
directly or not, and of the tools and options that make the code. The folder is in the first of these that can be
written:

1. ``ENGINE_CACHE_DIR``;
2. ``XDG_CACHE_HOME`` or ``~/.cache``, then ``exact-geometry``;
3. a private folder of this user under the system's temporary folder.

Where none can be written, kernels are compiled anew in each process.

**Seeds.** ``ENGINE_CACHE_SEED`` names a folder or a .tar.xz that ``python -m engine warm --into`` has written, maybe on
another machine. What the cache lacks is looked up there, read in place and never written. Each file begins with the
sha256 of the rest: one that differs is not run, nor one that belongs to neither this user nor root or that any user can
write, nor a seed that other tools made; a line in the log says so, and its kernels are compiled.
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
import uuid
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numba
from numba import config as numba_config

log = logging.getLogger(__name__)

COMPLETE = "complete"
"""How the name of the empty file begins that says that nothing is left to compile for a CPU (cold_start.py)."""

_ROOT = Path(__file__).resolve().parent
_PREFIX = __name__.removesuffix("engine.kernel_cache")
"""What stands before the names of our modules: nothing, or ``exact_geometry.`` where `engine` is another's."""
_MADE_BY = "MADE_BY"
"""The file of a seed that says what `tools` made it."""
_LARGEST_SEED = 1 << 28  # bytes, unpacked; all kernels for one CPU are 5 MB
_OPTIONS = (
    *("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "LLVM_REFPRUNE_PASS", "LLVM_REFPRUNE_FLAGS", "DEBUGINFO_DEFAULT"),
    *("BOUNDSCHECK", "EXTEND_VARIABLE_LIFETIMES", "USING_SVML", "LLVM_PASS_TIMINGS"),
)
"""What of numba's configuration changes the code that it makes; the CPU is part of each kernel's key."""

_IMPORT = re.compile(
    r"^[ \t]*(?:from\s+engine([.\w]*)\s+import\s+(\([^)]*\)|[^\n]*)|import\s+engine([.\w]+))", re.MULTILINE
)


@functools.cache
def _file(module: str) -> Path | None:
    """Return the source of the dotted `module`, of the engine or one that has kernels of its own; None if none is."""
    if module.partition(".")[0] != "engine":
        own = getattr(sys.modules.get(module), "__file__", None)
        return None if own is None else Path(own)
    base = _folder(module)
    found = (path for path in (base.with_suffix(".py"), base / "__init__.py") if path.is_file())
    return None if module == "engine" else next(found, None)


@functools.cache
def read_source(module: str) -> tuple[bytes, set[str]]:
    """Return a hash of a module, and the engine modules that its import lines name, `engine` left out."""
    path, named = _file(module), set()
    text = "" if path is None else path.read_text("utf-8")
    for match in _IMPORT.finditer(text):
        package = "engine" + (match[1] or match[3] or "")
        named.add(package)
        if _folder(package).is_dir():
            names = re.findall(r"\w+", re.sub(r"#.*|\bas\s+\w+", "", match[2] or ""))
            named.update(f"{package}.{name}" for name in names)
    return hashlib.sha256(text.encode()).digest(), {name for name in named if _file(name) is not None}


def _folder(module: str) -> Path:
    return _ROOT.joinpath(*module.split(".")[1:])


@functools.cache
def tools() -> str:
    """Name what makes the code of kernels, beside their sources and the CPU."""
    made_by = [
        f"numba {numba.__version__}, llvmlite {importlib.metadata.version('llvmlite')}",
        f"{sys.implementation.cache_tag} on {sys.platform} {platform.machine()}",
        *(f"{name}={getattr(numba_config, name, None)}" for name in _OPTIONS),
    ]
    return ", ".join(made_by)


@functools.cache
def source_digest(module: str) -> str:
    """Return a hash of `module`, of all engine modules below it, of those that compile, and of `tools`.

    Not of this one: how code is kept changes no code.
    """
    reached, waiting = set(), {module.removeprefix(_PREFIX), "engine.jit"}
    while waiting:
        name = waiting.pop()
        reached.add(name)
        waiting |= read_source(name)[1] - reached
    digest = hashlib.sha256((tools() + _PREFIX).encode())  # what is kept names our modules as they are imported
    for name in sorted(reached - {"engine.kernel_cache"}):
        digest.update(f"\0{name}\0".encode() + read_source(name)[0])
    return digest.hexdigest()[:20]


def _is_writable(folder: Path) -> bool:
    """Tell whether `folder` belongs to this user and a file can be made in it; make the folder if it is missing."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if hasattr(os, "getuid") and folder.stat().st_uid != os.getuid():
            return False  # compiled code is run as found: never from another user's folder
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
    """Return the folder that holds compiled code, None where nothing can be written."""
    return next((folder for folder in _candidates() if _is_writable(folder)), None)


def keep(name: str, content: bytes) -> None:
    """Write the file `name` of the cache, whole or not at all, its sha256 in front; not where the disk is full."""
    folder = cache_folder()
    if folder is None:
        return
    part = folder / f"{name}.{uuid.uuid4().hex}"
    with suppress(OSError):
        try:
            part.parent.mkdir(mode=0o700, exist_ok=True)
            part.write_bytes(hashlib.sha256(content).digest() + content)
            part.replace(folder / name)
        finally:
            part.unlink(missing_ok=True)


def kept(name: str) -> bytes | None:
    """Return the file `name` of the cache, else that of the seed; None where neither has it as it was written."""
    for folder in (cache_folder(), seed()):
        if folder is not None and (folder / name).exists():
            try:
                _check_owner(folder / name)
                written = (folder / name).read_bytes()
                if hashlib.sha256(written[32:]).digest() == written[:32]:
                    return written[32:]
                raise ValueError("it is damaged")
            except (OSError, ValueError) as error:
                log.warning("%s in %s is not used: %s", name, folder, error)
    return None


@functools.cache
def seed() -> Path | None:
    """Return the folder of what ``ENGINE_CACHE_SEED`` names, None where that is nothing or may not be used."""
    named = os.environ.get("ENGINE_CACHE_SEED")
    if not named:
        return None
    try:
        _check_owner(Path(named))
        folder = Path(named) if Path(named).is_dir() else _unpacked(Path(named))
        _check_owner(folder / _MADE_BY)
        if (made_by := (folder / _MADE_BY).read_text("utf-8")) != tools():
            raise ValueError(f"made by {made_by[:1000]}; here is {tools()}")
        return folder
    except Exception as error:  # torn in any way
        log.warning("the kernel seed %s is not used: %s", named, error)
        return None


def _check_owner(path: Path) -> None:
    """Refuse what others may write: compiled code is run as found."""
    status = path.stat()
    if hasattr(os, "getuid") and (status.st_uid not in (0, os.getuid()) or status.st_mode & 0o002):
        raise ValueError(f"{path.name} belongs to user {status.st_uid}, mode {status.st_mode & 0o777:o}")


def _unpacked(archive: Path) -> Path:
    """Return the folder with the files of `archive`, which is unpacked once."""
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
            with suppress(OSError):  # another process was faster
                Path(room, "seed").rename(target)
    return target


def seal(folder: Path, archive: Path | None = None) -> None:
    """Make a seed of `folder`, by a file that says what made it; write it to `archive` (.tar.xz) if that is named."""
    (folder / _MADE_BY).write_text(tools(), "utf-8")
    if archive is not None:
        import tarfile

        with tarfile.open(archive, "w:xz") as tar:
            tar.add(folder, ".")
