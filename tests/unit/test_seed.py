"""A seed of all kernels: a process with nothing of its own answers from it at once, and compiles nothing."""

from __future__ import annotations

import lzma
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from numba import config as numba_config

from engine.compiling import kernel_cache
from tests.programs import COUNTER

pytestmark = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="the compiler is disabled")

PROBE = (
    """
import logging
logging.basicConfig()
import numpy as np
import engine
"""
    + COUNTER
    + """
corners = [[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)]
faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
cube, other = engine.Polyhedron(corners, faces), engine.Polyhedron(np.array(corners) + 0.5, faces)
box, square = engine.Aabb([0, 0, 0], [1, 1, 1]), engine.Polygon([[[0, 0], [2, 0], [0, 2]]])
points = np.linspace(-1, 2, 24)
answers = [
    engine.locate(points.reshape(8, 3), engine.Sphere([0, 0, 0], 1)).sum(),
    engine.locate(points.reshape(8, 3), cube).sum(),
    len(engine.clip_segments(points.reshape(4, 2, 3), box).source),
    *engine.clip_polygons(points.reshape(4, 3, 2), engine.Aabb([0, 0], [1, 1])).status.tolist(),
    engine.collide(cube, other).relation.label,
    engine.overlay(square, engine.Polygon([[[1, 0], [1, 1], [0, 1]]])).pieces[0].shell.size,
]
engine.warm(processes=2)
print(*answers, counter.n)
"""
)
ANSWERS = "-2 -4 2 0 0 0 0 overlapping 6"


@pytest.fixture(scope="module")
def seed(kernels: Path) -> Path:
    """Return a seed of all kernels, beside it the archive of the same."""
    kernel_cache.seal(kernels, kernels.with_name("seed.tar.xz"))
    return kernels


def ask(home: Path, before: str = "", **more: str) -> subprocess.Popen[str]:
    read_cached = {name: value for name, value in os.environ.items() if not name.startswith(("ENGINE_", "XDG_"))}
    return subprocess.Popen(
        [sys.executable, "-c", before + PROBE],
        env={**read_cached, "HOME": str(home), "TMPDIR": str(home), **more},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def told(process: subprocess.Popen[str]) -> tuple[str, str]:
    """Return what it answered, with the number of compilations last, and its log."""
    output, errors = process.communicate(timeout=600)
    assert process.returncode == 0, errors
    return output.strip(), errors


@pytest.mark.some(1)
@pytest.mark.parametrize("kind", ["folder", "archive"])
def test_an_empty_home_and_a_seed_compile_nothing(tmp_path: Path, seed: Path, kind: str) -> None:
    named = seed if kind == "folder" else seed.with_name("seed.tar.xz")
    assert told(ask(tmp_path, ENGINE_CACHE_SEED=str(named))) == (f"{ANSWERS} 0", "")
    own = [path for path in tmp_path.rglob("*.nbc") if "seed-" not in str(path)]
    assert not own


def test_a_seed_is_enough_where_nothing_can_be_written(tmp_path: Path, seed: Path) -> None:
    home = tmp_path / "home"
    home.write_text("a file where a folder should be")  # unwritable even for root
    nowhere = f"import tempfile; tempfile.tempdir = {str(home)!r}"
    assert told(ask(home, nowhere, ENGINE_CACHE_SEED=str(seed))) == (f"{ANSWERS} 0", "")


@pytest.mark.full
def test_two_processes_unpack_one_archive(tmp_path: Path, seed: Path) -> None:
    archive = str(seed.with_name("seed.tar.xz"))
    together = [ask(tmp_path, ENGINE_CACHE_SEED=archive) for _ in range(2)]
    assert [told(process) for process in together] == [(f"{ANSWERS} 0", "")] * 2
    assert len(list(tmp_path.rglob("seed-*"))) == 1


def test_a_pipe_in_the_cache_is_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """To open it waited for ever for somebody to write."""
    monkeypatch.setattr(kernel_cache, "_candidates", lambda: iter([tmp_path]))
    kernel_cache.cache_folder.cache_clear()
    try:
        os.mkfifo(tmp_path / "a kernel", 0o600)
        thread = threading.Thread(target=lambda: found.append(kernel_cache.read_cached("a kernel")), daemon=True)
        found: list[bytes | None] = []
        thread.start()
        thread.join(20)
        assert found == [None]
        kernel_cache.write_cached("a kernel", b"compiled")
        assert kernel_cache.read_cached("a kernel") == b"compiled"
    finally:
        kernel_cache.cache_folder.cache_clear()


def test_a_seed_is_packed_and_read_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernel_cache, "_candidates", lambda: iter([tmp_path]))
    kernel_cache.cache_folder.cache_clear()
    try:
        name, code = "digest/kernel-key.nbc", b"machine code " * 1000
        kernel_cache.write_cached(name, code)
        kernel_cache.seal(tmp_path)
        packed = (tmp_path / name).read_bytes()
        assert len(packed) < 1000
        kernel_cache.seal(tmp_path)  # packed once only
        assert (tmp_path / name).read_bytes() == packed
        assert kernel_cache.read_cached(name) == code
        (tmp_path / name).write_bytes(packed[:-9] + bytes(9))
        assert kernel_cache.read_cached(name) is None
        kernel_cache.seal(tmp_path)  # does not make it good
        assert not (tmp_path / name).exists()
        for content in (packed[32:-9], packed[32:44], lzma.compress(bytes(1 << 27))):
            kernel_cache.write_cached(name, content)
            assert kernel_cache.read_cached(name) is None
    finally:
        kernel_cache.cache_folder.cache_clear()
