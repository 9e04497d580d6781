"""Pairs of closed polyhedra: do the solids meet? Most peers see surfaces, and miss a body inside another."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import cache, partial
from itertools import pairwise, product

import numpy as np

import engine
from benchmarks import workloads
from benchmarks.contenders import Couple, Placed, Prepared, make
from benchmarks.contest import Contender, Contest, Goals, contender, refusing
from benchmarks.crowds import BALLS, convex_pair, crowd
from benchmarks.errors import same
from benchmarks.fields import Figure, Size, Task
from benchmarks.measure import clocked
from benchmarks.poses import Pair, pair_of_size, random_rotations
from benchmarks.settled import MOST, collides
from benchmarks.workloads import Mesh, MissingDataError, bumpy_sphere, generator, hard_pairs

PEERS = (
    ("ours", "ours", "pair"),
    ("textbook: vertices in the other", "textbook", "pair by vertices"),
    ("textbook: edges through faces", "textbook", "pair by edges"),
    ("textbook: volumes first", "textbook", "pair by volumes"),
    ("coal", "coal", "pair"),
    ("fcl", "fcl", "pair"),
    ("Open3D", "open3d", "pair"),
    ("VTK", "vtk", "pair"),
    ("libigl", "igl", "pair"),
    ("manifold3d", "manifold3d", "pair"),
)
CALLED = ("coal", "fcl")
"""Peers whose bare calls cost a part of what is measured."""


def contests(seed: int, scale: float) -> Iterator[Contest]:
    """Yield the contests of collision."""
    try:
        cases = hard_pairs()
        chosen = np.random.default_rng(0).permutation(len(cases))[: int(len(cases) * min(1, 2 * scale))]
        about = "inside one another, touching, edges only, ulps apart, far from the origin, linked, in cavities"
        yield stored("contact", [cases[i] for i in chosen], about)
    except MissingDataError:
        pass
    couples, exact = _easy(seed, int(400 * scale))
    about = "bumpy balls of 80 faces, half of them meeting, none closely"
    rows = np.arange(len(couples))
    yield Contest("collision", "apart or crossing", False, rows, exact, same, contenders(couples), about)


def stored(name: str, cases: list[dict], about: str = "") -> Contest:
    """Return the contest of some pairs of the hard set."""
    couples = [tuple(Placed(_mesh(case[key])) for key in ("first", "second")) for case in cases]
    exact = np.array([case["relation"] != "disjoint" for case in cases])
    return Contest("collision", name, True, np.arange(len(cases)), exact, same, contenders(couples), about)


def _mesh(body: dict) -> Mesh:
    return Mesh("case", np.array(body["vertices"], float), np.array(body["faces"], np.int64))


def _easy(seed: int, n_pairs: int) -> tuple[list[Couple], np.ndarray]:
    """Return pairs of star-shaped bodies about two centres: certain by their radii and the distance of the centres."""
    body, source, pairs, exact = bumpy_sphere("report", seed, 1), generator("report collision", seed), [], []
    radii = np.linalg.norm(body.vertices, axis=1)
    inner, outer = 0.9 * radii.min(), radii.max()  # faces lie within the vertices' radii by less than a tenth
    for i_pair in range(n_pairs):
        direction = source.normal(size=3)
        meet = bool(i_pair % 2)
        distance = source.uniform(1.0, 1.9) * inner if meet else source.uniform(2.02, 3) * outer
        offset = direction / np.linalg.norm(direction) * distance
        pairs.append((Placed(body), Placed(Mesh("moved", body.vertices + offset, body.faces))))
        exact.append(meet)
    return pairs, np.array(exact)


def contenders(couples: list[Couple]) -> list[Contender]:
    """Return the contenders; items are indices of pairs: one call from Python for each, models are made beforehand."""
    packages = {name: contender(name, module, kind, None).package for name, module, kind in PEERS}
    return [
        Contender(name, partial(_each, module, kind, couples), packages[name],
                  partial(_overhead, module) if module in CALLED else None)
        for name, module, kind in PEERS
    ]  # fmt: skip


def _each(module: str, kind: str, couples: list[Couple]) -> Prepared:
    calls = [make(module, kind, couple, 1).ask for couple in couples]
    return Prepared(lambda rows: np.array([int(refusing(calls[row], None)) for row in rows]))


@cache
def _overhead(module: str) -> float:
    """Return what one call costs on two triangles' worth of bodies far apart."""
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    call = make(module, "pair", (Placed(Mesh("a", vertices, faces)), Placed(Mesh("b", vertices + 100.0, faces))), 1).ask
    before = time.perf_counter()
    for _ in range(1000):
        call(None)
    return (time.perf_counter() - before) / 1000


