"""Convex bodies and pairs of them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import numpy.typing as npt
import pytest

from engine import Aabb, Polyhedron, Pose, Relation, Solid, Sphere, collide, collide_poses
from engine.collision.codes import UNSETTLED
from engine.collision.collide import collide_pair
from engine.collision.convex_batch import relate_convex_pairs
from engine.collision.convex_body import ASIDE, CENTER, RADIUS, REACH, ROUND, convex_body_of, pool_bodies
from engine.collision.meshes.placement import PoseArrays
from engine.collision.result import Work

CUBE = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
FLAG = np.zeros(1, np.uint8)


def ball_of_belts(n_around: int, n_belts: int) -> Polyhedron:
    """A convex solid of n_around * n_belts + 2 vertices; few: all are looked at, many: a walk uphill."""
    vertices, faces = [[0.0, 0.0, -1.0]], []
    for belt in range(n_belts):
        z = -np.cos(np.pi * (belt + 1) / (n_belts + 1))
        for k in range(n_around):
            turn = 2 * np.pi * (k + belt / 2) / n_around
            vertices.append([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z])
    vertices.append([0.0, 0.0, 1.0])
    top = len(vertices) - 1
    for k in range(n_around):
        following = (k + 1) % n_around
        faces.append([0, 1 + following, 1 + k])
        faces.append([top, top - n_around + k, top - n_around + following])
        for belt in range(n_belts - 1):
            a, b = 1 + belt * n_around + k, 1 + belt * n_around + following
            faces += [[a, b, a + n_around], [b, b + n_around, a + n_around]]
    return Polyhedron(vertices, faces)


def poses(n: int, spread: float, seed: int) -> list[Pose]:
    rng = np.random.default_rng(seed)
    quaternions = rng.normal(size=(n, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
    result = []
    for w, x, y, z in quaternions:
        turn = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        result.append(Pose(turn, rng.normal(size=3) * spread))
    return result


def short_answers(
    first: Solid, second: Solid, placed: list[Pose | None], boolean: bool = False, flag: npt.NDArray[np.uint8] = FLAG
) -> list[int]:
    bodies = [convex_body_of(first), convex_body_of(second)]
    assert bodies[0] is not None
    assert bodies[1] is not None
    n = len(placed)
    rotations, translations = np.broadcast_to(np.eye(3), (n + 1, 3, 3)).copy(), np.zeros((n + 1, 3))
    for row, pose in enumerate(placed, 1):
        if pose is not None:
            rotations[row], translations[row] = pose.rotation, pose.translation
    pairs = np.column_stack([np.zeros(n, np.int64), np.arange(1, n + 1)])
    rows, found = np.append(0, np.ones(n, np.int64)), np.full(n, UNSETTLED, np.int8)
    with np.errstate(all="ignore"):
        pool = pool_bodies([body for body in bodies if body is not None])
        relate_convex_pairs(pool, rows, PoseArrays(rotations, translations, True), pairs, boolean, False, found, flag)
    return found.tolist()


BODIES: dict[str, Solid] = {
    "box": Aabb([-1, -0.5, -0.25], [1, 0.5, 0.25]),
    "corner": Polyhedron([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
    "small": ball_of_belts(5, 2),
    "large": ball_of_belts(12, 6),
    "inward": Polyhedron(np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)]) * 0.3, [f[::-1] for f in CUBE]),
    "ball": Sphere([0.1, 0.2, 0.3], 0.4),
    "point": Sphere([0.1, 0.2, 0.3], 1e-3),
}  # fmt: skip


@pytest.mark.parametrize("second", sorted(BODIES))
@pytest.mark.parametrize("first", sorted(BODIES))
def test_answers_are_those_of_the_exact_path(first: str, second: str) -> None:
    one, other = BODIES[first], BODIES[second]
    slow = "ball" in (first, second) or "point" in (first, second)
    placed: list[Pose | None] = [*poses(3 if slow else 12, 0.5, 1), *poses(3 if slow else 12, 0.05, 2), None]
    found = short_answers(one, other, placed)
    for pose, relation in zip(placed, found):
        exact = collide_pair(one, other, (None, pose), Work(witness=False)).relation
        assert relation in (exact, UNSETTLED), pose
    assert found.count(UNSETTLED) <= 3


@pytest.mark.parametrize("shift", [2.0, np.nextafter(2.0, 3.0), np.nextafter(2.0, 1.0)])
def test_contact_and_its_neighbours_are_left_open(shift: float) -> None:
    turn = Pose(np.eye(3), [shift, 0.25, 0.125])
    assert short_answers(BODIES["box"], BODIES["box"], [turn]) == [UNSETTLED]


def test_boxes_that_share_a_symmetry_are_decided() -> None:
    cube = Aabb([-1, -1, -1], [1, 1, 1])
    steps = [[1, 0, 0], [0, 1.5, 0], [1, 1, 0], [1, 1, 1], [3, 0, 0], [3, 3, 3], [0, 0, 0]]
    placed: list[Pose | None] = [Pose(np.eye(3), step) for step in steps]
    found = short_answers(cube, cube, placed)
    over, apart = Relation.OVERLAPPING, Relation.DISJOINT
    assert found[:6] == [over, over, over, over, apart, apart]
    assert short_answers(cube, Aabb([-3, -3, -3], [3, 3, 3]), [None]) == [Relation.FIRST_INSIDE_SECOND]
    assert short_answers(cube, cube, placed, True)[:6] == found[:6]


@pytest.mark.parametrize("scale", [5e-324, 1e-310, 1e-200, 1e-100, 1e100, 1e200, 1e307])
def test_the_ends_of_the_exponent_range_prove_nothing_wrong(scale: float) -> None:
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], float) * scale
    cube = Polyhedron(corners, CUBE)
    if convex_body_of(cube) is not None:
        found = short_answers(cube, cube, [None, Pose(np.eye(3), [2 * scale if scale < 1e300 else 0.0, 0, 0])])
        assert found[0] in (UNSETTLED, Relation.OVERLAPPING)
        assert found[1] in (UNSETTLED, Relation.DISJOINT if scale < 1e300 else Relation.OVERLAPPING)


def test_bodies_without_interior_or_not_convex_have_no_short_path() -> None:
    flat, point = Aabb([0, 0, 0], [1, 1, 0]), Sphere([0, 0, 0], 0.0)
    assert convex_body_of(flat) is convex_body_of(point) is None


@pytest.mark.parametrize("gap", [1e-3, 1e-5, 1e-6, 1e-8, 1e-12, 0.0, -1e-12, -1e-8, -1e-6, -1e-5, -1e-3])
def test_near_contact_is_decided_or_left_open(gap: float) -> None:
    """Corner on corner and corner on face, from clearly apart to clearly within: never the wrong answer."""
    one = BODIES["box"]
    spike = Polyhedron([[0, 0, 0], [1, -1, -1], [1, 1, -1], [1, 0, 1]], [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]])
    placed: list[Pose | None] = [Pose(np.eye(3), [1 + gap, y, z]) for y in (0.0, 0.1, 0.45) for z in (0.0, -0.2)]
    found = short_answers(one, spike, placed)
    right = Relation.DISJOINT if gap > 0 else Relation.OVERLAPPING
    if abs(gap) >= 1e-3:
        assert found.count(right) >= len(placed) - 1
    assert all(answer in (right, UNSETTLED) for answer in found)
    if gap == 0.0:
        assert found == [UNSETTLED] * len(placed)


@pytest.mark.parametrize("shift", [1e3, 1e6, 1e9, 1e15])
def test_bodies_far_from_the_origin(shift: float) -> None:
    one, other = (Polyhedron(body.vertices * scale + move, body.triangles) for body, scale, move in (
        (ball_of_belts(5, 2), 1.0, shift), (ball_of_belts(4, 3), 0.5, -shift)))  # fmt: skip
    if convex_body_of(one) is None or convex_body_of(other) is None:
        return  # rounded to so few places that they are not convex any more
    placed: list[Pose | None] = [
        Pose(pose.rotation, one.vertices.mean(0) - pose.rotation @ other.vertices.mean(0) + pose.translation)
        for pose in poses(10, 0.8, 3)
    ]
    found = short_answers(one, other, placed)
    exact = [collide_pair(one, other, (None, pose), Work(witness=False)).relation for pose in placed]
    assert all(answer in (right, UNSETTLED) for answer, right in zip(found, exact))
    assert shift > 1e6 or found.count(UNSETTLED) <= 1


@pytest.mark.parametrize("scale", [1e-320, 1e-200, 1e-30, 1e30, 1e70, 1e200, 1e306])
def test_rounded_bodies_at_the_ends_of_the_exponent_range(scale: float) -> None:
    body = ball_of_belts(5, 2)
    one = Polyhedron(body.vertices * scale, body.triangles)
    if convex_body_of(one) is None:
        return
    placed: list[Pose | None] = [Pose(pose.rotation, pose.translation * scale) for pose in poses(9, 0.8, 4)]
    found, unscaled = short_answers(one, one, placed), short_answers(body, body, list(poses(9, 0.8, 4)))
    assert all(UNSETTLED in (a, b) or a == b for a, b in zip(found, unscaled))
    assert short_answers(one, one, [Pose(np.eye(3), [1.7e308, 0, 0])])[0] in (Relation.DISJOINT, UNSETTLED)


def test_a_raised_flag_ends_the_search() -> None:
    body = ball_of_belts(5, 2)
    assert short_answers(body, body, list(poses(20, 0.5, 5)), flag=np.ones(1, np.uint8)) == [UNSETTLED] * 20


def test_many_poses_of_one_pair_are_what_each_alone_is() -> None:
    body, placed = ball_of_belts(5, 2), poses(40, 0.6, 6)
    turns, moves = [pose.rotation for pose in placed], [pose.translation for pose in placed]
    alone = [int(collide(body, body, second_pose=pose).relation) for pose in placed]
    assert collide_poses(body, body, turns, moves).tolist() == alone


# --- What kernels are told of convex bodies: neighbours, farthest vertices, reaches, and points inside ---


def test_bodies_without_interior_or_not_convex_have_no_place() -> None:
    notched = Polyhedron(
        [[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, 1], [0, 0, 4]],
        [[0, 2, 1], [0, 1, 4], [0, 4, 2], [1, 2, 3], [2, 4, 3], [4, 1, 3]],
    )
    bodies: list[Solid] = [Aabb([0, 0, 0], [1, 1, 0]), Sphere([0, 0, 0], 0), Sphere([0, 0], 1), notched]
    assert [convex_body_of(body) for body in bodies] == [None] * 4


def test_pooled_arrays_describe_each_body() -> None:
    solids: list[Solid] = [Aabb([0, 1, 2], [3, 4, 6]), Sphere([1, 2, 3], 2), ball_of_belts(6, 3)]
    bodies = [body for body in map(convex_body_of, solids) if body is not None]
    pool = pool_bodies(bodies)
    assert pool.firsts[0].tolist() == [0, 8, 9, 29]
    for k, body in enumerate(bodies):
        first, stop = pool.firsts[0, k], pool.firsts[0, k + 1]
        points = pool.points[:, first:stop]
        assert (points == body.points).all()
        for center in (CENTER, ASIDE):
            middle = [Fraction(x) for x in pool.numbers[k, center : center + 3].tolist()]
            farthest = max(sum((Fraction(x) - m) ** 2 for x, m in zip(p, middle)) for p in points.T.tolist())
            assert farthest <= Fraction(pool.numbers[k, RADIUS]) ** 2 or pool.numbers[k, ROUND] > 0
        assert pool.numbers[k, REACH] == np.abs(points).max() + pool.numbers[k, ROUND]
