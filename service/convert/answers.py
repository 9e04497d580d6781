"""Answers: the engine's results to answer models, arrays as they are, long lists as `Series`; `wire` writes them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import Any, Final

import numpy as np

import engine
from engine import Scene, Solid
from service.convert import questions
from service.schemas.base import Accuracy
from service.schemas.bodies import (
    ClearanceAnswer,
    ClearanceFeature,
    ClearanceResponse,
    ClipSegmentsSceneResponse,
    CollideResponse,
    CollideSceneResponse,
    Keep,
    StoredSceneSummary,
)
from service.schemas.clipping import (
    ClipLinesResponse,
    ClipSegmentsResponse,
)
from service.schemas.hits import HitsResponse
from service.schemas.points import (
    AabbBounds,
    BoundsResponse,
    CompareResponse,
    ContainsResponse,
    ContainsSceneResponse,
    DistancesResponse,
    NearestFeature,
    SceneDistancesResponse,
    SphereBounds,
)
from service.schemas.solids import InspectResponse, MeshAdvice, StoredSolidSummary
from service.wire import Series, series_of
from service.work import Call

SHORT: Final = 12
"""Vertices of a ring up to which lists are written faster than an array, and rings per part."""
_BOUNDARY: Final = int(engine.Location.BOUNDARY)  # numpy compares with an enum's member more slowly


def from_accuracy(accuracy: engine.Accuracy) -> Accuracy:
    """Return the accuracy object of an answer."""
    return Accuracy.made(
        decisions=accuracy.decisions,
        coordinates_ulp=accuracy.coordinates_ulp,
        items=accuracy.n_items,
        beyond_filter=accuracy.n_beyond_filter,
        rational=accuracy.n_rational,
        method=accuracy.method,
        notes=getattr(accuracy, "notes", None),
    )


def from_stored(name: str, solid: Solid, collapsed: int | None = None) -> StoredSolidSummary:
    """Return the store's answer about a solid; collapsed: triangles that were left out of its file."""
    counts = {field: len(getattr(solid, field)) for field in ("planes", "powers", "operands") if hasattr(solid, field)}
    if isinstance(solid, engine.Polygon):
        counts["rings"] = len(solid.ring_offsets) - 1
    if hasattr(solid, "face_offsets"):
        counts["faces"] = len(solid.face_offsets) - 1
    return StoredSolidSummary.made(
        id=name,
        type=solid.type,
        dimension=solid.dimension,
        vertices=len(solid.vertices) if hasattr(solid, "vertices") else None,
        faces=next(iter(counts.values()), None),
        memory=solid.memory,
        collapsed=collapsed,
    )


def from_inspection(report: engine.Inspection, accuracy: engine.Accuracy, with_mesh: bool) -> InspectResponse:
    """Return the answer of `solids/inspect`; with_mesh: also the mesh, after mends."""
    names = ("open_edges", "turned_edges", "t_junctions", "duplicate_faces", "flat_faces", "self_crossings")
    return InspectResponse.made(
        closed=report.is_closed,
        shells=report.n_shells,
        **{name: getattr(report, name) for name in names},
        inverted_shells=[shell.tolist() for shell in report.inverted_shells],
        advice=[MeshAdvice.made(kind=kind, mend=words) for kind, words in report.advice.items()],
        mended=list(report.mended),
        vertices=report.vertices if with_mesh else None,
        faces=report.faces if with_mesh else None,
        accuracy=from_accuracy(accuracy),
    )


def from_locations(locations: Any, accuracy: engine.Accuracy) -> ContainsResponse:
    """Return the answer of `contains`."""
    return ContainsResponse.made(
        contained=locations >= _BOUNDARY,
        boundary=np.flatnonzero(locations == _BOUNDARY),
        accuracy=from_accuracy(accuracy),
    )


def from_scene_locations(located: engine.SceneLocations, accuracy: engine.Accuracy) -> ContainsSceneResponse:
    """Return the answer of `contains/scene`: ragged arrays as lists of lists."""
    offsets, n_points = located.offsets, len(located.offsets) - 1

    def bodies(start: int, stop: int) -> list[Any]:
        return _split(located.indices[offsets[start] : offsets[stop]], offsets[start : stop + 1])

    def boundary(start: int, stop: int) -> list[Any]:
        span = slice(offsets[start], offsets[stop])
        before = np.concatenate([[0], np.cumsum(located.on_boundary[span])])
        bodies_on_boundary = located.indices[span][located.on_boundary[span]]
        return _split(bodies_on_boundary, before[offsets[start : stop + 1] - offsets[start]])

    return ContainsSceneResponse.made(
        bodies=Series(n_points, bodies, offsets=offsets),
        boundary=Series(n_points, boundary, offsets=offsets),
        accuracy=from_accuracy(accuracy),
    )


def _split(items: Any, offsets: Any) -> list[list[int]]:
    flat, ends = items.tolist(), (offsets - offsets[0]).tolist()
    return [flat[start:stop] for start, stop in pairwise(ends)]


