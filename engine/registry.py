"""The rows of the ten solids: everything about a type, and where its code is. To add a solid, add a row.

A new solid needs its class in `engine/solids/`, a row here, and its name in `engine/__init__`. The least is `solid`,
`about`, `fields`, and `exact` if points can be in it: then `locate` and scenes answer, in exact arithmetic; every other
cell makes an operation answer, or answer sooner.
"""

from __future__ import annotations

from typing import Final

from engine.containment import locators
from engine.containment import posed_locators as posed
from engine.containment.methods import rational_locate
from engine.distance.ball_and_planes import BallMeasure, PlanesMeasure
from engine.distance.point_measures import TriangleMeasure
from engine.polygon_clipping import planes
from engine.segment_clipping import clip_segments as segments
from engine.segment_clipping import hits, profiles
from engine.segment_clipping.on_boundary import boundary
from engine.solid_cutting import exact_measures as simple
from engine.solid_cutting import measures
from engine.solids import bounds
from engine.solids.csg import Csg
from engine.solids.implicit import Implicit
from engine.solids.mesh import Polyhedron, Surface
from engine.solids.polygon import Polygon
from engine.solids.primitives import Aabb, Convex, HalfSpace, Sphere, Triangle
from engine.solids.registry import BodyKind, Field, Row, register

