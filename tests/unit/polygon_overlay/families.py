"""Generated pairs of polygons that make overlays hard; each family returns the rings of both."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Random = np.random.Generator
Rings = list[np.ndarray]
Pair = tuple[Rings, Rings]


def star(random: Random, n: int, centre: float = 0.0, radius: float = 1.0) -> np.ndarray:
    angles = np.sort(random.random(n)) * 2 * np.pi
    lengths = radius * (0.3 + random.random(n))
    return np.stack([centre + lengths * np.cos(angles), centre + lengths * np.sin(angles)], axis=1)


def rotated(ring: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return ring @ np.array([[c, s], [-s, c]])


def some(random: Random, low: int, high: int) -> int:
    return int(random.integers(low, high + 1))


def lattice(random: Random) -> Pair:
    size = some(random, 3, 16)
    rings = [random.integers(0, size, (some(random, 4, 11), 2)).astype(float) for _ in range(3)]
    return rings[:2], rings[2:]


def small_lattice(random: Random) -> Pair:
    """3 x 3 and 4 x 4: hardly an edge that touches no other."""
    rings = [random.integers(0, some(random, 3, 4), (some(random, 3, 7), 2)).astype(float) for _ in range(2)]
    return rings[:1], rings[1:]


def scaled_lattice(random: Random) -> Pair:
    """No power of two: what was collinear is not quite."""
    subject, clip = small_lattice(random)
    scale = 10.0 ** some(random, -20, 20) / 3.0
    return [ring * scale for ring in subject], [ring * scale for ring in clip]


def nearly_lattice(random: Random) -> Pair:
    rings = [random.integers(0, 4, (9, 2)) + random.integers(-2, 3, (9, 2)) * 2.0**-51 for _ in range(2)]
    return rings[:1], rings[1:]


def rotated_lattice(random: Random) -> Pair:
    angle = random.random()
    rings = [rotated(random.integers(0, 6, (8, 2)).astype(float), angle) for _ in range(2)]
    return rings[:1], rings[1:]


def coincident_edges(random: Random) -> Pair:
    """The second polygon takes most of its vertices, and pieces of edges, from the first."""
    first = random.integers(0, 9, (some(random, 5, 9), 2)).astype(float)
    second = first.copy()
    middles = (first + np.roll(first, 1, axis=0)) / 2
    chosen = random.random(len(first))
    second[chosen < 0.3] = middles[chosen < 0.3]
    second[chosen < 0.1] = random.integers(0, 9, 2)
    return [first], [second]


def shared_border(random: Random) -> Pair:
    """Two neighbours along a border that runs back and forth, as in maps, now and then copied with an ulp's error."""
    n = some(random, 3, 8)
    border = np.stack([random.random(n) * 0.3, np.sort(random.random(n))], axis=1)
    copy = border * (1 + random.integers(-1, 2, border.shape) * 2.0**-52 * (random.random() < 0.5))
    left = np.concatenate([border, [[-1.0, 1.0], [-1.0, 0.0]]])
    return [left], [np.concatenate([copy[::-1], [[1.0, 0.0], [1.0, 1.0]]])]


def nearly_coincident(random: Random) -> Pair:
    first = star(random, 12)
    return [first], [np.concatenate([first[:6] * (1 + random.integers(-2, 3, (6, 2)) * 2.0**-52), star(random, 5)])]


def turned_by_less_than_an_ulp(random: Random) -> Pair:
    rings, angle = [star(random, 10, 0.0, 1e-3), star(random, 9)], random.random() * 1e-15
    return rings, [rotated(ring, angle) for ring in rings]


def turned_a_little(random: Random) -> Pair:
    """The classic robustness test: a polygon on itself, turned by less and less."""
    first = star(random, some(random, 5, 12))
    return [first], [rotated(first, 10.0 ** -random.uniform(3, 17))]