# --- the table --------------------------------------------------------------------------------------------------------

NEAR = {"coal": (5.0, 8.0), "fcl": (3.3, 5.0)}
SOUP = {"coal": (6.0, 10.0), "fcl": (5.0, 8.0)}
CONVEX = {10: (3.0, 4.0), 32: (2.0, 3.0), 100: (1.3, 3.0), 200: (1.0, 3.0)}
"""Against coal, net of what its calls cost."""


def table(size: Size) -> Iterator[Task]:
    """Yield the rows of the table: one thread, unless a row says otherwise."""
    for faces in ("1k", "10k", "86k", "soup")[: size.of(4, 1)]:
        yield f"near contact, {faces}", partial(_near_contact, size, faces)
    for option in ("boolean", "witnesses", "detail"):
        yield f"near contact, 1k, {option}", partial(_alone, size, option)
    for n_vertices in BALLS:
        yield f"convex of {n_vertices}", partial(_convex, size, n_vertices)
    for is_moved in (False, True):
        n_bodies = size.of(10_000, 1_000)
        yield f"{n_bodies:,} bodies{', all moved before' * is_moved}", partial(_crowd, size, n_bodies, is_moved)
    faces = "1k" if size.is_quick else "86k"
    yield f"prepare, {faces} faces", partial(_prepare, size, faces)
    yield "near contact, two threads", partial(_two_threads, size)
    for name in ("flush stack, a scene", "flush stack, call by call", "pairs of simple solids", "pairs of polygons"):
        yield name, partial(_ours, size, name)
    for dimension in (2, 3):
        yield f"triangles {dimension}D", partial(_triangles, size, dimension)


def figures(size: Size) -> Iterator[Task]:
    """Yield what is no contest."""
    yield "flush stack, wrong answers", partial(_flush_wrong, size)


def _pair(size: Size, faces: str) -> Pair:
    return pair_of_size(faces, size.of({"86k": 2_000}.get(faces, 4_000), 200), size.seed)


def _poses(name: str, pair: Pair, kind: str, goals: dict[str, Goals], is_plain: bool = True) -> Contest:
    """Who is right where contenders differ is settled in rationals; a large mesh takes seconds."""
    rows, closed = np.arange(len(pair.rotations)), pair.is_closed
    found = [contender("ours", "ours", "poses", pair, 1)]
    for module in goals:
        peer = contender(module, module, kind, pair, 1, goals[module])
        found.append(Contender(peer.name, peer.make, peer.package, partial(_overhead, module), peer.goals))
    if is_plain:
        found.append(contender("ours, plain signs", "plain_signs", "poses", pair, 1))

    def exact(chosen: np.ndarray) -> np.ndarray:
        return np.array([collides(pair, row) for row in chosen])

    about = f"{pair.name}, {'solids' if closed else 'surfaces'}"
    return Contest("collision", name, True, rows, exact, same, found, about, n_sample=0, most=MOST)


def _near_contact(size: Size, faces: str) -> Contest:
    return _poses(f"near contact, {faces}", _pair(size, faces), "poses", SOUP if faces == "soup" else NEAR)


def _convex(size: Size, n_vertices: int) -> Contest:
    pair = convex_pair(n_vertices, size.of(20_000, 1_000), size.seed)
    return _poses(f"convex of {n_vertices}", pair, "convex poses", {"coal": CONVEX[n_vertices]}, False)


def _run(name: str, run: object, count: int) -> Contest:
    """Return the contest of a call of ours alone."""
    ours = Contender("ours", lambda: Prepared(run))  # type: ignore[arg-type]
    return Contest("collision", name, False, None, None, same, [ours], count=count)


def _alone(size: Size, option: str) -> Contest:
    pair = pair_of_size("1k", size.of(400, 100), size.seed)
    first, second = pair.solids()
    poses = pair.rotations, pair.translations

    def run(_: object) -> object:
        return engine.collide_poses(first, second, *poses, workers=1, **{option: True})  # type: ignore[call-overload]

    return _run(f"near contact, 1k, {option}", run, len(pair.rotations))


def _crowd(size: Size, n_bodies: int, is_moved: bool) -> Contest:
    """fcl updates its tree where bodies moved, ours starts from nothing as always."""
    bodies = crowd(n_bodies, size.seed)
    goals = (None, None) if is_moved else (10.0, 20.0)
    found = [
        contender("ours", "ours", "crowd", bodies, 1),
        contender("fcl's manager", "fcl", "crowd", bodies, 1, goals),
    ]
    frames = bodies.frames() if is_moved else []
    name = f"{n_bodies:,} bodies{', all moved before' * is_moved}"
    return Contest("collision", name, False, frames, None, same, found, count=n_bodies * max(1, len(frames)))


