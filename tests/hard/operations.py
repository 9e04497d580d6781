"""Each operation of a hard case: the exact answer by the reference, the engine's answer in the same form, and the part
of the answer that no exact transformation changes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import engine
from tests import build
from tests.reference import (
    bounds,
    collision,
    containment,
    cutting,
    distance,
    hits,
    overlay,
    segments,
    sutherland_hodgman,
)
from tests.reference.exact import Q, nearest_double, nearest_double_with_root, sub, vector
from tests.reference.solids import dimension, edges, triangles_with_faces

Dict = dict[str, Any]


@dataclass(frozen=True)
class Operation:
    """One operation.

    exact: input -> answer by the reference. by_engine: input -> answer by the engine. kept: the part of an answer that
    exact transformations keep. function: the engine's public name.
    """

    function: str
    exact: Callable[[Dict], Any]
    by_engine: Callable[[Dict], Any]
    kept: Callable[[Any], Any]


def everything(answer: Any) -> Any:
    return answer


def nothing(answer: Any) -> Any:
    return None


def _locate_exact(data: Dict) -> list[int]:
    return containment.locate_many(data["points"], data["solid"])


def _locate(data: Dict) -> list[int]:
    solid, points = build.solid(data["solid"]), np.array(data["points"], float)
    found = engine.locate(points, solid)
    assert engine.contains(points, solid).tolist() == (found >= 0).tolist()
    return found.tolist()


def _scene_exact(data: Dict) -> list[list[list[Any]]]:
    found = []
    for point in data["points"]:
        where = [containment.locate(point, body["solid"], body.get("pose")) for body in data["bodies"]]
        found.append([[i, location == 0] for i, location in enumerate(where) if location >= 0])
    return found


def _scene(data: Dict) -> list[list[list[Any]]]:
    poses = [build.pose(body.get("pose")) for body in data["bodies"]]
    found = engine.locate_scene(data["points"], [build.solid(body["solid"]) for body in data["bodies"]], poses)
    pairs = list(zip(found.indices.tolist(), found.on_boundary.tolist(), strict=True))
    ends = found.offsets.tolist()
    return [[list(pair) for pair in pairs[i:j]] for i, j in itertools.pairwise(ends)]


def _collide_exact(data: Dict) -> str:
    poses = data.get("first_pose"), data.get("second_pose")
    return engine.Relation(collision.relation(data["first"], data["second"], *poses)).label


def _collide(data: Dict) -> str:
    first, second = build.solid(data["first"]), build.solid(data["second"])
    poses = [build.pose(data.get(key)) for key in ("first_pose", "second_pose")]
    found = engine.collide(first, second, first_pose=poses[0], second_pose=poses[1])
    back = engine.collide(second, first, first_pose=poses[1], second_pose=poses[0])
    assert int(back.relation) == collision.SWAPPED[int(found.relation)], "collide is symmetric"
    assert (found.witness is None) == (found.relation == engine.Relation.DISJOINT)
    return found.relation.label


def _pairs_exact(data: Dict) -> list[list[Any]]:
    bodies, found = data["bodies"], []
    for i, a in enumerate(bodies):
        for j in range(i + 1, len(bodies)):
            b = bodies[j]
            relation = collision.relation(a["solid"], b["solid"], a.get("pose"), b.get("pose"))
            if relation:
                found.append([i, j, engine.Relation(relation).label])
    return found


def _pairs(data: Dict) -> list[list[Any]]:
    poses = [build.pose(body.get("pose")) for body in data["bodies"]]
    found = engine.collide_scene([build.solid(body["solid"]) for body in data["bodies"]], poses)
    columns = found.first.tolist(), found.second.tolist(), found.relation.tolist()
    return [[i, j, engine.Relation(relation).label] for i, j, relation in zip(*columns, strict=True)]


def _segments_exact(data: Dict) -> list[Dict]:
    found = []
    for source, piece in segments.clip_segments(data["segments"], data["region"]):
        start, end, t = piece.rounded()
        found.append({"segment": source, "start": start, "end": end, "t": t, "faces": list(piece.faces)})
    return found


def _segments(data: Dict) -> list[Dict]:
    region = build.solid(data["region"])
    found = engine.clip_segments(data["segments"], region)
    names = ("segment", "start", "end", "t", "faces")
    columns = (found.source, found.start, found.end, found.t, found.faces)
    rows = zip(*(column.tolist() for column in columns), strict=True)
    return [dict(zip(names, row, strict=True)) for row in rows]


def _polygons_exact(data: Dict) -> list[list[Any]]:
    planes = sutherland_hodgman.planes_of(data["region"])
    found = []
    for rings in data["polygons"]:
        left = [sutherland_hodgman.rounded(sutherland_hodgman.clip_contour(ring, planes)) for ring in rings]
        found.append([first_least(ring) for ring in left if ring])
    return found


def _polygons(data: Dict) -> list[list[Any]]:
    found = engine.clip_polygons(data["polygons"], build.solid(data["region"]))
    assert not found.status.any()
    return [[first_least(ring.tolist()) for ring in found.rings(i)] for i in range(len(found))]


def first_least(ring: list[Any]) -> list[Any]:
    """Return the ring turned so that it is the least of its turns: the start of a ring does not matter."""
    return min(ring[i:] + ring[:i] for i in range(len(ring)))


def hexadecimal(number: Any) -> str:
    """Return a rational as text, quick and without limit."""
    return f"{int(number.numerator):x}/{int(number.denominator):x}"


def _overlay_exact(data: Dict) -> Dict:
    found = overlay.overlay(data["subject"], data["clip"], data["operation"])
    return {
        "area": hexadecimal(found.area),
        "pieces": len(found.pieces),
        "holes": sum(holes for _, holes in found.pieces),
    }


def _overlay(data: Dict) -> Dict:
    found = engine.overlay(build.solid(data["subject"]), build.solid(data["clip"]), data["operation"])
    return {"area": hexadecimal(found.area_exact), "pieces": found.n_pieces_exact, "holes": found.n_holes_exact}


def _bounds_exact(data: Dict) -> Dict:
    low, high = bounds.bounding_box(data["solid"])
    center, radius = bounds.minimal_sphere(bounds.points_of(data["solid"]))
    return {"min": low, "max": high, "center": center, "radius": radius}


def _bounds(data: Dict) -> Dict:
    found = engine.bounds(build.solid(data["solid"]))
    box, ball = found.aabb, found.sphere
    return {
        "min": box.min.tolist(),
        "max": box.max.tolist(),
        "center": ball.center.tolist(),
        "radius": ball.radius,
    }


def _hits_exact(data: Dict) -> list[Dict]:
    triangles, faces = zip(*triangles_with_faces(data["surface"]), strict=True)
    found = []
    for i, (start, other) in enumerate(data["segments"]):
        is_ray = data.get("rays", False)
        way = vector(other) if is_ray else sub(vector(other), vector(start))
        some = hits.hits(vector(start), way, is_ray, triangles, faces)
        found += [{"segment": i, "t": nearest_double(hit.t), "kind": hit.kind} for hit in some]
    return found


def _hits(data: Dict) -> list[Dict]:
    found = engine.hits(data["segments"], build.solid(data["surface"]), rays=data.get("rays", False))
    columns = found.source.tolist(), found.t.tolist(), found.kind.tolist()
    return [{"segment": i, "t": t, "kind": kind} for i, t, kind in zip(*columns, strict=True)]


def _distances_exact(data: Dict) -> list[float]:
    """From the boundary; with "signed" negative inside."""
    solid, found = data["solid"], []
    parts = edges(solid) if dimension(solid) == 2 else [part for part, _ in triangles_with_faces(solid)]
    for point in data["points"]:
        squares = (distance.squared_distance(tuple(dict.fromkeys(part)), (vector(point),)) for part in parts)
        size = nearest_double_with_root(Q(0), Q(1), min(squares))
        is_inside = data.get("signed", False) and containment.locate(point, solid) > 0
        found.append(-size if is_inside else size)
    return found


def _distances(data: Dict) -> list[float]:
    options = {"signed": True} if data.get("signed") else {"to": "boundary"}
    return engine.distances(data["points"], build.solid(data["solid"]), **options).tolist()


def _mesh(solid: Dict) -> tuple[Any, np.ndarray]:
    return cutting.points_of(np.array(solid["vertices"], float)), np.array(solid["faces"])


def _volume_exact(data: Dict) -> float:
    return cutting.nearest(abs(cutting.signed_volume(*_mesh(data["solid"]))))


def _volume(data: Dict) -> float:
    return float(engine.volume(build.solid(data["solid"])))


def _cut_exact(data: Dict) -> float:
    row = [*data["region"]["normal"], data["region"]["offset"]]
    return cutting.nearest(abs(cutting.cut_volume(*_mesh(data["solid"]), row)[0]))


def _cut(data: Dict) -> float:
    return float(engine.cut(build.solid(data["solid"]), build.solid(data["region"])).volume)


def _section_exact(data: Dict) -> list[float]:
    squares = (cutting.cut_volume(*_mesh(data["solid"]), row)[1] for row in data["planes"])
    return [nearest_double_with_root(Q(0), Q(1), Q(square)) for square in squares]


def _section(data: Dict) -> list[float]:
    planes = [engine.HalfSpace(row[:3], row[3]) for row in data["planes"]]
    found = engine.section(build.solid(data["solid"]), planes)
    return [math.fsum(found.areas[slice(*ends)]) for ends in itertools.pairwise(found.plane_offsets)]


def _overlap_exact(data: Dict) -> float:
    return cutting.nearest(cutting.convex_overlap_of_space(_mesh(data["first"]), _mesh(data["second"])))


def _overlap(data: Dict) -> float:
    return float(engine.overlap_volume(build.solid(data["first"]), build.solid(data["second"])))


OPERATIONS = {
    "bounds": Operation("bounds", _bounds_exact, _bounds, nothing),
    "clip_polygons": Operation(
        "clip_polygons", _polygons_exact, _polygons, lambda a: [[len(ring) for ring in rings] for rings in a]
    ),
    "clip_segments": Operation(
        "clip_segments", _segments_exact, _segments, lambda a: [(p["segment"], p["t"]) for p in a]
    ),
    "collide": Operation("collide", _collide_exact, _collide, everything),
    "collide_scene": Operation("collide_scene", _pairs_exact, _pairs, everything),
    "cut": Operation("cut", _cut_exact, _cut, nothing),
    "distances": Operation("distances", _distances_exact, _distances, nothing),
    "hits": Operation("hits", _hits_exact, _hits, everything),
    "locate": Operation("locate", _locate_exact, _locate, everything),
    "locate_scene": Operation("locate_scene", _scene_exact, _scene, everything),
    "overlay": Operation("overlay", _overlay_exact, _overlay, lambda a: (a["pieces"], a["holes"])),
    "overlap": Operation("overlap_volume", _overlap_exact, _overlap, nothing),
    "section": Operation("section", _section_exact, _section, nothing),
    "volume": Operation("volume", _volume_exact, _volume, nothing),
}