def from_bounds(volumes: engine.Bounds, accuracy: engine.Accuracy) -> BoundsResponse:
    """Return the answer of `bounds`."""
    return BoundsResponse.made(
        aabb=AabbBounds.made(min=volumes.aabb.min, max=volumes.aabb.max),
        sphere=SphereBounds.made(center=volumes.sphere.center, radius=volumes.sphere.radius),
        accuracy=from_accuracy(accuracy),
    )


def from_comparison(comparison: engine.Comparison, accuracy: engine.Accuracy) -> CompareResponse:
    """Return the answer of `compare`."""
    names = ("method", "differing", "inexact", "seconds_exact", "seconds_plain")
    same = {name: getattr(comparison, name) for name in names}
    return CompareResponse.made(methods=list(comparison.methods), accuracy=from_accuracy(accuracy), **same)


def from_pieces(pieces: engine.SegmentPieces, accuracy: engine.Accuracy) -> ClipSegmentsResponse:
    """Return the answer of `clip/segments`."""
    columns = (pieces.source, pieces.start, pieces.end, pieces.t, pieces.faces)
    some = _rows(("segment", "start", "end", "t", "faces"), columns)
    return ClipSegmentsResponse.made(
        pieces=Series(len(pieces.source), some, weight=10), accuracy=from_accuracy(accuracy)
    )


def _rows(names: tuple[str, ...], columns: Iterable[Any]) -> Callable[[int, int], list[Any]]:
    """Return a function that makes rows start .. stop of columns, each an object."""

    def some(start: int, stop: int) -> list[Any]:
        return [dict(zip(names, row)) for row in zip(*(column[start:stop].tolist() for column in columns))]

    return some


def from_line_pieces(pieces: engine.LinePieces, accuracy: engine.Accuracy) -> ClipLinesResponse:
    """Return the answer of `clip/lines`."""
    columns = (pieces.source, pieces.segments, pieces.t, pieces.faces)

    def some(start: int, stop: int) -> list[Any]:
        lines = rings_of(pieces.vertices, pieces.offsets[start : stop + 1])
        return [
            {"line": line, "positions": positions, "segments": on, "t": t, "faces": faces}
            for positions, line, on, t, faces in zip(lines, *(column[start:stop].tolist() for column in columns))
        ]

    return ClipLinesResponse.made(
        pieces=Series(len(pieces), some, weight=10, offsets=pieces.offsets), accuracy=from_accuracy(accuracy)
    )


def rings_of(vertices: Any, offsets: Any, is_closed: bool = False) -> list[Any]:
    """Return consecutive rings, or lines, for the answer; is_closed: repeat the first position, as in GeoJSON.

    offsets: of the rings in ``vertices``.
    """
    vertices, ends = vertices[offsets[0] : offsets[-1]], (offsets - offsets[0]).tolist()
    if len(vertices) < SHORT * len(ends):  # order: an array for each would take longer than its few numbers
        positions = vertices.tolist()
        return [positions[i:j] + positions[i : i + is_closed] for i, j in pairwise(ends)]
    if is_closed:
        return [series_of(np.concatenate([vertices[i:j], vertices[i : i + 1]])) for i, j in pairwise(ends)]
    return [series_of(vertices[i:j]) for i, j in pairwise(ends)]


def from_collision(collision: engine.Collision, accuracy: engine.Accuracy) -> CollideResponse:
    """Return the answer of `collide` for one pose."""
    return CollideResponse.made(
        collisions=[_collision_answer(collision.relation, collision.witness, collision.detail)],
        accuracy=from_accuracy(accuracy),
    )


def from_pose_collisions(results: Any, accuracy: engine.Accuracy, witness: bool) -> CollideResponse:
    """Return the answer of `collide` for many poses: relations, and witnesses and details if requested."""
    relations, *rest = results if isinstance(results, tuple) else (results,)
    witnesses = rest.pop(0) if witness else [None] * len(relations)
    details = rest[0] if rest else None

    def some(start: int, stop: int) -> list[Any]:
        return [
            _collision_answer(engine.Relation(relation), witness, detail)
            for relation, witness, detail in zip(
                relations[start:stop].tolist(), witnesses[start:stop], _details(details, start, stop)
            )
        ]

    return CollideResponse.made(collisions=Series(len(relations), some, weight=10), accuracy=from_accuracy(accuracy))


def _details(codes: Any, start: int, stop: int) -> list[engine.Rcc8 | None]:
    """Return the RCC-8 relations of some pairs: None if not requested (codes None), or undefined."""
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


