"""Work for minutes ends when its deadline passes and when it is cancelled: every operation of `engine.__all__`.

An operation that takes a deadline and is not in `WORK` fails, so that a new one cannot be forgotten; the same questions
over HTTP are in test_deadlines.py. `FIRST` asks about a mesh of 800,000 faces of which nothing is prepared yet. What
counts is CPU time after the end.
"""

from __future__ import annotations

import inspect
import pickle
import threading
import time
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

import engine
from tests.contract.test_deadlines import (
    MANY_SIDES,
    TIN,
    TINY,
    ZIGZAG,
    across,
    ball,
    check_ends,
    circle,
    comb,
    far_apart,
    prism,
    stripes,
)
from tests.contract.test_deadlines import vanishing as vanishing_terms

DEADLINE, SOON = 0.2, 0.05


def made(document: dict[str, Any]) -> Any:
    fields = {key: value for key, value in document.items() if key != "type"}
    kinds = {"polyhedron": engine.Polyhedron, "convex": engine.Convex, "implicit": engine.Implicit,
             "polygon": engine.Polygon}  # fmt: skip
    return kinds[document["type"]](**fields)


MADE: dict[str, Callable[[], Any]] = {
    "vanishing": lambda: made(vanishing_terms(400)),
    "tin": lambda: made(TIN),
    "large tin": lambda: made(prism(circle(4_000))),
    "comb": lambda: engine.Polygon([comb(3_000)]),
    "many sides": lambda: made(MANY_SIDES),
    "ball": lambda: made(ball(9_000)),
    "fine": lambda: fine_ball(640),
}


@cache
def solid(name: str) -> Any:
    """Return the solid of the requests, made once."""
    return MADE[name]()


def fine_ball(n: int) -> engine.Polyhedron:
    """Return a ball of 2 n (n - 1) faces, by longitude and latitude."""
    turns, rises = np.linspace(0, 2 * np.pi, n, endpoint=False), np.linspace(-np.pi / 2, np.pi / 2, n + 1)[1:-1]
    rows = [np.c_[np.cos(rise) * np.cos(turns), np.cos(rise) * np.sin(turns), np.full(n, np.sin(rise))]
            for rise in rises]  # fmt: skip
    vertices = np.concatenate([*rows, [[0, 0, -1], [0, 0, 1]]])
    a = np.arange(n - 2)[:, None] * n + np.arange(n)
    b = np.arange(n - 2)[:, None] * n + (np.arange(n) + 1) % n
    quads = np.concatenate([np.stack([a, b, b + n], axis=2), np.stack([a, b + n, a + n], axis=2)]).reshape(-1, 3)
    first, follow = np.arange(n), (np.arange(n) + 1) % n
    south = np.stack([np.full(n, len(vertices) - 2), follow, first], axis=1)
    north = np.stack([np.full(n, len(vertices) - 1), first + (n - 2) * n, follow + (n - 2) * n], axis=1)
    return engine.Polyhedron(vertices, np.concatenate([quads, south, north]))


def new(body: Any) -> Any:
    """Return the same solid with nothing prepared."""
    return pickle.loads(pickle.dumps(body))


def poses(n: int, z: float) -> tuple[Any, Any]:
    return np.tile(np.eye(3), (n, 1, 1)), np.tile([0.0, 0.5, z], (n, 1))


@cache
def far_pair() -> tuple[Any, Any]:
    """Return polygons whose exponents only integers hold."""
    question = far_apart()
    return made(question["subject"]), made(question["clip"])


