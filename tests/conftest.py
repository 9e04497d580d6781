"""Options, the shared data folder, seeds."""

from __future__ import annotations

import os
import zlib
from collections import defaultdict
from pathlib import Path

import pytest

from engine.compiling.cold_start import fill_cache
from engine.warmup import SHARES

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data"
os.environ.setdefault("GEOMETRY_WORKERS", "1")  # services that tests start have one process unless a test asks for more
WHOLE_SUITE = 4000
"""Tests from which on a run will need nearly every kernel."""


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
    for item in items:
        if item.get_closest_marker("data") and not DATA.is_dir():
            item.add_marker(pytest.mark.skip(reason=f"no shared data at {DATA}"))


def pytest_collection_finish(session: pytest.Session) -> None:
    """Compile by every core before a run of the whole suite, where no kernel is cached yet."""
    if len(session.items) >= WHOLE_SUITE and not session.config.getoption("--collect-only"):
        fill_cache("engine.warmup", SHARES, os.cpu_count() or 1)


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of real meshes and hard sets; tests that use it carry the marker `data`."""
    return DATA


@pytest.fixture(scope="session")
def seed(pytestconfig: pytest.Config) -> str:
    """What is added to the seeds of generated questions, to draw others."""
    return str(pytestconfig.getoption("--seed"))
