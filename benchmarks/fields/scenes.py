"""Stored scenes: segments through many bodies, changes after some moved, single questions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from itertools import cycle
from typing import Any

import numpy as np

import engine
from benchmarks.answers.shapes import BOX, corners
from benchmarks.bodies import Crowd, belted_ball, crowd
from benchmarks.contenders import Prepared
from benchmarks.contest import Contender, Contest, Goals, Size, Task, field_of
from benchmarks.errors import meets, same
from benchmarks.fields.containment import same_rows, summed
from benchmarks.workloads import Bodies, Mesh, generator

SINGLE: dict[str, Goals] = {"open3d": (1.0, 2.0), "trimesh": (1.0, 2.0)}
KEEP: dict[str, dict[str, Goals]] = {"all": SINGLE, "first": {"open3d": (1.0, 2.0)}, "any": SINGLE}
"""Which pieces are returned: of every body met, or whether any is; against rays with all hits, the first, or any."""
Ways = dict[str, tuple[Callable[[Any], object], Goals]]
"""Variants of ours: suffix of the name, question, and goal of the ratio."""


def tasks(size: Size) -> Iterator[Task]:
    """Yield the rows."""
    n_bodies = size.of(1_000, 100)
    for keep in KEEP:
        for n_segments in (1, 10, 100, 100_000):
            yield Task(f"{n_segments:,} segments, {keep}", partial(_through, size, n_bodies, keep, n_segments, False))
        yield Task(f"10,000 segments that graze, {keep}", partial(_through, size, n_bodies, keep, 10_000, True))
    yield Task("100 of 10,000 bodies moved", partial(_moved, size))
    yield Task("points in a kept scene", partial(_points, size))
    for what in ("point", "segment", "moved body"):
        yield Task(f"one {what}, a kept scene of 10,000", partial(_one, size, what))


@cache
def scattered(n_bodies: int, seed: int, has_balls: bool) -> Bodies:
    """Return bodies of radius 0.04 in the unit cube, smaller where they are more: boxes, meshes of 1,000 faces, balls.

    Balls stand as meshes of as many faces, which ours takes as balls where they are named so.
    """
    name, kinds = f"scattered {n_bodies}", ("box", "mesh", "ball" if has_balls else "mesh")
    shapes = (Mesh("", corners(np.full(3, -0.7), np.full(3, 0.7)), BOX), belted_ball(502, seed),
              belted_ball(502, seed, is_round=True))  # fmt: skip
    radius = 0.04 / max(1.0, n_bodies / 1000) ** (1 / 3)
    centers = generator(name, seed).uniform(0.0, 1.0, (n_bodies, 3))
    return Bodies(name, [
        Mesh(kinds[k % 3], center + radius * shapes[k % 3].vertices, shapes[k % 3].faces)
        for k, center in enumerate(centers)
    ])  # fmt: skip


def _segments(bodies: Bodies, n: int, is_grazing: bool, seed: int) -> np.ndarray:
    """Return segments of the unit cube, or ones through vertices and middles of edges of the bodies."""
    draw = generator(f"{bodies.name} segments {n}", seed)
    if not is_grazing:
        return draw.uniform(0.0, 1.0, (n, 2, 3))
    sides = np.concatenate([body.vertices[body.faces[:, :2]] for body in bodies.bodies])
    share = np.where(draw.random((n, 1)) < 0.5, 0.0, 0.5)
    start, end = sides[draw.integers(len(sides), size=n)].transpose(1, 0, 2)
    on, way = start * (1 - share) + end * share, draw.normal(size=(n, 3)) * 0.25
    return np.stack([on - way, on + way], axis=1)


def _through(size: Size, n_bodies: int, keep: str, n_segments: int, is_grazing: bool) -> Contest:
    """Segments through a scene, compared by the number of bodies a segment meets and the sum of their numbers, or by
    whether it meets any.

    Segments that graze are judged, without balls, whose meshes would have other answers.
    """
    bodies = scattered(n_bodies, size.seed, not is_grazing)
    segments = _segments(bodies, n_segments if n_segments <= 100 else size.n(n_segments), is_grazing, size.seed)
    result = field_of(f"scene {keep}", bodies, KEEP[keep], 1)

    def exact(rows: np.ndarray) -> np.ndarray:
        met = [[n for n, body in enumerate(bodies.bodies) if meets(segments[row], body)] for row in rows.tolist()]
        return np.array([(len(owners), sum(owners)) for owners in met] if keep == "all" else list(map(bool, met)))

    if keep == "all":
        result = [replace(each, make=partial(summed, each, n_bodies)) for each in result]
    name = f"{n_segments:,} segments{' that graze' * is_grazing}, {keep}"
    return Contest("scenes", name, is_grazing, segments, exact if is_grazing else None,
                   same_rows if keep == "all" else same, result, most=50)  # fmt: skip


@cache
def _kept(n_bodies: int, seed: int) -> tuple[engine.Scene, Crowd]:
    bodies = crowd(n_bodies, seed)
    return engine.Scene(bodies.solids(), bodies.poses()), bodies


def _scene(size: Size) -> tuple[engine.Scene, Crowd]:
    return _kept(size.of(10_000, 1_000), size.seed)


def _ours(name: str, asks: Ways, count: int) -> Contest:
    """Return a contest between variants of ours; the first is the reference."""
    result = [Contender(f"ours{about}", lambda ask=ask: Prepared(ask, answer=lambda _: None), goals=goals)
             for about, (ask, goals) in asks.items()]  # fmt: skip
    return Contest("scenes", name, False, None, None, same, result, count=count)


def _moved(size: Size) -> Contest:
    """New pairs after one body in a hundred took a step, against all pairs, and against fcl's manager of them all."""
    (scene, bodies), draw = _scene(size), generator("moved", size.seed)
    solids, poses, named = list(scene.solids), list(scene.poses), draw.choice(len(scene), len(scene) // 100, False)
    turns, places = bodies.rotations[named], bodies.translations[named]

    def step(_: object) -> object:
        steps = places + draw.uniform(-0.01, 0.01, places.shape)
        moved = {int(body): engine.Pose(*pose) for body, *pose in zip(named, turns, steps)}
        return scene.moved(moved).collide(moved=named.tolist())

    every: Ways = {"": (step, (None, None)), ", all pairs": (lambda _: engine.collide_scene(solids, poses), (20, 50))}
    made = _ours("100 of 10,000 bodies moved", every, 1)
    peers = [replace(each, make=partial(_frame, each, bodies)) for each in field_of("crowd", bodies, {"fcl": (3, 6)})]
    return replace(made, contenders=[*made.contenders, *peers[1:]])


def _frame(one: Contender, bodies: Crowd) -> Prepared:
    """Return a contender that sets every body's pose, and computes all pairs."""
    made = one.make()
    frames = made.native([bodies])
    return Prepared(lambda _: made.ask(frames))


def _points(size: Size) -> Contest:
    scene, bodies = _scene(size)
    points = generator("kept", size.seed).uniform(0.0, bodies.translations.max(), (size.n(1_000_000), 3))
    solids, poses = list(scene.solids), list(scene.poses)
    asks: Ways = {"": (lambda _: scene.locate(points), (None, None)),
                  ", locate_scene": (lambda _: engine.locate_scene(points, solids, poses), (1.0, None))}  # fmt: skip
    return _ours("points in a kept scene", asks, len(points))


def _one(size: Size, what: str) -> Contest:
    """Ours alone; must be below 60 us, aim 30."""
    (scene, bodies), draw = _scene(size), generator(f"one {what}", size.seed)
    starts, body = cycle(draw.uniform(0.0, bodies.translations.max(), (64, 3))), int(draw.integers(len(scene)))
    turn, place = bodies.rotations[body], bodies.translations[body]

    def ask(_: object) -> object:
        start = next(starts)
        if what == "point":
            return scene.locate(start[None])
        if what == "segment":
            return scene.clip_segments(np.stack([start, start + 1.0])[None])
        return scene.moved({body: engine.Pose(turn, place + 1e-3 * start)}).collide(moved=[body])

    return _ours(f"one {what}, a kept scene of 10,000", {"": (ask, (None, None))}, 1)