def from_clearances(measured: Any, accuracy: engine.Accuracy, are_bools: bool) -> ClearanceResponse:
    """Return the answer of `clearance`: of one pair, or distances or bools of many poses."""
    if are_bools:
        return ClearanceResponse.made(
            clearances=None, clear=np.asarray(measured, np.bool_), accuracy=from_accuracy(accuracy)
        )

    def some(start: int, stop: int) -> list[Any]:
        return [
            _clearance(item if isinstance(item, engine.Clearance) else engine.Clearance(float(item)))
            for item in measured[start:stop]
        ]

    return ClearanceResponse.made(
        clearances=Series(len(measured), some, weight=4), clear=None, accuracy=from_accuracy(accuracy)
    )


def _clearance(clearance: engine.Clearance) -> ClearanceAnswer:
    features = clearance.features and [
        ClearanceFeature.made(kind=feature.kind, indices=list(feature.indices)) for feature in clearance.features
    ]
    return ClearanceAnswer.made(distance=clearance.distance, points=clearance.points, features=features)


def from_distances(measured: Any, accuracy: engine.Accuracy) -> DistancesResponse:
    """Return the answer of `distances`: numbers, bools, or `engine.Distances`."""
    if not isinstance(measured, engine.Distances):
        name = "within" if measured.dtype == np.bool_ else "distances"
        return DistancesResponse.made(**{name: measured}, accuracy=from_accuracy(accuracy))

    def features(start: int, stop: int) -> list[Any]:
        some = [measured.feature(item) for item in range(start, stop)]
        return [
            NearestFeature.made(kind=each.kind if each else "inside", indices=list(each.indices) if each else [])
            for each in some
        ]

    return DistancesResponse.made(
        distances=measured.distance,
        nearest=measured.point,
        faces=measured.face,
        features=Series(len(measured), features, weight=2),
        accuracy=from_accuracy(accuracy),
    )


def from_scene_distances(measured: Any, accuracy: engine.Accuracy) -> SceneDistancesResponse:
    """Return the answer of `scenes/{id}/distances`: bools, or `engine.SceneDistances`."""
    columns = {"within": measured}
    if isinstance(measured, engine.SceneDistances):
        columns = {"distances": measured.distance, "bodies": measured.body, "nearest": measured.point}
    return SceneDistancesResponse.made(**columns, accuracy=from_accuracy(accuracy))


def from_scene_pairs(pairs: engine.ScenePairs, accuracy: engine.Accuracy) -> CollideSceneResponse:
    """Return the answer of `collide/scene`."""
    labels = [relation.label for relation in engine.Relation]
    columns = (pairs.first, pairs.second, pairs.relation)

    def some(start: int, stop: int) -> list[Any]:
        rows = [
            {"first": first, "second": second, "relation": labels[code]}
            for first, second, code in zip(*(column[start:stop].tolist() for column in columns))
        ]
        for pair, detail in zip(rows, _details(pairs.detail, start, stop)):
            if detail is not None:
                pair["detail"] = detail.label
        if pairs.distance is not None:
            for pair, distance in zip(rows, pairs.distance[start:stop].tolist()):
                pair["distance"] = distance
        return rows

    return CollideSceneResponse.made(pairs=Series(len(pairs.first), some, weight=4), accuracy=from_accuracy(accuracy))


def from_stored_scene(name: str, scene: Scene) -> StoredSceneSummary:
    """Return the store's answer about a scene."""
    return StoredSceneSummary.made(id=name, dimension=scene.solids[0].dimension, bodies=len(scene), memory=scene.memory)


def clipped_in_scene(scene: Scene, segments: Any, keep: Keep | None, call: Call) -> ClipSegmentsSceneResponse:
    """Return the answer of `clip/segments/scene`."""
    segments = questions.to_items(segments, scene.solids[0].dimension if len(scene) else 3, call)
    clipped, accuracy = call.compute(
        scene.clip_segments, segments, keep=keep or "all", rewrite_error=questions.rewrite_error_paths_for_scene
    )
    if isinstance(clipped, np.ndarray):
        return ClipSegmentsSceneResponse.made(pieces=None, met=clipped, accuracy=from_accuracy(accuracy))
    names = ("source", "body", "start", "end", "t", "faces", "ranks")
    some = _rows(("segment", *names[1:]), [getattr(clipped, name) for name in names])
    return ClipSegmentsSceneResponse.made(
        pieces=Series(len(clipped), some, weight=12), met=None, accuracy=from_accuracy(accuracy)
    )


def from_hits(result: Any, accuracy: engine.Accuracy) -> HitsResponse:
    """Return the answer of `hits`, on a surface or in a scene."""
    if isinstance(result, np.ndarray):
        return HitsResponse.made(hits=None, met=result, accuracy=from_accuracy(accuracy))
    names = [name for name in ("source", "body", "t", "t_end", "face", "triangle") if hasattr(result, name)]
    kinds = np.array([kind.name.lower() for kind in engine.HitKind])[result.kind]
    columns = [*(getattr(result, name) for name in names), kinds, result.barycentric, result.normal]
    some = _rows(("segment", *names[1:], "kind", "barycentric", "normal"), columns)
    return HitsResponse.made(hits=Series(len(result), some, weight=13), met=None, accuracy=from_accuracy(accuracy))
