"""Do two bodies meet? Booleans are compared; most peers see surfaces, and miss a body inside another."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from itertools import combinations, pairwise, product
from typing import Any

import numpy as np

import engine
from benchmarks import errors, workloads
from benchmarks.answers.shapes import BOX, QUADS, TETRAHEDRON, corners
from benchmarks.bodies import Pair, convex_pair, crowd, pair_of_size, random_rotations
from benchmarks.contenders import Couple, Placed, Prepared, make
from benchmarks.contest import Contender, Contest, Goals, Size, Task, contender, field_of, refusing, two_threads
from benchmarks.errors import same
from benchmarks.measure import clocked
from benchmarks.polygon_pairs import parcels_and_parts
from benchmarks.workloads import Mesh, bumpy_sphere, document, generator, hard_pairs

BOOKS = ("textbook:pair by vertices", "textbook:pair by edges", "textbook:pair by volumes")
BODIES = ("coal", "fcl", "open3d", "igl", "manifold3d")
PEERS = (*BOOKS, *BODIES)
CALLED = ("coal", "fcl")
"""Peers for which the overhead of a call is a part of the measured time."""
NEAR: dict[str, Goals] = {"coal": (5.0, 8.0), "fcl": (3.3, 5.0)}
SOUP: dict[str, Goals] = {"coal": (6.0, 10.0), "fcl": (5.0, 8.0)}
CONVEX = {10: (3.0, 4.0), 32: (2.0, 3.0), 100: (1.3, 3.0), 200: (1.0, 3.0)}
"""Against coal, net of what its calls cost."""
RELATIONS = {relation.label: relation for relation in engine.Relation} | {
    "A_in_B": engine.Relation.FIRST_INSIDE_SECOND,
    "B_in_A": engine.Relation.SECOND_INSIDE_FIRST,
}
"""As the hard set names them."""
ALONE = ("flush stack, a scene", "flush stack, call by call", "pairs of simple solids", "pairs of polygons",
         "triangles 2D", "triangles 3D")  # fmt: skip


def tasks(size: Size) -> Iterator[Task]:
    """Yield the rows: one thread, unless a row says otherwise."""
    yield Task("contact", partial(_contact, size, PEERS), True)
    yield Task("contact, which relation", partial(_contact, size, ()), True)
    yield Task("apart or crossing", partial(_easy, size), True)
    for is_hard in (False, True):
        yield Task(f"bricks, {'turned' if is_hard else 'upright'}", partial(_bricks, size, is_hard), True)
        yield Task(f"neighbours, {'split' if is_hard else 'whole'}", partial(_neighbours, size, is_hard), True)
    for faces in ("1k", "10k", "86k", "soup")[: size.of(4, 1)]:
        yield Task(f"near contact, {faces}", partial(_near_contact, size, faces), faces == "1k")
    for kind in ("relations", "witnesses", "detail"):
        yield Task(f"near contact, 1k, {kind}", partial(_alone, size, kind))
    for n_vertices in CONVEX:
        yield Task(f"convex of {n_vertices}", partial(_convex, size, n_vertices))
    n_bodies = size.of(10_000, 1_000)
    for name in (f"{n_bodies:,} bodies", f"{n_bodies:,} bodies, all moved before"):
        yield Task(name, partial(_crowd, size, name, n_bodies))
    faces = size.of("86k", "1k")
    yield Task(f"prepare, {faces} faces", partial(_prepare, size, faces))
    yield Task("near contact, two threads", partial(_two_threads, size))
    for name in ALONE:
        yield Task(name, partial(_ours, size, name))


# --- the page ---------------------------------------------------------------------------------------------------------


def _contact(size: Size, peers: tuple[str, ...]) -> Contest:
    cases = hard_pairs()
    chosen = np.random.default_rng(0).permutation(len(cases))[: size.n(1_600, 200)]
    about = "inside one another, touching, edges only, ulps apart, far from the origin, linked, in cavities"
    couples = [tuple(Placed(_mesh(cases[i][key])) for key in ("first", "second")) for i in chosen]
    exact = np.array([RELATIONS[cases[i]["relation"]] for i in chosen])
    if not peers:
        return on_couples("contact, which relation", True, couples, exact, about, peers)
    return on_couples("contact", True, couples, exact != engine.Relation.DISJOINT, about, peers)


def _mesh(body: dict) -> Mesh:
    return Mesh("case", np.array(body["vertices"], float), np.array(body["faces"], np.int64))


def on_couples(
    name: str, is_hard: bool, couples: list[Any], exact: np.ndarray, about: str, peers: tuple[str, ...] = PEERS,
    moved: Callable[[float], tuple[list[Any], np.ndarray]] | None = None, **more: Any,
) -> Contest:  # fmt: skip
    """Items are numbers of pairs: one call from Python for each, models are made beforehand.

    moved: pairs that were moved apart or into each other by so much of their size, and their exact answers.
    """
    result = field_of("pair" if peers else "relation", None, peers, 1)

    def request(item: int) -> tuple[str, dict[str, Any]]:
        first, second = (document(body.shape) for body in couples[item])
        return "/v1/collide", {"first": first, "second": second}

    def moved_items(step: float) -> tuple[np.ndarray, np.ndarray]:
        assert moved is not None
        some, answers = moved(step)
        couples.extend(some)
        return np.arange(len(couples) - len(some), len(couples)), answers

    made = [replace(_net(each), make=partial(on_each, each, couples, len(couples))) for each in result]
    return Contest("collision", name, is_hard, np.arange(len(couples)), exact, same, made, about, request=request,
                   moved=None if moved is None else moved_items, **more)  # fmt: skip


def on_each(one: Contender, subjects: list[Any], n_first: int, refusal: Any = errors.REFUSED) -> Prepared:
    """Return a contender asked about one subject an item. Models of the first so many are made at once, those of others
    when they are asked about."""
    module, kind, _, _, *setting = one.make.args  # type: ignore[attr-defined]

    @cache
    def call(row: int) -> Any:
        return make(module, kind, subjects[row], 1, *setting).ask

    for row in range(n_first):
        call(row)
    return Prepared(lambda rows: np.array([refusing(call(int(row)), None, refusal) for row in rows]))


def _bricks(size: Size, is_hard: bool) -> Contest:
    """A wall of bricks, each half upon two others, and pairs of it whose boxes meet; hard: turned and rounded."""
    rows, wide = (3, 4) if size.is_quick else (8, 10)
    lows = [[2.0 * k + level % 2, 0.0, float(level)] for level in range(rows) for k in range(wide)]
    boxes = [corners(np.array(low), np.add(low, [2.0, 1.0, 1.0])) for low in lows]
    pairs = [(a, b) for a, b in combinations(range(len(lows)), 2)
             if abs(lows[a][0] - lows[b][0]) <= 2.0 and abs(lows[a][2] - lows[b][2]) <= 1.0]  # fmt: skip
    turn = random_rotations(generator("bricks", size.seed), 1)[0] if is_hard else np.eye(3)

    def couples_at(step: float) -> tuple[list[Couple], np.ndarray]:
        made = []
        for number, (a, b) in enumerate(pairs):
            way = boxes[b].mean(axis=0) - boxes[a].mean(axis=0)
            off = (-1.0) ** number * step * 2.0 * way / np.linalg.norm(way)
            made.append(tuple(Placed(Mesh("brick", box @ turn.T, BOX)) for box in (boxes[a], boxes[b] + off)))
        return made, errors.meet(made)

    couples, exact = couples_at(0.0)
    about = f"{len(boxes)} bricks of a wall, pairs that share a part of a side, an edge or a corner"
    about += ", turned once and rounded" if is_hard else ", upright, whole numbers"
    return on_couples(f"bricks, {'turned' if is_hard else 'upright'}", is_hard, couples, exact, about, BODIES[:-1],
                      couples_at if is_hard else None, near=0.0 if is_hard else None)  # fmt: skip


def _neighbours(size: Size, is_hard: bool) -> Contest:
    """Parcels and their neighbours, or the halves of these, whose new corners are rounded: which relation?"""
    left, right = parcels_and_parts(size.n(225, 100), size.seed, is_hard)
    pairs = errors.boxes_that_meet(left, right)
    result = field_of("relations of polygons", (left, right), ("shapely",), 1)

    about = f"{len(left)} parcels and {'halves of them, new corners rounded' if is_hard else 'themselves'}: "
    about += "disjoint, touching, overlapping, inside?"
    return Contest("collision", f"neighbours, {'split' if is_hard else 'whole'}", is_hard, pairs,
                   errors.relations(left, right, pairs), same, result, about,
                   request=partial(asked_of_layers, left, right, pairs))  # fmt: skip


def asked_of_layers(left: np.ndarray, right: np.ndarray, pairs: np.ndarray, item: int) -> tuple[str, dict[str, Any]]:
    """Return path and body that ask about one pair of two layers."""
    first, second = (document(workloads.Rings("", [layer[k]])) for layer, k in zip((left, right), pairs[item]))
    return "/v1/collide", {"first": first, "second": second}


def _net(one: Contender) -> Contender:
    """Return the contender with the overhead of its calls."""
    module = one.make.args[0]  # type: ignore[attr-defined]
    return replace(one, overhead=partial(_overhead, module)) if module in CALLED else one


@cache
def _overhead(module: str) -> float:
    """Return the seconds of one call on two bodies of a triangle each, far apart."""
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    couple = (Placed(Mesh("a", vertices, TETRAHEDRON)), Placed(Mesh("b", vertices + 100.0, TETRAHEDRON)))
    call = make(module, "pair", couple, 1).ask
    return clocked(lambda: [call(None) for _ in range(1000)])[0] / 1000


def _easy(size: Size) -> Contest:
    """Star-shaped bodies about two centres: certain by their radii and the distance of the centres."""
    body, source, pairs, exact = bumpy_sphere("report", size.seed, 1), generator("report collision", size.seed), [], []
    radii = np.linalg.norm(body.vertices, axis=1)
    inner, outer = 0.9 * radii.min(), radii.max()  # faces lie within the vertices' radii by less than a tenth
    for i_pair in range(size.n(400, 100)):
        direction, meet = source.normal(size=3), bool(i_pair % 2)
        distance = source.uniform(1.0, 1.9) * inner if meet else source.uniform(2.02, 3) * outer
        offset = direction / np.linalg.norm(direction) * distance
        pairs.append((Placed(body), Placed(Mesh("moved", body.vertices + offset, body.faces))))
        exact.append(meet)
    about = "bumpy balls of 80 faces, half of them meeting, none closely"
    return on_couples("apart or crossing", False, pairs, np.array(exact), about)


# --- the table --------------------------------------------------------------------------------------------------------


def _poses(name: str, pair: Pair, kind: str, goals: Mapping[str, Goals], is_page: bool = False) -> Contest:
    """Pairs under poses; differing answers are decided in rationals; a large mesh takes seconds."""
    result = [_net(each) for each in field_of(kind, pair, goals, 1)]
    if kind == "poses":
        result.append(replace(contender("ours:relations", "", pair, 1), name="ours, five relations"))

    def exact(chosen: np.ndarray) -> np.ndarray:
        return np.array([errors.collides(pair, row) for row in chosen])

    about = f"{pair.name}, {'solids' if pair.is_closed else 'surfaces'}, poses near contact"
    return Contest("collision", name, True, np.arange(len(pair.rotations)), exact, same, result, about,
                   n_sample=20 * is_page, most=20, request=partial(request, pair) if is_page else None)  # fmt: skip


def request(pair: Pair, row: int, path: str = "/v1/collide") -> tuple[str, dict[str, Any]]:
    """Return path and body that ask about one pose."""
    pose = {"rotation": pair.rotations[row].tolist(), "translation": pair.translations[row].tolist()}
    return path, {"first": document(pair.first), "second": document(pair.second), "poses": [pose]}


def _near_contact(size: Size, faces: str) -> Contest:
    pair = pair_of_size(faces, size.n({"86k": 2_000}.get(faces, 4_000), 200), size.seed)
    return _poses(f"near contact, {faces}", pair, "poses", SOUP if faces == "soup" else NEAR, faces == "1k")


def _convex(size: Size, n_vertices: int) -> Contest:
    pair = convex_pair(n_vertices, size.n(20_000, 1_000), size.seed)
    return _poses(f"convex of {n_vertices}", pair, "convex poses", {"coal": CONVEX[n_vertices]})


def _alone(size: Size, kind: str) -> Contest:
    pair = pair_of_size("1k", size.n(400, 100), size.seed)
    result, rows = field_of(f"{kind}", pair, (), 1), np.arange(len(pair.rotations))
    return Contest("collision", f"near contact, 1k, {kind}", True, rows, None, same, result, count=len(rows))


def _crowd(size: Size, name: str, n_bodies: int) -> Contest:
    """Many bodies: fcl updates its tree for moved bodies, ours is rebuilt at each call."""
    bodies, is_moved = crowd(n_bodies, size.seed), name.endswith("before")
    result = field_of("crowd", bodies, {"fcl": None if is_moved else (10.0, 20.0)}, 1)
    frames = bodies.frames() if is_moved else []
    return Contest("collision", name, False, frames, None, same, result, count=n_bodies * max(1, len(frames)))


def _prepare(size: Size, faces: str) -> Contest:
    """From arrays to the tree."""
    mesh = pair_of_size(faces, 2, size.seed).first
    result = field_of("tree", mesh, dict.fromkeys(CALLED, (1.0, 2.0)), 1)
    return Contest("collision", f"prepare, {faces} faces", False, None, None, same, result, count=1)


def _two_threads(size: Size) -> Contest:
    pair = pair_of_size(size.of("10k", "1k"), size.n(4_000, 200), size.seed)
    rows = np.arange(len(pair.rotations))
    return Contest("collision", "near contact, two threads", False, rows, None, same, two_threads("poses", pair))


def _stack(size: Size) -> tuple[list[engine.Polyhedron], engine.Pose]:
    """Return 300 boxes on one another, heights in decimals, and one pose: each must touch the next."""
    draw = generator("flush stacks", size.seed)
    pose = engine.Pose(random_rotations(draw, 1)[0], draw.normal(size=3))
    boxes = [engine.Polyhedron(corners(np.array([0, 0, low]), np.array([1, 1, high])), QUADS)
             for low, high in pairwise(0.1 * level for level in range(301))]  # fmt: skip
    return boxes, pose


def _ours(size: Size, name: str) -> Contest:
    """Ours alone: call by call from Python, or one call for all."""
    posed: dict[str, Any] = {}
    match name:
        case "flush stack, a scene":
            boxes, pose = _stack(size)
            return _run(name, lambda _: engine.collide_scene(boxes, [pose] * len(boxes), workers=1), len(boxes))
        case "triangles 2D" | "triangles 3D":
            draw = generator(f"rows/{name}", size.seed)
            first, second = draw.uniform(0.0, 1.0, (2, size.n(200_000), 3, int(name[-2])))
            for side in (first, second):
                side[::10] = np.round(side[::10] * 4) / 4  # one in ten on a lattice, with its partner
            return _run(name, lambda _: engine.collide_triangles(first, second, workers=1), len(first))
        case "flush stack, call by call":
            boxes, pose = _stack(size)
            pairs, posed = list(pairwise(boxes)), {"first_pose": pose, "second_pose": pose}
        case "pairs of polygons":
            bodies = workloads.polygon_scene(100, size.seed).bodies
            pairs = list(pairwise(engine.Polygon(body.rings) for body in bodies))
        case _:
            pairs = _simple_pairs()
    return _run(name, lambda _: [engine.collide(a, b, workers=1, **posed) for a, b in pairs], len(pairs))


def _run(name: str, ask: Any, count: int) -> Contest:
    ours = Contender("ours", lambda: Prepared(ask))
    return Contest("collision", name, False, None, None, same, [ours], count=count)


def _simple_pairs() -> list[tuple[Any, Any]]:
    """Return every pair of simple solids for which collision is defined, and a tetrahedron."""
    solids = [make() for make in workloads.SIMPLE.values()]
    solids.append(engine.Polyhedron([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]], TETRAHEDRON))
    return [pair for pair in product(solids, solids) if refusing(lambda each: engine.collide(*each), pair, None)]
