"""Scenes for hypothesis: coordinates of one difficulty per example, solids as dictionaries, points on them."""

from __future__ import annotations

import math
from typing import Any

from hypothesis import strategies as st

from tests.reference.shapes import box, reversed_faces, union_of

Dict = dict[str, Any]
TINY = 5e-324
LATTICE = st.integers(-3, 3).map(float)


def stepped(pair: tuple[float, int]) -> float:
    """Return x moved by k doubles."""
    x, k = pair
    for _ in range(abs(k)):
        x = math.nextafter(x, math.copysign(math.inf, k))
    return x


NUMBERS = {
    "lattice": LATTICE,
    "tenths": st.integers(-30, 30).map(lambda k: k * 0.1),
    "ulps": st.tuples(LATTICE, st.integers(-2, 2)).map(stepped),
    "far": st.tuples(st.just(1e9), st.integers(-20, 20)).map(lambda p: p[0] + p[1] * 0.1),
    "tiny": st.integers(-3, 3).map(lambda k: k * TINY),
    "huge": st.integers(-3, 3).map(lambda k: k * 4e307),
    "wild": st.floats(allow_nan=False, allow_infinity=False),
    "together": st.one_of(LATTICE, st.floats(-1e-300, 1e-300), st.floats(-1e300, 1e300)),
}
"""Each example draws all of its coordinates from one of these."""

SCALES = st.sampled_from(list(NUMBERS))
TAME = st.sampled_from(["lattice", "tenths", "ulps", "far"])

BOX = box((0, 0, 0), (1, 1, 1))["faces"]
TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
OCTAHEDRON = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]


def point(kind: str, n: int) -> st.SearchStrategy[list[float]]:
    return st.lists(NUMBERS[kind], min_size=n, max_size=n)


@st.composite
def polyhedron(draw: st.DrawFn, kind: str) -> Dict:
    """Return a closed mesh: boxes under even-odd, or four to eight free vertices, crossing itself as it likes."""
    form = draw(st.sampled_from(["boxes", "tetrahedron", "octahedron", "free box"]))
    if form == "boxes":
        boxes = []
        for _ in range(draw(st.integers(1, 2))):
            ends = draw(st.tuples(point(kind, 3), point(kind, 3)))
            boxes.append(box([*map(min, *ends)], [*map(max, *ends)]))
        solid = union_of(*boxes)
    else:
        faces = {"tetrahedron": TETRAHEDRON, "octahedron": OCTAHEDRON, "free box": BOX}[form]
        n = max(map(max, faces)) + 1
        vertices = draw(st.lists(point(kind, 3), min_size=n, max_size=n))
        solid = {"type": "polyhedron", "vertices": vertices, "faces": faces}
    return reversed_faces(solid) if draw(st.booleans()) else solid


@st.composite
def polygon(draw: st.DrawFn, kind: str, n_vertices: int = 6) -> Dict:
    """Return one or two rings, crossing themselves and each other as they like."""
    ring = st.lists(point(kind, 2), min_size=3, max_size=n_vertices).filter(lambda r: len(r) > 3 or r[0] != r[-1])
    return {"type": "polygon", "rings": draw(st.lists(ring, min_size=1, max_size=2))}


@st.composite
def aabb(draw: st.DrawFn, kind: str, n: int) -> Dict:
    ends = draw(st.tuples(point(kind, n), point(kind, n)))
    return {"type": "aabb", "min": [*map(min, *ends)], "max": [*map(max, *ends)]}


@st.composite
def sphere(draw: st.DrawFn, kind: str, n: int) -> Dict:
    radius = draw(NUMBERS["tenths" if kind == "far" else kind].map(abs))
    return {"type": "sphere", "center": draw(point(kind, n)), "radius": radius}


