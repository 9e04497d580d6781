"""Lanes: their arithmetic, how they are traced, addresses and memory."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numba import config as numba_config
from numba.core.errors import TypingError

from engine.compiling.jit import kernel
from engine.lanes.lanes import (
    any_above,
    any_of,
    array_at,
    bits_of,
    bytes_of,
    count_bits,
    dot,
    filter_pairs,
    greater,
    lane_of,
    lesser,
    load,
    load_lane,
    lowest_bit,
    move,
    plain_array_at,
    prefetch,
    root,
    select,
    spread,
    store,
)
from engine.lanes.tracing import LANES, Number, Rows, Triple, traced

SPECIAL = [0.0, -0.0, math.inf, -math.inf, math.nan, 1e-45, -1e-45, 1.1754942e-38, -1.1754944e-38, 3.4e38, -3.4e38]
SPECIAL += [1.0, -1.0, 1.0000001, 0.1, -7.5]
PAIRS = np.array([(a, b) for a in SPECIAL for b in SPECIAL], np.float32).reshape(-1, LANES, 2)
LEFT, RIGHT = np.ascontiguousarray(PAIRS[..., 0]), np.ascontiguousarray(PAIRS[..., 1])
N_RESULTS, N_MASKS = 14, 7


@traced
def operate(left: Rows, right: Rows, row: int, found: Rows) -> None:
    """Write the result of every operation on a pair of rows, in a traced function."""
    a, b = load(left, row), load(right, row)
    results = [a + b, a - b, a * b, -a, abs(a), root(a), lesser(a, b), greater(a, b), 0.5 - a, a * 0.5]
    results += [select(a < b, a, 1.5), lane_of(a, 3), load_lane(left, row, 5), dot((a, b, a), (b, a, a))]
    for place, result in enumerate(results):
        store(found, N_RESULTS * row + place, result)


@kernel
def operate_all(left: Any, right: Any, found: Any, bits: Any) -> None:
    """Write the same, and masks, with lanes as values of a compiled function too."""
    for row in range(len(left)):
        operate(left, right, row, found)
        a, b = load(left, row), load(right, row)
        bits[row, 0], bits[row, 1] = bits_of(a > b), bits_of(a < b)
        bits[row, 2], bits[row, 3] = bits_of(a >= b), bits_of(a <= b)
        bits[row, 4], bits[row, 5] = bits_of((a > b) & ~(a >= spread(0.5))), bits_of((a < b) | (b <= spread(0.0)))
        bits[row, 6] = 2 * any_of(a > b) + (count_bits(bits_of(a < b)) & 1)
        store(found, N_RESULTS * row + 10, select(a < b, a, spread(1.5)))
        store(found, N_RESULTS * row, a + b)
        store(found, N_RESULTS * row + 1, a - b)
        store(found, N_RESULTS * row + 2, a * b)
        store(found, N_RESULTS * row + 3, -a)
        store(found, N_RESULTS * row + 4, abs(a))


def expected_results(a: np.ndarray, b: np.ndarray) -> list[np.ndarray]:
    """Return what `operate` writes: in float64 where that is exact enough, else lane by lane."""
    x, y = a.astype(float), b.astype(float)
    wide = [x + y, x - y, x * y, np.copysign(x, np.where(np.signbit(x), 1.0, -1.0)), np.copysign(x, 1.0), np.sqrt(x)]
    lanes = [[p if p < q else q for p, q in zip(a, b)], [p if p > q else q for p, q in zip(a, b)]]
    wide += [np.array(lanes[0], float), np.array(lanes[1], float), 0.5 - x, x * 0.5]
    wide += [np.array([p if p < q else 1.5 for p, q in zip(a, b)], float), np.full(LANES, x[3]), np.full(LANES, x[5])]
    ab, aa = (x * y).astype(np.float32).astype(float), (x * x).astype(np.float32).astype(float)
    wide.append((ab + ab).astype(np.float32).astype(float) + aa)
    return [result.astype(np.float32) for result in wide]


def same_bits(found: np.ndarray, expected: np.ndarray) -> None:
    is_number = ~np.isnan(expected)
    assert (np.isnan(found) == ~is_number).all()
    assert (found[is_number].view(np.uint32) == expected[is_number].view(np.uint32)).all()


@pytest.mark.parametrize("run", [operate_all, getattr(operate_all, "py_func", operate_all)], ids=["compiled", "python"])
def test_operations_round_the_exact_result(run: Callable[..., None]) -> None:
    found, bits = np.empty((len(LEFT), N_RESULTS, LANES), np.float32), np.empty((len(LEFT), N_MASKS), np.int64)
    with np.errstate(all="ignore"):
        run(LEFT, RIGHT, found, bits)
        expected = np.array([expected_results(a, b) for a, b in zip(LEFT, RIGHT)])
    same_bits(found, expected)
    for row, (a, b) in enumerate(zip(LEFT.tolist(), RIGHT.tolist())):
        for place, told in enumerate(
            (
                [p > q for p, q in zip(a, b)],
                [p < q for p, q in zip(a, b)],
                [p >= q for p, q in zip(a, b)],
                [p <= q for p, q in zip(a, b)],
                [p > q and not p >= 0.5 for p, q in zip(a, b)],
                [p < q or q <= 0.0 for p, q in zip(a, b)],
            )
        ):
            assert bits[row, place] == sum(is_true << lane for lane, is_true in enumerate(told))
        assert bits[row, 6] == 2 * any(p > q for p, q in zip(a, b)) + sum(p < q for p, q in zip(a, b)) % 2


@traced
def table(rows: Rows) -> tuple[int, int]:
    """Return in which lanes row 0 exceeds each lane of row 1, or row 2 row 3."""
    return bytes_of(
        [any_above([(load(rows, 0), load_lane(rows, 1, k)), (load(rows, 2), load(rows, 3))]) for k in range(8)]
    )


@traced
def above(lane: int, rows: Rows) -> int:
    """Return in which lanes row 0 exceeds one lane of row 1."""
    return bits_of(load(rows, 0) > load_lane(rows, 1, lane))


@kernel
def ask(rows: Any, words: Any) -> None:
    words[0], words[1] = table(rows)
    words[2], words[3] = filter_pairs(words[0], 0, above, (rows,)), filter_pairs(words[1], LANES // 2, above, (rows,))
    words[4] = lowest_bit(words[5])


def test_tables_of_bits() -> None:
    rng = np.random.default_rng(2)
    for bit in range(63):
        rows, words = rng.choice([0.0, 1.0, 2.0, np.nan], (4, LANES)).astype(np.float32), np.zeros(6, np.int64)
        words[5] = 1 << bit | 1 << 62
        ask(rows, words)
        is_above = rows[0][None, :] > rows[1][:, None]
        for first, bits in ((0, is_above | (rows[2] > rows[3])), (2, is_above)):
            number = sum(1 << place for place in np.flatnonzero(bits).tolist())
            assert words[first : first + 2].tolist() == [number & 0xFFFFFFFF, number >> 32]
        assert words[4] == bit


# --- Functions on lanes, written once: what they are handed, in Python and by compiled code ---


@traced
def turned(rows: Rows, item: int, angle: Number, middle: Triple) -> None:
    """Set row `item` to itself times a number plus the sum of three."""
    store(rows, item, load(rows, item) * angle + (middle[0] + middle[1] + middle[2]))


@kernel
def turn(rows: Any, item: Any, angle: Any, middle: Any) -> None:
    turned(rows, item, angle, (middle[0], middle[1], middle[2]))


def test_numbers_are_rounded_to_float32_on_the_way_in() -> None:
    start = np.arange(24, dtype=np.float32).reshape(3, 8)
    compiled, plain = start.copy(), start.copy()
    turn(compiled, 1, 0.1, np.array([0.1, 0.2, 0.3]))
    turned(plain, 1, 0.1, (0.1, 0.2, 0.3))
    total = np.float32(0.1) + np.float32(0.2) + np.float32(0.3)
    assert plain[1].tolist() == (start[1] * np.float32(0.1) + total).tolist()
    assert compiled.tolist() == plain.tolist()
    assert (plain[::2] == start[::2]).all()


@pytest.mark.skipif(numba_config.DISABLE_JIT, reason="types are looked at by the compiler")
@pytest.mark.parametrize("rows", [np.zeros((3, 8)), np.zeros((3, 16), np.float32)[:, ::2], 1.0])
def test_rows_are_contiguous_float32(rows: Any) -> None:
    with pytest.raises(TypingError):
        turn(rows, 0, 1.0, np.zeros(3))


# --- Arrays by their address: the numbers that are there, compiled and in Python ---


@kernel
def last_of(address: int) -> float:
    return float(array_at(address, (2, 3), np.float64)[1, 2])


def test_an_array_by_its_address() -> None:
    values = np.array([-0.0, 5e-324, np.inf, 1.0, 2.0, 3.0])
    assert plain_array_at(values.ctypes.data, (2, 3), np.float64).tobytes() == values.tobytes()
    assert plain_array_at(values.ctypes.data, (0,), np.float64).tolist() == []
    assert last_of(values.ctypes.data) == 3.0


# --- Runs of numbers are copied to their place and nowhere else; asking for a line changes nothing ---


@kernel
def copy(target: Any, at: int, source: Any, first: int, n: int) -> None:
    prefetch(source, first)
    prefetch(source, 10**6)
    move(target, at, source, first, n)


def test_runs_are_copied() -> None:
    source = np.array([np.nan, -0.0, 5e-324, np.inf, 1.0, 2.0])
    for at, first, n in ((0, 0, 6), (2, 1, 3), (5, 5, 0), (4, 4, 2)):
        target = np.full(6, 7.0)
        copy(target, at, source, first, n)
        expected = np.full(6, 7.0)
        expected[at : at + n] = source[first : first + n]
        assert target.tobytes() == expected.tobytes()
