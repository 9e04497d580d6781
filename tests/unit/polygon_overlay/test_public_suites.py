"""Pairs from public test suites, four operations each: no exception, no invalid ring, exact areas.

A seeded sample by default; everything with --full. The rule is even-odd over all rings, whatever the suite's own rule.
"""

from __future__ import annotations

import gzip
import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from engine.polygon_overlay.compiled.loading import RingArrays
from engine.polygon_overlay.overlay import overlay_rings
from engine.polygon_overlay.result import Overlay
from engine.running.budget import Budget
from engine.types import read_only
from tests.conftest import DATA
from tests.unit.polygon_overlay.checks import (
    OPERATIONS,
    assert_area_close,
    assert_counts_add_up,
    assert_equals_reference,
    assert_valid,
)

Pair = tuple[str, list[Any], list[Any]]

pytestmark = pytest.mark.data


def flat(multi: list[Any]) -> list[Any]:
    return [ring for polygon in multi for ring in polygon]


@cache
def all_pairs(folder: Path) -> list[Pair]:
    """Return every pair as (name, rings, rings), smallest first; rings of no vertices are dropped."""

    def load(name: str) -> Any:
        with gzip.open(folder / "clipping" / f"{name}.json.gz") as file:
            return json.load(file)

    pairs: list[Pair] = [(f"clipper2 {c['name']}", c["subj"], c["clip"]) for c in load("clipper2_cases")]
    pairs += [(c["source"], flat(c["a"]), flat(c["b"])) for c in load("geos_pairs")]
    for case in load("mfogel_cases"):
        first, *others = case["geoms"]
        pairs.append((case["source"], flat(first), flat(flat(others))))
    kept = [(name, [r for r in a if r], [r for r in b if r]) for name, a, b in pairs]
    return sorted(kept, key=lambda pair: sum(map(len, pair[1] + pair[2])))


def arrays(rings: list[Any]) -> RingArrays:
    """Like `Polygon`, but no rings and rings of two vertices are taken too."""
    found = [np.array(ring, float) for ring in rings]
    found = [ring[:-1] if len(ring) > 1 and (ring[0] == ring[-1]).all() else ring for ring in found]
    vertices = np.concatenate(found) if found else np.zeros((0, 2))
    return RingArrays(read_only(vertices), read_only(np.cumsum([0, *map(len, found)])))


def run(pair: Pair, operation: Any, swapped: bool = False) -> Overlay:
    subject, clip = arrays(pair[1]), arrays(pair[2])
    if swapped:
        subject, clip = clip, subject
    return overlay_rings(subject, clip, operation, Budget())[0]


def n_vertices(pair: Pair) -> int:
    return sum(map(len, pair[1] + pair[2]))


def check(pair: Pair, against_reference: bool) -> None:
    areas = []
    for operation in OPERATIONS:
        result = run(pair, operation)
        assert_valid(result)
        assert_counts_add_up(result)
        areas.append(result.area_exact)
        assert_area_close(result)
        if against_reference and pair[1] + pair[2]:
            assert_equals_reference(result, pair[1], pair[2], operation)
    both, union, only, either = areas
    other = run(pair, "difference", swapped=True).area_exact
    assert only + other == either
    assert either + both == union


@pytest.mark.some(8)
@pytest.mark.parametrize("place", range(24))
def test_sample(data: Path, place: int) -> None:
    """Every fifteenth pair of up to 150 vertices; those of up to 40 against the reference."""
    pairs = [pair for pair in all_pairs(data) if n_vertices(pair) <= 150]
    pair = pairs[place * (len(pairs) - 1) // 23]
    check(pair, against_reference=n_vertices(pair) <= 40)


@pytest.mark.full
@pytest.mark.parametrize("index", range(len(all_pairs(DATA)) if (DATA / "clipping").is_dir() else 0))
def test_all(data: Path, index: int) -> None:
    pair = all_pairs(data)[index]
    if n_vertices(pair) <= 10_000:
        check(pair, against_reference=n_vertices(pair) <= 50)
    else:
        for operation in OPERATIONS:
            assert_counts_add_up(run(pair, operation))
