"""What a careful user of each peer would write for a filed case of the plane; whatever it raises is a refusal.

Each function takes the case's input and returns the answer in the form that `benchmarks.fields.filed` judges: booleans
(points, bodies that meet), pieces of segments, an area. `NotApplicable` where the peer has no such operation.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Rings = list[np.ndarray]
Piece = tuple[int, Any, Any]
"""Index of the segment, start, end."""


class NotApplicable(Exception):
    """The peer does not answer this kind of question."""


def rings_of(solid: dict[str, Any]) -> Rings:
    """Return the rings of a polygon or box."""
    match solid["type"]:
        case "polygon":
            return [np.array(ring, float) for ring in solid["rings"]]
        case "aabb":
            (x0, y0), (x1, y1) = solid["min"], solid["max"]
            return [np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], float)]
    raise NotApplicable(solid["type"])


def refuse_poses(data: dict[str, Any]) -> None:
    """Leave posed bodies to the peers that take poses."""
    if "first_pose" in data or "second_pose" in data:
        raise NotApplicable("no poses")


def area_of(rings: list[Any]) -> float:
    """Return the sum of the signed areas, without its sign."""
    total = 0.0
    for ring in rings:
        x, y = np.asarray(ring, float).T
        total += 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    return abs(total)


# --- shapely ----------------------------------------------------------------------------------------------------------


def shapely_shape(solid: dict[str, Any]) -> Any:
    """Return the rings as one geometry under even-odd: as given where that is valid, else repaired ring by ring."""
    import shapely

    rings = rings_of(solid)
    for made in (shapely.Polygon(rings[0], rings[1:]), shapely.MultiPolygon([shapely.Polygon(ring) for ring in rings])):
        if made.is_valid:
            return made
    return shapely.symmetric_difference_all([shapely.make_valid(shapely.Polygon(ring)) for ring in rings])


def shapely_locate(data: dict[str, Any]) -> np.ndarray:
    import shapely

    rings = rings_of(data["solid"])
    x, y = np.array(data["points"], float).T
    return shapely.intersects_xy(shapely.Polygon(rings[0], rings[1:]), x, y)  # not repaired: as its users call it


def shapely_segments(data: dict[str, Any]) -> list[Piece]:
    import shapely

    region = shapely_shape(data["region"])
    return _lines(shapely.intersection(shapely.linestrings(data["segments"]), region))


def shapely_rectangle_segments(data: dict[str, Any]) -> list[Piece]:
    import shapely

    if data["region"]["type"] != "aabb":
        raise NotApplicable("boxes only")
    bounds = *data["region"]["min"], *data["region"]["max"]
    return _lines(shapely.clip_by_rect(shapely.linestrings(data["segments"]), *bounds))


def _lines(found: Any) -> list[Piece]:
    import shapely

    lines, owners = shapely.get_parts(found, return_index=True)
    kept = (shapely.get_type_id(lines) == shapely.GeometryType.LINESTRING) & ~shapely.is_empty(lines)
    return [(int(i), line.coords[0], line.coords[-1]) for line, i in zip(lines[kept], owners[kept], strict=True)]


def shapely_polygons(data: dict[str, Any]) -> float:
    import shapely

    bounds = *data["region"]["min"], *data["region"]["max"]
    shapes = [shapely_shape({"type": "polygon", "rings": rings}) for rings in data["polygons"]]
    return sum(shapely.clip_by_rect(shape, *bounds).area for shape in shapes)


def shapely_overlay(data: dict[str, Any]) -> float:
    import shapely

    return getattr(shapely, data["operation"])(*(shapely_shape(data[key]) for key in ("subject", "clip"))).area


def shapely_collide(data: dict[str, Any]) -> bool:
    import shapely

    refuse_poses(data)
    first, second = data["first"], data["second"]
    if second["type"] == "sphere" and len(second["center"]) == 2:
        return shapely_shape(first).distance(shapely.Point(second["center"])) <= second["radius"]
    shapes = [rings_of(solid) for solid in (first, second)]
    return shapely.intersects(*(shapely.Polygon(rings[0], rings[1:]) for rings in shapes))  # not repaired: as given


# --- matplotlib -------------------------------------------------------------------------------------------------------


def matplotlib_locate(data: dict[str, Any]) -> np.ndarray:
    from matplotlib.path import Path

    paths = [Path(np.concatenate([ring, ring[:1]]), closed=True) for ring in rings_of(data["solid"])]
    return Path.make_compound_path(*paths).contains_points(data["points"])


# --- pyclipper: integers, so coordinates are moved and scaled by a power of two to 50 bits ----------------------------


def _integers(*groups: Rings) -> tuple[list[list[Any]], float, np.ndarray]:
    """Return the groups in integers, the scale, and the point that became the origin."""
    every = np.concatenate([ring for rings in groups for ring in rings])
    middle = np.round((every.min(axis=0) + every.max(axis=0)) / 2)
    scale = 2.0 ** np.floor(50 - np.log2(np.abs(every - middle).max()))
    integers = [[np.rint((ring - middle) * scale).astype(np.int64).tolist() for ring in rings] for rings in groups]
    return integers, scale, middle


def pyclipper_locate(data: dict[str, Any]) -> np.ndarray:
    import pyclipper

    (rings, points), *_ = _integers(rings_of(data["solid"]), [np.array(data["points"], float)])
    found = np.array([[pyclipper.PointInPolygon(point, ring) for ring in rings] for point in points[0]])
    return (found < 0).any(axis=1) | ((found > 0).sum(axis=1) % 2 == 1)  # -1 is its boundary


def _clipped(subject: list[Any], clip: list[Any], operation: str, are_closed: bool = True) -> Any:
    import pyclipper

    kinds = {
        "intersection": pyclipper.CT_INTERSECTION, "union": pyclipper.CT_UNION, "difference": pyclipper.CT_DIFFERENCE,
        "symmetric_difference": pyclipper.CT_XOR,
    }  # fmt: skip
    clipper = pyclipper.Pyclipper()
    clipper.AddPaths(subject, pyclipper.PT_SUBJECT, are_closed)
    clipper.AddPaths(clip, pyclipper.PT_CLIP, True)
    call = clipper.Execute if are_closed else clipper.Execute2
    return call(kinds[operation], pyclipper.PFT_EVENODD, pyclipper.PFT_EVENODD)


def pyclipper_segments(data: dict[str, Any]) -> list[Piece]:
    import pyclipper

    region, found = rings_of(data["region"]), []
    for i, segment in enumerate(np.array(data["segments"], float)):
        (clip, line), scale, middle = _integers(region, [segment])
        paths = pyclipper.OpenPathsFromPolyTree(_clipped(line, clip, "intersection", are_closed=False))
        found += [(i, *(np.array([path[0], path[-1]]) / scale + middle)) for path in paths]
    return found


def pyclipper_polygons(data: dict[str, Any]) -> float:
    (subject, clip), scale, _ = _integers(*([np.array(ring) for ring in data["polygons"][0]], rings_of(data["region"])))
    return area_of(_clipped(subject, clip, "intersection")) / scale**2


def pyclipper_overlay(data: dict[str, Any]) -> float:
    (subject, clip), scale, _ = _integers(rings_of(data["subject"]), rings_of(data["clip"]))
    return area_of(_clipped(subject, clip, data["operation"])) / scale**2


# --- Clipper2, inside manifold3d --------------------------------------------------------------------------------------


def clipper2_overlay(data: dict[str, Any]) -> float:
    from manifold3d import CrossSection, FillRule

    first, second = (CrossSection(rings_of(data[key]), FillRule.EvenOdd) for key in ("subject", "clip"))
    found = {
        "intersection": lambda: first ^ second,
        "union": lambda: first + second,
        "difference": lambda: first - second,
        "symmetric_difference": lambda: (first - second) + (second - first),
    }
    return found[data["operation"]]().area()


def clipper2_polygons(data: dict[str, Any]) -> float:
    subject = {"type": "polygon", "rings": data["polygons"][0]}
    return clipper2_overlay({"subject": subject, "clip": data["region"], "operation": "intersection"})


# --- numba_celltree ---------------------------------------------------------------------------------------------------


def celltree_segments(data: dict[str, Any]) -> list[Piece]:
    from numba_celltree.algorithms.cohen_sutherland import cohen_sutherland_line_box_clip
    from numba_celltree.constants import Box, Point

    if data["region"]["type"] != "aabb":
        raise NotApplicable("boxes only")
    (x0, y0), (x1, y1) = np.array([data["region"]["min"], data["region"]["max"]], float).tolist()
    box, found = Box(x0, x1, y0, y1), []
    for i, (a, b) in enumerate(np.array(data["segments"], float).tolist()):
        kept, start, end = cohen_sutherland_line_box_clip(Point(*a), Point(*b), box)
        if kept:
            found.append((i, tuple(start), tuple(end)))
    return found
