"""Folder of the kernel cache, its seeds, and which of their files are trusted.

numba looks at the file of the kernel only, so a cached kernel would not notice that a helper in another file changed.
Each module therefore caches into a folder named by a digest of its own source, of every engine module it imports,
directly or not, and of the tools (sources.py). The folder is in the first of these that can be written:

1. ``ENGINE_CACHE_DIR``;
2. ``XDG_CACHE_HOME`` or ``~/.cache``, then ``exact-geometry``;
3. a private folder of this user under the system's temporary folder.

Where none can be written, kernels are compiled in each process again: a line in the log says so.

**Seeds.** ``ENGINE_CACHE_SEED`` names a folder or a .tar.xz that ``python -m engine warm --into`` has written, maybe on
another machine; where it is not set, a wheel's own is used, ``kernels/`` beside this package, a folder for each set of
tools. What the cache lacks is looked up there, read in place and never written. Its files are packed (xz), which saves
a seventh of a wheel and costs 25 ms for the largest.

**Trust.** Each file begins with the sha256 of its name and the rest: one that differs is not run, nor one that another
user owns or can write (other than root and the owner of these sources), or in such a folder, nor a seed that other
tools made; one line in the log says so, and the kernels are compiled.
"""

from __future__ import annotations

import functools
import hashlib
import logging
import os
import tempfile
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from engine.compiling.sources import PREFIX, reported, source_of, tools, warn_once

try:
    import fcntl
except ImportError:  # no such locks on this system: processes that start together compile the same
    fcntl = None  # type: ignore[assignment]

log = logging.getLogger(__name__)

COMPLETE = "complete"
"""Prefix of the empty file that marks a complete cache for a CPU (cold_start.py)."""

_ROOT = Path(__file__).resolve().parents[1]
_OWN_SEEDS = _ROOT / "kernels"
"""The seeds of a wheel, a folder for each set of `tools`."""
_MADE_BY = "MADE_BY"
"""The file of a seed that names its `tools`."""
_SECONDS = {
    "containment": 9, "collision": 30, "segment_clipping": 8, "polygon_clipping": 14, "polygon_overlay": 30,
    "scenes": 20, "distance": 12, "solids": 4, "bounding": 4, "arrangement": 2, "textbook": 2, "warmup": 280,
}  # fmt: skip
"""Seconds that the compiler works before the first answer by a part of the engine; "warmup": for all kernels."""
_REFERENCE = 0.0037
"""Seconds that compiling this file to bytecode took on the machine of `_SECONDS`."""
_PACKED = b"\xfd7zXZ\x00"
"""The first bytes of an xz file; machine code, pickled, never begins so."""
_LARGEST = 1 << 26  # bytes of a kernel, unpacked; the largest has 0.5 MB
_LARGEST_SEED = 1 << 28  # bytes, unpacked; all kernels for one CPU are 5 MB


def warn_of_compiling(module: str, processes: float = 1) -> None:
    """Log, once a process, that kernels are compiled now, about how long that takes here, and how to avoid it."""
    part = module.removeprefix(f"{PREFIX}engine.").partition(".")[0]
    if part in _SECONDS and warn_of_compiling not in reported:
        warn_once(
            warn_of_compiling,
            "no compiled kernels for %s yet: compiling them takes about %d s here, %s. Beforehand: engine.warm() or "
            "python -m engine warm; never: a wheel with kernels for this Python and numba (docs/running.md)",
            "all operations" if part == "warmup" else part.replace("_", " "),
            max(1, round(_SECONDS[part] * _slowness() / processes)),
            "in each process" if cache_folder() is None else "once",
        )


def expect_compiling() -> None:
    """Leave `warn_of_compiling` out from now on: the caller shows the progress."""
    reported.add(warn_of_compiling)