def far_away(random: Random) -> Pair:
    offset = float(random.choice([1e6, 1e9]))
    return [star(random, 10, offset)], [star(random, 10, offset)]


def far_lattice(random: Random) -> Pair:
    """Lattice and half-lattice points at 1e9, some an ulp (2^-23) off."""
    rings = [
        1e9 + random.integers(0, 10, (some(random, 4, 8), 2)) / 2 + random.integers(-1, 2, 2) * 2.0**-23
        for _ in range(2)
    ]
    return rings[:1], rings[1:]


def many_exponents(random: Random) -> Pair:
    rings = [random.random((10, 2)) * 2.0 ** -random.integers(0, 52, (10, 2)).astype(float) for _ in range(2)]
    return rings[:1], rings[1:]


def combs(random: Random) -> Pair:
    teeth = some(random, 4, 12)
    x = np.arange(float(teeth))
    comb = np.concatenate([np.stack([x, (x % 2) * (teeth - 1)], axis=1), [[teeth, -1.0], [-1.0, -1.0]]])
    middle = teeth / 2
    turned = rotated(comb - middle, np.pi / 2 * (1 + some(random, -1, 1) * 2.0**-50)) + middle
    return [comb], [turned]


def stars(random: Random) -> Pair:
    return [star(random, some(random, 4, 16))], [star(random, some(random, 4, 16), 0.2, 0.9)]


def soups(random: Random) -> Pair:
    return [random.random((some(random, 5, 10), 2))], [random.random((some(random, 5, 10), 2))]


def convex_pairs(random: Random) -> Pair:
    """Convex rings: free, on a circle, squares and triangles on a lattice; the fast path of batches."""

    def ring() -> np.ndarray:
        n = some(random, 3, 12)
        match some(random, 0, 3):
            case 0:
                angles = np.sort(random.random(n)) * 2 * np.pi
            case 1:
                angles = np.arange(n) * (2 * np.pi / n)
            case 2:
                low = random.integers(-2, 1, 2).astype(float)
                return low + np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * random.integers(1, 4, 2)
            case _:
                return random.integers(-2, 3, (3, 2)).astype(float)
        return np.stack([np.cos(angles), np.sin(angles)], axis=1) * random.uniform(0.5, 1.5)

    rings = [ring()[:: 1 if random.random() < 0.5 else -1], ring()]
    return rings[:1], rings[1:]


def nearly_equal_convex(random: Random) -> Pair:
    angles = np.sort(random.random(some(random, 3, 9))) * 2 * np.pi
    first = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return [first], [first * (1 + random.integers(-1, 2, first.shape) * 2.0**-52)]


def nearly_collinear(random: Random) -> Pair:
    """Triangles with corners an ulp's multiple off the line y = x (L. Kettner et al., Classroom examples, 2008)."""
    ends = np.array([[0.5, 0.5], [12.0, 12.0], [24.0, 24.0], [17.300000000000001] * 2, [8.8000000000000007] * 2])

    def ring() -> np.ndarray:
        points = ends[random.permutation(5)[: some(random, 3, 5)]]
        return points + random.integers(0, 64, points.shape) * 2.0**-53 * (points == 0.5)

    return [ring()], [np.concatenate([ring(), [[some(random, 0, 24), some(random, 0, 24)]]])]


def pencils(random: Random) -> Pair:
    """Long edges that pass one point within an ulp or two: crossings crowd together (hot pixels)."""

    def ring() -> np.ndarray:
        n = some(random, 3, 5)
        angles = np.sort(random.random(n)) * np.pi
        ends = np.stack([np.cos(angles), np.sin(angles)], axis=1) * random.uniform(0.5, 2, (n, 1))
        both = np.stack([ends, -ends * random.uniform(0.5, 2, (n, 1))], axis=1)
        both[1::2] = both[1::2, ::-1]
        return both.reshape(-1, 2) + 1 / 3

    return [ring()], [ring()]


