"""Families of awkward input: each is asked at a small size; a cliff is seen by a clock of the test's own."""

from __future__ import annotations

from functools import partial
from typing import Any

import pytest

from benchmarks import cliffs
from benchmarks.cliffs import FAMILIES, Family, grown


def test_there_are_forty_families_of_different_names() -> None:
    assert len({family.name for family in FAMILIES}) == len(FAMILIES) >= 40


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
def test_every_family_is_asked(family: Family) -> None:
    ask, peer = family.make(32)
    assert ask() is not None
    assert peer is None or peer() is not None


def _family(power: float, peer_power: float) -> Family:
    return Family("made up", 100, lambda n: (partial(pow, n, power), partial(pow, n, peer_power)))


def test_growth_and_slowness_are_faults(monkeypatch: pytest.MonkeyPatch) -> None:
    """Seconds are what the question returns, in millionths."""
    monkeypatch.setattr(cliffs, "clocked", lambda ask: (0.0, 1e-6 * ask(), None))
    faults: Any = {name: grown(_family(*powers), 4, 1e9)[1] for name, powers in
                   {"even": (1.3, 1.2), "steep": (1.4, 1.3), "slow": (1.3, 1.1)}.items()}  # fmt: skip
    assert faults["even"] == []
    assert faults["steep"] == ["made up: grows by 1.40"]
    assert faults["slow"] == ["made up: a peer is 5.8 times as fast"]
    assert grown(_family(1.4, 1.3), 1, 1e9)[1] == []
    assert grown(Family("short", 1, lambda n: (lambda: 1e3 * n * n, None)), 2, 1e9)[1] == ["short: grows by 2.00"]
    assert grown(Family("tiny", 1, lambda n: (lambda: n * n, None)), 3, 1e9)[1] == []