@cache
def arrows() -> tuple[Any, Any]:
    """Return the vertices and faces of prisms whose ends are not convex, of which each is looked at by itself."""
    tip = np.array([[0, 0], [2, 1], [0, 2], [1, 1]])
    corners = np.concatenate([np.c_[tip, np.zeros(4)], np.c_[tip, np.ones(4)]])
    faces = np.array([[3, 2, 1, 0], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
    numbers = np.arange(100_000)[:, None, None]
    return (corners + numbers * [3.0, 0.0, 0.0]).reshape(-1, 3), (faces + 8 * numbers).reshape(-1, 4)


@cache
def soup() -> tuple[Any, Any]:
    """Return the vertices and faces of three fine balls side by side, in which no two faces share a vertex."""
    corners = solid("fine").vertices[solid("fine").triangles.ravel()]
    vertices = np.concatenate([corners + k * np.array([3.0, 0.0, 0.0]) for k in range(3)])
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


@cache
def in_lists() -> tuple[Any, Any]:
    """Return a fine ball as lists."""
    return solid("fine").vertices.tolist(), solid("fine").triangles.tolist()


@cache
def nested() -> tuple[Any, Any]:
    """Return a surface and a ball in its middle: every face is nearly as far as every other."""
    outer, inner = fine_ball(300), fine_ball(300)
    return engine.Surface(outer.vertices, outer.triangles), engine.Polyhedron(0.5 * inner.vertices, inner.triangles)


@cache
def wrinkled() -> tuple[Any, Any]:
    ball = fine_ball(300)
    sizes = np.random.default_rng(0).uniform(0.99, 1.0, (len(ball.vertices), 1))
    return ball.vertices * sizes, ball.triangles


def vast() -> Any:
    """Return two balls that are not convex, with nothing prepared: no point sees all of their faces."""
    vertices, faces = wrinkled()
    return engine.Polyhedron(
        np.concatenate([vertices, vertices + np.array([4.0, 0.0, 0.0])]), np.concatenate([faces, faces + len(vertices)])
    )


@cache
def spread_out() -> Any:
    """Return surfaces whose exponents only integers hold."""
    vertices, faces = wrinkled()
    return engine.Surface(
        np.concatenate([vertices * 1e150, vertices[:3] * 1e-200]),
        np.concatenate([faces, len(vertices) + np.arange(3)[None]]),
    )


def fan(n: int) -> list[Any]:
    """Return thin triangles that all cross each other."""
    turns = np.pi * np.arange(n) / n
    ends = np.c_[np.cos(turns), np.sin(turns)]
    return [np.stack([end, -end, -end + 0.01 * end[::-1]]) for end in ends]


@cache
def crossing_triangles() -> tuple[Any, Any]:
    """Return thin triangles through the origin, nearly all of which cross each other."""
    draw = np.random.default_rng(0)
    ends = draw.normal(size=(5_000, 3))
    corners = np.stack([ends, -ends, -ends + 0.01 * draw.normal(size=ends.shape)], axis=1)
    return corners.reshape(-1, 3), np.arange(15_000).reshape(-1, 3)


POSE = engine.Pose(np.eye(3), [0, 0, 1])
ALONG = np.tile([[-1.0, 0.0], [9_000.0, 0.0]], (20_000, 1, 1))
IN_A_FACE = np.tile([[-2.0, 0.1, 0.0], [2.0, 0.2, 0.0]], (60_000, 1, 1))
CHORDS = np.tile([[-2.0, 0.1], [2.0, 0.2]], (60_000, 1, 1))
POINTS = np.tile([3.0, 5.0], (100_000, 1))
TINS = [None, POSE] * 30
LINES = [np.tile([[-1.0, 0.0], [9_000.0, 0.0]], (10, 1))] * 1_000
IN_A_PLANE = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [-1.0, 0.0, 1.0]])
SIZES = [[1e200], [1e-200], [1.0]], [[1e-150], [1e150], [3.0]]
FAR = [np.tile(IN_A_PLANE * sizes, (100_000, 1, 1)) for sizes in SIZES]
"""Triangles of one plane whose exponents only integers hold."""
WORK: dict[str, Callable[..., Any]] = {
    "split": lambda **options: engine.split(
        engine.Polygon([*stripes(300)]), [[[k, -1.0], [k + 0.5, 9_000.0]] for k in range(900)], **options
    ),
    "Polygon": lambda **end: engine.Polygon(
        {"type": "MultiPolygon", "coordinates": [[bar] for bar in [*stripes(1_500), *across(1_500), TINY]]}, **end
    ),
    "Polyhedron": lambda **end: engine.Polyhedron(*arrows(), **end),
    "Scene.clip_segments": lambda **end: engine.Scene([solid("comb")]).clip_segments(ALONG, **end),
    "Scene.collide": lambda **end: engine.Scene([solid("tin")] * 60, TINS).collide(**end),
    "Scene.hits": lambda **end: engine.Scene([solid("tin")]).hits(IN_A_FACE, **end),
    "Scene.locate": lambda **end: engine.Scene([solid("vanishing")]).locate(POINTS, **end),
    "Surface": lambda **end: engine.Surface(*arrows(), **end),
    "bounds": lambda **end: engine.bounds(new(solid("ball")), **end),
    "area": lambda **end: engine.area(spread_out(), **end),
    "centroid": lambda **end: engine.centroid(vast(), **end),
    "volume": lambda **end: engine.volume(vast(), **end),
    "cut": lambda **end: engine.cut(vast(), engine.HalfSpace([0, 0, 1], -0.5), **end),
    "section": lambda **end: engine.section(vast(), np.linspace(0.1, 0.9, 99), **end),
    "overlap_volume": lambda **end: engine.overlap_volume(vast(), engine.Aabb([-1] * 3, [1] * 3), **end),
    "iou": lambda **end: engine.iou(vast(), engine.Aabb([-1] * 3, [1] * 3), **end),
    "clearance": lambda **end: engine.clearance(*nested(), **end),
    "clearance_poses": lambda **end: engine.clearance_poses(solid("tin"), solid("tin"), *poses(10_000, 3.0), **end),
    "distances": lambda **end: engine.distances(POINTS, solid("many sides"), **end),
    "Scene.distances": lambda **end: engine.Scene([solid("many sides")]).distances(POINTS, **end),
    "clip_lines": lambda **end: engine.clip_lines(LINES, solid("comb"), **end),
    "clip_polygons": lambda **end: engine.clip_polygons([[ZIGZAG]] * 4, solid("many sides"), **end),
    "clip_segments": lambda **end: engine.clip_segments(ALONG, solid("comb"), **end),
    "collide": lambda **end: engine.collide(solid("large tin"), solid("large tin"), second_pose=POSE, **end),
    "collide_poses": lambda **end: engine.collide_poses(solid("tin"), solid("tin"), *poses(10_000, 1.0), **end),
    "collide_scene": lambda **end: engine.collide_scene([solid("tin")] * 60, TINS, **end),
    "collide_triangles": lambda **end: engine.collide_triangles(*FAR, **end),
    "compare": lambda **end: engine.compare("clip_segments", CHORDS, solid("many sides"), **end),
    "contains": lambda **end: engine.contains(POINTS, solid("vanishing"), **end),
    "filled": lambda **end: engine.filled(fan(1_500), "non_zero", **end),
    "hits": lambda **end: engine.hits(IN_A_FACE, solid("tin"), **end),
    "inspect": lambda **end: engine.inspect(crossing_triangles(), **end),
    "locate": lambda **end: engine.locate(POINTS, solid("vanishing"), **end),
    "locate_scene": lambda **end: engine.locate_scene(POINTS, [solid("vanishing")], **end),
    "overlay": lambda **end: engine.overlay(*far_pair(), "union", **end),
    "overlay_batch": lambda **end: engine.overlay_batch(*([each] * 100 for each in far_pair()), "union", **end),
    "union_all": lambda **end: engine.union_all([engine.Polygon([ring]) for ring in fan(1_500)], **end),
}
SPREAD = np.random.default_rng(0).uniform(-1, 1, (100_000, 3))
MANY = np.tile(SPREAD, (50, 1))
FIRST: dict[str, Callable[..., Any]] = {
    "Polyhedron": lambda body, **end: engine.Polyhedron(*soup(), **end),
    "Polyhedron, lists": lambda body, **end: engine.Polyhedron(*in_lists(), **end),
    "Surface": lambda body, **end: engine.Surface(*soup(), **end),
    "Scene.locate": lambda body, **end: engine.Scene([body], [POSE]).locate(SPREAD, **end),
    "bounds": lambda body, **end: engine.bounds(body, **end),
    "clearance": lambda body, **end: engine.clearance(body, new(body), second_pose=POSE, **end),
    "clip_segments": lambda body, **end: engine.clip_segments(SPREAD.reshape(-1, 2, 3), body, **end),
    "collide": lambda body, **end: engine.collide(body, new(body), second_pose=POSE, **end),
    "collide_poses": lambda body, **end: engine.collide_poses(body, new(body), *poses(10, 1.0), **end),
    "distances": lambda body, **end: engine.distances(MANY, body, **end),
    "hits": lambda body, **end: engine.hits(SPREAD.reshape(-1, 2, 3), body, **end),
    "locate": lambda body, **end: engine.locate(SPREAD, body, **end),
    "locate, cells": lambda body, **end: engine.locate(MANY, body, **end),
    "locate_scene": lambda body, **end: engine.locate_scene(SPREAD, [body], [POSE], **end),
}


