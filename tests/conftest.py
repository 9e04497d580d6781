"""Options, the shared data folder, seeds."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from engine.cold_start import fill_cache
from engine.warmup import SHARES

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data"
WHOLE_SUITE = 4000
"""Tests from which on a run will need nearly every kernel."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--full", action="store_true", help="run the large samples too (minutes to hours)")
    parser.addoption("--seed", default="", help="draw other samples where questions are drawn at random")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out `full` without --full; skip `data` where the shared data folder is absent."""
    large = [] if config.getoption("--full") else [item for item in items if item.get_closest_marker("full")]
    if large:
        config.hook.pytest_deselected(items=large)
        items[:] = [item for item in items if not item.get_closest_marker("full")]
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
