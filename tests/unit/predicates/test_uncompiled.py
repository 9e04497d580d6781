"""Every predicate gives the same bytes with the compiler and without."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import config as numba_config

from engine.predicates.orientation import orient3d_batch
from tests.unit.predicates.batches import (
    orient2d_batch,
    side_of_plane_batch,
    sign_of_polynomial_batch,
)
from tests.unit.predicates.test_posed import orient3d_posed_batch


def all_signs() -> str:
    """Return the answers of all kernels on a fixed sample, near-degenerate, with mixed exponents."""
    draw = np.random.default_rng(1)
    n = 150
    points = draw.integers(-2, 3, (4, n, 3)) / 3.0
    points[:, : n // 2] = np.ldexp(points[:, : n // 2], draw.integers(-1060, 1015, (1, n // 2, 3)))
    points[:, :20] = np.ldexp(points[:, :20], draw.integers(-9, 2, (4, 20, 3)))
    flat = np.ascontiguousarray(points[:, :, :2])
    rows = np.concatenate([points[0], points[1, :, :1]], axis=1)
    poses = np.tile(np.array([0.6, -0.8, 0.0, 0.8, 0.6, 0.0, 0.0, 0.0, 1.0, 1.0, 0.5, 0.1]), (2, 1))
    bodies = draw.integers(-1, 2, (4, n))
    powers = np.array([[2, 0, 0], [0, 2, 0], [0, 0, 2], [0, 0, 0]])
    answers = np.full((6, n), 9, np.int8)
    with np.errstate(all="ignore"):
        orient2d_batch(*flat[:3], answers[0])
        orient3d_batch(*points, answers[1])
        side_of_plane_batch(rows * [1.0, 1.0, 0.0, 1.0], points[2], answers[2])
        side_of_plane_batch(rows, points[2], answers[3])
        sign_of_polynomial_batch(powers, np.array([9.0, 9.0, 9.0, -9.0]), 2, points[3], answers[4])
        orient3d_posed_batch(poses, points, bodies, 0.0, True, answers[5])
    return answers.tobytes().hex()


@pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="the compiler is disabled")
def test_the_same_signs_without_the_compiler() -> None:
    root = Path(__file__).resolve().parents[3]
    plain = subprocess.run(
        [sys.executable, "-c", "from tests.unit.predicates.test_uncompiled import all_signs; print(all_signs())"],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(root)},
        cwd=root,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert plain.returncode == 0, plain.stderr
    answers = all_signs()
    assert plain.stdout.strip() == answers
    assert {"ff", "00", "01", "02"} == {answers[i : i + 2] for i in range(0, len(answers), 2)}
