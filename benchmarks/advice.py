"""What the textbook's advice is worth, measured: the tables of docs/textbook_advice.md.

python -m benchmarks advice

Counts and shares only, from generated input; nothing is timed, nothing needs peers or data. What the bounding volumes
save in time stands in docs/collision_cost.md.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import engine
from benchmarks.bodies import random_rotations
from benchmarks.workloads import bumpy_sphere, generator, ring_around
from engine.bounding.aabb import corners_of_box
from engine.textbook import clip_segments, collision, polygons

N = 20_000
UNIT = np.zeros(3), np.ones(3)
MARGIN = 1e-3
"""Of the triangle's size: how far points are inside or outside at least."""


def projections() -> Iterator[str]:
    """A triangle nearly in a coordinate plane, points in its plane, projected along each axis in float64."""
    yield "| the plane leaves a coordinate plane by | wrong on the largest area | wrong on the smallest area |"
    yield "|---|---|---|"
    draw = generator("advice projection", 0)
    for tilt in (1.0, 1e-8, 1e-12, 1e-13, 1e-14, 1e-15, 1e-16):
        corners = np.array([[0.1, 0.2, 0.0], [0.9, 0.3, 0.0], [0.4, 0.8, 0.0]])
        weights = draw.uniform(-0.3, 1.0, (N, 2))
        weights = np.column_stack([weights, 1.0 - weights.sum(axis=1)])
        weights = weights[np.abs(weights).min(axis=1) > MARGIN]
        inside = (weights > 0.0).all(axis=1)
        points = weights @ corners
        for rows in (corners, points):
            rows[:, 2] = 0.3 + tilt * rows[:, 1] + 0.5 * tilt * rows[:, 0]
        flat = [[np.ascontiguousarray(each[:, kept]) for each in (points, corners)] for kept in ([0, 1], [1, 2])]
        wrong = [np.mean(polygons.by_same_side(*each) != inside) for each in flat]
        yield f"| {tilt:g} | {wrong[0]:.1%} | {wrong[1]:.1%} |"


def outcodes() -> Iterator[str]:
    """Segments about the unit cube: intersections with its planes that are computed, and how segments are settled."""
    yield "| segments as long as | accepted at once | rejected at once | intersections each | without outcodes |"
    yield "|---|---|---|---|---|"
    draw = generator("advice outcodes", 0)
    for length in (0.1, 0.5, 1.0, 3.0, 10.0):
        middles, ways = draw.uniform(-1.0, 2.0, (N, 3)), draw.normal(size=(N, 3))
        half = 0.5 * length * ways / np.linalg.norm(ways, axis=1)[:, None]
        counts = np.array([_cuts(a, b) for a, b in zip(middles - half, middles + half)])
        crossed = ((middles - half < 0) != (middles + half < 0)) | ((middles - half > 1) != (middles + half > 1))
        shares = (counts == -1).mean(), (counts == -2).mean()
        cuts = np.maximum(counts, 0).mean()
        planes = crossed.sum(axis=1).mean()
        yield f"| {length:g} | {shares[0]:.0%} | {shares[1]:.0%} | {cuts:.2f} | 6; {planes:.2f} planes crossed |"


def _cuts(p: np.ndarray, q: np.ndarray) -> int:
    """Return how many intersections Cohen and Sutherland compute; -1 accepted at once, -2 rejected at once."""
    p, q = p.copy(), q.copy()
    for n_cuts in range(7):
        codes = [clip_segments.code_word(each, *UNIT) for each in (p, q)]
        if codes[0] | codes[1] == 0:
            return n_cuts or -1
        if codes[0] & codes[1]:
            return n_cuts or -2
        differing = codes[0] ^ codes[1]
        bit = (differing & -differing).bit_length() - 1
        end = p if codes[0] >> bit & 1 else q
        end[:] = clip_segments.cut(p, q, bit, *UNIT)
        end[bit // 2] = UNIT[bit % 2][bit // 2]  # so that no plane is cut twice
    return 6


def volumes() -> Iterator[str]:
    """Pairs of bumpy balls at random places, half a body to three bodies apart: who settles them."""
    yield "| first comes | pairs that it settles, of those that reach it |"
    yield "|---|---|"
    draw, mesh = generator("advice volumes", 0), bumpy_sphere("advice", 0, 1)
    reached, settled = np.zeros(4, int), np.zeros(4, int)
    for turn in random_rotations(draw, 400):
        way = draw.normal(size=3)
        move = way / np.linalg.norm(way) * draw.uniform(0.5, 3.0) * np.abs(mesh.vertices).max()
        other = mesh.vertices @ turn.T + move
        radii = [np.linalg.norm(mesh.vertices, axis=1).max()] * 2
        boxes = [(each.min(axis=0), each.max(axis=0)) for each in (mesh.vertices, other)]
        corners = corners_of_box(*boxes[1])
        tests = (
            lambda radii=radii, move=move: np.linalg.norm(move) <= sum(radii),
            lambda boxes=boxes: collision.boxes_meet(*boxes[0], *boxes[1]),
            lambda corners=corners: collision.meet(mesh.vertices, mesh.faces, corners, collision.BOX_TRIANGLES),
            lambda: False,
        )
        for stage, test in enumerate(tests):
            reached[stage] += 1
            if not test():
                settled[stage] += 1
                break
    names = "the spheres", "the boxes", "a polyhedron against the other's box", "both polyhedra"
    for name, n, of in zip(names, settled, reached):
        yield f"| {name} | {n:,} of {of:,} |"


def angles() -> Iterator[str]:
    """A regular polygon of 12 corners: points anywhere, and points so far from an edge, by the unsigned sum."""
    yield "| tolerance, radians | anywhere | 1e-3 from an edge | 1e-6 | 1e-9 | 1e-12 |"
    yield "|---|---|---|---|---|---|"
    draw = generator("advice angles", 0)
    ring = ring_around(2.0 * np.pi * (np.arange(12) + 0.3) / 12)
    polygon = engine.Polygon([ring])
    sets = [draw.uniform(-1.2, 1.2, (N, 2))]
    for off in (1e-3, 1e-6, 1e-9, 1e-12):
        k, t, sign = draw.integers(0, 12, N), draw.uniform(0.05, 0.95, N), draw.choice([-1.0, 1.0], N)
        a, b = ring[k], ring[(k + 1) % 12]
        way = b - a
        normal = np.column_stack([way[:, 1], -way[:, 0]]) / np.linalg.norm(way, axis=1)[:, None]
        sets.append(a + t[:, None] * way + (off * sign)[:, None] * normal)
    exact = [engine.contains(points, polygon) for points in sets]
    for tolerance in (0.0, 1e-14, 1e-12, 1e-9, 1e-6, 1e-3):
        found = [polygons.by_unsigned_angles(points, ring, tolerance) for points in sets]
        yield f"| {tolerance:g} | " + " | ".join(f"{np.mean(a != b):.2%}" for a, b in zip(found, exact)) + " |"
    found = [polygons.by_signed_angles(points, ring) for points in sets]
    yield "| the signed sum, none | " + " | ".join(f"{np.mean(a != b):.2%}" for a, b in zip(found, exact)) + " |"


def main(words: list[str] | None = None) -> int:
    """Print the tables."""
    for table in (projections, outcodes, volumes, angles):
        print(f"\n{(table.__doc__ or '').splitlines()[0]}\n")
        print("\n".join(table()), flush=True)
    return 0
