"""The profile of hypothesis: the same examples in every run, two fifths of those named; with --full 100 times all."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, settings

from tests.properties import examples


def pytest_configure(config: pytest.Config) -> None:
    examples.FACTOR = 100 if config.getoption("--full") else 0.4
    settings.register_profile(
        "geometry",
        derandomize=True,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
        print_blob=False,
    )
    settings.load_profile("geometry")
