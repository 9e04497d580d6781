"""Arrays by their address: the numbers that are there, compiled and in Python."""

from __future__ import annotations

import numpy as np

from engine.jit import kernel
from engine.lanes.addresses import array_at, plain_array_at


@kernel
def last_of(address: int) -> float:
    return float(array_at(address, (2, 3), np.float64)[1, 2])


def test_an_array_by_its_address() -> None:
    values = np.array([-0.0, 5e-324, np.inf, 1.0, 2.0, 3.0])
    assert plain_array_at(values.ctypes.data, (2, 3), np.float64).tobytes() == values.tobytes()
    assert plain_array_at(values.ctypes.data, (0,), np.float64).tolist() == []
    assert last_of(values.ctypes.data) == 3.0
