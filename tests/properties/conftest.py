"""The profile of hypothesis: the same examples in every run, and a hundred times as many with --full."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, settings

from tests.properties import examples


def pytest_configure(config: pytest.Config) -> None:
    examples.FACTOR = 100 if config.getoption("--full") else 1
    settings.register_profile(
        "geometry",
        derandomize=True,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
        print_blob=False,
    )
    settings.load_profile("geometry")
