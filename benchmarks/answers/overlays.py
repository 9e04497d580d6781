"""Questions to overlay and overlay_batch."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Literal

import numpy as np

import engine
from benchmarks.answers import shapes
from benchmarks.answers.asking import Drawn, Question, drawn_by, family, same
from benchmarks.answers.draws import FAR_PLACES, NEAR_PLACES, Array, Draw, Place, around, put, turned

Operation = Literal["intersection", "union", "difference", "symmetric_difference"]
OPERATIONS: tuple[Operation, ...] = ("intersection", "union", "difference", "symmetric_difference")
Rings = list[Array]
Pair = tuple[Rings, Rings]


def said(result: engine.Overlay | None) -> Any:
    """Return an overlay as a list, without the bound on displacements, which depends on the order of edges."""
    if result is None:
        return None
    return [
        result.vertices, result.ring_offsets, result.piece_offsets, result.area_exact, result.n_pieces_exact,
        result.n_holes_exact, [(part.kind, part.area, list(part.near)) for part in result.collapsed],
        result.pieces_joined, result.pieces_parted, result.holes_joined, result.holes_parted, result.rounds,
        result.vertices_moved, result.snapped,
    ]  # fmt: skip


def overlaid(pair: Pair, workers: int | None) -> tuple[int, Any]:
    subject, clip = (engine.Polygon(rings) for rings in pair)
    return 4, [said(engine.overlay(subject, clip, name, workers=workers)) for name in OPERATIONS]


def overlaid_in_order(pair: Pair, other: Pair, workers: int | None) -> tuple[int, Any]:
    """Overlay also with rings and vertices in another order: the result must have the same rings."""
    n, result = overlaid(pair, workers)
    return 2 * n, same(overlaid(other, workers)[1], result, "rings and vertices")


def batch_overlaid(pairs: list[Pair], workers: int | None) -> tuple[int, Any]:
    subjects, clips = ([engine.Polygon(rings) for rings in side] for side in zip(*pairs))
    answers = []
    for name in OPERATIONS:
        result = engine.overlay_batch(subjects, clips, name, workers=workers)
        flat = [result.status, result.vertices, result.ring_offsets, result.piece_offsets, result.pair_offsets]
        answers.append([*flat, [said(result[pair]) for pair in range(0, len(result), 9)]])
    return 4 * len(pairs), answers


def any_rings(draw: Draw) -> Pair:
    return draw.pick(shapes.RINGS)(draw), draw.pick(shapes.RINGS)(draw)


def lattice(draw: Draw) -> Pair:
    """Lattice rings: nearly every edge touches another."""
    size = draw.pick([2, 3, 8])
    rings = [draw.whole(0, size, draw.one(4, 9), 2).astype(float) for _ in range(3)]
    return rings[:2], rings[2:]


def turned_lattice(draw: Draw) -> Pair:
    subject, clip = lattice(draw)
    rotation, scale = draw.rotation(2), draw.pick([1.0, 1 / 3, 1e-9])
    return [turned(ring, rotation) * scale for ring in subject], [turned(ring, rotation) * scale for ring in clip]


def coincident(draw: Draw) -> Pair:
    """Return a ring, and one made of its vertices and middles of its edges, some an ulp off."""
    first = draw.spots(draw.one(4, 9), 2)
    second = np.where(draw.unit(len(first), 1) < 0.4, first * 0.5 + np.roll(first, 1, axis=0) * 0.5, first)
    return [first], [draw.nudged(second) if draw.chance(0.5) else second]


def shared_border(draw: Draw) -> Pair:
    n = draw.one(3, 9)
    border = np.stack([draw.unit(n) * 0.3, np.sort(draw.unit(n))], axis=1)
    copy = draw.nudged(border, 1)[::-1] if draw.chance(0.5) else border[::-1]
    return [np.concatenate([border, [[-1.0, 1.0], [-1.0, 0.0]]])], [np.concatenate([copy, [[1.0, 0.0], [1.0, 1.0]]])]


def pencil(draw: Draw) -> Pair:
    """Long edges that pass one point within an ulp or two: hot pixels."""

    def ring() -> Array:
        ends = around(np.sort(draw.unit(draw.one(3, 5))) * 2.0)
        both = np.stack([ends, -ends * (0.5 + draw.unit(len(ends), 1))], axis=1)
        both[1::2] = both[1::2, ::-1]
        return both.reshape(-1, 2) + 1 / 3

    return [ring()], [ring()]


def turned_a_little(draw: Draw) -> Pair:
    first = shapes.star(draw, draw.one(5, 14))
    t = draw.pick([1e-3, 1e-8, 1e-12, 1e-15, 1e-16])
    x, y = around(np.array([t]))[0]
    return [first], [turned(first, np.array([[x, -y], [y, x]]))]


def convex_pair(draw: Draw) -> Pair:
    return [shapes.round_ring(draw)], [shapes.round_ring(draw)]


def stars(draw: Draw) -> Pair:
    return [shapes.star(draw, draw.one(5, 30))], [shapes.star(draw, draw.one(5, 30))]


KINDS: tuple[Callable[[Draw], Pair], ...] = (
    any_rings, lattice, turned_lattice, coincident, shared_border, pencil, turned_a_little, convex_pair, stars,
)  # fmt: skip


def _drawn(draw: Draw, places: tuple[Place, ...], kind: Callable[[Draw], Pair] | None = None) -> Pair:
    """Return a pair all of whose rings have three vertices left when a repeated last one is dropped."""
    place = draw.pick(places)
    while True:  # bound: lattices draw such a pair at every second try at least
        pair = (kind or draw.pick(KINDS))(draw)
        subject, clip = ([put(ring, place) for ring in rings] for rings in pair)
        if all(len(ring) - int((ring[0] == ring[-1]).all()) >= 3 for ring in (*subject, *clip)):
            return subject, clip


def _of_each_kind(places: tuple[Place, ...], times: int) -> Drawn:
    return lambda draw: (partial(overlaid, _drawn(draw, places, kind)) for kind in KINDS * times)


family("overlay", "pairs_of_all_kinds", 24, _of_each_kind(NEAR_PLACES, 3))
family("overlay", "pairs_far_away", 10, _of_each_kind(FAR_PLACES, 1))


@drawn_by("overlay", 6)
def rings_in_another_order(draw: Draw) -> Iterator[Question]:
    for kind in KINDS:
        pair = _drawn(draw, NEAR_PLACES, kind)
        subject, clip = ([np.roll(ring, 1, axis=0)[::-1] for ring in rings[::-1]] for rings in pair)
        yield partial(overlaid_in_order, pair, (subject, clip))


def displaced(pair: Pair, workers: int | None) -> tuple[int, Any]:
    """Query the largest displacement of edges by rounding."""
    subject, clip = (engine.Polygon(rings) for rings in pair)
    result, accuracy = engine.overlay(subject, clip, "union", report=True, workers=workers)
    batch = engine.overlay_batch([subject, subject], [clip, clip], "difference", workers=workers)
    return 3, [result.largest_displacement, accuracy.coordinates_ulp, batch.displacement]


family("displacements", "bounds_on_displacement", 10,
       lambda draw: (partial(displaced, _drawn(draw, NEAR_PLACES, kind)) for kind in KINDS * 3))  # fmt: skip


@drawn_by("overlay", 4)
def large_rings(draw: Draw) -> Iterator[Question]:
    """Rings of thousands of vertices, of which most are near nothing; hundreds of rings; dense crossings."""
    coasts = [shapes.coast(draw, 3000), shapes.coast(draw, 2500) + draw.pick([0.1, 1.0, 3.5])]
    yield partial(overlaid, (coasts[:1], coasts[1:]))
    yield partial(overlaid, (coasts[:1], [shapes.star(draw, 9)]))
    holes = shapes.many_holes(draw)
    yield partial(overlaid, (holes, [ring + draw.pick([0.0, 0.1, 0.25]) for ring in holes]))
    yield partial(overlaid, (holes, coasts[1:]))
    yield partial(overlaid, ([shapes.star(draw, 60)], [shapes.star(draw, 80)]))


@drawn_by("overlay_batch", 20)
def batches_of_all_kinds(draw: Draw) -> Iterator[Question]:
    places = draw.pick([NEAR_PLACES, ((1.0, 0.0),), ((1 / 3, 1e6),)])
    yield partial(batch_overlaid, [_drawn(draw, places) for _ in range(draw.pick([3, 40, 150]))])


@drawn_by("overlay_batch", 10)
def batches_of_one_kind(draw: Draw) -> Iterator[Question]:
    kind = draw.pick([convex_pair, stars, lattice, turned_lattice])
    yield partial(batch_overlaid, [_drawn(draw, NEAR_PLACES, kind) for _ in range(500)])


@drawn_by("overlay_batch", 6)
def batches_far_away(draw: Draw) -> Iterator[Question]:
    pairs = [_drawn(draw, FAR_PLACES + NEAR_PLACES[:2]) for _ in range(10)]
    yield partial(batch_overlaid, [*pairs, *[_drawn(draw, NEAR_PLACES) for _ in range(10)]])


def layers_overlaid(layers: list[Any], workers: int | None) -> tuple[int, Any]:
    """Overlay two layers in every way: members and coordinates of every row."""
    hows = ("intersection", "union", "identity", "difference", "symmetric_difference")
    answers: list[Any] = []
    for how in hows:
        rows: Any = engine.layers.overlay_features(*layers, how)
        for row in rows:
            rings = _rings_of(row["geometry"])
            answers += [row["properties"], row.get("id", ""), len(rings), *(np.asarray(ring, float) for ring in rings)]
        answers.append(rows.collapsed)
    return len(hows), answers


def _rings_of(geometry: Any) -> list[Any]:
    if geometry is None:
        return []
    parts = [geometry["coordinates"]] if geometry["type"] == "Polygon" else geometry["coordinates"]
    return [ring for part in parts for ring in part]


@drawn_by("layers", 8)
def layers(draw: Draw) -> Iterator[Question]:
    """Features of one to three parts, which overlap, within a layer and across; some without geometry."""
    for _ in range(3):
        sides = []
        for name in "lr":
            features: list[Any] = []
            for k in range(12):
                rings = [draw.whole(0, 6, 5, 2) * draw.pick([1.0, 1 / 3]) for _ in range(draw.one(1, 3))]
                shape = {"type": "MultiPolygon", "coordinates": [[ring.tolist()] for ring in rings]}
                geometry = None if draw.chance(0.1) else shape
                properties = {"n": k, name: k}
                features.append({"type": "Feature", "id": k, "properties": properties, "geometry": geometry})
            sides.append({"type": "FeatureCollection", "features": features})
        yield partial(layers_overlaid, sides)


def _layer(draw: Draw) -> list[Rings]:
    """Return polygons of one ring or two of several kinds, some of which share rings."""
    pairs = [_drawn(draw, NEAR_PLACES[:2]) for _ in range(draw.one(1, 4))]
    layer = [side for pair in pairs for side in pair]
    return [*layer, layer[0][:1]] if draw.chance(0.3) else layer


def _said_of_many(result: engine.Overlay) -> list[Any]:
    return [*said(result), result.sources]


def united(layer: list[Rings], grid: float | None, workers: int | None) -> tuple[int, Any]:
    polygons = [engine.Polygon(rings) for rings in layer]
    return 1, _said_of_many(engine.union_all(polygons, grid=grid, workers=workers))


def filled_by(rings: Rings, workers: int | None) -> tuple[int, Any]:
    result = [engine.filled(rings, rule) for rule in ("non_zero", "positive", "negative")]  # type: ignore[arg-type]
    return 3, [[each.vertices, each.ring_offsets] for each in result]


def overlaid_on_grid(pair: Pair, grid: float, workers: int | None) -> tuple[int, Any]:
    subject, clip = (engine.Polygon(rings) for rings in pair)
    result = [engine.overlay(subject, clip, name, grid=grid, workers=workers) for name in OPERATIONS]
    return 4, [_said_of_many(each) for each in result]


@drawn_by("union_all", 12)
def layers_of_all_kinds(draw: Draw) -> Iterator[Question]:
    for _ in range(12):
        yield partial(united, _layer(draw), None)
        yield partial(united, _layer(draw), draw.pick([0.125, 0.1, 1e-6]))


family("filled", "rings_under_fill_rules", 8, lambda draw: (
    partial(filled_by, [ring for rings in _layer(draw) for ring in rings]) for _ in range(12)
))  # fmt: skip
family("grid", "overlays_on_grids", 8, lambda draw: (
    partial(overlaid_on_grid, _drawn(draw, NEAR_PLACES[:2], kind), draw.pick([0.25, 0.01, 2.0**-20, 1e-9]))
    for kind in KINDS
))  # fmt: skip
