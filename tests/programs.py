"""Programs that some tests use where they are installed; looked for when a test asks, since .ci/run fetches them."""

from __future__ import annotations

import os
import shutil

import pytest

COUNTER = """
from numba.core import event

class Counter(event.Listener):
    n = 0
    def on_start(self, happening):
        self.n += 1
    def on_end(self, happening):
        pass

counter = Counter()
event.register("numba:compile", counter)
"""
"""Code for a process of its own: counts what numba compiles after it."""


def program(*names: str, package: str) -> str:
    """Return the path of the first of these that is there; skip the test where none is. package: Debian's."""
    path = f"{os.environ.get('PATH', '')}:/usr/sbin"
    found = next(filter(None, (shutil.which(name, path=path) for name in names)), None)
    if found is None:
        pytest.skip(f"no {names[0]} on this machine (Debian: apt-get install {package})")
    return found


def chromium() -> str:
    """Return the path of the browser that pages are used in."""
    return program("chromium", "chromium-browser", "google-chrome", package="chromium")
