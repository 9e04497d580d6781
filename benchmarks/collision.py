"""Speed and error of collision, row by row: ``python -m benchmarks.collision [--quick]``.

One thread unless a row says otherwise. Peers are called once a pose from Python, as their users must; what a bare call
costs is measured on two far triangles, and every ratio is shown gross and net of it.
"""

from __future__ import annotations

import gzip
import json
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from functools import cache, partial
from itertools import pairwise

import numpy as np

import engine
from benchmarks import workloads
from benchmarks.collision_scenes import scene_tasks
from benchmarks.contenders import Absent, Prepared, load
from benchmarks.measure import clocked, interleaved, ratios, spread
from benchmarks.poses import Pair, pair_of_size, random_rotations
from benchmarks.settled import judged
from benchmarks.suite import Row, Suite, of_seconds, options

PEERS = ("coal_calls", "fcl_calls")
SIZES = ("1k", "10k", "86k")
GOALS = {"coal_calls": (5.0, 8.0), "fcl_calls": (3.3, 5.0)}
SOUP = {"coal_calls": (6.0, 10.0), "fcl_calls": (5.0, 8.0)}
RELATIONS = {"A_in_B": 1, "B_in_A": 2, "disjoint": 0, "overlapping": 3, "touching": 4}

Task = tuple[str, Callable[[str], Iterable[Row]]]


def tasks(suite: Suite) -> Iterator[Task]:
    """Yield the rows of the table in its order."""
    quick = suite.options.quick
    yield "bare call of a peer", partial(_overhead, suite)
    made: dict[tuple[str, str], Prepared] = {}
    for size in SIZES[:1] if quick else SIZES:
        for peer in PEERS:
            yield f"near contact, {size} faces vs {peer}", partial(_mesh_pair, suite, size, peer, GOALS[peer], made)
    for peer in PEERS:
        yield f"near contact, env / rob soup vs {peer}", partial(_mesh_pair, suite, "soup", peer, SOUP[peer], made)
    yield from scene_tasks(suite, _bare_call)
    yield "cost of exactness", partial(_cost_of_exactness, suite, SIZES[:1] if quick else SIZES)
    size = "1k" if quick else "86k"
    yield f"prepare, {size} faces", partial(_prepare, suite, size)
    yield "two threads", partial(_two_threads, suite, "1k" if quick else "10k")
    yield "flush stacks under one pose", partial(_flush_stacks, suite)
    yield "hard set, wrong answers", partial(_hard, suite)


def _n_poses(suite: Suite, size: str) -> int:
    return 300 if suite.options.quick else {"86k": 2_000}.get(size, 4_000)


@cache
def _bare_call(peer: str) -> float:
    """Return the seconds of one call on two triangles far apart."""
    triangle = workloads.Mesh("triangle", np.eye(3), np.array([[0, 1, 2]]))
    far = np.tile(np.array([100.0, 0, 0]), (1_000, 1))
    pair = Pair("far triangles", triangle, triangle, False, np.tile(np.eye(3), (1_000, 1, 1)), far)
    prepared = load(peer).MAKERS["mesh_pair"](pair, 1)
    asked = prepared.native(np.arange(1_000))
    return min(clocked(lambda: prepared.ask(asked))[0] for _ in range(9)) / 1_000


def _overhead(suite: Suite, name: str) -> Iterable[Row]:
    for peer in PEERS:
        module = load(peer)
        if isinstance(module, Absent):
            yield Row(f"{name}, {peer}", "", note=f"{peer} does not run here: {module.reason}")
        else:
            row = Row(f"{name}, {module.NAME}", "us", value=_bare_call(peer) * 1e6)
            row.note = "two triangles far apart, once a pose from Python"
            yield row


