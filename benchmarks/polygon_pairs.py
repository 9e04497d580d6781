"""Pairs of polygons to overlay: large ones by family, small ones by the thousand, those of public suites."""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterator

import numpy as np

from benchmarks.workloads import DATA, MissingDataError, generator

Rings = list[np.ndarray]


def large(family: str, n: int, seed: int) -> tuple[Rings, Rings]:
    """Return a pair of about n vertices each.

    smooth, spiky: closed curves, the spikes 10,000 at most, their sides then of many vertices, since crossings go with
    the square of their number; comb: sqrt(n) teeth upright on as many lying, their sides of many vertices; dense
    comb: n / 2 straight teeth, so that crossings go with n squared; soup: n / 5 rings of five random points, which
    overlap and cross themselves.
    """
    draw = generator(f"overlay/{family}/{n}", seed)
    match family:
        case "smooth":
            return [_curve(draw, n, (0.0, 0.0))], [_curve(draw, n, (0.3, 0.2))]
        case "spiky":
            return [_spikes(draw, n, (0.0, 0.0))], [_spikes(draw, n, (0.3, 0.2))]
        case "comb":
            return [_comb(draw, n, int(n**0.5))], [_comb(draw, n, int(n**0.5))[:, ::-1].copy()]
        case "dense comb":
            return [_comb(draw, n, n // 2)], [_comb(draw, n, n // 2)[:, ::-1].copy()]
        case "soup":
            return _soup(draw, n), _soup(draw, n)
    raise ValueError(family)


def _around(lengths: np.ndarray, centre: tuple[float, float]) -> np.ndarray:
    angles = np.linspace(0, 2 * np.pi, len(lengths), endpoint=False)
    return np.stack([centre[0] + lengths * np.cos(angles), centre[1] + lengths * np.sin(angles)], axis=1)


def _curve(draw: np.random.Generator, n: int, centre: tuple[float, float]) -> np.ndarray:
    angles = np.linspace(0, 2 * np.pi, n, endpoint=False)
    return _around(1 + sum(0.15 / k * np.cos(k * angles + draw.uniform(0, 6)) for k in range(2, 8)), centre)


def _spikes(draw: np.random.Generator, n: int, centre: tuple[float, float]) -> np.ndarray:
    n_tips = min(n, 10_000)
    tips = _around(draw.uniform(0.5, 1.0, n_tips), centre)
    if n_tips == n:
        return tips
    places = np.linspace(0, n_tips, n, endpoint=False)
    return np.stack([np.interp(places, np.arange(n_tips + 1), np.append(axis, axis[0])) for axis in tips.T], axis=1)


def _comb(draw: np.random.Generator, n: int, n_teeth: int) -> np.ndarray:
    tips = 2 * n_teeth
    x = np.linspace(0, 1, tips)
    y = np.where(np.arange(tips) % 2, 1.0, 0.05) + draw.uniform(0, 1e-3, tips)
    places = np.linspace(0, tips - 1, max(tips, n - 2))
    side = np.stack([np.interp(places, np.arange(tips), x), np.interp(places, np.arange(tips), y)], axis=1)
    return np.concatenate([side[: n - 2], [[1.0, -0.1], [0.0, -0.1]]])


def _soup(draw: np.random.Generator, n: int) -> Rings:
    centres, reach = draw.uniform(0, 1, (n // 5, 1, 2)), 1.5 / np.sqrt(n // 5)
    return list(centres + draw.uniform(-reach, reach, (n // 5, 5, 2)))


def small(family: str, size: int, n_pairs: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return pairs of rings (n_pairs, size, 2) that mostly meet: star (concave) or convex."""
    draw = generator(f"overlay batch/{family}/{size}", seed)

    def rings() -> np.ndarray:
        # less than half a turn from one to the next, so that rings are simple
        angles = 2 * np.pi / size * (np.arange(size) + draw.uniform(0.0, 0.9, (n_pairs, size)))
        lengths = draw.uniform(0.4, 1.0, (n_pairs, size)) if family == "star" else np.ones((n_pairs, size))
        found = np.stack([lengths * np.cos(angles), lengths * np.sin(angles)], axis=2)
        return found + draw.uniform(-0.5, 0.5, (n_pairs, 1, 2))

    return rings(), rings()


SUITES = ("clipper2_cases", "geos_pairs", "mfogel_cases")


def public(suites: tuple[str, ...] = SUITES, n_most: int | None = None) -> Iterator[tuple[Rings, Rings]]:
    """Yield the pairs of public test suites whose polygons have rings of at least three vertices.

    n_most: of the geometries of a case, none with an empty ring; all but the first are the second of the pair.
    """
    folder = DATA / "clipping"
    if not folder.is_dir():
        raise MissingDataError("public pairs are in the shared data folder, which is not here")
    for suite in suites:
        for case in json.loads(gzip.decompress((folder / f"{suite}.json.gz").read_bytes())):
            if "subj" in case:
                pair = case["subj"], case["clip"]
            else:
                first, *rest = case["geoms"][:n_most] if "geoms" in case else (case["a"], case["b"])
                pair = _flat([first]), _flat(rest)
            if n_most is not None and not all(ring for rings in pair for ring in rings):
                continue
            subject, clip = ([_ring(ring) for ring in rings if ring] for rings in pair)
            if subject and clip and min(map(len, subject + clip)) >= 3:
                yield subject, clip


def _flat(shapes: list) -> list:
    return [ring for shape in shapes for polygon in shape for ring in polygon]


def _ring(positions: list[list[float]]) -> np.ndarray:
    ring = np.array([position[:2] for position in positions], float)
    return ring[:-1] if len(ring) > 1 and (ring[0] == ring[-1]).all() else ring
