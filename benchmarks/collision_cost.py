"""What each way of reducing the quadratic cost of collision saves: the table of docs/collision_cost.md.

python -m benchmarks collision_cost [--quick]

One thread, two generated bodies near contact; every figure is the best of three runs. Nothing needs peers or data.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator

import numpy as np

import engine
from benchmarks.bodies import Pair, belted_ball, bumpy_pair, crowd, near_contact
from benchmarks.measure import clocked
from benchmarks.page import seconds
from benchmarks.workloads import Mesh
from engine.textbook import collision

Line = tuple[str, str, str]
"""The approach, its time in words, what it settles."""


def best(run: Callable[[], object], n_items: int = 1) -> str:
    """Return the least time an item of three runs, in words."""
    run()
    return seconds(min(clocked(run)[0] for _ in range(3)) / n_items)


def ask(pair: Pair, **options: bool) -> Callable[[], np.ndarray]:
    first, second = pair.solids()
    engine.collide_poses(first, second, pair.rotations[:1], pair.translations[:1])  # builds what is kept
    return lambda: engine.collide_poses(first, second, pair.rotations, pair.translations, workers=1, **options)


def naive(times: int) -> Line:
    """Every edge against every face, for a pose without contact: nothing ends the loops early."""
    pair = bumpy_pair("cost", times, 50)
    free = int(np.flatnonzero(ask(pair)() == engine.Relation.DISJOINT)[0])
    moved = np.ascontiguousarray(pair.second.vertices @ pair.rotations[free].T + pair.translations[free])
    faces = pair.first.faces.astype(np.int64), pair.second.faces.astype(np.int64)
    took = best(lambda: collision.by_edges(pair.first.vertices, faces[0], moved, faces[1]))
    return f"all pairs, {len(faces[0]):,} x {len(faces[1]):,} faces", took, "everything, in float64 only"


def volumes(pair: Pair) -> Iterator[Line]:
    """One bounding volume for each body: near contact, and at places of a scene ten bodies wide."""
    n, middles, radii, random = len(pair.rotations), [], [], np.random.default_rng(1)
    for mesh in (pair.first, pair.second):
        middles.append(0.5 * (mesh.vertices.min(0) + mesh.vertices.max(0)))
        radii.append(np.linalg.norm(mesh.vertices - middles[-1], axis=1).max())
    low, high = pair.first.vertices.min(0), pair.first.vertices.max(0)
    half = 0.5 * (pair.second.vertices.max(0) - pair.second.vertices.min(0))
    scattered = middles[0] + random.uniform(-1, 1, (n, 3)) * 5 * (high - low)

    def by_sphere(places: np.ndarray) -> np.ndarray:
        return np.linalg.norm(places - middles[0], axis=1) > sum(radii)

    def by_box(places: np.ndarray) -> np.ndarray:
        reach = np.abs(pair.rotations) @ half
        return ((places - reach > high) | (places + reach < low)).any(axis=1)

    places = pair.rotations @ middles[1] + pair.translations
    for name, test in (("bounding sphere", by_sphere), ("bounding box, turned with the body", by_box)):
        settled = f"{test(scattered).mean():.1%} of scattered poses, {test(places).mean():.1%} near contact"
        yield name, best(lambda test=test: test(places), n), settled


def lines(is_quick: bool) -> Iterator[Line]:
    n_poses = 200 if is_quick else 2_000
    for times in (2, 3) if is_quick else (2, 3, 4):
        yield naive(times)
    for times in (3, 4) if is_quick else (3, 4, 5):
        pair = bumpy_pair("cost", times, n_poses)
        if times == 3:
            yield from volumes(pair)
        name = f"box trees, {len(pair.first.faces):,} x {len(pair.second.faces):,} faces"
        yield name, best(ask(pair), n_poses), "five relations, exact"
    yield "the same, boolean only", best(ask(pair, boolean=True), n_poses), "disjoint or not, exact"
    first, second = pair.solids()
    poses = [engine.Pose(r, t) for r, t in zip(pair.rotations[:100], pair.translations[:100], strict=True)]
    took = best(lambda: [engine.collide(first, second, second_pose=pose, boolean=True) for pose in poses], 100)
    yield "the same, one call a pose", took, "disjoint or not, exact"
    convex = belted_ball(100, 1)
    dented = Mesh("dented", convex.vertices.copy(), convex.faces)
    dented.vertices[50] *= 0.9
    for name, mesh in (("100 vertices, box trees (one dent)", dented), ("100 vertices, convex path", convex)):
        took = best(ask(near_contact(name, mesh, mesh, True, n_poses, 1)), n_poses)
        yield name, took, "five relations, exact"
    for n_bodies in (300,) if is_quick else (1_000, 3_000):
        scene = crowd(n_bodies, 1)
        every, stand = scene.solids(), scene.poses()
        pairs = np.stack(np.triu_indices(n_bodies, 1), axis=1)
        for how, only in (("every pair's boxes", pairs), ("grid of boxes", None)):
            run = best(lambda only=only: engine.collide_scene(every, stand, only=only, workers=1))  # noqa: B023
            yield f"{n_bodies:,} bodies, {how}", run, "every colliding pair, exact"


def main(words: list[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small bodies, seconds")
    print("| approach | time | settles |\n|---|---|---|", flush=True)
    for line in lines(parser.parse_args(words).quick):
        print(f"| {' | '.join(line)} |", flush=True)
    return 0