def _mesh_pair(
    suite: Suite,
    size: str,
    peer_name: str,
    goals: tuple[float, float],
    made: dict[tuple[str, str], Prepared],
    name: str,
) -> Iterable[Row]:
    chosen, module = suite.options, load(peer_name)
    row = Row(name, "x", *goals)
    if isinstance(module, Absent):
        row.note = f"{peer_name} does not run here: {module.reason}"
        yield row
        return
    n_poses = _n_poses(suite, size)
    pair = pair_of_size(size, n_poses, chosen.seed)
    for other in [key for key in made if key[0] != size]:  # large structures, not needed again
        del made[other]
    for contender in ("ours", peer_name):
        if (size, contender) not in made:
            made[size, contender] = load(contender).MAKERS["mesh_pair"](pair, 1)
    ours, peer = made[size, "ours"], made[size, peer_name]
    rows = np.arange(n_poses)
    asked = [ours.native(rows), peer.native(rows)]
    runs = [lambda: ours.ask(asked[0]), lambda: peer.ask(asked[1])]
    (a, b), (relations, collides) = interleaved(runs, chosen.rounds, chosen.seconds)
    wall, cpu = ratios(a, b)
    row.value, row.low, row.high, row.cpu_value = wall.median, wall.low, wall.high, cpu.median
    bare = _bare_call(peer_name) * n_poses
    net = spread([(theirs - bare) / mine for mine, theirs in zip(a.wall, b.wall, strict=True)])
    row.ours, row.peer = (f"{timing.median / n_poses * 1e6:.3g} us" for timing in (a, b))
    colliding = relations != engine.Relation.DISJOINT
    inside = (relations == 1) | (relations == 2)
    differ, counts = judged(pair, colliding, peer.answer(collides), module.NAME)
    row.note = (
        f"net {net.median:.3g}; {pair.name}, {n_poses} poses, {colliding.mean():.0%} collide, "
        f"{inside.sum()} of them inside; {differ}"
    )
    row.raw |= {"ours": asdict(a), "peer": asdict(b), "bare_call": bare / n_poses, "net": asdict(net), **counts}
    yield row


def _cost_of_exactness(suite: Suite, sizes: tuple[str, ...], name: str) -> Iterable[Row]:
    """The same kernel without a bound on the error of its signs, near contact."""
    chosen, module = suite.options, load("plain_signs")
    for size in sizes:
        pair = pair_of_size(size, _n_poses(suite, size), chosen.seed)
        first, second = pair.solids()

        def exact(a: engine.Solid = first, b: engine.Solid = second, pair: Pair = pair) -> np.ndarray:
            return engine.collide_poses(a, b, pair.rotations, pair.translations, workers=1)

        def plain(exact: Callable[[], np.ndarray] = exact) -> np.ndarray:
            with module.poses_by_plain_signs():
                return exact()

        (a, b), (ours, theirs) = interleaved([exact, plain], chosen.rounds, chosen.seconds)
        wall, cpu = ratios(b, a)  # exact over plain
        row = Row(f"{name}, {size}", "times", 1.12, 1.05, wall.median, wall.low, wall.high, cpu_value=cpu.median)
        row.ours, row.peer = (f"{timing.median / len(ours) * 1e6:.3g} us" for timing in (a, b))
        row.note = f"{pair.name}, {len(ours)} poses; {int((ours != theirs).sum())} answers differ"
        row.raw |= {"exact": asdict(a), "plain": asdict(b)}
        yield row


def _prepare(suite: Suite, size: str, name: str) -> Iterable[Row]:
    """From arrays to the answer of a first question with nothing near: constructor and tree."""
    pair = pair_of_size(size, 2, suite.options.seed)
    point = engine.Surface([[9, 9, 9], [9, 9, 9.5], [9, 9.5, 9]], [[0, 1, 2]])
    checked, whole, peers = [], [], {peer: [] for peer in PEERS}
    for _ in range(3 if suite.options.quick else 7):
        made_in, _, solid = clocked(partial(engine.Polyhedron, pair.first.vertices, pair.first.faces))
        checked.append(made_in)
        whole.append(made_in + clocked(partial(engine.collide, solid, point))[0])
        for peer in PEERS:
            module = load(peer)
            if not isinstance(module, Absent):
                peers[peer].append(clocked(partial(module.model, pair.first))[0])
    for peer in PEERS:
        if not peers[peer]:
            yield Row(f"{name} vs {peer}", "x", 1.0, 2.0, note=f"{peer} does not run here")
            continue
        row = Row(f"{name} vs {peer}", "x", 1.0, 2.0)
        found = spread([theirs / mine for mine, theirs in zip(whole, peers[peer], strict=True)])
        tree = spread([b / (a - c) for a, b, c in zip(whole, peers[peer], checked, strict=True)])
        row.value, row.low, row.high = found.median, found.low, found.high
        row.ours, row.peer = f"{np.median(whole):.3g} s", f"{np.median(peers[peer]):.3g} s"
        row.note = f"from arrays; {tree.median:.3g} x without the constructor's checks ({np.median(checked):.3g} s)"
        row.raw |= {"ours": whole, "constructor": checked, "peer": peers[peer]}
        yield row


