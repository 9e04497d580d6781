"""Exact images of points and half-spaces: a point keeps its side, up to the determinant of the pose."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine import HalfSpace, Pose
from engine.collision.exact_images import as_vector, image_half_space, image_point, value_at
from engine.predicates.rational import dot


@pytest.mark.parametrize("d", [2, 3])
def test_the_image_of_a_half_space_holds_the_images_of_its_points(d: int) -> None:
    rng = np.random.default_rng(d)
    for _ in range(20):
        turn, _ = np.linalg.qr(rng.normal(size=(d, d)))
        turn[:, 0] *= np.sign(np.linalg.det(turn))
        pose, normal, offset = Pose(turn, rng.normal(size=d)), rng.normal(size=d), float(rng.normal())
        points = rng.normal(size=(4, d))
        images = [image_point(point, pose) for point in points]
        rows = [as_vector(row) for row in pose.rotation]
        assert images[0][0] == dot(rows[0], as_vector(points[0])) + Fraction(float(pose.translation[0]))
        ratios = {
            value_at(image_half_space(HalfSpace(normal, offset), pose), image)
            / value_at((as_vector(normal), Fraction(offset)), p)
            for p, image in zip(map(as_vector, points), images)
        }
        assert len(ratios) == 1  # the determinant
        assert abs(ratios.pop() - 1) < 1e-11


def test_no_pose_changes_nothing() -> None:
    assert image_point([0.1, 0.2], None) == (Fraction(0.1), Fraction(0.2))
    assert image_half_space(HalfSpace([1.0, 2.0], 3.0), None) == ((1, 2), 3)
