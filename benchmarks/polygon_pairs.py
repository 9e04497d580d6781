"""Pairs of polygons to overlay: large ones by family, small ones by the thousand, those of public suites."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.workloads import generator, packed, ring_around

Rings = list[np.ndarray]
Random = np.random.Generator


def _curve(draw: Random, n: int, centre: tuple[float, float]) -> np.ndarray:
    angles = np.linspace(0, 2 * np.pi, n, endpoint=False)
    radii = 1 + sum(0.15 / k * np.cos(k * angles + draw.uniform(0, 6)) for k in range(2, 8))
    return centre + ring_around(angles, radii)


def _spikes(draw: Random, n: int, centre: tuple[float, float]) -> np.ndarray:
    n_tips = min(n, 10_000)
    tips = centre + ring_around(np.linspace(0, 2 * np.pi, n_tips, endpoint=False), draw.uniform(0.5, 1.0, n_tips))
    if n_tips == n:
        return tips
    places = np.linspace(0, n_tips, n, endpoint=False)
    return np.stack([np.interp(places, np.arange(n_tips + 1), np.append(axis, axis[0])) for axis in tips.T], axis=1)


def _comb(draw: Random, n: int, n_teeth: int) -> np.ndarray:
    tips = 2 * n_teeth
    x = np.linspace(0, 1, tips)
    y = np.where(np.arange(tips) % 2, 1.0, 0.05) + draw.uniform(0, 1e-3, tips)
    places = np.linspace(0, tips - 1, max(tips, n - 2))
    side = np.stack([np.interp(places, np.arange(tips), x), np.interp(places, np.arange(tips), y)], axis=1)
    return np.concatenate([side[: n - 2], [[1.0, -0.1], [0.0, -0.1]]])


def _soup(draw: Random, n: int) -> Rings:
    centres, reach = draw.uniform(0, 1, (n // 5, 1, 2)), 1.5 / np.sqrt(n // 5)
    return list(centres + draw.uniform(-reach, reach, (n // 5, 5, 2)))


def _crossed(comb: Callable[[], np.ndarray]) -> tuple[Rings, Rings]:
    return [comb()], [comb()[:, ::-1].copy()]


LARGE: dict[str, Callable[[Random, int], tuple[Rings, Rings]]] = {
    "smooth": lambda draw, n: ([_curve(draw, n, (0.0, 0.0))], [_curve(draw, n, (0.3, 0.2))]),
    "spiky": lambda draw, n: ([_spikes(draw, n, (0.0, 0.0))], [_spikes(draw, n, (0.3, 0.2))]),
    "comb": lambda draw, n: _crossed(lambda: _comb(draw, n, int(n**0.5))),
    "dense comb": lambda draw, n: _crossed(lambda: _comb(draw, n, n // 2)),
    "soup": lambda draw, n: (_soup(draw, n), _soup(draw, n)),
}
"""Pairs of about n vertices each.

smooth, spiky: closed curves, the spikes 10,000 at most, their sides then of many vertices, since crossings go with
the square of their number; comb: sqrt(n) teeth upright on as many lying, their sides of many vertices; dense
comb: n / 2 straight teeth, so that crossings go with n squared; soup: n / 5 rings of five random points, which
overlap and cross themselves.
"""


def large(family: str, n: int, seed: int) -> tuple[Rings, Rings]:
    """Return a pair of a family."""
    return LARGE[family](generator(f"overlay/{family}/{n}", seed), n)


def parcels(n: int, seed: int, jitter: float = 0.3) -> np.ndarray:
    """Return some n quadrilaterals (m, 4, 2) that share their borders, on a grid whose corners are moved at random."""
    draw, side = generator("parcels", seed), int(n**0.5)
    corners = np.stack(np.meshgrid(np.arange(side + 1.0), np.arange(side + 1.0), indexing="ij"), axis=-1)
    if jitter:
        corners += draw.uniform(-jitter, jitter, corners.shape) + draw.uniform(0.0, 1.0, 2)
    around = [corners[:-1, :-1], corners[1:, :-1], corners[1:, 1:], corners[:-1, 1:]]
    return np.stack(around, axis=2).reshape(-1, 4, 2)


def parcels_and_parts(n: int, seed: int, is_split: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return parcels, and the same again or each in two parts, whose new corners are rounded onto its sides."""
    whole = parcels(n, seed)
    if not is_split:
        return whole, whole
    a, b, c, d = whole.transpose(1, 0, 2)
    low, high = a + (b - a) / 3.0, d + (c - d) / 3.0
    return whole, np.concatenate([np.stack([a, low, high, d], axis=1), np.stack([low, b, c, high], axis=1)])


def small(family: str, size: int, n_pairs: int, seed: int) -> list[tuple[Rings, Rings]]:
    """Return pairs of single rings that mostly meet: star (concave) or convex, or 6 to 9 vertices on a lattice."""
    draw = generator(f"overlay batch/{family}/{size}", seed)

    def on_lattice() -> Rings:
        return [draw.integers(0, 5, (draw.integers(6, 10), 2)).astype(float)]

    def rings() -> np.ndarray:
        # less than half a turn from one to the next, so that rings are simple
        angles = 2 * np.pi / size * (np.arange(size) + draw.uniform(0.0, 0.9, (n_pairs, size)))
        lengths = draw.uniform(0.4, 1.0, (n_pairs, size)) if family == "star" else np.ones((n_pairs, size))
        return ring_around(angles, lengths) + draw.uniform(-0.5, 0.5, (n_pairs, 1, 2))

    if family == "lattice":
        return [(on_lattice(), on_lattice()) for _ in range(n_pairs)]
    return [([first], [second]) for first, second in zip(rings(), rings(), strict=True)]


SUITES = ("geos_pairs", "mfogel_cases", "clipper2_cases")


def public(most_vertices: int) -> Iterator[tuple[Rings, Rings]]:
    """Yield the pairs of public test suites with at most so many vertices, whose rings all have at least three."""
    for suite in SUITES:
        for case in packed(f"clipping/{suite}.json.gz"):
            if "subj" in case:
                pair = case["subj"], case["clip"]
            else:
                first, *rest = case.get("geoms") or (case["a"], case["b"])
                pair = _flat([first]), _flat(rest)
            subject, clip = ([_ring(ring) for ring in rings if ring] for rings in pair)
            sizes = list(map(len, subject + clip))
            if subject and clip and min(sizes) >= 3 and sum(sizes) <= most_vertices:
                yield subject, clip


def _flat(shapes: list) -> list:
    return [ring for shape in shapes for polygon in shape for ring in polygon]


def _ring(positions: list[list[float]]) -> np.ndarray:
    ring = np.array([position[:2] for position in positions], float)
    return ring[:-1] if len(ring) > 1 and (ring[0] == ring[-1]).all() else ring


def layer(family: str, part: int, seed: int) -> list[np.ndarray]:
    """Return polygons of one ring each to be united; part: one over how many of the whole layer."""
    if family != "circles":
        return list(
            parcels((120 // part) ** 2, seed) if family == "parcels" else parcels((150 // part) ** 2, seed, 0.0)
        )
    draw, n = generator("circles", seed), 1_000 // part
    unit = ring_around(np.arange(64) * 2.0 * np.pi / 64)
    return [centre + draw.uniform(0.3, 0.8) * unit for centre in draw.uniform(0.0, n**0.5, (n, 2))]
