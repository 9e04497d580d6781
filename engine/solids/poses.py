"""Poses from what people hold, and many poses of one dimension as two arrays."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Iterator
from typing import Any, ClassVar, overload

import numpy as np

from engine.errors import EngineError, InvalidArrayError, WrongDimensionError
from engine.running.budget import polled
from engine.solids.base import Immutable
from engine.solids.checks import as_floats, check_dimension, frozen, shown, spell
from engine.solids.pose import Pose, checked_tolerance, rounded_tolerance
from engine.solids.rotations import check_rotations
from engine.types import FloatArray


class Poses(Immutable):
    """Rigid motions of one dimension, checked once: taken wherever many poses are.

    Parameters
    ----------
    rotations : array_like, shape (n, d, d)
        Row-major. Without translations: a list of poses, each as any argument that is a pose, or matrices of
        homogeneous coordinates (n, d + 1, d + 1).
    translations : array_like, shape (n, d), optional
        Added after the rotations.
    tolerance, rounded
        As for `Pose`, of each rotation.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError, NotRigidError
        The message names the pose.

    Notes
    -----
    A sequence of `Pose`: it is iterated, indexed and sliced. Immutable, picklable, compared by value.

    Examples
    --------
    >>> from engine import Poses
    >>> slide = Poses([np.eye(4), [[1, 0, 0, 2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]])
    >>> slide, slide[1].translation.tolist()
    (<Poses: 2 in 3D>, [2.0, 0.0, 0.0])
    """

    __slots__ = ("rotations", "translations")

    type: ClassVar[str] = "poses"
    rotations: FloatArray
    """``(n, d, d)``, read-only."""
    translations: FloatArray
    """``(n, d)``, read-only."""

    def __init__(
        self, rotations: Any, translations: object = None, *, tolerance: float = 1e-12, rounded: bool = False
    ) -> None:
        if translations is None:
            if isinstance(rotations, np.ndarray) and rotations.ndim == 3 and rotations.shape[1] > 2:
                turns, moves = as_pose_arrays(rotations, rotations.shape[1] - 1)
            else:
                turns, moves = as_pose_arrays(rotations, None)
        else:
            turns, moves = as_floats(rotations, 3, ("rotations",)), as_floats(translations, 2, ("translations",))
        tolerance = rounded_tolerance(rounded, checked_tolerance(tolerance))
        turns, moves = check_pose_arrays(turns, moves, None, tolerance)
        object.__setattr__(self, "rotations", frozen(turns))
        object.__setattr__(self, "translations", frozen(moves))

    @classmethod
    def _each(cls, make: Callable[..., Pose], name: str, items: Any, translations: Any) -> Poses:
        """Return one pose an item, with its row of translations if there are any."""
        made = []
        moves = None if translations is None else as_floats(translations, 2, ("translations",))
        if moves is not None and len(moves) != len(items):
            raise InvalidArrayError(
                f"{name} and translations must be equally many, got {len(items)} and {len(moves)}", ("translations",)
            )
        for number, item in enumerate(polled(items)):
            try:
                made.append(make(item) if moves is None else make(item, moves[number]))
            except EngineError as error:
                raise error.at(name, number) from None
        return cls(made)

    @classmethod
    def from_quaternions(cls, wxyz: object = None, translations: object = None, *, xyzw: object = None) -> Poses:
        """Return the poses of quaternions and translations; 3D.

        Parameters
        ----------
        wxyz : array_like, shape (n, 4)
            As for `Pose.from_quaternion`.
        translations : array_like, shape (n, 3), optional
            Added after the rotations.
        xyzw : array_like, shape (n, 4), optional
            In place of `wxyz`, in the order of scipy and ROS.

        Returns
        -------
        Poses
            One a row.
        """
        if (wxyz is None) == (xyzw is None):
            raise InvalidArrayError("give quaternions as wxyz or as xyzw", ("quaternions",))
        rows = as_floats(xyzw if wxyz is None else wxyz, 2, ("quaternions",))
        if len(rows) and wxyz is None:
            rows = np.roll(rows, 1, axis=1)
        return cls._each(Pose.from_quaternion, "quaternions", rows, translations)

    @classmethod
    def from_axis_angle(cls, axes: object, angles: object, translations: object = None) -> Poses:
        """Return the poses of turns about axes through the origin, and translations; 3D.

        Parameters
        ----------
        axes : array_like, shape (n, 3)
            Of any length but 0.
        angles : array_like, shape (n,)
            In radians.
        translations : array_like, shape (n, 3), optional
            Added after the rotations.

        Returns
        -------
        Poses
            One a row, as `Pose.from_axis_angle` has it.
        """
        rows, turns = as_floats(axes, 2, ("axes",)), as_floats(angles, 1, ("angles",))
        if len(rows) != len(turns):
            raise InvalidArrayError(
                f"axes and angles must be equally many, got {len(rows)} and {len(turns)}", ("angles",)
            )

        def make(item: tuple[FloatArray, float], *moved: FloatArray) -> Pose:
            return Pose.from_axis_angle(*item, *moved)

        return cls._each(make, "axes", list(zip(rows, turns.tolist())), translations)

    @classmethod
    def from_rpy(cls, rpy: object, translations: object = None) -> Poses:
        """Return the poses of roll, pitch and yaw, as URDF and ROS have them, and translations; 3D.

        Parameters
        ----------
        rpy : array_like, shape (n, 3)
            Angles in radians, as for `Pose.from_rpy`.
        translations : array_like, shape (n, 3), optional
            Added after the rotations.

        Returns
        -------
        Poses
            One a row.
        """
        return cls._each(Pose.from_rpy, "rpy", as_floats(rpy, 2, ("rpy",)), translations)

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return int(self.translations.shape[1])

    def __len__(self) -> int:
        return len(self.translations)

    def __iter__(self) -> Iterator[Pose]:
        return map(Pose.of_checked, self.rotations, self.translations)

    @overload
    def __getitem__(self, index: int) -> Pose: ...
    @overload
    def __getitem__(self, index: slice) -> Poses: ...
    def __getitem__(self, index: int | slice) -> Pose | Poses:
        if not isinstance(index, slice):
            k = operator.index(index)
            return Pose.of_checked(self.rotations[k], self.translations[k])
        some = object.__new__(Poses)
        object.__setattr__(some, "rotations", frozen(self.rotations[index]))
        object.__setattr__(some, "translations", frozen(self.translations[index]))
        return some

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Poses):
            return NotImplemented
        return np.array_equal(self.rotations, other.rotations) and np.array_equal(self.translations, other.translations)

    def __hash__(self) -> int:
        return hash((self.rotations.tobytes(), self.translations.tobytes()))

    def __reduce__(self) -> tuple[Any, ...]:
        return Poses, (self.rotations, self.translations)

    def __repr__(self) -> str:
        return f"<Poses: {len(self):,} in {self.dimension}D>"


def as_pose(value: object, dimension: int | None, *where: str | int) -> Pose:
    """Return a pose as it is, and a matrix, a pair (rotation, translation) or a rotation of scipy as one.

    dimension: of the body that is moved, None for any. where: the path of the argument, for errors. Raises:
    InvalidArrayError for anything else, and as `Pose`.
    """
    if isinstance(value, Pose):
        return value
    given: Any = value
    try:
        if hasattr(given, "as_matrix"):
            matrix = np.asarray(given.as_matrix())
            return Pose.from_matrix(matrix) if matrix.shape == (4, 4) else Pose(matrix, np.zeros(len(matrix)))
        if isinstance(given, (list, tuple)) and len(given) == 2 and axes_of(given[0]) == 2:
            return Pose(*given)
        if axes_of(given) == 2 and len(given) == (len(given[0]) if dimension is None else dimension + 1):
            return Pose.from_matrix(given)
    except EngineError as error:
        raise error.at(*where) from None
    except Exception as error:  # a caller's as_matrix
        raise InvalidArrayError(
            f"{spell(where)} gives no matrix: {type(error).__name__}: {error!s:.100}", where
        ) from error
    size = "4, 4" if dimension is None else f"{dimension + 1}, {dimension + 1}"
    raise InvalidArrayError(
        f"{spell(where)} must be a Pose, a matrix ({size}) or (rotation, translation), got {shown(value)}", where
    )


def as_pose_arrays(poses: Any, dimension: int | None) -> tuple[FloatArray, FloatArray]:
    """Return rotations (n, d, d) and translations (n, d) of poses: `Poses`, a list of them, or matrices (n, d + 1,
    d + 1). dimension: None for that of the first."""
    if isinstance(poses, Poses) and dimension in (None, poses.dimension):
        return poses.rotations, poses.translations
    if dimension is not None and isinstance(poses, np.ndarray) and poses.shape[1:] == (dimension + 1, dimension + 1):
        last = np.append(np.zeros(dimension), 1.0)
        if len(odd := np.flatnonzero((poses[:, -1] != last).any(axis=1))):
            as_pose(poses[odd[0]], dimension, "poses", int(odd[0]))  # says what is wrong
        return poses[:, :-1, :-1], poses[:, :-1, -1]
    if not isinstance(poses, Iterable) or isinstance(poses, (str, bytes)):
        raise InvalidArrayError(
            f"poses must be a list of poses or an array of matrices, got {shown(poses)}", ("poses",)
        )
    try:
        items = list(poses)
    except Exception as error:  # a single rotation of scipy, a caller's generator
        raise InvalidArrayError(
            f"poses cannot be listed: {type(error).__name__}: {error!s:.100}", ("poses",)
        ) from error
    made = [as_pose(each, dimension, "poses", number) for number, each in enumerate(polled(items))]
    size = dimension or (made[0].dimension if made else 3)
    for number, each in enumerate(made):
        if each.dimension != size:
            what = "the solid it moves has" if dimension is not None else "poses[0] has"
            raise WrongDimensionError(
                f"poses[{number}] has dimension {each.dimension}, {what} {size}", ("poses", number)
            )
    turns = np.array([each.rotation for each in made]).reshape(-1, size, size)
    return turns, np.array([each.translation for each in made]).reshape(-1, size)


def check_pose_arrays(
    turns: FloatArray, moves: FloatArray, dimension: int | None, tolerance: float = 1e-12, workers: int | None = 1
) -> tuple[FloatArray, FloatArray]:
    """Return rotations (n, d, d) and translations (n, d) of finite doubles after all other checks, those farther from
    a rotation than 1e-12 replaced by the nearest ones. dimension: None for that of the rotations."""
    size = dimension or (turns.shape[1] if len(turns) or turns.shape[1:] == (2, 2) else 3)
    if dimension is None:
        check_dimension(size, None, ("rotations",))
    if len(turns) and turns.shape[1:] != (size, size):
        raise WrongDimensionError(f"rotations must have shape (n, {size}, {size}), got {turns.shape}", ("rotations",))
    if len(moves) and moves.shape[1] != size:
        raise WrongDimensionError(f"translations must have shape (n, {size}), got {moves.shape}", ("translations",))
    if len(turns) != len(moves):
        raise InvalidArrayError(
            f"rotations and translations must be equally many, got {len(turns)} and {len(moves)}", ("translations",)
        )
    if tolerance != 1e-12:
        made = []
        for number, turn in enumerate(polled(turns)):
            try:
                made.append(Pose(turn, tolerance=tolerance).rotation)
            except EngineError as error:
                error.where = ("rotations", number, *error.where[1:])
                raise
        return np.array(made).reshape(-1, size, size), moves
    if len(turns):
        check_rotations(turns, workers=workers)
    else:
        turns, moves = np.zeros((0, size, size)), np.zeros((0, size))
    return turns, moves


def axes_of(value: Any) -> int:
    """Return how many axes an array has, or lists within lists as their first items have; 0 for anything else."""
    if isinstance(value, np.ndarray):
        return value.ndim
    axes = 0
    while isinstance(value, (list, tuple, np.ndarray)) and axes < 4:
        if isinstance(value, np.ndarray):
            return axes + value.ndim
        axes += 1
        if not value:
            break
        value = value[0]
    return axes
