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
another machine. What the cache lacks is looked up there, read in place and never written. A list in it holds the sha256
of each file: one that differs is not read, nor is a seed that belongs to neither this user nor root, that any user
can write, or that other tools made; a line in the log says so, and its kernels are compiled.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import json
import logging
import os
import platform
import re
import sys
import tempfile
import uuid
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numba
from numba import config as numba_config

log = logging.getLogger(__name__)

COMPLETE = "complete"
"""How the name of the empty file begins that says that nothing is left to compile for a CPU (cold_start.py)."""

_ROOT = Path(__file__).resolve().parent
_LIST = "MANIFEST.json"
_FILE = re.compile(rf"[0-9a-f]{{20}}/(?:[\w.<>-]+\.nb[ci]|{COMPLETE}[\w.-]*)")
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
def _source(module: str) -> str | None:
    """Return the source text of the dotted engine `module`, None if there is no such file."""
    base = _folder(module)
    for path in (base.with_suffix(".py"), base / "__init__.py"):
        if module != "engine" and path.is_file():
            return path.read_text("utf-8")
    return None


@functools.cache
def imported_modules(module: str) -> set[str]:
    """Return the engine modules that `module` names in its import lines (``engine/__init__`` is left out)."""
    found: set[str] = set()
    for match in _IMPORT.finditer(_source(module) or ""):
        package = "engine" + (match[1] or match[3] or "")
        candidates = [package]
        if _folder(package).is_dir():
            names = re.findall(r"\w+", re.sub(r"#.*|\bas\s+\w+", "", match[2] or ""))
            candidates += [f"{package}.{name}" for name in names]
        found.update(name for name in candidates if _source(name) is not None)
    return found


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
    """Return a hash of `module`, of all engine modules below it, of those that compile, and of `tools`."""
    reached, waiting = set(), {module, "engine.jit"}
    while waiting:
        name = waiting.pop()
        reached.add(name)
        waiting |= imported_modules(name) - reached
    digest = hashlib.sha256(tools().encode())
    for name in sorted(reached):
        digest.update(f"\0{name}\0".encode() + _source_hash(name))
    return digest.hexdigest()[:20]


@functools.cache
def _source_hash(module: str) -> bytes:
    return hashlib.sha256(str(_source(module)).encode()).digest()


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


@dataclass(frozen=True)
class Seed:
    """Kernels that were compiled elsewhere: a folder, and the sha256 of each of its files."""

    folder: Path
    files: dict[str, str]

    def holds(self, name: str) -> bool:
        """Tell whether there is a file of this name, as it was written."""
        expected = self.files.get(name)
        if expected is None:
            return False
        with suppress(OSError):
            if hashlib.sha256((self.folder / name).read_bytes()).hexdigest() == expected:
                return True
        log.warning("%s in the kernel seed %s is damaged: not used", name, self.folder)
        return False


@functools.cache
def seed() -> Seed | None:
    """Return what ``ENGINE_CACHE_SEED`` names, None where that is nothing or may not be used."""
    named = os.environ.get("ENGINE_CACHE_SEED")
    if not named:
        return None
    try:
        return _opened(Path(named))
    except Exception as error:  # torn in any way
        log.warning("the kernel seed %s is not used: %s", named, error)
        return None


def _opened(path: Path) -> Seed:
    _check_owner(path)
    folder = path if path.is_dir() else _unpacked(path)
    _check_owner(folder / _LIST)
    written = json.loads((folder / _LIST).read_text("utf-8"))
    files = {str(name): str(value) for name, value in written["files"].items()}
    if not all(map(_FILE.fullmatch, files)):
        raise ValueError("its list names files that no seed has")
    if written["tools"] != tools():
        raise ValueError(f"made by {written['tools']}; here is {tools()}")
    return Seed(folder, files)


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
        part = target.with_name(f"{target.name}.{uuid.uuid4().hex}")
        with tarfile.open(fileobj=io.BytesIO(content), mode="r:xz") as tar:
            room = _LARGEST_SEED
            for member in tar:
                room -= member.size
                stream = tar.extractfile(member) if member.name == _LIST or _FILE.fullmatch(member.name) else None
                if stream is None or room < 0:
                    raise ValueError(f"it holds {member.name}, {member.size} bytes")
                (part / member.name).parent.mkdir(mode=0o700, parents=True, exist_ok=True)
                (part / member.name).write_bytes(stream.read())
        with suppress(OSError):  # another process was faster
            part.rename(target)
    return target


def seal(folder: Path, archive: Path | None = None) -> None:
    """Make a seed of `folder`, by a list of what is in it; write it to `archive` (.tar.xz) as well if that is named."""
    found = {path.relative_to(folder).as_posix(): path for path in sorted(folder.glob("*/*"))}
    files = {
        name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in found.items() if _FILE.fullmatch(name)
    }
    part = folder / f"{_LIST}.{uuid.uuid4().hex}"
    part.write_text(json.dumps({"tools": tools(), "files": files}, indent=1), "utf-8")
    part.replace(folder / _LIST)
    if archive is not None:
        import tarfile

        with tarfile.open(archive, "w:xz") as tar:
            for name in (_LIST, *files):
                item = tarfile.TarInfo(name)
                item.size = (folder / name).stat().st_size
                with (folder / name).open("rb") as file:
                    tar.addfile(item, file)
