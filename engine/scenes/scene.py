"""Public: a stored scene, whose structures are prepared once and serve every query."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Final, Literal, Unpack, cast, overload

import numpy as np

from engine.collision.codes import TOUCHING, UNSETTLED
from engine.collision.collide import posed
from engine.distance.clearance import checked_distance
from engine.errors import EngineError, IndexOutOfRangeError, InvalidArrayError, InvalidOperationError
from engine.running.budget import Budget, Cancel
from engine.running.parallel import Options, Progress, check_options, is_unlimited
from engine.scenes.bodies import Bodies, checked_bodies
from engine.scenes.clip import Counts, clip_all, clip_first, clip_small_batch, firsts_for, meets_any
from engine.scenes.collide_scene import PairQuery, ScenePairs, collide_bodies, pair_keys
from engine.scenes.ends import ScenePieces
from engine.scenes.hits import hits
from engine.scenes.placements import Placements
from engine.scenes.point_queries import PointQueries
from engine.solids.accepted import PosesLike, SolidsLike
from engine.solids.base import Solid, _collect_arrays
from engine.solids.checks import as_point_groups, check_finite, shown
from engine.solids.pose import Pose
from engine.solids.ragged import are_among
from engine.types import Accuracy, BoolArray, FloatArray

_BYTES_OF_POSE: Final = 1000
Keep = Literal["all", "first", "any"]


class Scene(PointQueries):
    """Many bodies, queried repeatedly: which contain a point, which collide, what of a segment lies in which.

    Parameters
    ----------
    solids : sequence of Solid
        Of one dimension, the same object wherever it is the same solid; each query accepts the types that it accepts
        elsewhere. May be empty.
    poses : sequence of Pose or None, optional
        One for each body; the exact image is meant.

    Raises
    ------
    InvalidArrayError, WrongDimensionError
        The message names the body.

    Notes
    -----
    What a query needs of all bodies (boxes, trees over them, tables of solids by kind) is prepared by the first and
    cached; structures of single solids are cached with these. Immutable, picklable (without the caches), safe to share
    between threads. For one query about bodies that are used once, `locate_scene` and `collide_scene` give the same
    answers.

    Examples
    --------
    >>> from engine import Aabb, Pose
    >>> box, turn = Aabb([0, 0], [1, 1]), [[1, 0], [0, 1]]
    >>> scene = Scene([box, box], [None, Pose(turn, [3, 0])])
    >>> len(scene.collide().first), len(scene.moved({1: Pose(turn, [1, 0])}).collide(moved=[1]).first)
    (0, 1)
    """

    __slots__ = ()

    type: ClassVar[str] = "scene"
    hits = hits

    def __init__(self, solids: SolidsLike, poses: PosesLike | None = None) -> None:
        super().__init__(Placements(Bodies(*checked_bodies(solids, poses)), {}))

    def __len__(self) -> int:
        return len(self.solids)

    def __reduce__(self) -> tuple[Any, ...]:
        return Scene, (self.solids, self.poses)

    def __repr__(self) -> str:
        return f"Scene({len(self)} bodies)"

    @property
    def solids(self) -> tuple[Solid, ...]:
        """The solid of each body."""
        return self._placements.base.solids

    @property
    def poses(self) -> tuple[Pose | None, ...]:
        """The pose of each body, None for one that stands where its solid does."""
        return self._placements.poses

    @property
    def bounds(self) -> FloatArray | None:
        """``(2, dimension)`` low and high of a box that holds all bodies, rounded outward; infinite where they may have
        no bounds. None where there are no bodies."""
        if not len(self):
            return None
        boxes = self._placements.boxes(Budget())
        return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    @property
    def memory(self) -> int:
        """Bytes of all arrays held, of the solids and of what is prepared too, shared ones once."""
        sizes: dict[int, int] = {}
        _collect_arrays((self.solids, *self._placements.all_cached), sizes, set())
        return sum(sizes.values()) + _BYTES_OF_POSE * sum(pose is not None for pose in self.poses)

    def moved(self, poses: Mapping[int, Pose | None]) -> Scene:
        """Return the scene with some bodies under other poses; what is prepared of the others is shared.

        Parameters
        ----------
        poses : mapping of int to Pose or None
            The new pose of each body that moves, None to put it where its solid is.

        Returns
        -------
        Scene
            This one is unchanged.

        Raises
        ------
        IndexOutOfRangeError, InvalidArrayError, WrongDimensionError
            For a body that does not exist, or a wrong pose.

        Notes
        -----
        Cost: grows with the bodies that moved since all were prepared together; where these are more than a quarter,
        and more than 64, all are prepared again.
        """
        if not isinstance(poses, Mapping):
            raise InvalidArrayError(f"poses must be a dict of poses by body, got {type(poses).__name__}", ("poses",))
        solids = self.solids
        bodies = self._named(list(poses), "poses")
        given = {body: poses[body] for body in bodies}
        for body, pose in given.items():
            if type(pose) is not Pose or len(pose.translation) != solids[0].dimension:
                given[body] = posed(pose, solids[body], "poses", body)
        scene = object.__new__(Scene)
        PointQueries.__init__(scene, self._placements.after(given))
        return scene

    def collide(
        self,
        *,
        moved: Sequence[int] | None = None,
        skip: object = None,
        only: object = None,
        gap: float | None = None,
        witnesses: bool = False,
        boolean: bool = False,
        detail: bool = False,
        workers: int | None = None,
        deadline: float | None = None,
        cancel: Cancel | None = None,
        progress: Progress | None = None,
        report: bool = False,
    ) -> ScenePairs | tuple[ScenePairs, Accuracy]:
        """Find every pair of bodies with a common point; as `collide_scene`, with what is prepared cached.

        Parameters
        ----------
        moved : sequence of int, optional
            Only pairs with one of these bodies are tested. After ``scene.moved(poses)`` the colliding pairs are those
            of the scene before without a body of `poses`, and these.
        skip, only, gap, witnesses, boolean, detail, workers, deadline, cancel, progress, report
            As for `collide_scene`.

        Returns
        -------
        ScenePairs
            With ``report=True`` a pair of it and an `Accuracy`.

        Raises
        ------
        IndexOutOfRangeError
            For a body that does not exist.
        EngineError
            As `collide_scene`.
        """
        check_options(workers, progress, report=report, witnesses=witnesses, boolean=boolean, detail=detail)
        query = PairQuery(skip, only, gap, witnesses, boolean, detail)
        with Budget(deadline, cancel, workers) as budget:
            if moved is None or not len(self):
                self._named([] if moved is None else moved, "moved")
                pairs = collide_bodies(self._placements.whole().batches(budget), query, budget, workers, progress)
            else:
                pairs = self._collide_some(self._named(moved, "moved"), query, budget, workers, progress)
        return pairs if report else pairs[0]

    def _collide_some(
        self, named: list[int], query: PairQuery, budget: Budget, workers: int | None, progress: Progress | None
    ) -> tuple[ScenePairs, Accuracy]:
        """Return the pairs of a named body and any other; convex bodies in one batch, other pairs as a scene of their
        own."""
        standing, n = self._placements, len(self)
        reach = 0.0 if query.gap is None else checked_distance(query.gap, "gap")
        keys, relations = standing.pairs_with(np.array(named, np.int64), reach, bool(query.boolean), budget)
        is_plain = not (query.witnesses or query.detail) and query.gap is query.only is query.skip is None
        if is_plain and not (relations == UNSETTLED).any():
            met = np.flatnonzero(relations)
            order = met[np.argsort(keys[met])]
            first, second = np.divmod(keys[order], n)
            relations = np.full(len(met), TOUCHING, np.int8) if query.boolean else relations[order]
            return ScenePairs(first, second, relations), Accuracy("exact", None, len(keys), 0, 0, "named pairs")
        if query.only is not None:
            keys = keys[are_among(keys, pair_keys(query.only, n, "only", budget))]
        if query.skip is not None:
            keys = keys[~are_among(keys, pair_keys(query.skip, n, "skip", budget))]
        pairs = np.stack(np.divmod(keys, n), axis=1)
        bodies, local = np.unique(pairs, return_inverse=True)
        query = query._replace(skip=None, only=local.reshape(-1, 2))
        some = standing.base.batches(budget).under(bodies, [standing.pose(body) for body in bodies.tolist()])
        try:
            result, accuracy = collide_bodies(some, query, budget, workers, progress)
        except EngineError as error:
            raise _renamed(error, bodies.tolist()) from None
        return replace(result, first=bodies[result.first], second=bodies[result.second]), accuracy

    @overload
    def clip_segments(
        self,
        segments: object,
        *,
        keep: Literal["all", "first"] = "all",
        report: Literal[False] = False,
        **options: Unpack[Options],
    ) -> ScenePieces: ...
    @overload
    def clip_segments(
        self, segments: object, *, keep: Literal["any"], report: Literal[False] = False, **options: Unpack[Options]
    ) -> BoolArray: ...
    @overload
    def clip_segments(
        self, segments: object, *, keep: Keep = "all", report: Literal[True], **options: Unpack[Options]
    ) -> tuple[ScenePieces | BoolArray, Accuracy]: ...
    def clip_segments(
        self,
        segments: object,
        *,
        keep: Keep = "all",
        workers: int | None = None,
        deadline: float | None = None,
        cancel: Cancel | None = None,
        progress: Progress | None = None,
        report: bool = False,
    ) -> ScenePieces | BoolArray | tuple[ScenePieces | BoolArray, Accuracy]:
        """Return the pieces of segments within each body, in order along each segment.

        Parameters
        ----------
        segments : array_like, shape (n, 2, dim)
            May be empty.
        keep : {"all", "first", "any"}
            "first": of each segment the piece that begins first, of those that begin at one point that of the first
            body (picking). "any": whether it meets a body at all (line of sight). These two stop as soon as the answer
            is certain.
        workers, deadline, cancel, progress, report
            As for `engine.locate`; progress counts segments.

        Returns
        -------
        ScenePieces
            With "any" an ndarray of bool, shape (n,); with ``report=True`` a pair of the answer and an `Accuracy`.

        Raises
        ------
        UnsupportedSolidError, InvalidOperationError
            An implicit solid; an unknown `keep`.
        EngineError
            As `clip_segments`.

        Notes
        -----
        Bodies: what `clip_segments` accepts, and triangle (of the plane; in space the prism over it), surface, and csg
        of all these. On a surface, which contains nothing, pieces are the points where it is crossed (t0 = t1), or
        stretches that lie in it. Within a csg pieces are those of its closed set, joined where operands meet; faces are
        counted through its distinct leaves, operands first, a leaf's own behind those of all before it.

        Boundary, degenerate input, accuracy: as `clip_segments`; t and coordinates are the nearest doubles to those of
        the exact image of each body. Ends that round to one double are ordered by exact arithmetic, roots of spheres
        included.

        Cost: a tree over the boxes of the bodies gives each segment's candidates; each body cuts those that may meet
        it, in its own frame where it is posed. CSG trees and prisms cost some 0.1 ms for each segment near them.

        Examples
        --------
        >>> from engine import Aabb, Sphere
        >>> scene = Scene([Sphere([5, 0], 1), Aabb([1, -1], [2, 1])])
        >>> pieces = scene.clip_segments([[[0, 0], [8, 0]]])
        >>> pieces.body.tolist(), pieces.t.tolist()
        ([1, 0], [[0.125, 0.25], [0.5, 0.75]])
        """
        if report is False and is_unlimited(workers, deadline, cancel, progress):
            few = clip_small_batch(segments, self._placements, keep)
            if few is not None:
                return few
        check_options(workers, progress, report=report)
        if not isinstance(keep, str) or keep not in ("all", "first", "any"):
            raise InvalidOperationError(f"keep must be all, first or any, got {shown(keep)}", ("keep",))
        dimension, where = self.solids[0].dimension if len(self) else None, ("segments",)
        array = as_point_groups(segments, 2, dimension, where, must_be_finite=False)
        n = len(array)
        counts = Counts(n)
        with Budget(deadline, cancel, workers) as budget:
            check_finite(array, where, budget, workers)
            self._placements.base.check_cut(budget)
            result: ScenePieces | BoolArray
            if not len(self):
                result = np.zeros(n, np.bool_) if keep == "any" else ScenePieces(*firsts_for(0, array.shape[2]))
            else:
                cut: Any = {"all": clip_all, "first": clip_first, "any": meets_any}[keep]
                result = cut(array, self._placements, counts, budget, workers)
            budget.check()
        if progress is not None and n:
            progress(n)
        if not report:
            return result
        n_beyond, n_rational = int(counts.is_beyond.sum()), int(counts.is_rational.sum())
        return result, Accuracy("exact", 0.5, n, n_beyond, n_rational, "body_boxes")

    def _named(self, bodies: object, name: str) -> list[int]:
        """Return the indices of the caller's bodies, each once, ascending. name: of the argument, for errors. Raises:
        IndexOutOfRangeError, InvalidArrayError."""
        if not isinstance(bodies, (list, tuple, set, frozenset, np.ndarray)) or getattr(bodies, "ndim", 1) != 1:
            raise InvalidArrayError(f"{name} must be a list of bodies, got {type(bodies).__name__}", (name,))
        if type(bodies) is list and set(map(type, bodies)) == {int}:
            ascending = sorted(set(bodies))
            if ascending[0] >= 0 and ascending[-1] < len(self):
                return ascending
        indices, n = set(), len(self)
        for place, body in enumerate(bodies):
            if isinstance(body, (bool, np.bool_)) or not isinstance(body, (int, np.integer)):
                raise InvalidArrayError(f"{name} names bodies by index, got {type(body).__name__}", (name, place))
            if not 0 <= body < n:
                message = f"{name} names body {shown(body)}, which is not there; the scene has {n}"
                raise IndexOutOfRangeError(message, (name, place))
            indices.add(int(body))
        return sorted(indices)


def _renamed(error: EngineError, bodies: list[int]) -> EngineError:
    """Return an error about a subset of bodies with their indices in the scene instead."""
    if len(error.where) > 1 and error.where[0] == "solids":
        place = cast(int, error.where[1])
        message = error.message.replace(f"solids[{place}]", f"solids[{bodies[place]}]")
        return type(error)(message, ("solids", bodies[place], *error.where[2:]))
    return error
