"""Exact answers to four questions about a scene: containment, collision, segment clipping, polygon clipping."""

from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.convex import Convex
from engine.solids.csg import Csg
from engine.solids.half_space import HalfSpace
from engine.solids.implicit import Implicit
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.solids.surface import Surface
from engine.solids.triangle import Triangle
from engine.version import __version__

__all__ = [
    "Aabb",
    "Convex",
    "Csg",
    "HalfSpace",
    "Implicit",
    "Polygon",
    "Polyhedron",
    "Pose",
    "Solid",
    "Sphere",
    "Surface",
    "Triangle",
    "__version__",
]
