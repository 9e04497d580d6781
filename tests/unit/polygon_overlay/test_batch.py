"""Batches: refused before anything is overlaid, joined as if asked at once, iterated pair by pair."""

from __future__ import annotations

import numpy as np
import pytest

from engine.errors import InvalidArrayError, UnsupportedSolidError
from engine.polygon_overlay.batch import join_batches, overlay_batch
from engine.solids.aabb import Aabb
from engine.solids.polygon import Polygon
from tests.unit.polygon_overlay.families import star


def drawn(n: int) -> list[list[Polygon]]:
    random = np.random.default_rng(n)
    return [[Polygon([star(random, 7)]) for _ in range(n)] for _ in range(2)]


def test_joined_batches_are_one() -> None:
    subjects, clips = drawn(40)
    whole = overlay_batch(subjects, clips, workers=1)
    parts = join_batches([overlay_batch(subjects[k : k + 10], clips[k : k + 10]) for k in range(0, 40, 10)])
    for name in ("status", "vertices", "ring_offsets", "piece_offsets", "pair_offsets", "displacement", "areas"):
        assert getattr(parts, name).tolist() == getattr(whole, name).tolist()
    for one, other in zip(parts, whole.overlays, strict=True):
        assert one is not None
        assert other is not None
        assert one.vertices.tolist() == other.vertices.tolist()
        assert one.area_exact == other.area_exact


def test_what_is_refused() -> None:
    subjects, clips = drawn(3)
    with pytest.raises(InvalidArrayError, match="equal length"):
        overlay_batch(subjects, clips[:2])
    with pytest.raises(InvalidArrayError, match="list of polygons"):
        overlay_batch(subjects[0], clips)  # type: ignore[arg-type]
    with pytest.raises(UnsupportedSolidError):
        overlay_batch([*subjects[:2], Aabb([0, 0], [1, 1])], clips)
    empty = overlay_batch([], [])
    assert (len(empty), len(empty.areas)) == (0, 0)
    with pytest.raises(IndexError):
        empty[0]
