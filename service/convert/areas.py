"""Answers about areas: overlays, clipped polygons and layers, made as they are written."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any, Final

import numpy as np

import engine
from service import wire
from service.convert.answers import SHORT, from_accuracy, rings_of
from service.schemas.clipping import (
    ClipPolygonsResponse,
    LayersResponse,
    OverlayBatchResponse,
    OverlayCollapse,
    OverlayResponse,
    OverlayRounding,
    Sliver,
)
from service.wire import PART, Series
from service.work import Call

_FREE_AREA: Final = 100
"""Vertices of an overlay up to which its area takes no longer than the rest of the answer."""
_NUMBER_BYTES: Final = 10
"""Bytes of text that are made and written about as fast as a number."""


def from_features(layer: Any, accuracy: engine.Accuracy, call: Call) -> LayersResponse:
    """Return the answer of the layer operations, as GeoJSON."""
    call.media_type = "application/geo+json"
    call.instead = "send fewer features at once, or fewer or shorter properties"

    def features(start: int, stop: int) -> list[Any]:
        return [
            wire.Raw(b'{"type":"Feature",%b,"geometry":%b}' % (layer.members(row), geometry_of(layer, row, call)))
            for row in range(start, stop)
        ]

    n_bytes = layer.n_bytes
    return LayersResponse.made(
        type="FeatureCollection",
        crs=None if layer.crs_text is None else wire.Raw(layer.crs_text),
        features=Series(len(layer), features, weight=10, offsets=n_bytes // _NUMBER_BYTES, least=int(n_bytes[-1])),
        collapsed=layer.collapsed,
        slivers=None
        if layer.slivers is None
        else [Sliver.made(feature=row, piece=piece, width=width) for row, piece, width in layer.slivers],
        accuracy=from_accuracy(accuracy),
    )


def geometry_of(layer: Any, row: int, call: Call) -> bytes:
    """Return the geometry of a feature, of any number of parts and rings."""
    given = layer.geometry(row)
    if given is not None or layer.areas is None:
        return bytes(given or b"null")
    positions, (rings, pieces, ends) = layer.areas
    first, last = ends[row : row + 2].tolist()

    def somerings_of(start: int, stop: int) -> list[Any]:
        return rings_of(positions, rings[start : stop + 1])

    def polygon(piece: int) -> Any:
        start, stop = pieces[piece : piece + 2].tolist()
        if stop - start <= SHORT:
            return somerings_of(start, stop)
        return Series(stop - start, lambda i, j: somerings_of(start + i, start + j), 10, rings[start : stop + 1])

    if first == last:
        return b"null"
    if last == first + 1:
        return b'{"type":"Polygon","coordinates":%b}' % wire.encode(polygon(first), call.remaining)
    offsets = rings[pieces[first : last + 1]]
    parts = Series(last - first, lambda i, j: [polygon(piece) for piece in range(first + i, first + j)], 10, offsets)
    return b'{"type":"MultiPolygon","coordinates":%b}' % wire.encode(parts, call.remaining)


def from_overlay(result: engine.Overlay, accuracy: engine.Accuracy, area: bool | None) -> OverlayResponse:
    """Return the answer of `overlay`; area: whether it is requested, None for only if it costs next to nothing."""
    wants_area = len(result.vertices) <= _FREE_AREA if area is None else area
    rings = result.ring_offsets

    def pieces(start: int, stop: int) -> list[Any]:
        return _overlay_pieces(result, start, stop)

    return OverlayResponse.made(
        pieces=Series(result.n_pieces, pieces, weight=10, offsets=rings[result.piece_offsets]),
        area=_area(lambda: result.area) if wants_area else None,
        collapsed=[
            OverlayCollapse.made(kind=part.kind, area=_area(part.area.__float__), near=part.near)
            for part in result.collapsed
        ],
        rounding=OverlayRounding.made(
            rounds=result.rounds,
            snapped=result.snapped,
            vertices_moved=result.vertices_moved,
            largest_displacement=result.largest_displacement,
            pieces_exact=result.n_pieces_exact,
            holes_exact=result.n_holes_exact,
            pieces_joined=result.pieces_joined,
            pieces_parted=result.pieces_parted,
            holes_joined=result.holes_joined,
            holes_parted=result.holes_parted,
        ),
        accuracy=from_accuracy(accuracy),
    )


def from_overlays(batch: engine.OverlayBatch, accuracy: engine.Accuracy) -> OverlayBatchResponse:
    """Return the answer of `overlay/batch`."""
    offsets = batch.pair_offsets

    def some(first: int, last: int) -> list[Any]:
        ends = offsets[first : last + 1].tolist()
        pieces = _overlay_pieces(batch, ends[0], ends[-1])
        return [
            {
                "status": "not_representable" if status else "done",
                "pieces": pieces[start - ends[0] : stop - ends[0]],
                "largest_displacement": displacement,
            }
            for status, displacement, (start, stop) in zip(
                batch.status[first:last].tolist(), batch.displacement[first:last].tolist(), pairwise(ends)
            )
        ]

    weights = batch.ring_offsets[batch.piece_offsets[offsets]] + np.arange(len(offsets))
    return OverlayBatchResponse.made(
        overlays=Series(len(batch), some, weight=10, offsets=weights), accuracy=from_accuracy(accuracy)
    )


def _overlay_pieces(result: engine.Overlay | engine.OverlayBatch, start: int, stop: int) -> list[Any]:
    """Return some pieces of one overlay or of many, for the answer; many holes of one piece are made in parts."""
    ends = result.piece_offsets[start : stop + 1].tolist()
    if ends[-1] - ends[0] <= PART:
        rings = rings_of(result.vertices, result.ring_offsets[ends[0] : ends[-1] + 1], is_closed=True)
        return [{"shell": rings[i], "holes": rings[i + 1 : j]} for i, j in pairwise(end - ends[0] for end in ends)]

    def some(first: int, last: int) -> list[Any]:
        return rings_of(result.vertices, result.ring_offsets[first : last + 1], is_closed=True)

    def piece(first: int, last: int) -> dict[str, Any]:
        holes = Series(last - first - 1, lambda i, j: some(first + 1 + i, first + 1 + j), 10)
        holes = holes._replace(offsets=result.ring_offsets[first + 1 : last + 1])
        return {"shell": some(first, first + 1)[0], "holes": holes}

    return [piece(first, last) for first, last in pairwise(ends)]


def _area(nearest: Callable[[], float]) -> float | None:
    """Return an area, None where it is beyond float64."""
    try:
        return nearest()
    except (engine.NotRepresentableError, OverflowError):
        return None


def from_clipped(clipped: engine.ClippedPolygons, accuracy: engine.Accuracy) -> ClipPolygonsResponse:
    """Return the answer of `clip/polygons`."""
    offsets = clipped.polygon_offsets

    def some(first: int, last: int) -> list[Any]:
        ends = offsets[first : last + 1].tolist()
        rings = rings_of(clipped.vertices, clipped.ring_offsets[ends[0] : ends[-1] + 1])
        return [
            {
                "rings": rings[start - ends[0] : stop - ends[0]],
                "contours": clipped.contours[start:stop].tolist(),
                "status": engine.PolygonStatus(status).name.lower(),
                "may_have_bridges": may_have_bridges,
            }
            for status, may_have_bridges, (start, stop) in zip(
                clipped.status[first:last].tolist(), clipped.may_have_bridges[first:last].tolist(), pairwise(ends)
            )
        ]

    return ClipPolygonsResponse.made(
        polygons=Series(len(clipped), some, weight=10, offsets=clipped.ring_offsets[offsets]),
        accuracy=from_accuracy(accuracy),
    )