def _prepare(size: Size, faces: str) -> Contest:
    """From arrays to the tree."""
    mesh, goals = pair_of_size(faces, 2, size.seed).first, (1.0, 2.0)
    found = [contender("ours", "ours", "tree", mesh, 1)]
    found += [contender(module, module, "tree", mesh, 1, goals) for module in CALLED]
    return Contest("collision", f"prepare, {faces} faces", False, None, None, same, _silent(found), count=1)


def _silent(found: list[Contender]) -> list[Contender]:
    """Leave out what the contenders answer: nothing is asked."""

    def silent(one: Contender) -> Prepared:
        made = one.make()
        return Prepared(made.ask, made.native, lambda _: None)

    return [Contender(one.name, partial(silent, one), one.package, goals=one.goals) for one in found]


def _two_threads(size: Size) -> Contest:
    pair = _pair(size, "1k" if size.is_quick else "10k")
    one = contender("ours, one thread", "ours", "poses", pair, 1, (1.7, 1.9))
    two, rows = contender("ours", "ours", "poses", pair, 2), np.arange(len(pair.rotations))
    return Contest("collision", "near contact, two threads", False, rows, None, same, [two, one])


def _stack(size: Size) -> tuple[list[engine.Polyhedron], engine.Pose]:
    """Return 300 boxes on one another, heights in decimals, and one pose: each must touch the next."""
    draw = generator("flush stacks", size.seed)
    pose = engine.Pose(random_rotations(draw, 1)[0], draw.normal(size=3))
    faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    boxes = [
        engine.Polyhedron([[i & 1, i >> 1 & 1, (low, high)[i >> 2]] for i in range(8)], faces)
        for low, high in pairwise([0.1 * level for level in range(301)])
    ]
    return boxes, pose


def _flush_wrong(size: Size) -> Figure:
    boxes, pose = _stack(size)
    relations = engine.collide_scene(boxes, [pose] * len(boxes), workers=1).relation
    missed = len(boxes) - 1 - int((relations == engine.Relation.TOUCHING).sum())
    took, _, found = clocked(
        lambda: [engine.collide(a, b, first_pose=pose, second_pose=pose) for a, b in pairwise(boxes)]
    )
    wrong = sum(each.relation != engine.Relation.TOUCHING for each in found)  # type: ignore[attr-defined]
    note = f"{len(boxes)} boxes; {took / (len(boxes) - 1) * 1e6:.3g} us a pair; as a scene {missed} wrong"
    return Figure("flush stack, wrong answers", "wrong", [wrong + missed], 0, 0, note)


def _ours(size: Size, name: str) -> Contest:
    """Ours alone, call by call from Python."""
    match name:
        case "flush stack, a scene":
            boxes, pose = _stack(size)
            return _run(name, lambda _: engine.collide_scene(boxes, [pose] * len(boxes), workers=1), len(boxes))
        case "flush stack, call by call":
            boxes, pose = _stack(size)
            pairs, posed = list(pairwise(boxes)), {"first_pose": pose, "second_pose": pose}
        case "pairs of polygons":
            bodies = workloads.polygon_scene(100, size.seed).bodies
            pairs, posed = list(pairwise([engine.Polygon(body.rings) for body in bodies])), {}
        case _:
            pairs, posed = _simple_pairs(), {}
    return _run(name, lambda _: [engine.collide(a, b, workers=1, **posed) for a, b in pairs], len(pairs))


def _simple_pairs() -> list[tuple[engine.Solid, engine.Solid]]:
    """Return every simple solid with every other that collision is defined for, and a tetrahedron."""
    corners = [[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]]
    solids = [*workloads.simple_solids().values()]
    solids.append(engine.Polyhedron(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))
    return [pair for pair in product(solids, solids) if refusing(lambda each: engine.collide(*each), pair, None)]


def _triangles(size: Size, dimension: int) -> Contest:
    draw = generator(f"rows/triangles {dimension}", size.seed)
    first, second = (draw.uniform(0.0, 1.0, (size.of(200_000, 20_000), 3, dimension)) for _ in range(2))
    first[::10] = np.round(first[::10] * 4) / 4  # one in ten on a lattice, with its partner
    second[::10] = np.round(second[::10] * 4) / 4
    return _run(f"triangles {dimension}D", lambda _: engine.collide_triangles(first, second, workers=1), len(first))