def operations() -> set[str]:
    """Return the public names that take a deadline, methods too."""
    found = set()
    for name in engine.__all__:
        public = getattr(engine, name)
        own = {name: public}
        if inspect.isclass(public):
            methods = inspect.getmembers(public, inspect.isfunction)
            own |= {f"{name}.{key}": value for key, value in methods if key[0] != "_"}
        for full, each in own.items():
            if callable(each) and "deadline" in inspect.signature(each).parameters:
                found.add(full)
    return found


@pytest.fixture(scope="module", autouse=True)
def _warm() -> None:
    prepare()


@cache
def prepare() -> None:
    """Compile, which nothing interrupts, and make what takes long to make."""
    engine.warm()
    for name in MADE:
        solid(name)
    arrows(), soup(), in_lists(), nested(), far_pair()
    engine.compare("clip_segments", CHORDS[:1], solid("many sides"))


def cpu_after(call: Callable[..., Any], seconds: float, is_cancelled: bool) -> float:
    """Return the seconds of CPU that a call takes after its deadline, or after it was cancelled; it must not end."""
    at_the_end: list[float] = []
    switch = engine.Cancel()

    def end() -> None:
        at_the_end.append(time.process_time())
        if is_cancelled:
            switch.set()

    timer = threading.Timer(seconds, end)
    timer.start()
    try:
        with pytest.raises(engine.CancelledError if is_cancelled else engine.DeadlineExceededError):
            call(**({"cancel": switch} if is_cancelled else {"deadline": seconds}))
        spent = time.process_time()
    finally:
        timer.join()
    return spent - at_the_end[0]


