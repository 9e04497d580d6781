"""Public: which of many solids hold each of many points."""

from __future__ import annotations

from typing import Literal, Unpack, overload

from engine.running.budget import Cancel, reading
from engine.running.parallel import Options, Progress
from engine.scenes.locate import SceneLocations
from engine.scenes.scene import Scene
from engine.solids.accepted import PointsLike, PosesLike, SolidsLike
from engine.types import Accuracy


@overload
def locate_scene(
    points: PointsLike,
    solids: SolidsLike,
    poses: PosesLike | None = None,
    *,
    report: Literal[False] = False,
    **options: Unpack[Options],
) -> SceneLocations: ...
@overload
def locate_scene(
    points: PointsLike,
    solids: SolidsLike,
    poses: PosesLike | None = None,
    *,
    report: Literal[True],
    **options: Unpack[Options],
) -> tuple[SceneLocations, Accuracy]: ...
def locate_scene(
    points: PointsLike,
    solids: SolidsLike,
    poses: PosesLike | None = None,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> SceneLocations | tuple[SceneLocations, Accuracy]:
    """Find for each point the bodies that contain it, inside or on the boundary.

    Parameters
    ----------
    points : array_like, shape (n_points, dimension)
        Borrowed, and may be empty.
    solids : sequence of Solid
        Any type but surfaces, all of the points' dimension; one object may stand for many bodies.
    poses : sequence of Pose or None, optional
        One for each solid, None for a body that stands where its solid does.
    workers, deadline, cancel, progress, report
        As for `locate`; progress counts points.

    Returns
    -------
    SceneLocations
        With ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError, UnsupportedSolidError
        For arguments that break a rule; the message names the body or point.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    Boundary: a point on a wall that two bodies share is on both.

    Degenerate input: no points and no solids are accepted; solids as in `locate`.

    Accuracy: exact, also for posed solids: a body is the exact image R p + t under the matrix as given, not under a
    nearby rotation; a sphere keeps its radius about the exact image of its centre.

    Cost: bodies whose boxes contain the points; bodies without bounds (half_space, convex, implicit, the prism over a
    triangle of space) are tested for every point. The same as `Scene.locate` of a scene made for this call; for one
    solid use `locate`.

    References
    ----------
    Ericson, Real-Time Collision Detection, 2005, chapter 6 (trees over boxes).

    Examples
    --------
    >>> from engine import Aabb, Pose, locate_scene
    >>> box = Aabb([0, 0], [1, 1])
    >>> held = locate_scene([[0.5, 0.5], [1, 0.5], [9, 9]], [box, box], [None, Pose([[1, 0], [0, 1]], [1, 0])])
    >>> held.offsets.tolist(), held.indices.tolist(), held.on_boundary.tolist()
    ([0, 1, 3, 3], [0, 0, 1], [False, True, True])
    """
    with reading(deadline, cancel) as reader:
        scene = Scene(solids, poses)
    options = {"workers": workers, "deadline": reader.left(), "cancel": cancel, "progress": progress}
    return scene.locate(points, report=report, **options)  # type: ignore[arg-type]
