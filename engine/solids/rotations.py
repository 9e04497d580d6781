"""Which of many matrices are surely rotations, in float64."""

from __future__ import annotations

from typing import Any

from engine.jit import kernel


@kernel
def find_suspects(matrices: Any, limit: float, is_suspect: Any) -> None:
    """Fill is_suspect (n,) for matrices (n, d, d): whether max|R^T R - I| > limit as computed, or det is not positive.

    An entry of the product is a sum of d products, det a sum of d! of d; numbers that overflow are suspect.
    """
    dimension = matrices.shape[1]
    for item in range(matrices.shape[0]):
        suspect = False
        for j in range(dimension):
            for k in range(j + 1):
                defect = -1.0 if j == k else 0.0
                for i in range(dimension):
                    defect += matrices[item, i, j] * matrices[item, i, k]
                suspect |= not abs(defect) <= limit
        if dimension == 2:
            det = matrices[item, 0, 0] * matrices[item, 1, 1] - matrices[item, 0, 1] * matrices[item, 1, 0]
        else:
            det = 0.0
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                minor = matrices[item, 1, j] * matrices[item, 2, k] - matrices[item, 1, k] * matrices[item, 2, j]
                det += matrices[item, 0, i] * minor
        is_suspect[item] = suspect or not det > 0.0
