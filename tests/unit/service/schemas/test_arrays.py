"""The array type: what it takes, what it refuses and where it says the fault is, its JSON schema."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from engine import DeadlineExceededError
from service.schemas import arrays
from service.schemas.arrays import DIMENSION, POINTS, Array, Axis, Numbers
from service.schemas.solids import Faces
from service.settings import Settings
from service.store import Store
from service.work import Call, Memory

POSITIONS: TypeAdapter[Any] = TypeAdapter(Annotated[Array, Numbers(POINTS, DIMENSION)])
NUMBER: TypeAdapter[Any] = TypeAdapter(Annotated[float, Numbers()])
FACES: TypeAdapter[Any] = TypeAdapter(Faces)
CALL = Call(Settings(max_points=5, max_faces=5, deadline_seconds=86_400), Store(1), Memory(1))


def faults(adapter: TypeAdapter[Any], value: object) -> list[tuple[tuple[int, ...], str]]:
    with pytest.raises(ValidationError) as caught:
        adapter.validate_python(value, context=CALL)
    (error,) = caught.value.errors()
    return [(fault.path, fault.code) for fault in error["ctx"]["faults"]]


def test_lists_become_one_contiguous_array() -> None:
    array = POSITIONS.validate_python([[1, 2.5, -0.0], [2**53, 1e300, 5e-324]], context=CALL)
    assert array.dtype == np.float64
    assert array.flags.c_contiguous
    assert array.tolist() == [[1.0, 2.5, 0.0], [2.0**53, 1e300, 5e-324]]
    assert POSITIONS.validate_python([], context=CALL).shape == (0, 2)
    assert NUMBER.validate_python(3, context=CALL) == 3.0
    huge = int(1.7e308)
    assert POSITIONS.validate_python([[huge, huge], [1.7e308, 1.7e308]], context=CALL).tolist() == [[1.7e308] * 2] * 2


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ([[1, "2"]], [((0, 1), "invalid_array")]),
        ([[1, True], [None, 2]], [((0, 1), "invalid_array"), ((1, 0), "invalid_array")]),
        ([[1, float("inf")]], [((0, 1), "not_finite")]),
        ([[float("nan"), 1]], [((0, 0), "not_finite")]),
        ([[1, 2**53 + 1]], [((0, 1), "invalid_array")]),
        ([[1, 10**400]], [((0, 1), "invalid_array")]),
        ([[1, 2], [1, 2, 3]], [((1,), "invalid_array")]),
        ([[1]], [((0,), "invalid_array")]),
        ([1, 2], [((0,), "invalid_array"), ((1,), "invalid_array")]),
        ([[[1, 2]]], [((0,), "invalid_array")]),
        ([[1, [2]]], [((0, 1), "invalid_array")]),
        ({"x": 1}, [((), "invalid_array")]),
        ("12", [((), "invalid_array")]),
        (None, [((), "invalid_array")]),
        ([[0, 0]] * 6, [((), "limit_exceeded")]),
        ([[0, 0]] * 4 + [[]], [((4,), "empty_geometry")]),
    ],
)
def test_each_fault_has_its_place(value: object, expected: list[tuple[tuple[int, ...], str]]) -> None:
    assert faults(POSITIONS, value) == expected


def test_at_most_twenty_faults_are_named() -> None:
    assert len(faults(TypeAdapter(Annotated[Array, Numbers(Axis(0, None))]), ["x"] * 100)) == 20


@pytest.mark.parametrize("value", ["1.5", True, None, [], [1], 1e400, 2**60 + 1])
def test_a_number_is_a_number(value: object) -> None:
    assert faults(NUMBER, value)[0][0] == ()


def test_faces_are_triangles_or_lists() -> None:
    triangles = FACES.validate_python([[0, 1, 2], [2, 1, 3]], context=CALL)
    assert (triangles.dtype, triangles.shape) == (np.int64, (2, 3))
    assert FACES.validate_python([[0, 1, 2], [2, 1, 3, 4]], context=CALL) == [[0, 1, 2], [2, 1, 3, 4]]
    assert faults(FACES, [[0, 1, 2.0]]) == [((0, 2), "invalid_array")]
    assert faults(FACES, [[0, 1, 2], [0, -1, 2]]) == [((1, 1), "index_out_of_range")]
    assert faults(FACES, [[0, 1, 2**63]]) == [((0, 2), "index_out_of_range")]
    assert faults(FACES, [[0, 1, 2], [0, 1]]) == [((1,), "invalid_array")]
    assert faults(FACES, [[0, 1, 2]] * 6) == [((), "limit_exceeded")]
    assert faults(FACES, []) == [((), "empty_geometry")]


def test_schema_is_an_array_of_arrays_of_doubles() -> None:
    assert POSITIONS.json_schema() == {
        "type": "array",
        "x-limit": "max_points",
        "items": {"type": "array", "minItems": 2, "maxItems": 3, "items": {"type": "number", "format": "double"}},
    }


def test_many_short_arrays_end_at_the_deadline() -> None:
    late = Call(Settings(deadline_seconds=1e-9), Store(1), Memory(1))
    with pytest.raises(DeadlineExceededError):
        POSITIONS.validate_python([[0, 0]], context=late)


def test_the_search_for_what_is_wrong_ends_at_the_deadline() -> None:
    class Ending:
        settings, left = Settings(), 100

        def remaining(self) -> None:
            self.left -= 1
            if not self.left:
                raise DeadlineExceededError("late")

    with pytest.raises(DeadlineExceededError):
        POSITIONS.validate_python([[0, 0]] * 200 + [[0, None]], context=Ending())


STEPPED: list[Any] = [
    [[1, 2]] * 7, [[1.5, 2]] * 5, [[1, 2, 3], *[[1, 2]] * 6], [*[[1, 2]] * 6, [1, 2, 3]], [*[[1, 2]] * 6, [1, True]],
    [*[[1, 2]] * 3, 7, [1, 2]], [[1, 2], *[[1, "2"]] * 4], [[0, 2**53 + 1]] * 5, [[0, 1e400]] * 5, [[]] * 5,
    [[1, 2]] * 9,
    [[1, 2, 3]] * 3 + [[4, 5, 6, 7]] * 3, [[1, 2, 3]] * 3 + [[4, 5]] * 3, [[1, 2, 3]] * 4 + [[-1, 0, 1]],
    [[1, 2, 3]] * 5 + [[1.5, 0, 1]], list(range(7)), [1] * 6 + [[1]],
]  # fmt: skip


@pytest.mark.parametrize("adapter", [POSITIONS, FACES, TypeAdapter(Annotated[Array, Numbers(Axis(3, 8))])])
def test_a_long_list_becomes_in_steps_what_it_becomes_at_once(
    adapter: TypeAdapter[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    call = Call(Settings(max_points=8, max_faces=8, deadline_seconds=86_400), Store(1), Memory(1))

    def made(value: Any) -> Any:
        try:
            found = adapter.validate_python(value, context=call)
        except ValidationError as error:
            return error.errors()[0]["ctx"]["faults"]
        return (found.dtype, found.tolist()) if isinstance(found, np.ndarray) else found

    for value in STEPPED:
        monkeypatch.setattr(arrays, "STEP", 2**11)
        whole = made(value)
        monkeypatch.setattr(arrays, "STEP", 2)
        assert made(value) == whole
