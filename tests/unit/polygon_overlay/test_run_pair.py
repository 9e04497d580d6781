"""One pair is handed to the compiled code without a look at types: what a polygon holds must be of the one kind."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from engine.polygon_overlay.batch import overlay_batch
from engine.polygon_overlay.overlay import overlay
from engine.solids.polygon import Polygon

SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])
CLIP = Polygon([[(2, 2), (6, 2), (3, 3), (2, 6)]])
LAYOUTS = {
    "columns": np.asfortranarray(SQUARE),
    "every other column": np.repeat(SQUARE, 2, axis=1)[:, ::2],
    "backwards": SQUARE[::-1],
    "foreign": SQUARE.astype(">f8"),
    "half": SQUARE.astype(np.float32),
    "long": SQUARE.astype(np.longdouble),
    "whole": SQUARE.astype(np.int32),
    "odd address": np.frombuffer(b"\0" + SQUARE.tobytes(), np.uint8)[1:].view(np.float64).reshape(4, 2),
}


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("n_rings", [1, 2])
def test_arrays_of_polygons_are_of_one_kind(layout: str, n_rings: int) -> None:
    made = Polygon([LAYOUTS[layout]] * n_rings)
    for polygon in (made, pickle.loads(pickle.dumps(made)), copy.deepcopy(made)):
        for array, kind in ((polygon.vertices, np.float64), (polygon.ring_offsets, np.int64)):
            assert array.dtype == kind
            assert array.dtype.isnative
            assert array.flags.c_contiguous
            assert array.flags.aligned
            assert not array.flags.writeable


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("operation", ["intersection", "union", "difference"])
def test_overlay_of_any_layout(layout: str, operation: str) -> None:
    subject = Polygon([LAYOUTS[layout]])
    result = overlay(subject, CLIP, operation)  # type: ignore[call-overload]
    (expected,) = overlay_batch([Polygon([SQUARE])], [CLIP], operation)  # type: ignore[arg-type,misc]
    assert expected is not None
    for name in ("vertices", "ring_offsets", "piece_offsets"):
        assert getattr(result, name).tolist() == getattr(expected, name).tolist()
        assert not getattr(result, name).flags.writeable
