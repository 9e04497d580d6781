"""Clipping a segment on a sphere: the two roots of |p + t (q - p) - c|^2 = r^2, cut to [0, 1].

Source: exercise 22.4-7 of the chapter on computer graphics in Algorithms of Informatics.
What goes wrong: the discriminant cancels for a segment that nearly touches the sphere, far from the origin or far from
the sphere, so that it is kept or removed by rounding; the roots lose half of their digits there.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from engine.arrays import BoolArray, FloatArray
from engine.jit import kernel


@kernel
def clip(segments: FloatArray, center: FloatArray, radius: float) -> tuple[FloatArray, BoolArray]:
    """Return (clipped segments (n, 2, dim), kept (n,)); a removed segment is left as it came."""
    clipped, kept = segments.copy(), np.zeros(len(segments), np.bool_)
    for i in range(len(segments)):
        p, u = segments[i, 0], segments[i, 1] - segments[i, 0]
        a, half_b, c = 0.0, 0.0, -radius * radius
        for k in range(len(center)):
            w = p[k] - center[k]
            a += u[k] * u[k]
            half_b += u[k] * w
            c += w * w
        if a == 0.0:
            kept[i] = c <= 0.0
            continue
        discriminant = half_b * half_b - a * c
        if discriminant < 0.0:
            continue
        low = max(0.0, (-half_b - sqrt(discriminant)) / a)
        high = min(1.0, (-half_b + sqrt(discriminant)) / a)
        if low <= high:
            kept[i] = True
            clipped[i, 0], clipped[i, 1] = p + low * u, p + high * u
    return clipped, kept
