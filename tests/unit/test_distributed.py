"""Batches over Dask equal the batches of one process, also when a worker is killed in mid-run."""

from __future__ import annotations

import os
import signal
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import engine

pytest.importorskip("distributed", reason="the extra `distributed` is not installed")
from distributed import Client, LocalCluster

from engine import distributed

N_POINTS = 20_000


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs="CRITICAL") as cluster,
        Client(cluster) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def solid() -> engine.Polyhedron:
    """An octahedron."""
    corners = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    faces = [(x, y, z) if (x + y + z) % 2 == 0 else (x, z, y) for x in (0, 1) for y in (2, 3) for z in (4, 5)]
    return engine.Polyhedron(corners, faces)


@pytest.fixture(scope="module")
def points() -> np.ndarray:
    points = np.random.default_rng(20).uniform(-1.2, 1.2, (N_POINTS, 3))
    points[::5] = np.round(points[::5] * 4) / 4  # many on the boundary
    return points


def test_nothing_is_lost_or_doubled_when_a_worker_is_killed(
    client: Client, solid: engine.Polyhedron, points: np.ndarray
) -> None:
    done, killed = [], []

    def kill_one_then_count(n_items: int) -> None:
        done.append(n_items)
        if len(done) == 5:
            killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL)

    answer = distributed.locate(client, points, solid, part=300, progress=kill_one_then_count)
    assert killed
    assert killed[0] not in client.run(os.getpid).values()
    assert sum(done) == N_POINTS
    assert len(done) == -(-N_POINTS // 300)
    np.testing.assert_array_equal(answer, engine.locate(points, solid))
    assert {-1, 0, 1} == set(answer.tolist())


def test_poses_equal_one_process(client: Client, solid: engine.Polyhedron, points: np.ndarray) -> None:
    turns, moves = np.broadcast_to(np.eye(3), (60, 3, 3)), points[:60] * 2
    answer = distributed.collide_poses(client, solid, solid, turns, moves, part=7)
    np.testing.assert_array_equal(answer, engine.collide_poses(solid, solid, turns, moves))
    for least in (None, 0.5):
        found = distributed.clearance_poses(client, solid, solid, turns, moves, at_least=least, part=7)
        np.testing.assert_array_equal(found, engine.clearance_poses(solid, solid, turns, moves, at_least=least))


def test_segments_equal_one_process(client: Client, solid: engine.Polyhedron, points: np.ndarray) -> None:
    segments = points[:400].reshape(-1, 2, 3)
    answer, here = distributed.clip_segments(client, segments, solid, part=33), engine.clip_segments(segments, solid)
    for name in ("source", "start", "end", "t", "faces"):
        np.testing.assert_array_equal(getattr(answer, name), getattr(here, name))


def test_segments_through_a_scene_equal_one_process(
    client: Client, solid: engine.Polyhedron, points: np.ndarray
) -> None:
    segments = points[:400].reshape(-1, 2, 3)
    scene = engine.Scene(
        [solid, engine.Sphere([0, 0, 0], 1)], [engine.Pose.from_quaternion([2, 1, 0, 0], [0, 0, 0])] * 2
    )
    for keep in ("all", "first"):
        answer = distributed.clip_segments_scene(client, segments, scene, keep=keep, part=33)  # type: ignore[arg-type]
        here = scene.clip_segments(segments, keep=keep)  # type: ignore[call-overload]
        for name in ("source", "body", "start", "end", "t", "faces", "ranks"):
            np.testing.assert_array_equal(getattr(answer, name), getattr(here, name))
    met = distributed.clip_segments_scene(client, segments, scene, keep="any", part=33)
    np.testing.assert_array_equal(met, scene.clip_segments(segments, keep="any"))
    assert len(distributed.clip_segments_scene(client, [], scene)) == 0


def test_hits_equal_one_process(client: Client, solid: engine.Polyhedron, points: np.ndarray) -> None:
    lines = points[:200].reshape(-1, 2, 3)
    scene = engine.Scene([solid], [engine.Pose.from_quaternion([2, 1, 0, 0], [0, 0, 0])])
    assert distributed.hits(client, lines, solid, rays=True, part=33) == engine.hits(lines, solid, rays=True)
    assert distributed.hits(client, lines, scene, keep="first", part=33) == scene.hits(lines, keep="first")
    met = distributed.hits(client, lines, solid, keep="any", part=33)
    np.testing.assert_array_equal(met, engine.hits(lines, solid, keep="any"))


def test_overlaps_and_sections_equal_one_process(client: Client, solid: engine.Polyhedron, points: np.ndarray) -> None:
    first, second = ([engine.Aabb(low - 0.7, low + 0.7) for low in some] for some in (points[:40], points[40:80]))
    pose = engine.Pose.from_quaternion([2, 1, 0, 0], [0, 0, 0])
    for name in ("overlap_volume", "iou"):
        answer = getattr(distributed, name)(client, first, second, second_pose=pose, part=7)
        np.testing.assert_array_equal(answer, getattr(engine, name)(first, second, second_pose=pose))
    with pytest.raises(engine.UnsupportedPairError, match="as many of each"):
        distributed.iou(client, points[:8, None, :2] + np.eye(3, 2), points[:7, None, :2] + np.eye(3, 2))
    heights = np.linspace(-1.1, 1.1, 23)
    made: Any = distributed.section(client, solid, heights, normal=[1, 2, 3], part=4)
    here: Any = engine.section(solid, heights, normal=[1, 2, 3])
    for name in ("vertices", "ring_offsets", "piece_offsets", "plane_offsets", "areas", "flat"):
        np.testing.assert_array_equal(getattr(made, name), getattr(here, name))


def test_overlays_equal_one_process(client: Client, points: np.ndarray) -> None:
    subjects = [engine.Polygon([corners]) for corners in points[:240, :2].reshape(-1, 4, 2)]
    subjects[7] = subjects[-8] = engine.Polygon([[(0, 0), (1, 1), (0, 1)]])
    clips = subjects[::-1]
    clips[7] = engine.Polygon([[(0, 0), (1, 1 + 2.0**-52), (1 + 2.0**-52, 0.5)]])  # left to the path in integers
    answer = distributed.overlay_batch(client, subjects, clips, "difference", part=9)
    here = engine.overlay_batch(subjects, clips, "difference")
    for name in ("status", "vertices", "ring_offsets", "piece_offsets", "pair_offsets", "displacement"):
        np.testing.assert_array_equal(getattr(answer, name), getattr(here, name))
    assert [each.area_exact for each in answer.overlays] == [each.area_exact for each in here.overlays]
    for ours, theirs in zip(answer.overlays, here.overlays, strict=True):
        np.testing.assert_array_equal(ours.vertices, theirs.vertices)


def test_no_items(client: Client, solid: engine.Polyhedron) -> None:
    assert distributed.locate(client, [], solid).shape == (0,)
    assert len(distributed.clip_segments(client, [], solid)) == 0


def test_errors_are_those_of_the_engine(client: Client, solid: engine.Polyhedron, points: np.ndarray) -> None:
    with pytest.raises(engine.UnsupportedSolidError, match="nothing is inside a surface"):
        distributed.locate(client, points, engine.Surface(solid.vertices, solid.triangles), part=5_000)
    with pytest.raises(engine.NotFiniteError, match="1234"):
        distributed.locate(client, np.where(np.arange(N_POINTS)[:, None] == 1234, np.nan, points), solid)
    with pytest.raises(engine.InvalidInputError, match="part must be"):
        distributed.locate(client, points, solid, part=0)


def test_layers_are_joined_as_by_one_process(client: Client) -> None:
    geopandas = pytest.importorskip("geopandas")
    shapely = pytest.importorskip("shapely")
    testing = pytest.importorskip("pandas.testing")
    at = np.random.default_rng(5).random((2, 60, 2)) * 9
    left = geopandas.GeoDataFrame({"a": range(60)}, geometry=[shapely.box(x, y, x + 1, y + 2) for x, y in at[0]])
    right = geopandas.GeoDataFrame({"b": range(60)}, geometry=[*shapely.points(at[1][:59]), None])
    left.geometry.array[7], left.geometry.array[8] = None, shapely.Polygon()
    for how, options in (("inner", {}), ("left", {}), ("right", {"predicate": "dwithin", "distance": 0.5})):
        found = distributed.sjoin(client, left, right, how, part=17, **options)
        testing.assert_frame_equal(found, engine.layers.sjoin(left, right, how, **options))
    right.geometry.array[41] = shapely.GeometryCollection([shapely.Point(1e6, 0)])  # far from all of the left
    with pytest.raises(engine.UnsupportedSolidError, match=r"right\[41\] \(index 41\)"):
        distributed.sjoin(client, left, right, part=17)


def test_layers_are_overlaid_and_clipped_as_by_one_process(client: Client) -> None:
    geopandas, shapely = pytest.importorskip("geopandas"), pytest.importorskip("shapely")
    testing = pytest.importorskip("pandas.testing")
    rng = np.random.default_rng(6)

    def layer(n: int, name: str, *more: Any) -> Any:
        boxes = [shapely.box(x, y, x + 1.3, y + 1.7) for x, y in rng.random((n, 2)) * 9]
        shapes = [*boxes, *more, None, shapely.Polygon()]
        return geopandas.GeoDataFrame({name: range(len(shapes))}, geometry=shapes)

    lines = [shapely.LineString(at) for at in rng.random((9, 4, 2)) * 9]
    left, right = layer(40, "a"), layer(30, "b")
    mixed = layer(10, "a", *lines, *shapely.points(rng.random((9, 2)) * 9))
    for how in engine.layers.rows.HOWS:
        for one, keep in ((left, None), (mixed, False)):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = distributed.overlay(client, one, right, how, keep, part=11)
                testing.assert_frame_equal(found, engine.layers.overlay(one, right, how, keep), check_exact=True)
    for keep in ("inside", "outside"):
        found = distributed.clip(client, mixed, right, keep=keep, part=7)
        testing.assert_frame_equal(found, engine.layers.clip(mixed, right, keep=keep))
    assert len(distributed.clip(client, mixed.iloc[:0], (0, 0, 1, 1))) == 0
    crossing = geopandas.GeoDataFrame(geometry=[shapely.Polygon([(170, 0), (-170, 0), (-170, 10), (170, 10)])])
    east = geopandas.GeoDataFrame(geometry=[shapely.box(175, 5, 180, 20)])
    with pytest.warns(UserWarning, match="wrap: 1 polygons"):
        assert distributed.overlay(client, crossing, east, wrap=180).geometry[0].equals(shapely.box(175, 5, 180, 10))
    with pytest.raises(engine.UnsupportedSolidError, match=r"right\[3\]"):
        distributed.overlay(client, left, mixed.iloc[7:])
