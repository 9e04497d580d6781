"""Questions and answers of clipping segments, lines and polygons, of Boolean operations, and of layers (RFC 7946)."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, WithJsonSchema

from service.schemas.arrays import DIMENSION, PAIR, POINTS, Array, Axis, Numbers
from service.schemas.base import Accuracy, AtMost, Count, Schema, optional, with_example
from service.schemas.geojson import OrGeoJson, OrMembers
from service.schemas.solids import Indices, Number, Position, Segments, Solid


class ClipSegmentsRequest(Schema):
    """What remains of these segments within this region?"""

    model_config = with_example(
        {"region": {"type": "aabb", "min": [0, 0], "max": [2, 2]}, "segments": [[[-1, 1], [3, 1]], [[5, 5], [6, 6]]]}
    )

    region: Solid = Field(description="half_space, aabb, convex, sphere, polygon or polyhedron.")
    segments: Segments = Field(description="Two end points each. Or GeoJSON: LineStrings of two positions.")


class SegmentPiece(Schema):
    """A part of a segment that lies in the region; it may be a single point."""

    segment: Count = Field(description="Index of the segment that it is a part of.")
    start: Position = Field(description="Each coordinate is the float64 nearest to the exact one.")
    end: Position = Field(description="As `start`; equal to it where the piece is a point.")
    t: Annotated[Array, Numbers(PAIR)] = Field(description="Parameters of both ends: 0 and 1 are the segment's own.")
    faces: Annotated[Array, Numbers(PAIR, kind="integer", minimum=-1)] = Field(
        description="Plane or face of the region crossed at either end, -1 where the end is the segment's own."
    )


class ClipSegmentsResponse(Schema):
    """The pieces, by segment and then along it."""

    pieces: list[SegmentPiece] = Field(description="None where nothing remains.")
    accuracy: Accuracy


class ClipLinesRequest(Schema):
    """What remains of these polylines within this region?"""

    model_config = with_example(
        {
            "region": {"type": "aabb", "min": [0, 0], "max": [2, 2]},
            "lines": [[[-1, 1], [1, 1], [1, 3]], [[5, 5], [6, 6]]],
        },
        {"region": {"type": "aabb", "min": [0, 0], "max": [2, 2]}, "lines": [[[-1, 1], [3, 1]]], "keep": "outside"},
    )

    region: Solid = Field(description="half_space, aabb, convex, sphere, polygon or polyhedron.")
    lines: Annotated[Array, Numbers(POINTS, Axis(2, "max_points"), DIMENSION, ragged=True), OrGeoJson("LineString")] = (
        Field(
            description="Two positions or more each. Or GeoJSON: LineString, MultiLineString, or a collection of these."
        )
    )
    keep: Literal["inside", "outside"] = optional(
        "Which parts: those in the region, if left out, or those between, before and after these, ends included."
    )


class LinePiece(Schema):
    """A connected part of a line that lies in the region; it may be a single point, given twice."""

    line: Count = Field(description="Index of the line that it is a part of.")
    positions: Annotated[Array, Numbers(Axis(2, None), DIMENSION)] = Field(
        description="Both ends, each coordinate the float64 nearest to the exact one, and the line's own between them."
    )
    segments: Annotated[Array, Numbers(PAIR, kind="integer", minimum=0)] = Field(
        description="The segments of the line that both ends lie on: segment k goes from position k to k + 1."
    )
    t: Annotated[Array, Numbers(PAIR)] = Field(description="Parameters of both ends on those segments.")
    faces: Annotated[Array, Numbers(PAIR, kind="integer", minimum=-1)] = Field(
        description="Plane or face of the region crossed at either end, -1 where the end is the line's own."
    )


class ClipLinesResponse(Schema):
    """The pieces, by line and then along it."""

    pieces: list[LinePiece] = Field(description="None where nothing remains.")
    accuracy: Accuracy


Contour = Annotated[Array, Numbers(Axis(1, "max_points"), DIMENSION)]
Contours = Annotated[list[Contour], AtMost("max_rings", low=1)]


class ClipPolygonsRequest(Schema):
    """What does Sutherland-Hodgman leave of these polygons on this convex region?"""

    model_config = with_example(
        {"region": {"type": "half_space", "normal": [-1, 0], "offset": 1}, "polygons": [[[[0, 0], [4, 0], [0, 4]]]]}
    )

    region: Solid = Field(description="half_space, aabb, convex, or a polyhedron that is convex.")
    polygons: Annotated[list[Contours], AtMost("max_polygons"), OrGeoJson("Polygon")] = Field(
        description="Each a list of contours, in 2D or 3D, planar or not. Or a collection of GeoJSON with areas."
    )


class ClippedPolygon(Schema):
    """What is left of one polygon; connected, contour by contour."""

    rings: list[Contour] = Field(description="Each coordinate is the float64 nearest to the exact one.")
    contours: Indices = Field(description="For each ring the contour it is left of; those that vanish are missing.")
    status: Literal["clipped", "too_complex"] = Field(description="too_complex: an exact vertex grew beyond the cap.")
    may_have_bridges: bool = Field(description="Edges along a plane may run there and back, or along another contour.")


class ClipPolygonsResponse(Schema):
    """One entry for each polygon."""

    polygons: list[ClippedPolygon] = Field(description="In the order of the request.")
    accuracy: Accuracy


LinearRing = Annotated[Array, Numbers(Axis(4, None), Axis(2, 2))]
_SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4]]

Operation = Literal["intersection", "union", "difference", "symmetric_difference"]


class OverlayRequest(Schema):
    """What is the intersection, union, difference or symmetric difference of these two polygons?"""

    model_config = with_example(
        {
            "subject": {"type": "polygon", "rings": [_SQUARE, [[1, 1], [2, 1], [1, 2]]]},
            "clip": {"type": "polygon", "rings": [[[2, 2], [6, 2], [6, 6], [2, 6]]]},
            "operation": "difference",
        },
        {
            "subject": {"type": "polygon", "rings": [[[0, 0], [1, 0], [1, 1], [0, 1]]]},
            "clip": {"type": "polygon", "rings": [[[0.9999999999999999, 0.3], [2, 0.2], [2, 0.4]]]},
            "operation": "intersection",
            "area": True,
        },
        {
            "subject": {"type": "polygon", "rings": [_SQUARE]},
            "clip": {"type": "polygon", "rings": [[[4.00001, 0], [8, 0], [8, 4], [3.99999, 4]]]},
            "operation": "union",
            "grid": 0.001,
        },
    )

    subject: Solid = Field(description="A polygon.")
    clip: Solid = Field(description="A polygon.")
    operation: Operation = Field(description="How the two are combined; difference is the subject without the clip.")
    area: bool = optional("Compute the area; if left out, where it costs next to nothing: up to 100 vertices.")
    grid: Number = optional(
        "Snap the result to multiples of this power of two or ten, so that borders that nearly coincide do; no edge "
        "moves by more than 0.71 of it. `area` is then that of the output."
    )


class OverlayBatchRequest(Schema):
    """What is the intersection, union, difference or symmetric difference of these pairs of polygons?"""

    model_config = with_example(
        {
            "subjects": [{"type": "polygon", "rings": [_SQUARE]}, {"type": "polygon", "rings": []}],
            "clips": [
                {"type": "polygon", "rings": [[[2, 2], [6, 2], [6, 6], [2, 6]]]},
                {"type": "polygon", "rings": [_SQUARE]},
            ],
            "operation": "union",
        }
    )

    subjects: Annotated[list[Solid], AtMost("max_polygons"), OrMembers()] = Field(
        description="Polygons. Or GeoJSON: a FeatureCollection or GeometryCollection, a polygon each member."
    )
    clips: Annotated[list[Solid], AtMost("max_polygons"), OrMembers()] = Field(
        description="As many polygons, each for one subject."
    )
    operation: Operation = Field(
        description="How the two of each pair are combined; difference is the subject without the clip."
    )


class OverlayPiece(Schema):
    """A connected part: `[shell, *holes]` are the coordinates of a GeoJSON Polygon."""

    shell: LinearRing = Field(description="Counter-clockwise; the last position repeats the first.")
    holes: list[LinearRing] = Field(description="Clockwise; the last position of each repeats its first.")


class OverlayCollapse(Schema):
    """A part of the exact result that rounding lost."""

    kind: Literal["piece", "hole"] = Field(description="What it was.")
    area: Number = optional("Its area, correctly rounded; left out where it is beyond float64.")
    near: Position = Field(description="Its first vertex, rounded.")


class OverlayRounding(Schema):
    """What rounding to float64 did to the exact result.

    The output has `pieces_exact` - collapsed pieces - `pieces_joined` + `pieces_parted` pieces; likewise for holes.
    """

    rounds: Count = Field(description="How often the rings were rounded; 0 if the exact result is made of float64.")
    snapped: bool = Field(description="The coarser lattice of snap rounding was needed.")
    vertices_moved: Count = Field(description="Vertices that are not correctly rounded vertices of the exact result.")
    largest_displacement: Number = Field(description="Bound on the distance of an edge from its exact edge.")
    pieces_exact: Count = Field(description="Pieces of the exact result.")
    holes_exact: Count = Field(description="Holes of the exact result.")
    pieces_joined: Count = Field(description="Pieces fewer, since rounding joined some.")
    pieces_parted: Count = Field(description="Pieces more, since rounding parted some.")
    holes_joined: Count = Field(description="Holes fewer, since rounding joined some.")
    holes_parted: Count = Field(description="Holes more, since rounding parted some.")


class OverlayResponse(Schema):
    """The pieces: their coordinates together are those of a GeoJSON MultiPolygon."""

    pieces: list[OverlayPiece] = Field(description="Connected parts; none where the result is empty.")
    area: Number = optional(
        "Area of the exact result, correctly rounded; left out where it is beyond float64, or was not asked for."
    )
    collapsed: list[OverlayCollapse] = Field(description="Parts that rounding lost; none where it lost nothing.")
    rounding: OverlayRounding
    accuracy: Accuracy


class OverlaidPair(Schema):
    """The result of one pair."""

    status: Literal["done", "not_representable"] = Field(
        description="not_representable: a coordinate of the result is beyond float64; there are no pieces then."
    )
    pieces: list[OverlayPiece] = Field(description="Their coordinates together are those of a GeoJSON MultiPolygon.")
    largest_displacement: Number = Field(description="Bound on the distance of an edge from its exact edge.")


class OverlayBatchResponse(Schema):
    """One entry for each pair."""

    overlays: list[OverlaidPair] = Field(description="In the order of the request.")
    accuracy: Accuracy


_OBJECT = {"type": "object", "additionalProperties": True}
FeatureCollection = Annotated[Any, WithJsonSchema(_OBJECT)]
Feature = Annotated[dict[str, Any], WithJsonSchema(_OBJECT)]


def _square(x: float, size: float, **members: Any) -> dict[str, Any]:
    ring = [[x, x], [x + size, x], [x + size, x + size], [x, x + size], [x, x]]
    return {"type": "Feature", **members, "geometry": {"type": "Polygon", "coordinates": [ring]}}


def _collection(*features: dict[str, Any]) -> dict[str, Any]:
    return {"type": "FeatureCollection", "features": [*features]}


_PARCELS = _collection(
    _square(0, 2, id="a", properties={"owner": "Ada"}), _square(2, 2, id="b", properties={"owner": "Bo"})
)
_FLOODS = _collection(_square(1, 2, properties={"year": 1962}))
_POINT = {"type": "Feature", "properties": {"well": 7}, "geometry": {"type": "Point", "coordinates": [2, 2]}}
_ANY = "A FeatureCollection of points, lines and polygons, in the plane; null geometries are welcome."
_GRID = "Snap polygons to multiples of this power of two or ten."
_MIN_WIDTH = "List pieces that are narrower: the least distance of two parallel lines around a piece."
_WRAP = "180: coordinates are degrees; polygons are cut at the antimeridian, and joined in the answer."
_AREAS = "A FeatureCollection of Polygon and MultiPolygon, in the plane; null geometries are welcome."


class LayersOverlayRequest(Schema):
    """What do these two layers have in common, or not: every feature with every one that it meets?"""

    model_config = with_example({"left": _PARCELS, "right": _FLOODS, "operation": "intersection", "grid": 0.001})

    left: FeatureCollection = Field(description=_ANY)
    right: FeatureCollection = Field(description=_AREAS)
    operation: Literal["intersection", "union", "identity", "difference", "symmetric_difference"] = Field(
        description="intersection: a row for each pair with common area; difference: what is left of each feature of "
        "the left; identity: both; symmetric_difference: what is left of either; union: all of these."
    )
    grid: Number = optional(_GRID)
    min_width: Number = optional(_MIN_WIDTH, [0.01])
    wrap: Number = optional(_WRAP, [180])


class LayersUnionRequest(Schema):
    """What do the features of a layer cover together?"""

    model_config = with_example({"layer": _PARCELS, "by": ["owner"], "grid": 0.001, "coverage": True})

    layer: FeatureCollection = Field(description=_ANY)
    by: Annotated[list[str], AtMost("max_operands")] = optional(
        "Names of properties: features are united that have the same values of these; all, if left out."
    )
    grid: Number = optional(_GRID)
    coverage: bool = optional("The polygons do not overlap: verified, an overlap is refused with its place.")
    gaps: Literal["keep", "refuse"] = optional(
        "With coverage: what several features enclose, and none has as a hole, is kept and noted, or refused.",
        ["refuse"],
    )
    min_width: Number = optional(_MIN_WIDTH, [0.01])
    wrap: Number = optional(_WRAP, [180])


class LayersClipRequest(Schema):
    """What of these features lies in a region?"""

    model_config = with_example({"layer": _collection(_POINT), "mask": _PARCELS, "grid": 0.001})

    layer: FeatureCollection = Field(description=_ANY)
    mask: FeatureCollection = Field(description="The region, the union of polygons: a FeatureCollection of these.")
    keep: Literal["inside", "outside"] = optional(
        "What lies in the region, if left out, or what lies outside of it.", ["outside"]
    )
    grid: Number = optional(_GRID)
    min_width: Number = optional(_MIN_WIDTH, [0.01])
    wrap: Number = optional(_WRAP, [180])


class LayersSplitRequest(Schema):
    """Which pieces do lines make of these polygons?"""

    model_config = with_example(
        {
            "layer": _PARCELS,
            "lines": _collection(
                {
                    "type": "Feature",
                    "properties": {},
                    "geometry": {"type": "LineString", "coordinates": [[0, 1], [9, 1]]},
                }
            ),
            "min_width": 0.01,
        }
    )

    layer: FeatureCollection = Field(description=_AREAS)
    lines: FeatureCollection = Field(description="A FeatureCollection of LineString and MultiLineString, in the plane.")
    min_width: Number = optional(_MIN_WIDTH)


class LayersJoinRequest(Schema):
    """Which features of two layers are related?"""

    model_config = with_example(
        {"left": _collection(_POINT), "right": _PARCELS, "predicate": "dwithin", "distance": 1.5, "outside": True}
    )

    left: FeatureCollection = Field(description=_ANY)
    right: FeatureCollection = Field(description=_ANY)
    predicate: Literal[
        "intersects", "within", "contains", "touches", "overlaps", "crosses", "covers", "covered_by", "equals",
        "dwithin",
    ] = Field(description="The relation of a left feature to a right one, as in OGC Simple Features.")  # fmt: skip
    distance: Number = optional("With dwithin: the largest distance, which counts.")
    outside: bool = optional("Also a feature for each of the left that has no such relation.")


class LayersNearestRequest(Schema):
    """Which features of another layer are nearest?"""

    model_config = with_example(
        {"left": _collection(_POINT), "right": _PARCELS, "max_distance": 9.5, "exclusive": True, "outside": True}
    )

    left: FeatureCollection = Field(description=_ANY)
    right: FeatureCollection = Field(description=_ANY)
    max_distance: Number = optional("The largest distance, which counts.")
    exclusive: bool = optional("Features that are equal to it are not the nearest.")
    outside: bool = optional("Also a feature for each of the left that has none so near.")


class LayersContainsRequest(Schema):
    """Which features of a layer hold these points?"""

    model_config = with_example({"points": _collection(_POINT), "polygons": _PARCELS, "outside": True})

    points: FeatureCollection = Field(description="A FeatureCollection of Point; null geometries are welcome.")
    polygons: FeatureCollection = Field(description=_AREAS)
    outside: bool = optional("Also a feature for each point that nothing holds.")


class Sliver(Schema):
    """A narrow piece."""

    feature: Count = Field(description="Index of its feature in this answer.", examples=[0])
    piece: Count = Field(description="Index of its polygon in the feature.", examples=[0])
    width: Number = Field(
        description="The double nearest to the least distance of two parallel lines around it.", examples=[0.004]
    )


class LayersResponse(Schema):
    """A GeoJSON FeatureCollection: rings are closed, shells counter-clockwise, holes clockwise."""

    type: Literal["FeatureCollection"]
    crs: FeatureCollection = optional("The `crs` of the question, untouched.", examples=[{"type": "name"}])
    features: list[Feature] = Field(
        description="`properties` are those of the features that a row comes from, names that both layers have with _1 "
        "and _2; members named after the layers say which these were, by index and id. Geometry null: it was."
    )
    collapsed: Count = Field(description="Rows that are not here because rounding left nothing of them.")
    slivers: list[Sliver] = optional("The pieces narrower than `min_width`, if that was given.", [[]])
    accuracy: Accuracy