def slivers(random: Random) -> Pair:
    """Needles whose width is some ulps, along each other and across."""

    def needle() -> np.ndarray:
        a, b = random.random((2, 2))
        return np.array(
            [a, b, b + random.integers(-3, 4, 2) * np.spacing(b), a + random.integers(-1, 2, 2) * np.spacing(a)]
        )

    first = needle()
    return [first, needle()], [first[::-1] + random.integers(-1, 2, (4, 2)) * 2.0**-54, needle()]


def crossing_strips(random: Random) -> Pair:
    """Thin strips one way on thin strips the other: a crossing at every pair, collinear ends."""
    n, m = some(random, 1, 3), some(random, 1, 3)
    tilt = float(random.choice([0.0, 0.1, 1e-9]))
    strip = np.array([[-1.0, 0.0], [1.0, tilt], [1.0, 1e-3 + tilt], [-1.0, 1e-3]])
    return [strip + np.array([0, i / 7]) for i in range(n)], [strip[:, ::-1] + np.array([i / 7, 0]) for i in range(m)]


def degenerate_rings(random: Random) -> Pair:
    """Spikes, repeated points, rings without area, rings within rings that touch them."""
    base = random.integers(0, 5, (some(random, 3, 5), 2)).astype(float)
    spiked = np.concatenate([base[:2], random.integers(0, 5, (1, 2)), base[1:], base[-1:]])
    square = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])
    inner = np.array([[0.0, 0.0], [2.0, 1.0], [1.0, 2.0]]) * random.integers(1, 3)
    flat = np.array([[0.0, 0.0], [3.0, 3.0], [1.0, 1.0]]) + random.integers(0, 2, 2)
    return [spiked, flat], [square, inner] if random.random() < 0.5 else [square, square[::-1], spiked[::-1]]


FAMILIES: dict[Callable[[Random], Pair], int] = {
    lattice: 12,
    small_lattice: 20,
    scaled_lattice: 6,
    nearly_lattice: 2,
    rotated_lattice: 3,
    coincident_edges: 10,
    shared_border: 6,
    nearly_coincident: 2,
    turned_by_less_than_an_ulp: 1,
    turned_a_little: 3,
    far_away: 4,
    far_lattice: 4,
    many_exponents: 2,
    combs: 1,
    stars: 6,
    soups: 6,
    convex_pairs: 10,
    nearly_equal_convex: 3,
    nearly_collinear: 5,
    pencils: 3,
    slivers: 4,
    crossing_strips: 2,
    degenerate_rings: 6,
}
"""Each family with the thousands of pairs of it in the large set: fewer where all outputs need a second rounding."""


def drawn(family: Callable[[Random], Pair], seed: int) -> Pair:
    """Return the family's first pair of a seed all of whose rings have three vertices, a repeated last one apart."""
    random = np.random.default_rng(seed)
    while True:  # bound: lattices draw such a pair at every second try at least
        pair = family(random)
        if all(len(ring) - (ring[0] == ring[-1]).all() >= 3 for ring in pair[0] + pair[1]):
            return pair


def changed(random: Random, subject: Rings, clip: Rings) -> tuple[Rings, Rings, float]:
    """Return the pair mirrored, turned by a right angle, scaled by a power of two, or written in another order.

    Also the factor on areas; exact in every case, so areas and counts of results may not change otherwise.
    """
    way = some(random, 0, 3)
    exponent = some(random, -40, 40)

    def image(ring: np.ndarray) -> np.ndarray:
        match way:
            case 0:
                return ring * [-1.0, 1.0]
            case 1:
                return np.stack([-ring[:, 1], ring[:, 0]], axis=1)
            case 2:
                return ring * 2.0**exponent
        return ring[::-1]

    found = [[image(ring) for ring in rings] for rings in (subject, clip)]
    if way == 3:
        found = [rings[::-1] for rings in found]
    return found[0], found[1], 4.0**exponent if way == 2 else 1.0
