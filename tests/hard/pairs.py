"""Hard pairs of polyhedra by family, seeded: containment, contact of every kind, an ulp beside it, far away, slivers.

``python -m tests.hard.pairs`` writes cases/collide/pairs.npz: some pairs of every family with their exact relations by
tests/reference/collision.py.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.hard.points import generator, moved_by_ulps
from tests.reference.collision import relation

Array = np.ndarray[Any, Any]
Body = tuple[Array, Array]
STORED = Path(__file__).resolve().parent / "cases" / "collide" / "pairs.npz"
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
QUADS = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))
BOX = np.array([face for a, b, c, d in QUADS for face in ((a, b, c), (a, c, d))])


def box(low: Any, high: Any) -> Body:
    return np.array([[(low, high)[bit >> k & 1][k] for k in range(3)] for bit in range(8)], float), BOX


def tetrahedron(corners: Array) -> Body:
    """Return the solid of four corners, its faces turned outward."""
    a, b, c, d = corners
    outward = np.linalg.det(np.array([b - a, c - a, d - a])) > 0
    return corners.astype(float), TETRAHEDRON if outward else TETRAHEDRON[:, ::-1]


def together(*bodies: Body, inward: tuple[int, ...] = ()) -> Body:
    """Return several shells as one body, some of them turned inside out."""
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in bodies)])
    faces = [f[:, ::-1] + start if k in inward else f + start for k, ((_, f), start) in enumerate(zip(bodies, starts))]
    return np.concatenate([vertices for vertices, _ in bodies]), np.concatenate(faces)


def turn(random: np.random.Generator) -> Array:
    q, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def ring(side: float, thick: float) -> Body:
    """Return a square frame: four corners outside and inside, below and above."""
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)
    rings = [(square * side, -thick), (square * (side - 2 * thick), -thick), (square * side, thick),
             (square * (side - 2 * thick), thick)]  # fmt: skip
    vertices = np.concatenate([np.column_stack([flat, np.full(4, z)]) for flat, z in rings])
    faces = []
    for k in range(4):
        m = (k + 1) % 4
        for a, b in ((0, 8), (8, 12), (12, 4), (4, 0)):  # outer side, top, inner side, bottom
            faces += [[a + k, a + m, b + m], [a + k, b + m, b + k]]
    return vertices, np.array(faces)


def contain(random: np.random.Generator) -> tuple[Body, Body]:
    inner = tetrahedron(random.uniform(-0.3, 0.3, (4, 3))) if random.random() < 0.5 else box([-0.3] * 3, [0.3] * 3)
    outer = box([-1] * 3, [1] * 3)
    outer = outer[0] @ turn(random) * random.uniform(0.4, 2.0), outer[1]
    if random.random() < 0.3:  # a hole around the inner body, or within it
        outer = together(outer, (0.35 * outer[0] * random.uniform(0.2, 2.0), outer[1]), inward=(1,))
    pair = (inner[0] @ turn(random) + random.normal(size=3) * 0.05, inner[1]), outer
    return pair if random.random() < 0.5 else pair[::-1]


def edges_only(random: np.random.Generator) -> tuple[Body, Body]:
    first, second = box([-4, -0.5, -0.5], [4, 0.5, 0.5]), box([-0.5, -4, -0.5], [0.5, 4, 0.5])
    around, place = turn(random), random.normal(size=3) * 0.1 + [0, 0, random.uniform(0.5, 1.1)]
    return (first[0] @ around, first[1]), ((second[0] + place) @ around, second[1])


def touch(random: np.random.Generator) -> tuple[Body, Body]:
    """Return a box and a body on its top, at one of its edges or corners: by a corner, an edge or a face."""
    size = random.integers(4, 12, 3).astype(float)
    at = np.array([random.choice([0.0, s, float(random.integers(0, int(s) + 1))]) for s in size])
    at[2] = size[2]
    kind = random.integers(0, 4)
    if kind < 3:
        above = at + random.integers(-4, 5, (4, 3)) * [1, 1, 0] + np.arange(4)[:, None] * [0.5, 0.25, 0] + [0, 0, 2]
        above[: kind + 1, 2] = at[2]
        above[0] = at
        second = tetrahedron(above)
    else:
        second = box(at, at + random.integers(1, 6, 3))
    order = random.permutation(3)
    pair = tuple((vertices[:, order], faces[:, ::-1]) for vertices, faces in (box([0, 0, 0], size), second))
    return pair[0], pair[1]


def ulps(random: np.random.Generator) -> tuple[Body, Body]:
    first, (vertices, faces) = touch(random)
    return first, (moved_by_ulps(vertices, random), faces)


def far_away(random: np.random.Generator) -> tuple[Body, Body]:
    offset = random.choice([1e6, -1e6, 1e9, 1e9 + 0.5, 2.0**40], 3)
    first, second = touch(random)
    return (first[0] + offset, first[1]), (second[0] + offset, second[1])


def slivers(random: np.random.Generator) -> tuple[Body, Body]:
    needle = np.array([[0, 0, 0], [1000, 1e-7, 0], [500, 0, 1e-7], [400, -1e-8, -1e-7]]) * random.uniform(0.5, 2)
    at = random.uniform(50, 900)
    near = random.normal(size=(4, 3)) + np.array([at, 0, 0])
    near[0] = [at, random.normal() * 1e-7, random.normal() * 1e-7]
    return tetrahedron(needle), tetrahedron(near)


def stack(random: np.random.Generator) -> tuple[Body, Body]:
    step, n = random.choice([0.1, 0.3, 0.7, 1.1]), int(random.integers(1, 12))
    level = sum([step] * n) if random.random() < 0.5 else step * n
    other = step * n if random.random() < 0.7 else sum([step] * n)
    return box([0, 0, level - step], [1.4, 1.4, level]), box([-0.3, -0.3, other], [2.0, 2.0, other + step])


def turned_flush(random: np.random.Generator) -> tuple[Body, Body]:
    (a, faces), (b, _) = box([0, 0, 0], [2, 2, 2]), box([2, 0.5, 0.25], [4, 1.5, 1.25])
    around = turn(random)
    return (a @ around, faces), (b @ around, faces)


def linked(random: np.random.Generator) -> tuple[Body, Body]:
    first, second = ring(2.0, 0.25), ring(2.0, 0.25)
    around = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]) if random.random() < 0.5 else turn(random)
    place = np.array([random.uniform(1.4, 2.6), 0, 0]) if random.random() < 0.7 else np.array([1.75, 0, 0])
    return first, (second[0] @ around + place, second[1])


def components(random: np.random.Generator) -> tuple[Body, Body]:
    """Return two bodies of a few boxes each on a small lattice, some hollow: some apart, some inside, some flush."""
    bodies = []
    for _ in range(2):
        parts = []
        for k in range(int(random.integers(1, 4))):
            low = np.array([5 * k, 0, 0]) + random.integers(-1, 2, 3)
            parts.append(box(low, low + random.integers(1, 5, 3)))
        if random.random() < 0.5:
            low = parts[0][0].min(axis=0)
            parts += [box(low - 3, low + 9), box(low - 2, low + 8)]
        bodies.append(together(*parts, inward=(len(parts) - 1,)))
    return bodies[0], bodies[1]


FAMILIES: dict[str, Callable[[np.random.Generator], tuple[Body, Body]]] = {
    "contain": contain,
    "edges only": edges_only,
    "touch": touch,
    "ulps": ulps,
    "far away": far_away,
    "slivers": slivers,
    "stack": stack,
    "turned flush": turned_flush,
    "linked": linked,
    "components": components,
}


def hard_pairs(family: str, n_pairs: int, name: str = "pairs") -> list[tuple[Body, Body]]:
    """Return pairs of a family, always the same."""
    random = generator(name, family)
    return [FAMILIES[family](random) for _ in range(n_pairs)]


def exact_relation(first: Body, second: Body) -> int:
    """Return the relation by rational arithmetic."""
    a, b = ({"type": "polyhedron", "vertices": v.tolist(), "faces": f.tolist()} for v, f in (first, second))
    return relation(a, b)


def main() -> None:
    arrays: dict[str, Any] = {}
    for family in FAMILIES:
        pairs = hard_pairs(family, 8)
        bodies = [body for pair in pairs for body in pair]
        key = family.replace(" ", "_")
        arrays[f"{key}_vertices"] = np.concatenate([vertices for vertices, _ in bodies])
        arrays[f"{key}_faces"] = np.concatenate([faces for _, faces in bodies]).astype(np.int16)
        arrays[f"{key}_sizes"] = np.array([[len(vertices), len(faces)] for vertices, faces in bodies], np.int16)
        arrays[f"{key}_relation"] = np.array([exact_relation(*pair) for pair in pairs], np.int8)
    np.savez_compressed(STORED, **arrays)


if __name__ == "__main__":
    main()
