"""Counts wrong answers by exact ones of tests/reference: rationals that share nothing with the engine.

Hard sets have their exact answers. On workloads made for speed, the items on which contenders differ, and a random
sample of the others, are decided here. Float64 boxes, padded far beyond rounding, only exclude faces that cannot meet.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from benchmarks.workloads import Mesh, Rings, document

try:
    from tests.reference import containment as reference
    from tests.reference import hits as hits_reference
    from tests.reference.collision import relation
    from tests.reference.contact import segment_meets_triangle, triangles_meet
    from tests.reference.cutting import cut_volume, nearest, points_of, signed_volume
    from tests.reference.distance import distance, squared_distance
    from tests.reference.exact import Q, nearest_double, nearest_double_with_root, sub, vector
    from tests.reference.many_points import locate_points
    from tests.reference.overlay import overlay, signed_area
    from tests.reference.segments import clip_segment
    from tests.reference.solids import image
    from tests.reference.sutherland_hodgman import clip_contour, planes_of

    REASON = ""
except ImportError as error:  # the reference needs gmpy2
    REASON = f"exact answers need {error.name}, of the extra test"

_PADDING = 1e-9


def locations(points: np.ndarray, subject: Any) -> np.ndarray:
    """Return whether each point is in the closed subject."""
    if isinstance(subject, Mesh):
        return locate_points(points, subject.vertices, subject.faces) >= 0
    if isinstance(subject, Rings):
        return np.array([_in_rings(point, subject.rings) >= 0 for point in points], bool)
    return np.array(reference.locate_many(points.tolist(), document(subject))) >= 0


def _in_rings(point: np.ndarray, rings: list[np.ndarray]) -> int:
    """Return the even-odd location by the edges that the vertical line through the point meets, and no others."""
    starts, ends = np.concatenate(rings), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
    x, y = point
    touching = (np.minimum(starts, ends) <= point).all(axis=1) & (np.maximum(starts, ends) >= point).all(axis=1)
    p = vector(point.tolist())
    pairs = zip(starts[touching].tolist(), ends[touching].tolist(), strict=True)
    if any(reference.on_segment(p, vector(a), vector(b)) for a, b in pairs):
        return 0
    passed = (starts[:, 0] <= x) != (ends[:, 0] <= x)  # a half-line upwards, moved right by an infinitesimal
    parity = False
    for (ax, ay), (bx, by) in zip(starts[passed].tolist(), ends[passed].tolist(), strict=True):
        height = (Q(y) - Q(ay)) * (Q(bx) - Q(ax)) - (Q(by) - Q(ay)) * (Q(x) - Q(ax))
        parity ^= (height < 0) == (bx > ax)
    return 1 if parity else -1


class _Body:
    """A mesh under a pose: float64 boxes of its faces, and their exact corners on demand."""

    def __init__(self, mesh: Mesh, pose: dict[str, Any] | None) -> None:
        self.mesh, self.pose, self.placed = mesh, pose, mesh.vertices
        if pose is not None:
            self.placed = self.placed @ np.array(pose["rotation"]).T + np.array(pose["translation"])
        corners, padding = self.placed[mesh.faces], _PADDING * np.abs(self.placed).max()
        self.low, self.high = corners.min(axis=1) - padding, corners.max(axis=1) + padding
        self._images: dict[int, Any] = {}

    def vertex(self, number: int) -> Any:
        if number not in self._images:
            self._images[number] = image(self.mesh.vertices[number].tolist(), self.pose)
        return self._images[number]

    def face(self, number: int) -> Any:
        return tuple(self.vertex(vertex) for vertex in self.mesh.faces[number].tolist())

    def holds_part_of(self, other: _Body) -> bool:
        """Return whether a part of another body, which meets no face of this one, lies inside."""
        labels, faces = np.arange(len(other.placed)), other.mesh.faces
        while True:  # bound: labels only fall; a vertex of every connected part remains
            least = labels.copy()
            np.minimum.at(least, faces.ravel(), np.repeat(labels[faces].min(axis=1), 3))
            if (least == labels).all():
                break
            labels = least
        low, high, parts = self.low.min(axis=0), self.high.max(axis=0), np.unique(labels[faces]).tolist()
        near = [v for v in parts if ((low <= other.placed[v]) & (other.placed[v] <= high)).all()]
        own = [self.face(number) for number in range(len(self.mesh.faces))] if near else []
        return any(reference.locate_by_triangles(other.vertex(v), own) > 0 for v in near)


def collides(pair: Any, row: int) -> bool:
    """Return whether the two bodies of a pair, closed sets, have a common point at one pose."""
    pose = {"rotation": pair.rotations[row].tolist(), "translation": pair.translations[row].tolist()}
    return _bodies_meet(_Body(pair.first, None), _Body(pair.second, pose), pair.is_closed)


def meet(couples: Any) -> np.ndarray:
    """Return whether two closed meshes without poses have a common point, for each pair."""
    return np.array([_bodies_meet(*(_Body(body.shape, None) for body in couple), True) for couple in couples])


def _bodies_meet(a: _Body, b: _Body, is_closed: bool) -> bool:
    near = np.flatnonzero(((a.low <= b.high.max(axis=0)) & (a.high >= b.low.min(axis=0))).all(axis=1))
    for face in near.tolist():
        for other in np.flatnonzero(((b.low <= a.high[face]) & (b.high >= a.low[face])).all(axis=1)).tolist():
            if triangles_meet(a.face(face), b.face(other)):
                return True
    return is_closed and (a.holds_part_of(b) or b.holds_part_of(a))


def _passes(segment: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return which boxes, padded beyond rounding, a segment may pass through; those behind its start stay, too."""
    start, way = segment[0], segment[1] - segment[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.sort(np.stack([low - start, high - start]) / way, axis=0)
    first = np.nan_to_num(ends[0], nan=-np.inf).max(axis=-1) - _PADDING
    return first <= np.minimum(np.nan_to_num(ends[1], nan=np.inf).min(axis=-1), 1.0) + _PADDING


def meets(segment: np.ndarray, mesh: Mesh) -> bool:
    """Return whether a segment has a point in a closed body."""
    if not _passes(segment, mesh.vertices.min(axis=0) - _PADDING, mesh.vertices.max(axis=0) + _PADDING):
        return False
    corners = mesh.vertices[mesh.faces]
    near = corners[_passes(segment, corners.min(axis=1) - _PADDING, corners.max(axis=1) + _PADDING)]
    ends = tuple(map(vector, segment.tolist()))
    return any(segment_meets_triangle(ends, tuple(map(vector, face))) for face in near.tolist()) or bool(
        locations(segment[:1], mesh)[0]
    )


def hits_of(segments: np.ndarray, mesh: Mesh, keep: str) -> np.ndarray:
    """Return where segments first meet a mesh, NaN where nowhere; how often ("all"); or whether ("any")."""
    corners, result = mesh.vertices[mesh.faces], []
    low, high = corners.min(axis=1) - _PADDING, corners.max(axis=1) + _PADDING
    for segment in segments:
        near = corners[_passes(segment, low, high)].tolist()
        start, end = map(vector, segment.tolist())
        triangles = [tuple(map(vector, face)) for face in near]
        found = hits_reference.hits(start, sub(end, start), False, triangles, range(len(near))) if near else []
        first = nearest_double(found[0].t) if found else np.nan
        result.append({"first": first, "all": len(found), "any": bool(found)}[keep])
    return np.array(result)


def volume_of(mesh: Mesh) -> float:
    """Return the double nearest to the volume of a mesh."""
    return nearest(abs(signed_volume(points_of(mesh.vertices), mesh.faces)))


def cut_measures(mesh: Mesh, rows: np.ndarray, is_section: bool) -> np.ndarray:
    """Return the volume of the half, or the area of the section, of each plane, and the scale it is judged by."""
    points, sides = points_of(mesh.vertices), np.sort(np.ptp(mesh.vertices, axis=0))
    scale, result = float(np.prod(sides[is_section:])), []
    for row in rows.tolist():
        volume, square = cut_volume(points, mesh.faces, row)
        result.append(nearest_double_with_root(Q(0), Q(1), Q(square)) if is_section else nearest(abs(volume)))
    return np.array([[value, scale] for value in result])


def boxes_that_meet(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the pairs (n, 2) of two layers of rings (n, size, 2) whose boxes have a common point, in order."""
    low, high = right.min(axis=1), right.max(axis=1)
    rows = [np.flatnonzero(((low <= ring.max(axis=0)) & (high >= ring.min(axis=0))).all(axis=1)) for ring in left]
    return np.stack([np.repeat(np.arange(len(left)), [len(row) for row in rows]), np.concatenate(rows)], axis=1)


def relations(left: np.ndarray, right: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Return the relation of each pair of rings of two layers, as numbers of `engine.Relation`."""
    shapes = [[document(Rings("", [ring])) for ring in layer] for layer in (left, right)]
    return np.array([int(relation(shapes[0][a], shapes[1][b])) for a, b in pairs.tolist()])


def exact_distances(couples: Any) -> np.ndarray:
    """Return the doubles nearest to the distances of pairs of bodies without poses, 0 if they meet."""
    result = [distance(*(document(body.shape) for body in couple)) for couple in couples]
    return np.array([0.0 if each is None else nearest_double_with_root(-each[1], Q(1), each[0]) for each in result])


def squares_from(points: np.ndarray, mesh: Mesh) -> list[Any]:
    """Return the exact squared distances of points from a mesh. Faces whose boxes are certainly farther away than the
    nearest vertex are left out."""
    corners, result = mesh.vertices[mesh.faces], []
    low, high = corners.min(axis=1), corners.max(axis=1)
    for point in points:
        nearest = np.linalg.norm(mesh.vertices - point, axis=1).min() * (1 + _PADDING)
        near = np.linalg.norm(np.maximum(np.maximum(low - point, point - high), 0.0), axis=1) <= nearest
        faces = [tuple(map(vector, face)) for face in corners[near].tolist()]
        result.append(min(squared_distance(face, (vector(point.tolist()),)) for face in faces))
    return result


def distances_from(points: np.ndarray, mesh: Mesh) -> np.ndarray:
    """Return the doubles nearest to the distances of points from a mesh."""
    return np.array([nearest_double_with_root(Q(0), Q(1), square) for square in squares_from(points, mesh)])


def first_pieces(segments: np.ndarray, region: Any) -> np.ndarray:
    """Return (n, 2 * dim) nearest doubles of the first piece's ends, NaN if there is none."""
    rows, reported = np.full((len(segments), segments[0].size), np.nan), document(region)
    for row, segment in zip(rows, segments.tolist(), strict=True):
        if pieces := clip_segment(segment, reported):
            start, end, _ = pieces[0].rounded()
            row[:] = (*start, *end)
    return rows


def are_kept(rings: np.ndarray, region: Any) -> np.ndarray:
    """Return whether a part of each ring is left."""
    planes = planes_of(document(region))
    return np.array([len(clip_contour(ring, planes)) > 0 for ring in rings.tolist()])


def areas_in_region(rings: np.ndarray, region: Any) -> np.ndarray:
    """Return the area of each clipped ring and its own area."""
    planes, result = planes_of(document(region)), []
    for ring in rings.tolist():
        sizes = signed_area(clip_contour(ring, planes)), signed_area([vector(p) for p in ring])
        left, whole = (abs(float(Fraction(size))) for size in sizes)
        result.append([left, max(whole, 1e-300)])
    return np.array(result)


def scale_of(pair: Any) -> float:
    """Return the largest area of the boxes of a pair of polygons."""
    return max(*(float(np.prod(np.ptp(np.concatenate(rings), axis=0))) for rings in pair), 1e-300)


def overlay_area(pair: Any) -> tuple[float, float]:
    """Return the exact area of the intersection, rounded, and the scale of a pair."""
    solids = [{"type": "polygon", "rings": [ring.tolist() for ring in rings]} for rings in pair]
    return float(Fraction(overlay(*solids, "intersection").area)), scale_of(pair)


# --- judging ----------------------------------------------------------------------------------------------------------

REFUSED, OUTSIDE = -9, -8
"""Replacements of an answer: the contender raised an error for this item; the item is outside of its domain."""
SHOWABLE = 20
"""Wrong labels among which one is looked for that is small enough to be shown."""
AREA_TOLERANCE = 2.0**-20
"""Part of the largest area of the pair: above rounding of coordinates, below any piece that matters."""


def plain(value: Any) -> Any:
    """Return a number or array as JSON takes it, None for NaN."""
    result = np.asarray(value).tolist()
    return [None if x != x else x for x in result] if isinstance(result, list) else None if result != result else result


def same(answers: np.ndarray, exact: np.ndarray) -> dict[str, Any]:
    """Judge answers that are labels: equal or wrong; of equally wrong ones the first may be too large to draw."""
    answers, exact = np.asarray(answers).astype(np.int64), np.asarray(exact).astype(np.int64)
    refused, outside = answers == REFUSED, answers == OUTSIDE
    wrong = (answers != exact) & ~refused & ~outside
    result = {"judged": len(exact), "wrong": int(wrong.sum()), "refused": int(refused.sum())}
    result["outside"] = int(outside.sum())
    return result | ({"worst": np.flatnonzero(wrong)[:SHOWABLE].tolist()} if wrong.any() else {})


def _ulps(errors: np.ndarray) -> dict[str, float]:
    """Return the largest and the median of errors in ulps, 0 where there are none."""
    return {
        "ulp_largest": float(errors.max(initial=0.0)),
        "ulp_median": float(np.median(errors)) if errors.size else 0.0,
    }


def coordinates(answers: np.ndarray, exact: np.ndarray) -> dict[str, Any]:
    """Judge rows of coordinates, NaN where nothing remains: wrong where that differs; else their errors in ulps."""
    remaining, should = ~np.isnan(answers).any(axis=1), ~np.isnan(exact).any(axis=1)
    both, wrong = remaining & should, remaining != should
    ulps = np.abs(answers[both] - exact[both]) / np.spacing(np.maximum(np.abs(exact[both]), np.finfo(float).tiny))
    result = {"judged": len(exact), "wrong": int(wrong.sum()), "refused": 0} | _ulps(ulps)
    result |= {"off": int((ulps > 0).sum()), "coordinates": ulps.size}
    if wrong.any():
        result["worst"] = int(np.argmax(wrong))
    elif (ulps > 0).any():
        result["worst"] = int(np.flatnonzero(both)[np.argmax(ulps.max(axis=1))])
    return result


def distances(answers: np.ndarray, exact: np.ndarray, tolerance: float = 1e-6) -> dict[str, Any]:
    """Judge distances: NaN is a refusal, infinity out of domain; wrong: off by more than this part, 0 for apart."""
    answers = np.asarray(answers, float)
    refused, outside = np.isnan(answers), np.isinf(answers)
    error = np.abs(np.where(refused | outside, exact, answers) - exact)
    wrong = (error > tolerance * exact) | ((exact > 0.0) & (answers == 0.0))
    near = ~(wrong | refused | outside)
    ulps = error[near] / np.spacing(np.maximum(exact[near], np.finfo(float).tiny))
    result = {"judged": len(exact), "wrong": int(wrong.sum()), "refused": int(refused.sum())} | _ulps(ulps)
    result |= {"outside": int(outside.sum()), "off": int((ulps > 0).sum()), "coordinates": len(ulps)}
    return result | ({"worst": int(np.argmax(wrong * error))} if wrong.any() else {})


def places(answers: np.ndarray, exact: np.ndarray, tolerance: float = 1e-6) -> dict[str, Any]:
    """Judge the parameters of first hits, NaN where nothing is hit: wrong where that differs, or elsewhere on the
    segment by more than this part of it."""
    answers, exact = np.asarray(answers, float), np.asarray(exact, float)
    is_hit, should = ~np.isnan(answers), ~np.isnan(exact)
    wrong = (is_hit != should) | (is_hit & should & (np.abs(answers - exact) > tolerance))
    result = {"judged": len(exact), "wrong": int(wrong.sum()), "refused": 0}
    return result | ({"worst": np.flatnonzero(wrong)[:SHOWABLE].tolist()} if wrong.any() else {})


def areas(answers: np.ndarray, exact: np.ndarray) -> dict[str, Any]:
    """Judge areas by (area, scale): NaN is a refusal, infinity out of domain; wrong is off by `AREA_TOLERANCE`."""
    answers = np.asarray(answers, float)
    refused, outside = np.isnan(answers), np.isinf(answers)
    error = np.abs(np.where(outside, np.nan, answers) - exact[:, 0]) / exact[:, 1]
    good = error[error <= AREA_TOLERANCE] * 2.0**53
    result = {"judged": len(exact), "wrong": int((error > AREA_TOLERANCE).sum()), "refused": int(refused.sum())}
    result |= {"outside": int(outside.sum())} | _ulps(good)
    return result | ({"worst": int(np.nanargmax(error))} if result["wrong"] else {})