@st.composite
def row(draw: st.DrawFn, kind: str, n: int) -> list[float]:
    """Return a plane, often through a point of the same kind up to rounding."""
    normal = draw(point("tenths" if kind in ("far", "huge", "tiny") else kind, n).filter(any))
    if draw(st.booleans()):
        through = draw(point(kind, n))
        offset = -sum(a * x for a, x in zip(normal, through, strict=True))
        if math.isfinite(offset):
            return [*normal, offset]
    return [*normal, draw(NUMBERS[kind])]


def half_space(kind: str, n: int) -> st.SearchStrategy[Dict]:
    return row(kind, n).map(lambda r: {"type": "half_space", "normal": r[:-1], "offset": r[-1]})


def convex(kind: str, n: int) -> st.SearchStrategy[Dict]:
    return st.lists(row(kind, n), min_size=1, max_size=6).map(lambda rows: {"type": "convex", "planes": rows})


def triangle(kind: str, n: int) -> st.SearchStrategy[Dict]:
    return st.lists(point(kind, n), min_size=3, max_size=3).map(lambda v: {"type": "triangle", "vertices": v})


@st.composite
def implicit(draw: st.DrawFn, kind: str, n: int) -> Dict:
    powers = st.lists(st.integers(0, 3), min_size=n, max_size=n)
    terms = draw(st.lists(st.tuples(powers, NUMBERS[kind]), min_size=1, max_size=4))
    return {"type": "implicit", "terms": [{"powers": p, "coefficient": c} for p, c in terms]}


def leaf(kind: str, n: int) -> st.SearchStrategy[Dict]:
    shaped = [polygon(kind)] if n == 2 else [polyhedron(kind)]
    flat = [half_space(kind, n), convex(kind, n), triangle(kind, n), sphere(kind, n), aabb(kind, n), implicit(kind, n)]
    return st.one_of(*flat, *shaped)


@st.composite
def solid(draw: st.DrawFn, kind: str, n: int) -> Dict:
    """Return any solid that has an inside."""
    if draw(st.integers(0, 6)):
        return draw(leaf(kind, n))
    operation = draw(st.sampled_from(["union", "intersection", "difference"]))
    operands = draw(st.lists(leaf(kind, n), min_size=2, max_size=2))
    return {"type": "csg", "operation": operation, "operands": operands}


@st.composite
def region(draw: st.DrawFn, kind: str, n: int) -> Dict:
    """Return what segments can be clipped on."""
    shaped = [polygon(kind)] if n == 2 else [polyhedron(kind)]
    return draw(st.one_of(half_space(kind, n), convex(kind, n), sphere(kind, n), aabb(kind, n), *shaped))


def corners(data: Any) -> list[list[float]]:
    """Return positions that a solid is made of, as far as it has any."""
    if data["type"] == "csg":
        return [p for operand in data["operands"] for p in corners(operand)]
    if data["type"] == "polygon":
        return [p for ring in data["rings"] for p in ring]
    if data["type"] == "aabb":
        return [data["min"], data["max"]]
    return [data["center"]] if data["type"] == "sphere" else data.get("vertices", [])


@st.composite
def points_near(draw: st.DrawFn, data: Dict, kind: str, n: int, size: int) -> list[list[float]]:
    """Return points: free ones, corners, and rounded mixtures of two or three corners, on edges and faces or beside."""
    known = corners(data)
    free = st.lists(point(kind, n), min_size=1, max_size=size)
    if not known:
        return draw(free)

    def mixture(chosen: tuple[Any, Any, Any, float, float]) -> list[float]:
        a, b, c, s, t = chosen
        found = [x * (1 - s - t) + y * s + z * t for x, y, z in zip(a, b, c, strict=True)]
        return found if all(map(math.isfinite, found)) else a

    weights = st.sampled_from([0.0, 0.25, 0.5, 1.0 / 3.0, 0.1])
    some = st.sampled_from(known)
    on = st.lists(st.tuples(some, some, some, weights, weights).map(mixture), min_size=1, max_size=size)
    return draw(free) + draw(on)