def test_every_operation_has_its_work() -> None:
    assert set(WORK) == operations()


@pytest.mark.some(30)
@pytest.mark.parametrize("is_cancelled", [False, True])
@pytest.mark.parametrize("name", WORK)
def test_work_ends(name: str, is_cancelled: bool) -> None:
    check_ends(lambda: cpu_after(WORK[name], DEADLINE, is_cancelled))


@pytest.mark.parametrize("name", FIRST)
def test_building_for_a_first_question_ends(name: str) -> None:
    check_ends(lambda: cpu_after(partial(FIRST[name], new(solid("fine"))), SOON, False))


@pytest.mark.some(2)
@pytest.mark.parametrize("seconds", [0.05, 0.4, 1.5, 3.0])
def test_nine_million_crossings_end_in_every_stage(seconds: float) -> None:
    bars = [engine.Polygon([ring]) for ring in [*stripes(1_500), *across(1_500), TINY]]
    check_ends(lambda: cpu_after(partial(engine.union_all, bars), seconds, False))


@pytest.mark.parametrize("seconds", [0.1, 0.3])
def test_an_area_in_integers_ends_in_every_stage(seconds: float) -> None:
    solid = spread_out()
    check_ends(lambda: cpu_after(partial(engine.area, solid), seconds, False))


@pytest.mark.parametrize("seconds", [0.1, 0.8, 2.2])
def test_an_overlay_in_integers_ends_in_every_stage(seconds: float) -> None:
    """After the crossings come the faces, their labels and the rings."""
    pair = [engine.Polygon([*(ring[::-1] for ring in rings), TINY]) for rings in (stripes(300), across(300))]
    check_ends(lambda: cpu_after(partial(engine.overlay, *pair, "symmetric_difference"), seconds, False))