ROWS: Final = (
    Row(
        solid=HalfSpace,
        kind=BodyKind.ROWS,
        about="All points p with dot(normal, p) + offset >= 0; the normal points inward.",
        fields={
            "normal": Field("position", "Points inward; of any length but zero."),
            "offset": Field("number", "Over the length of the normal: how far inside the origin lies."),
        },
        stored=("normal", "offset"),
        exact=rational_locate.in_rows,
        locator=locators.rows_locator,
        posed=posed.by_filter(posed.rows),
        profile=profiles.on_planes,
        clip=segments.on_planes,
        planes=planes.planes_of_rows,
        meets={2: "half_space", 3: "half_space"},
        measure=PlanesMeasure,
    ),
    Row(
        solid=Sphere,
        kind=BodyKind.BALL,
        about="All points at most `radius` away from `center` (a disc in 2D).",
        fields={"center": Field("position", "The centre."), "radius": Field("number", "Zero or more.")},
        stored=("center", "radius"),
        exact_posed=rational_locate.in_sphere,
        locator=locators.ball_locator,
        posed=posed.posed_ball,
        box=lambda solid, _: (solid.center, solid.center, 0.0),
        bounds=bounds.bounds_of_sphere,
        volumes=simple.BALL,
        profile=profiles.on_sphere,
        clip=segments.on_ball,
        meets={2: "sphere", 3: "sphere"},
        measure=BallMeasure,
    ),
    Row(
        solid=Aabb,
        kind=BodyKind.BOX,
        about="All points with min <= p <= max on each axis.",
        fields={
            "min": Field("position", "The corner with the least coordinates."),
            "max": Field("position", "The corner with the greatest coordinates."),
        },
        stored=("min", "max"),
        exact=rational_locate.in_rows,
        locator=locators.box_locator,
        posed=posed.by_filter(posed.box_sides),
        box=lambda solid, _: (solid.min, solid.max, float("inf")),
        bounds=bounds.bounds_of_box,
        volumes=simple.BOX,
        profile=profiles.on_planes,
        n_faces=lambda solid: 2 * int(solid.dimension),
        clip=segments.on_box,
        planes=planes.planes_of_rows,
        meets={2: "box", 3: "box"},
        measure=TriangleMeasure,
    ),
    Row(
        solid=Convex,
        kind=BodyKind.ROWS,
        about="All points with a x + b y + c z + d >= 0 for every row [a, b, c, d] (2D: [a, b, c]); may be unbounded\n"
        "or empty.",
        fields={"planes": Field("rows", "Its rows.")},
        example={"planes": [[1, 0, 1], [0, 1, 1], [-1, -1, 1]]},
        stored=("planes",),
        exact=rational_locate.in_rows,
        locator=locators.rows_locator,
        posed=posed.by_filter(posed.rows),
        bounds=bounds.bounds_of_convex,
        volumes=simple.CONVEX,
        profile=profiles.on_planes,
        n_faces=lambda solid: len(solid.planes),
        clip=segments.on_planes,
        planes=planes.planes_of_rows,
        measure=PlanesMeasure,
    ),
    Row(
        solid=Polyhedron,
        kind=BodyKind.MESH,
        about="Everything within a closed, consistently oriented mesh (even-odd rule); faces by index, "
        "counter-clockwise seen\nfrom outside, triangles or simple polygons.",
        fields={
            "vertices": Field("vertices", "Positions; those at equal coordinates are one."),
            "faces": Field("faces", "Indices of vertices, three or more a face."),
        },
        stored=("vertices", "face_offsets", "face_indices"),
        exact=rational_locate.in_polyhedron,
        locator=locators.polyhedron_locator,
        posed=posed.by_filter(posed.faces),
        box=bounds.vertices_box,
        bounds=bounds.bounds_of_vertices,
        volumes=measures.MESH,
        profile=profiles.on_boundary,
        n_faces=lambda solid: int(solid.n_faces),
        clip=boundary.on_boundary,
        hits=hits.on_mesh,
        planes=planes.planes_of_faces,
        meets={3: "mesh"},
        measure=TriangleMeasure,
    ),
    Row(
        solid=Surface,
        kind=BodyKind.MESH,
        about="A mesh that encloses nothing, open or closed; for collision only.",
        fields={
            "vertices": Field("vertices", "Positions."),
            "faces": Field("faces", "Indices of vertices, three or more a face."),
        },
        example={"vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "faces": [[0, 1, 2], [0, 2, 3]]},
        stored=("vertices", "face_offsets", "face_indices"),
        box=bounds.vertices_box,
        bounds=bounds.bounds_of_vertices,
        volumes=measures.SURFACE,
        profile=profiles.on_boundary,
        hits=hits.on_mesh,
        meets={3: "mesh"},
        measure=TriangleMeasure,
    ),
    Row(
        solid=Triangle,
        kind=BodyKind.RINGS,
        about="2D: a triangle. 3D: for `contains` the prism over it, unbounded both ways; flat for bounds.",
        fields={"vertices": Field("three", "Three positions, in any order.")},
        stored=("vertices",),
        exact=rational_locate.in_triangle,
        locator=locators.triangle_locator,
        posed=posed.by_filter(posed.triangle),
        box=bounds.triangle_box,
        bounds=bounds.bounds_of_vertices,
        volumes=simple.TRIANGLE,
        profile=profiles.on_triangle,
        n_faces=lambda solid: len(solid.vertices),
        meets={2: "outline"},
        measure=TriangleMeasure,
    ),
    Row(
        solid=Polygon,
        kind=BodyKind.RINGS,
        about="Everything within the rings (even-odd rule over all of them, any orientation); a repeated last vertex "
        "is\ndropped.",
        fields={"rings": Field("rings", "Shells and holes alike.")},
        stored=("vertices", "ring_offsets"),
        exact=rational_locate.in_polygon,
        locator=locators.polygon_locator,
        posed=posed.by_filter(posed.rings),
        box=bounds.vertices_box,
        bounds=bounds.bounds_of_vertices,
        volumes=simple.RINGS,
        profile=profiles.on_boundary,
        n_faces=lambda solid: len(solid.vertices),
        clip=boundary.on_boundary,
        meets={2: "outline"},
        measure=TriangleMeasure,
    ),
    Row(
        solid=Implicit,
        about="All points where the sum of the terms is >= 0; total degree at most 16.",
        fields={"terms": Field("terms", "What is added up.")},
        example={
            "terms": [
                {"powers": [0, 0], "coefficient": 1},
                {"powers": [2, 0], "coefficient": -1},
                {"powers": [0, 4], "coefficient": -1},
            ]
        },
        stored=("powers", "coefficients"),
        exact=rational_locate.in_implicit,
        locator=locators.implicit_locator,
        posed=posed.posed_implicit,
    ),
    Row(
        solid=Csg,
        about="A Boolean of solids: union, intersection, or the first minus the second.",
        exact_posed=rational_locate.in_csg,
        locator=locators.csg_locator,
        posed=posed.posed_csg,
    ),
)

for _row in ROWS:
    register(_row)
