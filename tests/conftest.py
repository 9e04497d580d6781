"""Options, the shared data folder, seeds."""

from __future__ import annotations

import os
import shutil
import zlib
from collections import defaultdict
from pathlib import Path

import pytest

import engine
from engine import warm_command, warmup
from engine.compiling import jit, kernel_cache, sources
from engine.compiling.cold_start import fill_cache, has_all

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data"
os.environ.setdefault("GEOMETRY_WORKERS", "1")  # services that tests start have one process unless a test asks for more
WHOLE_SUITE = 4000
"""Tests from which on a run will need nearly every kernel."""

LONGEST = (
    "test_wheel", "test_playground", "test_live", "test_warmup", "test_jit", "test_registry",
    "test_deadlines_in_process", "test_types", "test_start", "test_site", "test_detail", "test_distributed",
    "test_jobs", "test_schemathesis", "test_size",
)  # fmt: skip
"""Files that take 10 s and more: begun first, so that at the end no process is left alone with one."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--full", action="store_true", help="run the large samples too (minutes to hours)")
    parser.addoption("--seed", default="", help="draw other samples where questions are drawn at random")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Without --full leave out `full`, and all but some of `some`; skip `data` where the shared folder is absent."""
    if not config.getoption("--full"):
        left_out = {item for item in items if item.get_closest_marker("full")}
        groups: dict[str, list[pytest.Item]] = defaultdict(list)
        for item in items:
            if item.get_closest_marker("some") and item not in left_out:
                groups[item.nodeid.partition("[")[0]].append(item)
        for group in groups.values():  # by a hash: parameters that vary together are not left out together
            group.sort(key=lambda item: zlib.crc32(item.nodeid.encode()))
            left_out |= {*group[group[0].get_closest_marker("some").args[0] :]}  # type: ignore[union-attr]
        config.hook.pytest_deselected(items=list(left_out))
        items[:] = [item for item in items if item not in left_out]
    items.sort(key=lambda item: LONGEST.index(item.path.stem) if item.path.stem in LONGEST else len(LONGEST))
    for item in items:
        if item.get_closest_marker("data") and not DATA.is_dir():
            item.add_marker(pytest.mark.skip(reason=f"no shared data at {DATA}"))


def pytest_collection_finish(session: pytest.Session) -> None:
    """Compile by every core before a run of the whole suite, where no kernel is cached yet."""
    if len(session.items) >= WHOLE_SUITE and not session.config.getoption("--collect-only"):
        fill_cache("engine.warmup", warmup.SHARES, os.cpu_count() or 1)


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of real meshes and hard sets; tests that use it carry the marker `data`."""
    return DATA


@pytest.fixture(scope="session")
def kernels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A seed of all kernels: a copy of the one in use, if it has all, else from the cache, which is filled first."""
    engine.warm(processes=os.cpu_count() or 1)
    warm_command.warm_textbook()
    folder, seed = tmp_path_factory.mktemp("kernels") / "seed", kernel_cache.seed()
    source = seed if seed is not None and has_all(seed, "engine.warmup") else kernel_cache.cache_folder()
    assert source is not None
    modules = {name for name in (kernel.__module__ for kernel in jit.KERNELS) if name.startswith("engine.")}
    for digest in map(sources.source_digest, modules | {"engine.warmup"}):
        if (source / digest).exists():
            shutil.copytree(source / digest, folder / digest, ignore=shutil.ignore_patterns("lock"))
    kernel_cache.seal(folder)
    return folder


@pytest.fixture(scope="session")
def seed(pytestconfig: pytest.Config) -> str:
    """What is added to the seeds of generated questions, to draw others."""
    return str(pytestconfig.getoption("--seed"))
