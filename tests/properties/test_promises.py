"""Promises that hold for every public operation: same answer on any threads, every call ends, with a report."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import engine
from tests import build
from tests.properties.examples import examples
from tests.properties.strategies import SCALES, aabb, point, polygon
from tests.reference.overlay import area, signed_area
from tests.reference.shapes import box, reversed_faces, union_of

SHELL = build.solid(union_of(box((0, 0, 0), (6, 6, 6)), reversed_faces(box((2, 2, 2), (4, 4, 4)))))
COMB = build.solid(
    {
        "type": "polygon",
        "rings": [[[x, y] for k in range(40) for x, y in ((k, 0.1 * (k % 7)), (k + 0.5, 9 - 0.3 * (k % 5)))]],
    }
)
SOURCE = np.random.default_rng(20)
POINTS = np.round(SOURCE.uniform(-1.0, 7.0, (6000, 3)) * 4.0) / 4.0
SEGMENTS = np.round(SOURCE.uniform(-1.0, 7.0, (1500, 2, 3)) * 4.0) / 4.0
TRIANGLES = SOURCE.uniform(-1.0, 7.0, (300, 3, 3))
BOX = engine.Aabb([0, 0, 0], [4, 5, 6])
ROWS = engine.Convex([[3, 1, -1, 0.1], [-1, 3, 1, 0.2], [1, -1, 3, 0.3], [-1, -1, -1, 9.1]])
POSES = np.repeat(np.eye(3)[None], 50, axis=0), np.round(SOURCE.uniform(-7.0, 7.0, (50, 3)))

CALLS: dict[str, tuple[str, tuple[Any, ...]]] = {
    "locate in a polyhedron": ("locate", (POINTS, SHELL)),
    "locate in a polygon": ("locate", (POINTS[:, :2].copy(), COMB)),
    "locate in a convex": ("locate", (POINTS, ROWS)),
    "contains in a box": ("contains", (POINTS, BOX)),
    "locate_scene": ("locate_scene", (POINTS, [SHELL, BOX, engine.Sphere([3, 3, 3], 2)])),
    "clip_segments on a box": ("clip_segments", (SEGMENTS, BOX)),
    "clip_segments on a sphere": ("clip_segments", (SEGMENTS, engine.Sphere([3, 3, 3], 2.5))),
    "clip_segments on a polyhedron": ("clip_segments", (SEGMENTS[:200], SHELL)),
    "clip_polygons": ("clip_polygons", (TRIANGLES, ROWS)),
    "overlay": ("overlay", (COMB, engine.Polygon([[[0, 1], [40, 1.5], [40, 4], [0, 4.5]]]), "difference")),
    "bounds": ("bounds", (SHELL,)),
    "collide": ("collide", (SHELL, engine.Aabb([1, 1, 1], [5, 5, 5]))),
    "collide_poses": ("collide_poses", (SHELL, engine.Aabb([1, 1, 1], [5, 5, 5]), *POSES)),
}


@pytest.fixture(params=CALLS)
def call(request: pytest.FixtureRequest) -> Callable[..., Any]:
    """Return a call of a public operation that takes the options common to all."""
    name, arguments = CALLS[request.param]
    return lambda **options: getattr(engine, name)(*arguments, **options)


def plain(result: Any) -> Any:
    """Return a result as something that compares by value."""
    if isinstance(result, np.ndarray):
        return result.tolist()
    if isinstance(result, list | tuple):
        return [plain(item) for item in result]
    if isinstance(result, engine.Solid) or hasattr(result, "__dataclass_fields__"):
        names = getattr(type(result), "__dataclass_fields__", None) or ("min", "max", "center", "radius")
        return {name: plain(getattr(result, name)) for name in names if hasattr(result, name) and name != "exact"}
    return result


def test_threads_do_not_matter(call: Callable[..., Any]) -> None:
    once = plain(call(workers=1))
    assert once == plain(call(workers=3)) == plain(call())


def test_a_report_comes_with_the_answer(call: Callable[..., Any]) -> None:
    result, accuracy = call(report=True)
    assert plain(result) == plain(call())
    assert accuracy.decisions == "exact"
    assert accuracy.coordinates_ulp is None or accuracy.coordinates_ulp >= 0.0
    assert 0 <= accuracy.n_rational <= accuracy.n_beyond_filter <= accuracy.n_items > 0
    assert accuracy.method


def test_a_passed_deadline_is_an_error(call: Callable[..., Any]) -> None:
    with pytest.raises(engine.DeadlineExceededError):
        call(deadline=0.0)


def test_a_cancelled_call_is_an_error(call: Callable[..., Any]) -> None:
    cancel = engine.Cancel()
    cancel.set()
    with pytest.raises(engine.CancelledError):
        call(cancel=cancel)


def test_progress_counts_every_item(call: Callable[..., Any]) -> None:
    counts: list[int] = []
    _, accuracy = call(progress=counts.append, report=True)
    assert sum(counts) in (accuracy.n_items, 1)  # a call about one solid or one pair is one item


@pytest.mark.parametrize("name", [name for name in CALLS if CALLS[name][0] in ("locate", "contains", "clip_segments")])
def test_chunks_and_order_do_not_matter(name: str) -> None:
    """All items at once, in parts, and backward: the same answers, item by item."""
    function, (items, solid) = CALLS[name]
    ask = getattr(engine, function)
    if function == "clip_segments":
        whole, backward = ask(items, solid), ask(items[::-1].copy(), solid)
        key = np.lexsort((backward.t[:, 0], len(items) - 1 - backward.source))
        for field in ("start", "end", "t", "faces"):
            np.testing.assert_array_equal(getattr(backward, field)[key], getattr(whole, field))
        part = ask(items[50:120], solid)
        mine = (whole.source >= 50) & (whole.source < 120)
        np.testing.assert_array_equal(part.t, whole.t[mine])
        return
    whole = ask(items, solid)
    np.testing.assert_array_equal(ask(items[::-1].copy(), solid)[::-1], whole)
    np.testing.assert_array_equal(np.concatenate([ask(part, solid) for part in np.array_split(items, 7)]), whole)


@examples(60)
@given(st.data(), SCALES, st.sampled_from([2, 3]))
def test_clipping_on_a_box_is_idempotent_and_stays_inside(data: st.DataObject, kind: str, n: int) -> None:
    region = build.solid(data.draw(aabb(kind, n)))
    segments = data.draw(st.lists(st.lists(point(kind, n), min_size=2, max_size=2), min_size=1, max_size=10))
    once = engine.clip_segments(segments, region)
    assert engine.contains(np.concatenate([once.start, once.end]), region).all()
    again = engine.clip_segments(np.stack([once.start, once.end], axis=1), region)
    np.testing.assert_array_equal(again.start, once.start)
    np.testing.assert_array_equal(again.end, once.end)
    assert (again.faces == -1).all()
    assert (again.t == (0.0, 1.0)).all()


@examples(60)
@given(st.data(), SCALES)
def test_areas_of_overlays_add_up(data: st.DataObject, kind: str) -> None:
    a, b = data.draw(polygon(kind)), data.draw(polygon(kind))

    def part(first: Any, second: Any, operation: str) -> Fraction:
        return engine.overlay(build.solid(first), build.solid(second), operation).area_exact

    try:
        common, a_only, b_only = part(a, b, "intersection"), part(a, b, "difference"), part(b, a, "difference")
        assert common + a_only == area(a)
        assert common + b_only == area(b)
        assert part(a, b, "union") == common + a_only + b_only
        assert part(a, b, "symmetric_difference") == a_only + b_only
        assert part(b, a, "intersection") == common
    except engine.NotRepresentableError:
        assert kind in ("wild", "huge", "together")


@examples(60)
@given(st.data(), SCALES, st.sampled_from(["intersection", "union", "difference", "symmetric_difference"]))
def test_overlays_are_valid(data: st.DataObject, kind: str, operation: str) -> None:
    """Shells turn left, holes right, and nothing overlaps: the even-odd area of all rings is the sum of their areas."""
    try:
        found = engine.overlay(build.solid(data.draw(polygon(kind))), build.solid(data.draw(polygon(kind))), operation)
    except engine.NotRepresentableError:
        return
    rings = [ring.tolist() for ring in found.rings]
    for piece in found.pieces:
        assert signed_area([map(Fraction, p) for p in piece.shell.tolist()]) > 0
        assert all(signed_area([map(Fraction, p) for p in hole.tolist()]) < 0 for hole in piece.holes)
    if rings:
        total = sum(signed_area([map(Fraction, p) for p in ring]) for ring in rings)
        assert area({"type": "polygon", "rings": rings}) == total
    assert len(found.pieces) == found.n_pieces
