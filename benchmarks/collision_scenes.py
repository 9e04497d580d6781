"""Rows of collision for small bodies: convex polyhedra pose by pose, and 10,000 bodies against each other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import cache, partial

import numpy as np

import engine
from benchmarks import workloads
from benchmarks.contenders import Absent, load
from benchmarks.measure import clocked, interleaved, ratios, spread
from benchmarks.poses import Pair, near_contact, random_rotations
from benchmarks.settled import judged
from benchmarks.suite import Row, Suite

BALLS = {10: (4, 2), 32: (10, 3), 100: (14, 7), 200: (18, 11)}
"""Vertices, and how these stand: so many around each of so many belts, and one at either pole."""
CONVEX = {10: (3.0, 4.0), 32: (2.0, 3.0), 100: (1.3, 3.0), 200: (1.0, 3.0)}
"""Must and aim against coal, net of its call overhead."""
CROWD = (10.0, 20.0)
FILLING = 1.25
"""Side of a body's share of space, in radii of the ball around the body: most have one or two neighbours in contact."""


def belted_ball(n_vertices: int, seed: int) -> workloads.Mesh:
    """Return a convex polyhedron: the vertices of staggered belts on a sphere, under a random linear map."""
    n_around, n_belts = BALLS[n_vertices]
    heights = -np.cos(np.pi * (np.arange(n_belts) + 1) / (n_belts + 1))
    turns = 2 * np.pi * (np.arange(n_around)[None, :] + np.arange(n_belts)[:, None] / 2) / n_around
    radii = np.sqrt(1 - heights**2)[:, None]
    belts = np.stack([radii * np.cos(turns), radii * np.sin(turns), np.broadcast_to(heights[:, None], turns.shape)], -1)
    vertices = np.concatenate([[[0, 0, -1.0]], belts.reshape(-1, 3), [[0, 0, 1.0]]])
    here = np.arange(n_around)
    there, top = (here + 1) % n_around, len(vertices) - 1
    faces = [
        np.stack([0 * here, 1 + there, 1 + here], 1),
        np.stack([0 * here + top, top - n_around + here, top - n_around + there], 1),
    ]
    for start in range(1, top - n_around, n_around):
        a, b = start + here, start + there
        faces += [np.stack([a, b, a + n_around], 1), np.stack([b, b + n_around, a + n_around], 1)]
    name = f"belted_ball_{n_vertices}"
    random = workloads.generator(name, seed)
    stretch = random_rotations(random, 1)[0] * random.uniform(0.6, 1.0, 3)
    return workloads.Mesh(name, np.ascontiguousarray(vertices @ stretch), np.concatenate(faces))


@dataclass(frozen=True, slots=True, eq=False)
class Crowd:
    """Many bodies, few solids: which solid each body is, and where it stands."""

    name: str
    meshes: list[workloads.Mesh]
    kinds: np.ndarray
    rotations: np.ndarray
    translations: np.ndarray

    def frames(self) -> list[Crowd]:
        """Return the crowd a step away, every body moved, and as it stands."""
        random = workloads.generator(self.name, 1)
        step = random.uniform(-0.25, 0.25, self.translations.shape)
        return [replace(self, translations=self.translations + step), self]


@cache
def crowd(n_bodies: int, seed: int) -> Crowd:
    """Return bodies of 10 vertices at random places of a cube, turned at random, as many as meet a neighbour or two."""
    name = f"crowd_{n_bodies}"
    random = workloads.generator(name, seed)
    side = FILLING * n_bodies ** (1 / 3)
    meshes = [belted_ball(10, seed + number) for number in range(8)]
    return Crowd(
        name,
        [workloads.Mesh(mesh.name, 0.5 * mesh.vertices, mesh.faces) for mesh in meshes],
        random.integers(0, len(meshes), n_bodies),
        random_rotations(random, n_bodies),
        random.uniform(0.0, side, (n_bodies, 3)),
    )


def scene_tasks(
    suite: Suite, bare_call: Callable[[str], float]
) -> Iterator[tuple[str, Callable[[str], Iterable[Row]]]]:
    """Yield these rows; bare_call: seconds of a peer's trivial call."""
    for n_vertices, goals in CONVEX.items():
        yield f"convex, {n_vertices} vertices, net vs coal", partial(_convex, suite, bare_call, n_vertices, goals)
    n_bodies = 1_000 if suite.options.quick else 10_000
    yield f"{n_bodies:,} bodies, all pairs, vs fcl's manager", partial(_crowd, suite, n_bodies)


@cache
def convex_pair(n_vertices: int, n_poses: int, seed: int) -> Pair:
    """Return two convex polyhedra near contact."""
    first, second = belted_ball(n_vertices, seed), belted_ball(n_vertices, seed + 1)
    return near_contact(first.name, first, second, True, n_poses, seed)