def _two_threads(suite: Suite, size: str, name: str) -> Iterable[Row]:
    chosen = suite.options
    pair = pair_of_size(size, _n_poses(suite, size), chosen.seed)
    first, second = pair.solids()
    runs = [
        lambda n=n: engine.collide_poses(first, second, pair.rotations, pair.translations, workers=n) for n in (2, 1)
    ]
    (two, one), _ = interleaved(runs, chosen.rounds, chosen.seconds)
    wall, _ = ratios(two, one)
    row = Row(name, "x", 1.7, 1.9, wall.median, wall.low, wall.high)
    row.note = f"{pair.name}, {len(pair.rotations)} poses: one thread over two"
    row.raw |= {"two": asdict(two), "one": asdict(one)}
    yield row


def _flush_stacks(suite: Suite, name: str) -> Iterable[Row]:
    """300 boxes on one another, heights in decimals, all under one pose: each must touch the next."""
    n_boxes = 300
    random = workloads.generator("flush stacks", suite.options.seed)
    pose = engine.Pose(random_rotations(random, 1)[0], random.normal(size=3))
    levels = [0.1 * k for k in range(n_boxes + 1)]
    faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    boxes = [
        engine.Polyhedron([[i & 1, i >> 1 & 1, (low, high)[i >> 2]] for i in range(8)], faces)
        for low, high in pairwise(levels)
    ]
    wrong, seconds = 0, []
    for _ in range(1 + (1 if suite.options.quick else 5)):
        took, _, found = clocked(
            lambda: [engine.collide(a, b, first_pose=pose, second_pose=pose).relation for a, b in pairwise(boxes)]
        )
        seconds.append(took)
        wrong += sum(relation != engine.Relation.TOUCHING for relation in found)
    row = Row(f"{name}, wrong answers", "", 0.0, 0.0, float(wrong))
    row.note = f"{n_boxes} boxes, one call a pair, {min(seconds) / (n_boxes - 1) * 1e6:.3g} us a pair"
    row.raw["seconds"] = seconds
    yield row
    scene = [clocked(lambda: engine.collide_scene(boxes, [pose] * n_boxes, workers=1)) for _ in range(len(seconds))]
    relations = scene[0][2].relation
    wrong = n_boxes - 1 - int((relations == engine.Relation.TOUCHING).sum())
    row = of_seconds(Row(f"{name}, as a scene", "s"), [took for took, _, _ in scene[1:]])
    row.note = f"{wrong} of {n_boxes - 1} pairs wrong"
    yield row


def _hard(suite: Suite, name: str) -> Iterable[Row]:
    path = workloads.DATA / "hard_collision" / "cases.json.gz"
    if not path.is_file():
        raise workloads.MissingDataError("the hard sets are in the shared data folder, which is not here")
    with gzip.open(path) as file:
        cases = json.load(file)[:: 10 if suite.options.quick else 1]
    still = (np.eye(3)[None], np.zeros((1, 3)))
    wrong, collides_wrong = 0, {peer: 0 for peer in PEERS if not isinstance(load(peer), Absent)}
    for case in cases:
        meshes = [
            workloads.Mesh(key, np.array(case[key]["vertices"], float), np.array(case[key]["faces"]))
            for key in ("first", "second")
        ]
        pair = Pair("", *meshes, True, *still)
        exact = RELATIONS[case["relation"]]
        wrong += int(engine.collide(*pair.solids()).relation) != exact
        for peer in collides_wrong:
            prepared = load(peer).MAKERS["mesh_pair"](pair, 1)
            collides_wrong[peer] += prepared.ask(prepared.native(np.arange(1)))[0] != (exact != 0)
    row = Row(name, "", 0.0, 0.0, float(wrong), raw=dict(collides_wrong))
    row.ours = f"{wrong}/{len(cases)}"
    row.note = "five relations; peers, collide or not: " + ", ".join(
        f"{load(peer).NAME} {count}" for peer, count in collides_wrong.items()
    )
    yield row


def main(words: list[str] | None = None) -> int:
    """Run the suite; the exit code is 0 also where a row misses its goal: the table says so."""
    suite = Suite("collision", options(words, __doc__ or ""))
    suite.run(tasks(suite))
    return 0


if __name__ == "__main__":
    sys.exit(main())