def _slowness() -> float:
    """Return how many times as long as where `_SECONDS` were measured Python's compiler works here."""
    source, seconds = source_of(__spec__) or b"", []
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
                    return _unpacked(written[32:])
                raise ValueError("it is damaged, or another file")
            except (OSError, ValueError) as error:
                warn_once(
                    (folder, str(error).partition("belongs")[2]),
                    "%s in %s is not used, nor others of which the same is true: %s", name, folder, error,
                )  # fmt: skip
    return None


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold the lock of a file; wait while another process does."""
    with path.open("w") as file:
        if fcntl is not None:
            fcntl.flock(file, fcntl.LOCK_EX)  # given back when the process ends, however it ends
        yield


def take_turns(file: str) -> None:
    """From now on compile a kernel that another process is compiling only when it has ended. file: locked by parts, a
    byte a kernel, by all processes that call this; locks end with their process."""
    if fcntl is not None:
        _turns.append(os.open(file, os.O_RDWR | os.O_CREAT, 0o644))


def wait_for_turn(name: str) -> bool:
    """Wait while another process that takes turns compiles the kernel of the file `name`; return whether one may have
    written it meanwhile."""
    for descriptor in _turns:
        end_turn()
        with suppress(OSError):  # this file system has no such locks: each compiles
            fcntl.lockf(descriptor, fcntl.LOCK_EX, 1, int.from_bytes(hashlib.sha256(name.encode()).digest()[:6], "big"))
    return bool(_turns)


def end_turn() -> None:
    """Let others compile, or load, the last kernel."""
    for descriptor in _turns:
        with suppress(OSError):
            fcntl.lockf(descriptor, fcntl.LOCK_UN)


_turns: list[int] = []
"""The descriptor of the file of `take_turns`, once it was called."""


def _unpacked(content: bytes) -> bytes:
    """Return the content of a file, unpacked if `seal` has packed it. Raises: ValueError if that is not possible."""
    if not content.startswith(_PACKED):
        return content
    try:
        import lzma
    except ImportError as error:  # Python was built without
        raise ValueError(f"it is packed: {error}") from error
    packed = lzma.LZMADecompressor()
    try:
        unpacked = packed.decompress(content, _LARGEST)
    except lzma.LZMAError as error:
        raise ValueError(f"it is damaged: {error}") from error
    if not packed.eof:
        raise ValueError("it is cut off, or too large")
    return unpacked


def _seal_of(name: str, content: bytes) -> bytes:
    """Return the sha256 that binds a file to its name."""
    return hashlib.sha256(f"{name}\0".encode() + content).digest()


def _is_trusted(folder: Path) -> bool:
    """Return whether only this user or root can write to a folder; log once if not."""
    try:
        check_owner(folder)
    except ValueError as error:
        warn_once(folder, "compiled kernels in %s are not used: %s", folder, error)
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
        folder = Path(named) if Path(named).is_dir() else _extracted(Path(named))
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


def _extracted(archive: Path) -> Path:
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
    """Make a seed of `folder`: pack its files, add one that names its tools; write all to `archive` (.tar.xz) if given.

    The same files make the same archive.
    """
    import lzma

    for file in folder.glob("*/*.nbc"):
        name, written = file.relative_to(folder).as_posix(), file.read_bytes()
        content = written[32:]
        if _seal_of(name, content) != written[:32]:
            file.unlink()  # it is damaged
        elif not content.startswith(_PACKED):
            packed = lzma.compress(content, check=lzma.CHECK_NONE)
            file.write_bytes(_seal_of(name, packed) + packed)
    (folder / _MADE_BY).touch(mode=0o644)
    (folder / _MADE_BY).write_text(tools(), "utf-8")
    if archive is not None:
        import tarfile

        with tarfile.open(archive, "w:xz") as tar:
            tar.add(folder, ".", filter=_plain)


def _plain(member: Any) -> Any:
    """Return a member of a .tar file without what differs between equal files."""
    return member.replace(mtime=0, uid=0, gid=0, uname="", gname="", deep=False)
