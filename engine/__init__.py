"""Exact answers to four questions about a scene: containment, collision, segment clipping, polygon clipping."""

from engine import layers
from engine.collision.collide import collide
from engine.collision.collide_poses import collide_poses
from engine.collision.result import Clearance, Collision, Feature, Witness
from engine.collision.triangles import collide_triangles
from engine.compare import Comparison, compare
from engine.containment.locate import contains, locate
from engine.distance.clearance import clearance, clearance_poses
from engine.distance.distances import Distances, distances
from engine.errors import (
    CancelledError,
    DeadlineExceededError,
    EmptyGeometryError,
    EngineError,
    FaceNotSimpleError,
    InconsistentOrientationError,
    IndexOutOfRangeError,
    InvalidArrayError,
    InvalidInputError,
    InvalidOperationError,
    InvalidPolynomialError,
    MinAboveMaxError,
    NegativeRadiusError,
    NotClosedError,
    NotFiniteError,
    NotRepresentableError,
    NotRigidError,
    RepeatedIndexError,
    RingTooShortError,
    TooComplexError,
    TooDeepError,
    UnsupportedPairError,
    UnsupportedSolidError,
    WrongDimensionError,
    ZeroNormalError,
)
from engine.files.layers import read_layer
from engine.files.meshes import read_mesh
from engine.inspection.inspect import Inspection, inspect
from engine.polygon_clipping.clip_polygons import ClippedPolygons, PolygonStatus, clip_polygons
from engine.polygon_overlay.batch import OverlayBatch, overlay_batch
from engine.polygon_overlay.compiled.workspace import release
from engine.polygon_overlay.overlay import filled, overlay, union_all
from engine.polygon_overlay.result import Collapse, Overlay, OverlayPiece
from engine.polygon_overlay.split import split
from engine.registry import ROWS as _ROWS  # noqa: F401 (fills the table of solids)
from engine.running.budget import Cancel
from engine.running.parallel import default_workers
from engine.scenes.collide_scene import ScenePairs, collide_scene
from engine.scenes.distances import SceneDistances
from engine.scenes.ends import ScenePieces
from engine.scenes.hits import SceneHits
from engine.scenes.locate import SceneLocations
from engine.scenes.point_queries import locate_scene
from engine.scenes.scene import Scene
from engine.segment_clipping.clip_segments import SegmentPieces, clip_segments
from engine.segment_clipping.hits import HitKind, Hits, hits
from engine.segment_clipping.lines import LinePieces, clip_lines
from engine.solid_cutting.cut import CutSolid, cut
from engine.solid_cutting.measures import area, centroid, volume
from engine.solid_cutting.overlap import iou, overlap_volume
from engine.solid_cutting.section import Sections, section
from engine.solids.accepted import PointsLike, PoseLike, SolidLike
from engine.solids.base import Solid
from engine.solids.bounds import Bounds, bounds
from engine.solids.csg import Csg
from engine.solids.implicit import Implicit
from engine.solids.mesh import Polyhedron, Surface
from engine.solids.polygon import Polygon
from engine.solids.pose import Pose
from engine.solids.poses import Poses
from engine.solids.primitives import Aabb, Convex, HalfSpace, Sphere, Triangle
from engine.solids.ragged import polygons
from engine.solids.registry import solid_types
from engine.types import Accuracy, Location, Rcc8, Relation
from engine.version import __version__
from engine.warmup import warm

__all__ = [
    "Aabb", "Accuracy", "Bounds", "Cancel", "CancelledError", "Clearance", "ClippedPolygons", "Collapse",
    "Collision", "Comparison", "Convex", "Csg", "CutSolid", "DeadlineExceededError", "Distances",
    "EmptyGeometryError", "EngineError", "FaceNotSimpleError", "Feature", "HalfSpace", "HitKind", "Hits",
    "Implicit", "InconsistentOrientationError", "IndexOutOfRangeError", "Inspection", "InvalidArrayError",
    "InvalidInputError", "InvalidOperationError", "InvalidPolynomialError", "LinePieces", "Location",
    "MinAboveMaxError", "NegativeRadiusError", "NotClosedError", "NotFiniteError", "NotRepresentableError",
    "NotRigidError", "Overlay", "OverlayBatch", "OverlayPiece", "PointsLike", "Polygon", "PolygonStatus",
    "Polyhedron", "Pose", "PoseLike", "Poses", "Rcc8", "Relation", "RepeatedIndexError", "RingTooShortError",
    "Scene", "SceneDistances", "SceneHits", "SceneLocations", "ScenePairs", "ScenePieces", "Sections",
    "SegmentPieces", "Solid", "SolidLike", "Sphere", "Surface", "TooComplexError", "TooDeepError", "Triangle",
    "UnsupportedPairError", "UnsupportedSolidError", "Witness", "WrongDimensionError", "ZeroNormalError",
    "__version__", "area", "bounds", "centroid", "clearance", "clearance_poses", "clip_lines", "clip_polygons",
    "clip_segments", "collide", "collide_poses", "collide_scene", "collide_triangles", "compare", "contains", "cut",
    "default_workers", "distances", "filled", "hits", "inspect", "iou", "layers", "locate", "locate_scene",
    "overlap_volume", "overlay", "overlay_batch", "polygons", "read_layer", "read_mesh", "release", "section",
    "solid_types", "split", "union_all", "volume", "warm",
]  # fmt: skip


def __dir__() -> list[str]:
    return sorted(__all__)
