"""Answers about solids that are measured, cut, and overlap."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import engine
from service.convert import octets, questions
from service.convert.answers import from_accuracy
from service.errors import ServiceError
from service.schemas.cutting import (
    CutPart,
    CutRequest,
    CutResponse,
    OverlapAnswer,
    OverlapRequest,
    OverlapResponse,
    PlaneSection,
    SectionPiece,
    SectionRequest,
    SectionResponse,
    VolumeResponse,
)
from service.wire import Series
from service.work import Call


def measured(solid: engine.Solid, call: Call) -> VolumeResponse:
    """Return what can be measured of a solid."""
    area, accuracy = call.compute(engine.area, solid)
    made: dict[str, Any] = {"volume": None, "centroid": None}
    has = engine.solid_types[solid.type].volumes
    if solid.dimension == 3 and has.volume is not None:
        made["volume"], accuracy = call.compute(engine.volume, solid)
    if (made["volume"] if solid.dimension == 3 else area) and has.centroid is not None:
        made["centroid"], _ = call.compute(engine.centroid, solid)
    return VolumeResponse.made(area=area, accuracy=from_accuracy(accuracy), **made)


def sections(question: SectionRequest, call: Call) -> SectionResponse:
    """Return the sections of a solid."""
    solid = questions.to_solid(question.solid, call, ("solid",))
    given = [name for name in ("planes", "heights", "through") if getattr(question, name) is not None]
    if len(given) != 1:
        detail = f"give one of planes, heights and through; got {' and '.join(given) or 'none'}"
        raise ServiceError("invalid_request", detail, (given[1] if len(given) > 1 else "planes",))
    planes: Any = question.heights if question.through is None else question.through
    if question.planes is not None:
        planes = [engine.HalfSpace(row[:3], row[3]) for row in question.planes]

    def rename(error: engine.EngineError) -> None:
        if error.where[:1] == ("planes",):
            error.where = (given[0], *error.where[1:])

    options = {"normal": question.normal, "measures": True}
    result, accuracy = call.compute(engine.section, solid, planes, **options, rewrite_error=rename)
    places, areas = (result.flat if question.flat else result.vertices), result.areas

    def rings(piece: int) -> list[Any]:
        first, last = result.piece_offsets[piece : piece + 2].tolist()
        return [places[slice(*result.ring_offsets[ring : ring + 2].tolist())] for ring in range(first, last)]

    def piece_of(piece: int) -> SectionPiece:
        shell, *holes = rings(piece)
        return SectionPiece.made(shell=shell, holes=holes, area=float(areas[piece]))

    def some(start: int, stop: int) -> list[Any]:
        offsets = result.plane_offsets
        return [
            PlaneSection.made(pieces=[piece_of(piece) for piece in range(*offsets[plane : plane + 2].tolist())])
            for plane in range(start, stop)
        ]

    ends = result.ring_offsets[result.piece_offsets[result.plane_offsets]]
    return SectionResponse.made(sections=Series(len(result), some, 3, 3 * ends), accuracy=from_accuracy(accuracy))


def cut(question: CutRequest, call: Call) -> CutResponse | Iterator[bytes]:
    """Return what a region leaves of a solid; the bytes of a file where one is asked for."""
    solid = questions.to_solid(question.solid, call, ("solid",))
    region = questions.to_solid(question.region, call, ("region",))
    keep = question.keep or "inside"
    if call.file is not None and keep == "both":
        raise ServiceError("invalid_request", "a file takes one part; ask for inside, then outside", ("keep",))
    result, accuracy = call.compute(engine.cut, solid, region, keep=keep, measures=call.file is None)
    if call.file is not None:
        more = {"collapsed": result.n_collapsed, "folded": result.n_folded}
        return octets.answer(call, octets.mesh_file(result.vertices, result.faces, call), accuracy, more)
    names = ("vertices", "faces", "origins", "collapsed", "folded", "volume", "area")
    parts = [
        CutPart.made(**{name: getattr(part, name) for name in names})
        for part in (result if keep == "both" else [result])
    ]
    return CutResponse.made(parts=parts, accuracy=from_accuracy(accuracy))


def overlaps(question: OverlapRequest, call: Call) -> OverlapResponse:
    """Return what two solids have in common, by pose."""
    first = questions.to_solid(question.first, call, ("first",))
    second = questions.to_solid(question.second, call, ("second",))
    models = question.poses
    poses = [None] if models is None else [questions.to_pose(pose, ("poses", k)) for k, pose in enumerate(models)]
    volumes, accuracy = call.compute(engine.overlap_volume, first, second, second_pose=poses)
    ratios, _ = call.compute(engine.iou, first, second, second_pose=poses)
    made = [OverlapAnswer.made(overlap=each, iou=ratio) for each, ratio in zip(volumes.tolist(), ratios.tolist())]
    return OverlapResponse.made(overlaps=made, accuracy=from_accuracy(accuracy))
