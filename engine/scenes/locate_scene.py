"""Public: which of many solids hold each of many points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Unpack, overload

from engine.running.budget import Cancel
from engine.running.parallel import Options, Progress
from engine.scenes.locate import SceneLocations
from engine.scenes.scene import Scene
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.types import Accuracy


@overload
def locate_scene(
    points: object,
    solids: Sequence[Solid],
    poses: Sequence[Pose | None] | None = None,
    *,
    report: Literal[False] = False,
    **options: Unpack[Options],
) -> SceneLocations: ...
@overload
def locate_scene(
    points: object,
    solids: Sequence[Solid],
    poses: Sequence[Pose | None] | None = None,
    *,
    report: Literal[True],
    **options: Unpack[Options],
) -> tuple[SceneLocations, Accuracy]: ...
def locate_scene(
    points: object,
    solids: Sequence[Solid],
    poses: Sequence[Pose | None] | None = None,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> SceneLocations | tuple[SceneLocations, Accuracy]:
    """Find for each point the solids that hold it, inside or on the boundary.

    It is `Scene.locate` of a scene made for this question alone. For one solid use `locate`.

    Parameters
        points: ``(n_points, dimension)`` numbers; borrowed.
        solids: any but surfaces, all of the points' dimension; the same object may stand for many bodies.
        poses: one `Pose` or None for each solid. A posed solid is the exact image of the solid under R p + t; a sphere
            keeps its radius about the exact image of its centre.
        workers, deadline, cancel, progress, report: as in `locate`; progress counts points.
    Returns
        `SceneLocations`; with report=True a pair of it and an `Accuracy`.
    Boundary: a point on a wall that two bodies share is on both.
    Degenerate input: no points and no solids are welcome; solids as in `locate`.
    Accuracy: exact, also for posed solids: the image of the matrix as given is meant, not that of a nearby rotation.
    Cost: bodies whose boxes hold the points; bodies without bounds (half_space, convex, implicit, the prism over a
        triangle of space) are asked about every point.
    Raises: InvalidArrayError, WrongDimensionError, NotFiniteError, UnsupportedSolidError, DeadlineExceededError,
        CancelledError.

    >>> from engine import Aabb, Pose, locate_scene
    >>> box = Aabb([0, 0], [1, 1])
    >>> held = locate_scene([[0.5, 0.5], [1, 0.5], [9, 9]], [box, box], [None, Pose([[1, 0], [0, 1]], [1, 0])])
    >>> held.offsets.tolist(), held.indices.tolist(), held.on_boundary.tolist()
    ([0, 1, 3, 3], [0, 0, 1], [False, True, True])
    """
    options = {"workers": workers, "deadline": deadline, "cancel": cancel, "progress": progress}
    return Scene(solids, poses).locate(points, report=report, **options)  # type: ignore[arg-type]
