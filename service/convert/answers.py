"""Answers: the engine's results to answer models, arrays as they are, long lists as `Series`; `wire` writes them."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any, Final

import numpy as np

import engine
from engine import Solid
from service import wire
from service.schemas import (
    bounds,
    clearance,
    collision,
    compare,
    containment,
    layers,
    overlay,
    polygons,
    segments,
    solids,
)
from service.schemas.problem import Accuracy
from service.wire import PART, Series, series_of
from service.work import Call

_FREE_AREA: Final = 100
"""Vertices of an overlay up to which its area takes no longer than the rest of the answer."""
_SHORT: Final = 12
"""Vertices of a ring up to which lists are written faster than an array, and rings that are made at once."""
_NUMBER_BYTES: Final = 10
"""Bytes of text that are made and written about as fast as a number."""
_BOUNDARY: Final = int(engine.Location.BOUNDARY)  # numpy compares with an enum's member more slowly


def from_features(found: Any, accuracy: engine.Accuracy, call: Call) -> layers.LayersResponse:
    """Return an answer about layers, as GeoJSON."""
    call.media_type = "application/geo+json"
    call.instead = "send fewer features at once, or fewer or shorter properties"

    def features(start: int, stop: int) -> list[Any]:
        return [
            wire.Raw(b'{"type":"Feature",%b,"geometry":%b}' % (found.members(row), _geometry(found, row, call)))
            for row in range(start, stop)
        ]

    n_bytes = found.n_bytes
    return layers.LayersResponse.made(
        type="FeatureCollection",
        crs=None if found.crs_text is None else wire.Raw(found.crs_text),
        features=Series(len(found), features, weight=10, offsets=n_bytes // _NUMBER_BYTES, least=int(n_bytes[-1])),
        collapsed=found.collapsed,
        accuracy=from_accuracy(accuracy),
    )


def _geometry(found: Any, row: int, call: Call) -> bytes:
    """Return the geometry of a feature, however many parts and rings it has."""
    if found.areas is None:
        return bytes(found.geometry(row))
    positions, (rings, pieces, ends) = found.areas
    first, last = ends[row : row + 2].tolist()

    def some_rings(start: int, stop: int) -> list[Any]:
        return _rings(positions, rings[start : stop + 1])

    def polygon(piece: int) -> Any:
        start, stop = pieces[piece : piece + 2].tolist()
        if stop - start <= _SHORT:
            return some_rings(start, stop)
        return Series(stop - start, lambda i, j: some_rings(start + i, start + j), 10, rings[start : stop + 1])

    if first == last:
        return b"null"
    if last == first + 1:
        return b'{"type":"Polygon","coordinates":%b}' % wire.encode(polygon(first), call.remaining)
    offsets = rings[pieces[first : last + 1]]
    parts = Series(last - first, lambda i, j: [polygon(piece) for piece in range(first + i, first + j)], 10, offsets)
    return b'{"type":"MultiPolygon","coordinates":%b}' % wire.encode(parts, call.remaining)


def from_accuracy(accuracy: engine.Accuracy) -> Accuracy:
    """Return the accuracy object of an answer."""
    return Accuracy.made(
        decisions=accuracy.decisions,
        coordinates_ulp=accuracy.coordinates_ulp,
        items=accuracy.n_items,
        beyond_filter=accuracy.n_beyond_filter,
        rational=accuracy.n_rational,
        method=accuracy.method,
    )


def from_stored(name: str, solid: Solid, collapsed: int | None = None) -> solids.StoredSolidSummary:
    """Return what the store says of a solid; collapsed: triangles that were left out of its file."""
    counts = {field: len(getattr(solid, field)) for field in ("planes", "powers", "operands") if hasattr(solid, field)}
    if isinstance(solid, engine.Polygon):
        counts["rings"] = len(solid.ring_offsets) - 1
    if hasattr(solid, "face_offsets"):
        counts["faces"] = len(solid.face_offsets) - 1
    return solids.StoredSolidSummary.made(
        id=name,
        type=solid.type,
        dimension=solid.dimension,
        vertices=len(solid.vertices) if hasattr(solid, "vertices") else None,
        faces=next(iter(counts.values()), None),
        memory=solid.memory,
        collapsed=collapsed,
    )


def from_locations(locations: Any, accuracy: engine.Accuracy) -> containment.ContainsResponse:
    """Return the answer of `contains`."""
    return containment.ContainsResponse.made(
        contained=locations >= _BOUNDARY,
        boundary=np.flatnonzero(locations == _BOUNDARY),
        accuracy=from_accuracy(accuracy),
    )


def from_scene_locations(found: engine.SceneLocations, accuracy: engine.Accuracy) -> containment.ContainsSceneResponse:
    """Return the answer of `contains/scene`: ragged arrays as lists of lists."""
    offsets, n_points = found.offsets, len(found.offsets) - 1

    def bodies(start: int, stop: int) -> list[Any]:
        return _split(found.indices[offsets[start] : offsets[stop]], offsets[start : stop + 1])

    def boundary(start: int, stop: int) -> list[Any]:
        held = slice(offsets[start], offsets[stop])
        before = np.concatenate([[0], np.cumsum(found.on_boundary[held])])
        kept = found.indices[held][found.on_boundary[held]]
        return _split(kept, before[offsets[start : stop + 1] - offsets[start]])

    return containment.ContainsSceneResponse.made(
        bodies=Series(n_points, bodies, offsets=offsets),
        boundary=Series(n_points, boundary, offsets=offsets),
        accuracy=from_accuracy(accuracy),
    )


def _split(items: Any, offsets: Any) -> list[list[int]]:
    flat, ends = items.tolist(), (offsets - offsets[0]).tolist()
    return [flat[start:stop] for start, stop in pairwise(ends)]


def from_bounds(found: engine.Bounds, accuracy: engine.Accuracy) -> bounds.BoundsResponse:
    """Return the answer of `bounds`."""
    return bounds.BoundsResponse.made(
        aabb=bounds.AabbBounds.made(min=found.aabb.min, max=found.aabb.max),
        sphere=bounds.SphereBounds.made(center=found.sphere.center, radius=found.sphere.radius),
        accuracy=from_accuracy(accuracy),
    )


def from_comparison(found: engine.Comparison, accuracy: engine.Accuracy) -> compare.CompareResponse:
    """Return the answer of `compare`."""
    names = ("method", "differing", "inexact", "seconds_exact", "seconds_plain")
    same = {name: getattr(found, name) for name in names}
    return compare.CompareResponse.made(methods=list(found.methods), accuracy=from_accuracy(accuracy), **same)


def from_pieces(pieces: engine.SegmentPieces, accuracy: engine.Accuracy) -> segments.ClipSegmentsResponse:
    """Return the answer of `clip/segments`."""
    columns = (pieces.source, pieces.start, pieces.end, pieces.t, pieces.faces)

    def some(start: int, stop: int) -> list[Any]:
        return [
            {"segment": source, "start": start, "end": end, "t": t, "faces": faces}
            for source, start, end, t, faces in zip(*(column[start:stop].tolist() for column in columns))
        ]

    return segments.ClipSegmentsResponse.made(
        pieces=Series(len(pieces.source), some, weight=10), accuracy=from_accuracy(accuracy)
    )


def from_line_pieces(pieces: engine.LinePieces, accuracy: engine.Accuracy) -> segments.ClipLinesResponse:
    """Return the answer of `clip/lines`."""
    columns = (pieces.source, pieces.segments, pieces.t, pieces.faces)

    def some(start: int, stop: int) -> list[Any]:
        lines = _rings(pieces.vertices, pieces.offsets[start : stop + 1])
        return [
            {"line": line, "positions": positions, "segments": on, "t": t, "faces": faces}
            for positions, line, on, t, faces in zip(lines, *(column[start:stop].tolist() for column in columns))
        ]

    return segments.ClipLinesResponse.made(
        pieces=Series(len(pieces), some, weight=10, offsets=pieces.offsets), accuracy=from_accuracy(accuracy)
    )


def from_overlay(result: engine.Overlay, accuracy: engine.Accuracy, area: bool | None) -> overlay.OverlayResponse:
    """Return the answer of `overlay`; area: whether it was asked for, None for where it costs next to nothing."""
    wants_area = len(result.vertices) <= _FREE_AREA if area is None else area
    rings = result.ring_offsets

    def pieces(start: int, stop: int) -> list[Any]:
        return _overlay_pieces(result, start, stop)

    return overlay.OverlayResponse.made(
        pieces=Series(result.n_pieces, pieces, weight=10, offsets=rings[result.piece_offsets]),
        area=_area(lambda: result.area) if wants_area else None,
        collapsed=[
            overlay.OverlayCollapse.made(kind=part.kind, area=_area(part.area.__float__), near=part.near)
            for part in result.collapsed
        ],
        rounding=overlay.OverlayRounding.made(
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


def from_overlays(batch: engine.OverlayBatch, accuracy: engine.Accuracy) -> overlay.OverlayBatchResponse:
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
    return overlay.OverlayBatchResponse.made(
        overlays=Series(len(batch), some, weight=10, offsets=weights), accuracy=from_accuracy(accuracy)
    )


def _overlay_pieces(result: engine.Overlay | engine.OverlayBatch, start: int, stop: int) -> list[Any]:
    """Return some pieces of an overlay, or of many, as they are written; many holes of one are made in parts."""
    ends = result.piece_offsets[start : stop + 1].tolist()
    if ends[-1] - ends[0] <= PART:
        rings = _rings(result.vertices, result.ring_offsets[ends[0] : ends[-1] + 1], is_closed=True)
        return [{"shell": rings[i], "holes": rings[i + 1 : j]} for i, j in pairwise(end - ends[0] for end in ends)]

    def some(first: int, last: int) -> list[Any]:
        return _rings(result.vertices, result.ring_offsets[first : last + 1], is_closed=True)

    def piece(first: int, last: int) -> dict[str, Any]:
        holes = Series(last - first - 1, lambda i, j: some(first + 1 + i, first + 1 + j), 10)
        holes = holes._replace(offsets=result.ring_offsets[first + 1 : last + 1])
        return {"shell": some(first, first + 1)[0], "holes": holes}

    return [piece(first, last) for first, last in pairwise(ends)]


def _rings(vertices: Any, offsets: Any, is_closed: bool = False) -> list[Any]:
    """Return consecutive rings, or lines, as they are written; closed: as GeoJSON has them, the first position again.

    offsets: where they begin among ``vertices``, and where the last ends.
    """
    vertices, ends = vertices[offsets[0] : offsets[-1]], (offsets - offsets[0]).tolist()
    if len(vertices) < _SHORT * len(ends):  # order: an array for each would take longer than its few numbers
        positions = vertices.tolist()
        return [positions[i:j] + positions[i : i + is_closed] for i, j in pairwise(ends)]
    if is_closed:
        return [series_of(np.concatenate([vertices[i:j], vertices[i : i + 1]])) for i, j in pairwise(ends)]
    return [series_of(vertices[i:j]) for i, j in pairwise(ends)]


def _area(nearest: Callable[[], float]) -> float | None:
    """Return an area, None where it is beyond float64."""
    try:
        return nearest()
    except (engine.NotRepresentableError, OverflowError):
        return None


def from_clipped(clipped: engine.ClippedPolygons, accuracy: engine.Accuracy) -> polygons.ClipPolygonsResponse:
    """Return the answer of `clip/polygons`."""
    offsets = clipped.polygon_offsets

    def some(first: int, last: int) -> list[Any]:
        ends = offsets[first : last + 1].tolist()
        rings = _rings(clipped.vertices, clipped.ring_offsets[ends[0] : ends[-1] + 1])
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

    return polygons.ClipPolygonsResponse.made(
        polygons=Series(len(clipped), some, weight=10, offsets=clipped.ring_offsets[offsets]),
        accuracy=from_accuracy(accuracy),
    )


def from_collision(collision_: engine.Collision, accuracy: engine.Accuracy) -> collision.CollideResponse:
    """Return the answer of `collide` for one pose."""
    return collision.CollideResponse.made(
        collisions=[_collision_answer(collision_.relation, collision_.witness, collision_.detail)],
        accuracy=from_accuracy(accuracy),
    )


def from_pose_collisions(found: Any, accuracy: engine.Accuracy, witness: bool) -> collision.CollideResponse:
    """Return the answer of `collide` for many poses: relations, witnesses if asked for, details if asked for."""
    relations, *rest = found if isinstance(found, tuple) else (found,)
    witnesses = rest.pop(0) if witness else [None] * len(relations)
    details = rest[0] if rest else None

    def some(start: int, stop: int) -> list[Any]:
        return [
            _collision_answer(engine.Relation(relation), witness, detail)
            for relation, witness, detail in zip(
                relations[start:stop].tolist(), witnesses[start:stop], _details(details, start, stop)
            )
        ]

    return collision.CollideResponse.made(
        collisions=Series(len(relations), some, weight=10), accuracy=from_accuracy(accuracy)
    )


def _details(codes: Any, start: int, stop: int) -> list[engine.Rcc8 | None]:
    """Return the relations of RCC-8 of some pairs: None where none was asked for (codes None), or none is."""
    if codes is None:
        return [None] * (stop - start)
    return [None if code < 0 else engine.Rcc8(code) for code in codes[start:stop].tolist()]


def _collision_answer(
    relation: engine.Relation, witness: engine.Witness | None, detail: engine.Rcc8 | None
) -> dict[str, Any]:
    answer: dict[str, Any] = {"relation": relation.label}
    if witness is not None:
        answer["witness"] = _witness(witness)
    if detail is not None:
        answer["detail"] = detail.label
    return answer


def _witness(witness: engine.Witness) -> dict[str, Any]:
    answer: dict[str, Any] = {"kind": witness.kind}
    if witness.first_face >= 0:
        answer["first_face"] = witness.first_face
    if witness.second_face >= 0:
        answer["second_face"] = witness.second_face
    if witness.containing:
        answer["containing"] = witness.containing
    answer["piercing"] = witness.piercing
    return answer


def from_clearances(found: Any, accuracy: engine.Accuracy, are_bools: bool) -> clearance.ClearanceResponse:
    """Return the answer of `clearance`: of one pair, or distances or bools of many poses."""
    if are_bools:
        return clearance.ClearanceResponse.made(
            clearances=None, clear=np.asarray(found, np.bool_), accuracy=from_accuracy(accuracy)
        )

    def some(start: int, stop: int) -> list[Any]:
        return [
            _clearance(item if isinstance(item, engine.Clearance) else engine.Clearance(float(item)))
            for item in found[start:stop]
        ]

    return clearance.ClearanceResponse.made(
        clearances=Series(len(found), some, weight=4), clear=None, accuracy=from_accuracy(accuracy)
    )


def _clearance(found: engine.Clearance) -> clearance.ClearanceAnswer:
    features = found.features and [
        clearance.ClearanceFeature.made(kind=feature.kind, indices=list(feature.indices)) for feature in found.features
    ]
    return clearance.ClearanceAnswer.made(distance=found.distance, points=found.points, features=features)


def from_scene_pairs(pairs: engine.ScenePairs, accuracy: engine.Accuracy) -> collision.CollideSceneResponse:
    """Return the answer of `collide/scene`."""
    labels = [relation.label for relation in engine.Relation]
    columns = (pairs.first, pairs.second, pairs.relation)

    def some(start: int, stop: int) -> list[Any]:
        found = [
            {"first": first, "second": second, "relation": labels[code]}
            for first, second, code in zip(*(column[start:stop].tolist() for column in columns))
        ]
        for pair, detail in zip(found, _details(pairs.detail, start, stop)):
            if detail is not None:
                pair["detail"] = detail.label
        if pairs.distance is not None:
            for pair, distance in zip(found, pairs.distance[start:stop].tolist()):
                pair["distance"] = distance
        return found

    return collision.CollideSceneResponse.made(
        pairs=Series(len(pairs.first), some, weight=4), accuracy=from_accuracy(accuracy)
    )