def _convex(
    suite: Suite, bare_call: Callable[[str], float], n_vertices: int, goals: tuple[float, float], name: str
) -> Iterable[Row]:
    chosen, module = suite.options, load("coal_calls")
    row = Row(name, "x", *goals)
    if isinstance(module, Absent):
        row.note = f"coal does not run here: {module.reason}"
        yield row
        return
    n_poses = 1_000 if chosen.quick else 20_000
    pair = convex_pair(n_vertices, n_poses, chosen.seed)
    contenders = [load(contender).MAKERS["convex_pair"](pair, 1) for contender in ("ours", "coal_calls")]
    asked = [contender.native(np.arange(n_poses)) for contender in contenders]
    runs = [partial(contender.ask, poses) for contender, poses in zip(contenders, asked, strict=True)]
    (a, b), found = interleaved(runs, chosen.rounds, chosen.seconds)
    ours, theirs = (contender.answer(each) for contender, each in zip(contenders, found, strict=True))
    differ, counts = judged(pair, ours, theirs, module.NAME)
    bare = bare_call("coal_calls") * n_poses
    net = spread([(peer - bare) / mine for mine, peer in zip(a.wall, b.wall, strict=True)])
    gross, _ = ratios(a, b)
    row.value, row.low, row.high = net.median, net.low, net.high
    row.cpu_value = spread([(peer - bare) / mine for mine, peer in zip(a.cpu, b.cpu, strict=True)]).median
    row.ours, row.peer = (f"{timing.median / n_poses * 1e6:.3g} us" for timing in (a, b))
    row.note = (
        f"gross {gross.median:.3g}; bare call {bare / n_poses * 1e6:.3g} us; {n_poses} poses, {ours.mean():.0%} "
        f"collide; {differ}"
    )
    row.raw |= {"ours": asdict(a), "peer": asdict(b), "bare_call": bare / n_poses, "net": asdict(net), **counts}
    yield row


def _crowd(suite: Suite, n_bodies: int, name: str) -> Iterable[Row]:
    chosen, module = suite.options, load("fcl_calls")
    row = Row(name, "x", *CROWD)
    if isinstance(module, Absent):
        row.note = f"fcl does not run here: {module.reason}"
        yield row
        return
    bodies = crowd(n_bodies, chosen.seed)
    ours = load("ours").MAKERS["crowd"](bodies, 1)
    build, _, peer = clocked(partial(module.MAKERS["crowd"], bodies, 1))
    runs = [partial(ours.ask, None), partial(peer.ask, None)]
    (a, b), found = interleaved(runs, min(chosen.rounds, 7), chosen.seconds)
    mine, theirs = ours.answer(found[0]), peer.answer(found[1])
    wall, cpu = ratios(a, b)
    row.value, row.low, row.high, row.cpu_value = wall.median, wall.low, wall.high, cpu.median
    row.ours, row.peer = (f"{timing.median * 1e3:.3g} ms" for timing in (a, b))
    row.note = (
        f"{len(mine)} colliding pairs, {len(np.setxor1d(mine, theirs))} differ; ours starts from solids and poses, "
        f"fcl from its tree, made in {build * 1e3:.3g} ms"
    )
    row.raw |= {"ours": asdict(a), "peer": asdict(b), "build": build}
    yield row
    yield _moving(suite, bodies, n_bodies)
    yield _all_relations(bodies, n_bodies)


def _moving(suite: Suite, bodies: Crowd, n_bodies: int) -> Row:
    """The crowd, every body moved before each question: fcl updates its tree, ours starts from nothing as always."""
    chosen, row = suite.options, Row(f"{n_bodies:,} bodies, all moved before, vs fcl's manager", "x")
    ours, peer = (load(name).MAKERS["moving_crowd"](bodies, 1) for name in ("ours", "fcl_calls"))
    asked = [contender.native(np.arange(n_bodies)) for contender in (ours, peer)]
    runs = [partial(contender.ask, frames) for contender, frames in zip((ours, peer), asked, strict=True)]
    (a, b), found = interleaved(runs, min(chosen.rounds, 5), chosen.seconds)
    differ = len(np.setxor1d(ours.answer(found[0]), peer.answer(found[1])))
    wall, cpu = ratios(a, b)
    row.value, row.low, row.high, row.cpu_value = wall.median, wall.low, wall.high, cpu.median
    n_frames = len(asked[0])
    row.ours, row.peer = (f"{timing.median / n_frames * 1e3:.3g} ms" for timing in (a, b))
    row.note = f"{differ} pairs differ; fcl: new transforms, update, all pairs; ours: all pairs under new poses"
    row.raw |= {"ours": asdict(a), "peer": asdict(b)}
    return row


def _all_relations(bodies: Crowd, n_bodies: int) -> Row:
    """How many pairs of the crowd the float path decides: the rest costs what `collide` costs."""
    solids = [engine.Polyhedron(mesh.vertices, mesh.faces) for mesh in bodies.meshes]
    poses = [engine.Pose(turn, move) for turn, move in zip(bodies.rotations, bodies.translations, strict=True)]
    seconds, _, (_, accuracy) = clocked(
        partial(engine.collide_scene, [solids[kind] for kind in bodies.kinds], poses, workers=1, report=True)
    )
    row = Row(f"{n_bodies:,} bodies, first question", "s", value=seconds)
    row.note = f"{accuracy.n_items} pairs of boxes meet, {accuracy.n_beyond_filter} of them beyond the float path"
    return row
