"""Numbers cross the wire unchanged, and what is no JSON is refused."""

from __future__ import annotations

import json
import random
import struct

import numpy as np
import pytest

from service import wire
from service.errors import ServiceError
from service.schemas.base import Accuracy
from service.schemas.points import ContainsResponse

HARD = [
    "2.2250738585072011e-308",  # hung PHP
    "2.2250738585072014e-308",
    "4.9406564584124654e-324",
    "2.4703282292062327e-324",  # just below half the least denormal
    "2.4703282292062328e-324",  # just above
    "1.7976931348623157e308",
    "1.7976931348623158e308",  # still rounds down to the largest double
    "9007199254740993.0",  # a tie between two doubles
    "9007199254740992.99999999999999999999999999",
    "9007199254740993.00000000000000000000000001",
    "0.1",
    "-0.0",
    "1e22",
    "1e23",
    "8.41e21",
    "0." + "0" * 400 + "1",
    "123456789" * 30 + ".5",
    "1.00000000000000011102230246251565404236316680908203125",  # a tie between 1 and the next double
    "1.00000000000000011102230246251565404236316680908203124",
    "1.00000000000000011102230246251565404236316680908203126",
]


def texts() -> list[str]:
    source = random.Random(1)
    found = list(HARD)
    for _ in range(3000):
        value = struct.unpack("<d", source.randbytes(8))[0]
        if np.isfinite(value):
            found += [repr(value), f"{value:.25e}", f"{value:.16e}"]
        digits = "".join(source.choice("0123456789") for _ in range(source.randrange(1, 40)))
        found.append(f"{source.choice('-')}{source.randrange(1, 10)}.{digits}e{source.randrange(-340, 300)}")
    return found


def test_a_number_decodes_to_what_float_makes_of_its_text() -> None:
    given = texts()
    decoded = wire.decode(f"[{','.join(given)}]".encode())
    assert [struct.pack("<d", float(x)) for x in decoded] == [struct.pack("<d", float(text)) for text in given]


def test_integers_of_any_size_stay_integers() -> None:
    assert wire.decode(b"[9007199254740993, 1" + b"0" * 400 + b"]") == [2**53 + 1, 10**400]


@pytest.mark.parametrize(
    "body",
    [b"", b"{", b'{"a":1', b"[1] 2", b"\xff", b'"\xff"', b"[01]", b"[1.]", b"nul", b"\xef\xbb\xbf[]", b"[" * 100_000],
)
def test_what_is_no_json_is_refused(body: bytes) -> None:
    with pytest.raises(ServiceError) as caught:
        wire.decode(body)
    assert caught.value.code == "not_json"


def test_arrays_encode_to_numbers_that_decode_to_the_same_bits() -> None:
    values = np.frombuffer(random.Random(2).randbytes(8 * 3000))
    values = np.ascontiguousarray(values[np.isfinite(values)])
    values = values[: len(values) // 3 * 3].reshape(-1, 3)
    assert np.array(json.loads(wire.encode({"a": values}))["a"]).tobytes() == values.tobytes()
    assert wire.encode({"a": values[:0], "b": values[:, 0] > 0, "c": values[:2, 1] > 2, "i": np.arange(2, dtype="i1")})
    assert json.loads(wire.encode(values[::2])) == values[::2].tolist()


@pytest.mark.parametrize("length", [0, 1, wire.PART, wire.PART + 1, 3 * wire.PART])
def test_long_answers_are_encoded_as_short_ones(length: int) -> None:
    accuracy = Accuracy.made(decisions="exact", coordinates_ulp=None, items=length)
    answer = ContainsResponse.made(
        contained=np.arange(length) % 3 == 0, boundary=list(range(length)), accuracy=accuracy, missing=None
    )
    assert json.loads(wire.encode(answer)) == {
        "contained": [k % 3 == 0 for k in range(length)],
        "boundary": list(range(length)),
        "accuracy": {"decisions": "exact", "items": length},
    }
