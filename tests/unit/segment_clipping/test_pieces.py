"""Pieces as kernels write them, and what joins them."""

from __future__ import annotations

import numpy as np

from engine.segment_clipping.pieces import joined, point_of, put_own_end, room_for


def test_an_own_end_is_written_without_negative_zeros_and_parts_are_joined() -> None:
    for dimension in (2, 3):
        segments = np.array([[[-0.0, 1.0, 2.0], [3.0, -0.0, 5.0]]])[:, :, :dimension].copy()
        pieces = room_for(1, dimension)
        pieces.source[0] = 7
        for end in range(2):
            put_own_end(pieces, 0, end, segments, 0, dimension == 2)
        assert point_of(segments, 0, 1, dimension == 2) == (3.0, 0.0, 5.0 if dimension == 3 else 0.0)
        both = joined([pieces, pieces])
        assert both.ends.tobytes() == np.repeat(segments + 0.0, 2, axis=0).swapaxes(0, 1).tobytes()
        assert (both.source.tolist(), both.t.tolist(), both.faces.tolist()) == ([7, 7], [[0, 1]] * 2, [[-1, -1]] * 2)
