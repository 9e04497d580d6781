"""One pair: what a polygon holds must be of the one kind that compiled code takes, and what is made later of a small
pair is what the long way makes at once.
"""

from __future__ import annotations

import copy
import dataclasses
import pickle
from collections.abc import Callable
from typing import Any, get_args

import numpy as np
import pytest

from engine.polygon_overlay.batch import overlay_batch
from engine.polygon_overlay.compiled.kernel import PairStatus
from engine.polygon_overlay.overlay import overlay
from engine.polygon_overlay.pair_arrays import polygon_arrays_of
from engine.polygon_overlay.result import Overlay
from engine.polygon_overlay.run import SELECTED_ARRAYS, Operation, overlay_few, run_kernel
from engine.running.budget import Budget
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


FIELDS = [
    field.name for field in dataclasses.fields(Overlay) if not field.name.startswith("_") and field.name != "exact"
]
TWO = Polygon([[(0, 0), (4, 0), (4, 4), (0, 4)], [(1, 1), (2, 1), (1, 2)]]), Polygon([[(3, 3), (9, 1), (-1, 7)]])


def told(result: Overlay) -> dict[str, Any]:
    values = {name: getattr(result, name) for name in (*FIELDS, "sources", "area", "piece_areas", "collapsed")}
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in values.items()}


@pytest.mark.parametrize("operation", get_args(Operation))
def test_a_few_are_told_as_many_are(operation: Any) -> None:
    draw = np.random.default_rng(5)
    n_few = 0
    for _ in range(60):
        first, second = (
            Polygon([draw.integers(0, 4, (draw.integers(3, 9), 2)) / draw.choice([1.0, 3.0]) for _ in range(n_rings)])
            for n_rings in draw.integers(1, 3, 2)
        )
        few = overlay_few(first, second, SELECTED_ARRAYS[operation])
        if few is not None:
            n_few += 1
            assert told(few) == told(overlay(first, second, operation, report=True)[0])
    assert n_few > 30


@pytest.mark.parametrize("way", [copy.copy, lambda result: pickle.loads(pickle.dumps(result)), dataclasses.replace])
def test_a_result_that_nothing_was_asked_of_yet_is_copied(way: Callable[[Overlay], Overlay]) -> None:
    made = overlay(*TWO, "union")
    assert "vertices" not in vars(made)
    assert told(way(made)) == told(made)
    assert not made.vertices.flags.writeable
    assert made.vertices is made.vertices


def test_what_no_overlay_has_is_an_attribute_error() -> None:
    for result in (overlay(*TWO), overlay(*TWO, report=True)[0]):
        assert not hasattr(result, "verticess")
        with pytest.raises(AttributeError, match="'Overlay' object has no attribute 'vertex'"):
            result.vertex  # noqa: B018


def test_fields_are_listed_before_they_are_made() -> None:
    made = overlay(*TWO, "union")
    assert {field.name for field in dataclasses.fields(Overlay)} <= set(dir(made))
    assert "vertices" not in vars(made)


def test_many_vertices_and_doubt_are_left() -> None:
    circle = np.stack([np.cos(np.arange(300.0)), np.sin(np.arange(300.0))], axis=1)
    far = Polygon([1e200 * np.array(TWO[0].vertices[:4])])
    kept = SELECTED_ARRAYS["union"]
    assert overlay_few(Polygon([circle]), Polygon([circle]), kept) is None
    assert overlay_few(far, TWO[1], kept) is None
    near = np.nextafter(1.0, 2.0)  # rounding parts the triangles anew
    doubtful = Polygon([[(0, 0), (1, 1), (0, 1)]]), Polygon([[(0, 0), (1, near), (near, 0.5)]])
    assert overlay_few(*doubtful, kept) is None


def test_room_is_made() -> None:
    """Two combs across each other: more contacts, vertices and rings than vertices in all."""
    n = 60
    teeth = np.array([[k + 0.5 * (j > 1), 0.1 if j in (0, 3) else n] for k in range(n) for j in range(4)])
    comb = np.concatenate([teeth, [[n, 0.0], [0, 0.0]]])
    sides = [polygon_arrays_of([Polygon([each])] * 3) for each in (comb, comb[:, ::-1])]
    found = run_kernel(*sides, SELECTED_ARRAYS["intersection"], Budget())
    assert found.status.tolist() == [PairStatus.DONE] * 3
    assert len(set(found.counts[:, 0].tolist())) == 1
    assert found.counts[0, 0] > n * (n - 2)
