"""Every error the engine raises.

    EngineError
    ├── InvalidInputError (also a ValueError)
    │   ├── InvalidArrayError         invalid_array            wrong type or shape
    │   ├── WrongDimensionError       wrong_dimension          2D and 3D mixed, or a dimension the operation lacks
    │   ├── NotFiniteError            not_finite               NaN or infinity
    │   ├── EmptyGeometryError        empty_geometry           nothing to work on
    │   ├── IndexOutOfRangeError      index_out_of_range       a face names a vertex that is not there
    │   ├── RepeatedIndexError        repeated_index           a face names one vertex twice
    │   ├── NotClosedError            not_closed               an edge has a face on one side only
    │   ├── InconsistentOrientationError inconsistent_orientation  an edge is used unequally in its two directions
    │   ├── FaceNotSimpleError        face_not_simple          a polygonal face cannot be cut into triangles
    │   ├── RingTooShortError         ring_too_short           a ring or face of too few vertices
    │   ├── MinAboveMaxError          min_above_max            a box with min > max on an axis
    │   ├── NegativeRadiusError       negative_radius
    │   ├── ZeroNormalError           zero_normal              a plane without direction
    │   ├── InvalidPolynomialError    invalid_polynomial       powers or degree out of bounds
    │   ├── InvalidOperationError     invalid_operation        an unknown Boolean or output mode
    │   ├── NotRigidError             not_rigid                a pose that is no rotation
    │   └── TooDeepError              too_deep                 a CSG tree deeper than the limit
    ├── UnsupportedSolidError         unsupported_solid        this operation does not take this solid
    ├── UnsupportedPairError          unsupported_pair         collision of these two is not defined
    ├── NotRepresentableError         not_representable        the exact result is no float64
    ├── TooComplexError               too_complex              a stated cap on exact work was reached
    ├── DeadlineExceededError         deadline_exceeded        (also a TimeoutError)
    └── CancelledError                cancelled

`code` is stable and part of the API. `where` is the path to the element that broke the rule, relative to the argument
named first, for example ``("solid", "faces", 3)``. The message alone is enough to reproduce the problem.
"""

from __future__ import annotations

import re
from typing import ClassVar


class EngineError(Exception):
    """Base of every error the engine raises on purpose."""

    code: ClassVar[str] = "engine_error"

    def __init_subclass__(cls) -> None:
        """Set `code` to the class's name in snake case, without "Error": `NotClosedError` has ``not_closed``."""
        cls.code = re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__.removesuffix("Error")).lower()

    def __init__(self, message: str, where: tuple[str | int, ...] = ()) -> None:
        super().__init__(message)
        self.message = message
        self.where = tuple(where)

    def at(self, *prefix: str | int) -> EngineError:
        """Return this error with `prefix` put before its path, for the caller that knows the outer name."""
        self.where = (*prefix, *self.where)
        return self

    def __reduce__(self) -> tuple[type[EngineError], tuple[str, tuple[str | int, ...]]]:
        return type(self), (self.message, self.where)


class InvalidInputError(EngineError, ValueError):
    """An argument breaks an invariant; `where` names the element."""


class InvalidArrayError(InvalidInputError):
    """Wrong type or shape."""


class WrongDimensionError(InvalidInputError):
    """2D and 3D mixed, or a dimension the operation does not have."""


class NotFiniteError(InvalidInputError):
    """NaN or infinity."""


class EmptyGeometryError(InvalidInputError):
    """A solid without vertices, faces, planes, rings, terms or operands."""


class IndexOutOfRangeError(InvalidInputError):
    """A face names a vertex that is not there."""


class RepeatedIndexError(InvalidInputError):
    """A face names one vertex twice."""


class NotClosedError(InvalidInputError):
    """An edge has a face on one side only."""


class InconsistentOrientationError(InvalidInputError):
    """An edge is not used equally often in both directions."""


class FaceNotSimpleError(InvalidInputError):
    """A polygonal face has no triangulation by the stated rule."""


class RingTooShortError(InvalidInputError):
    """A ring of fewer than three vertices."""


class MinAboveMaxError(InvalidInputError):
    """A box with min > max on an axis."""


class NegativeRadiusError(InvalidInputError):
    """A sphere with a negative radius."""


class ZeroNormalError(InvalidInputError):
    """A plane whose normal is zero."""


class InvalidPolynomialError(InvalidInputError):
    """Powers, degree or number of terms out of bounds."""


class InvalidOperationError(InvalidInputError):
    """An unknown Boolean operation or output mode."""


class NotRigidError(InvalidInputError):
    """A pose whose matrix is no rotation."""


class TooDeepError(InvalidInputError):
    """A CSG tree deeper than the limit."""


class UnsupportedSolidError(EngineError):
    """This operation does not take this solid; the message names those it takes."""


class UnsupportedPairError(EngineError):
    """Collision of these two is not defined; the message names what is."""


class NotRepresentableError(EngineError):
    """The exact result is no float64."""


class TooComplexError(EngineError):
    """A stated cap on exact work was reached."""


class DeadlineExceededError(EngineError, TimeoutError):
    """The call ran past its deadline; there is no partial answer."""


class CancelledError(EngineError):
    """The caller gave up on the call."""
