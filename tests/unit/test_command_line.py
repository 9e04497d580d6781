"""The command line gives the answers of the functions, reads what it writes, and refuses bad files by name."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import engine
from engine.__main__ import main

SPHERE = '{"type": "sphere", "center": [0, 0, 0], "radius": 1}'
BOX = '{"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]}'
CUBE_OFF = """OFF
8 6 0
0 0 0
1 0 0
1 1 0
0 1 0
0 0 1
1 0 1
1 1 1
0 1 1
4 0 3 2 1
4 4 5 6 7
4 0 1 5 4
4 2 3 7 6
4 0 4 7 3
4 1 2 6 5
"""
SQUARE = {"type": "Polygon", "coordinates": [[[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]]}
HOLED = {
    "type": "Polygon",
    "coordinates": [[[2, 2], [6, 2], [6, 6], [2, 6], [2, 2]], [[3, 3], [3, 5], [5, 5], [5, 3], [3, 3]]],
}


@pytest.fixture
def cube(tmp_path: Path) -> str:
    pytest.importorskip("trimesh", reason="the extra `formats` is not installed")
    path = tmp_path / "cube.off"
    path.write_text(CUBE_OFF)
    return str(path)


def written(tmp_path: Path, name: str, value: object) -> str:
    path = tmp_path / name
    if name.endswith(".npy"):
        np.save(path, value)
    else:
        path.write_text(value if isinstance(value, str) else json.dumps(value))
    return str(path)


def test_contains_prints_labels(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    points = written(tmp_path, "points.csv", "x,y,z\n0,0,0\n1,0,0\n0.6,0.8,1e-300\n2,0,0\n")
    assert main(["contains", SPHERE, points]) == 0
    assert capsys.readouterr().out.split() == ["location", "inside", "boundary", "outside", "outside"]


def test_contains_writes_what_locate_returns(cube: str, tmp_path: Path) -> None:
    points = np.random.default_rng(3).integers(-2, 6, (500, 3)) / 4
    target = tmp_path / "out.npy"
    assert main(["contains", cube, written(tmp_path, "points.npy", points), "-o", str(target)]) == 0
    np.testing.assert_array_equal(np.load(target), engine.locate(points, engine.Aabb((0, 0, 0), (1, 1, 1))))


def test_collide_with_and_without_poses(cube: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["collide", cube, BOX]) == 0
    assert capsys.readouterr().out.split() == ["relation", "overlapping"]
    poses = np.zeros((3, 3, 4))
    poses[:, :, :3] = np.eye(3)
    poses[:, 0, 3] = (0.5, 1.0, 1.5)
    assert main(["collide", cube, BOX, "--poses", written(tmp_path, "poses.npy", poses.reshape(3, 12))]) == 0
    assert capsys.readouterr().out.split() == ["relation", "overlapping", "touching", "disjoint"]


def test_clearance_and_whether_it_is_at_least_so_much(capsys: pytest.CaptureFixture[str]) -> None:
    pair = [
        '{"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]}',
        '{"type": "sphere", "center": [4, 5, 1], "radius": 2}',
    ]
    assert main(["clearance", *pair]) == 0
    assert capsys.readouterr().out.split() == ["distance", "3.0"]
    for least, said in (("3", "True"), ("3.0000000000000004", "False")):
        assert main(["clearance", *pair, "--at-least", least]) == 0
        assert capsys.readouterr().out.split() == ["clear", said]


def test_clip_segments_reads_back_the_same_doubles(cube: str, tmp_path: Path) -> None:
    segments = np.random.default_rng(4).uniform(-1, 2, (200, 2, 3))
    source, target = written(tmp_path, "segments.npy", segments), tmp_path / "pieces.csv"
    assert main(["clip", cube, source, "-o", str(target)]) == 0
    header, *rows = target.read_text().split()
    assert header == "source,start_0,start_1,start_2,end_0,end_1,end_2,t_0,t_1,faces_0,faces_1"
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    pieces = engine.clip_segments(segments, engine.Aabb((0, 0, 0), (1, 1, 1)))
    np.testing.assert_array_equal(table[:, 0], pieces.source)
    np.testing.assert_array_equal(table[:, 1:7], np.hstack([pieces.start, pieces.end]))
    np.testing.assert_array_equal(table[:, 7:9], pieces.t)


def test_hits_are_rows_with_kinds_in_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sheet = '{"type": "surface", "vertices": [[0, 0, 0], [4, 0, 0], [0, 4, 0]], "faces": [[0, 1, 2]]}'
    rays = written(tmp_path, "rays.npy", np.array([[[1.0, 1, 3], [0, 0, -1]], [[0, 1, 3], [0, 0, -1]]]))
    assert main(["hits", sheet, rays, "--rays"]) == 0
    header, *rows = capsys.readouterr().out.split()
    assert header.startswith("source,t,t_end,face,triangle,kind,barycentric_0")
    assert rows == [
        "0,3.0,3.0,0,0,across,0.5,0.25,0.25,0.0,0.0,1.0", "1,3.0,3.0,0,0,rim,0.75,0.0,0.25,0.0,0.0,1.0"
    ]  # fmt: skip
    assert main(["hits", sheet, rays, "--keep", "any"]) == 0
    assert capsys.readouterr().out.split() == ["met", "True", "True"]


def test_clip_line_strings_and_polygons_of_geojson(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    region = written(tmp_path, "region.geojson", SQUARE)
    line = written(tmp_path, "line.geojson", {"type": "LineString", "coordinates": [[-1, 1], [7, 1]]})
    assert main(["clip", region, line]) == 0
    assert capsys.readouterr().out.split()[1] == "0,0.0,1.0,4.0,1.0,0.125,0.625,3,1"
    box = '{"type": "aabb", "min": [0, 0], "max": [4, 4]}'
    assert main(["clip", box, written(tmp_path, "holed.geojson", HOLED), "--polygons"]) == 0
    (feature,) = json.loads(capsys.readouterr().out)["features"]
    clipped = engine.Polygon(feature["geometry"]["coordinates"][0])
    assert engine.overlay(clipped, engine.Polygon(SQUARE["coordinates"])).area_exact == 3


def test_overlay_of_layers_keeps_attributes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    far = {"type": "Polygon", "coordinates": [[[90, 0], [91, 0], [91, 1], [90, 0]]]}
    features = [
        {"type": "Feature", "id": 7 + k, "properties": {"a": k}, "geometry": each}
        for k, each in enumerate([SQUARE, far])
    ]
    layer = {"type": "FeatureCollection", "crs": {"type": "name"}, "features": features}
    left, right = written(tmp_path, "left.geojson", layer), written(tmp_path, "right.geojson", HOLED)
    target = tmp_path / "out.geojson"
    assert main(["overlay", left, right, "--operation", "identity", "-o", str(target)]) == 0
    found = json.loads(target.read_text())
    assert found["crs"] == {"type": "name"}
    assert [(f["properties"], f.get("id"), "right" in f) for f in found["features"]] == [
        ({"a": 0}, None, True), ({"a": 0}, 7, False), ({"a": 1}, 8, False),
    ]  # fmt: skip
    square, holed = (engine.Polygon(each["coordinates"]) for each in (SQUARE, HOLED))
    for feature, operation in zip(found["features"], ("intersection", "difference"), strict=False):
        polygon = engine.layers.polygon_of(feature["geometry"])
        assert engine.union_all([polygon]).area_exact == engine.overlay(square, holed, operation).area_exact  # type: ignore[arg-type]
    assert main(["overlay", str(target), str(target)]) == 0
    assert len(json.loads(capsys.readouterr().out)["features"]) == 3


def test_layers_are_united_and_points_joined(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    features = [{"type": "Feature", "id": k, "properties": {"a": k % 2}, "geometry": SQUARE} for k in range(3)]
    layer = written(tmp_path, "layer.geojson", {"type": "FeatureCollection", "features": features})
    for more, groups in (([], [{"count": 3}]), (["--by", "a"], [{"a": 0, "count": 2}, {"a": 1, "count": 1}])):
        assert main(["union", layer, *more]) == 0
        found = json.loads(capsys.readouterr().out)["features"]
        assert [feature["properties"] for feature in found] == groups
        square = engine.union_all([engine.Polygon(SQUARE["coordinates"])])
        assert all(feature["geometry"] == square.__geo_interface__ for feature in found)
    corner, far = ({"type": "Point", "coordinates": at} for at in (SQUARE["coordinates"][0][0], [99, 99]))
    points = [{"type": "Feature", "properties": {"p": k}, "geometry": at} for k, at in enumerate((corner, far))]
    points = written(tmp_path, "points.geojson", {"type": "FeatureCollection", "features": points})
    for more, expected in (([], [(0, 0), (0, 1), (0, 2)]), (["--outside"], [(0, 0), (0, 1), (0, 2), (1, None)])):
        assert main(["join", points, layer, *more]) == 0
        found = json.loads(capsys.readouterr().out)["features"]
        assert [(f["properties"]["p"], f.get("polygon", {}).get("id")) for f in found] == expected
        assert all(feature["boundary"] for feature in found[:3])


def test_parts_of_a_multipolygon_are_united(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rings = [[[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]], [[1, 1], [3, 1], [3, 3], [1, 3], [1, 1]]]
    path = written(tmp_path, "both.geojson", {"type": "MultiPolygon", "coordinates": [[ring] for ring in rings]})
    assert main(["contains", path, written(tmp_path, "p.csv", "1.5,1.5\n0.5,2.5\n")]) == 0
    assert capsys.readouterr().out.split() == ["location", "inside", "outside"]


def test_bounds(cube: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bounds", cube]) == 0
    header, row = capsys.readouterr().out.split()
    assert header == "min_0,min_1,min_2,max_0,max_1,max_2,center_0,center_1,center_2,radius"
    assert (
        row == f"0.0,0.0,0.0,1.0,1.0,1.0,0.5,0.5,0.5,{engine.bounds(engine.Aabb((0,) * 3, (1,) * 3)).sphere.radius!r}"
    )


def test_volume_section_and_cut(cube: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["volume", cube]) == 0
    assert capsys.readouterr().out.split() == ["volume,area,centroid_0,centroid_1,centroid_2", "1.0,6.0,0.5,0.5,0.5"]
    assert main(["section", cube, "0.25", "7", "--normal", "1", "0", "0"]) == 0
    header, *rows = capsys.readouterr().out.split()
    assert header == "plane,piece,ring,position_0,position_1,position_2"
    assert {row.split(",")[0] for row in rows} == {"0"}
    assert {row.split(",")[3] for row in rows} == {"0.25"}
    half, target = '{"type": "half_space", "normal": [0, 0, 1], "offset": -0.5}', str(tmp_path / "half.off")
    for keep, middle in (("inside", 0.75), ("outside", 0.25)):
        assert main(["cut", cube, half, "--keep", keep, "-o", target]) == 0
        solid = engine.read_mesh(target).solid()
        assert (engine.volume(solid), engine.centroid(solid).tolist()) == (0.5, [0.5, 0.5, middle])  # type: ignore[union-attr]
    assert main(["cut", cube, half, "-o", str(tmp_path / "half.stl")]) == 2
    assert "written to .off or .npz" in capsys.readouterr().err


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "off", "glb"])
def test_every_mesh_format(suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    trimesh = pytest.importorskip("trimesh", reason="the extra `formats` is not installed")
    path = tmp_path / f"box.{suffix}"
    trimesh.creation.box((2, 2, 2)).export(path)
    assert main(["contains", str(path), written(tmp_path, "p.csv", "0,0,0\n1,1,1\n1.5,0,0\n")]) == 0
    assert capsys.readouterr().out.split() == ["location", "inside", "boundary", "outside"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["contains", "missing.off", "p.csv"], "missing.off"),
        (["contains", "solid.txt", "p.csv"], "a solid is read from"),
        (["contains", '{"type": "sphere"', "p.csv"], "is not JSON"),
        (["contains", '{"type": "ball"}', "p.csv"], "got 'ball'"),
        (["contains", '{"type": "sphere", "centre": 1}', "p.csv"], "sphere lacks a field or has one too many"),
        (["contains", '{"type": "sphere", "center": [0, 0, 0], "radius": -1}', "p.csv"], "negative_radius at radius"),
        (["contains", SPHERE, "p.csv"], "rows of 3 numbers expected, the shape is (2, 2)"),
        (["contains", SPHERE, "bad.csv"], "could not convert string 'x' to float64 at row 1"),
        (["contains", SPHERE, "nan.csv"], "not_finite at points.1.0"),
        (["contains", "empty.stl", "p.csv"], "the stl file holds no faces"),
        (["contains", "broken.glb", "p.csv"], "cannot be read as glb"),
        (["contains", "open.off", "p.csv"], "not_closed"),
        (["clip", SPHERE, "p.csv"], "rows of 2 x 3 numbers expected"),
        (["overlay", "square.geojson", SPHERE], "no GeoJSON: its type is 'sphere'"),
        (["contains", BOX, "ok.csv", "-o", "out.xml"], "this answer is written to"),
    ],
)
def test_refusals_name_what_is_wrong(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("trimesh", reason="the extra `formats` is not installed")
    monkeypatch.chdir(tmp_path)
    written(tmp_path, "p.csv", "0,0\n1,1\n")
    written(tmp_path, "ok.csv", "0,0,0\n")
    written(tmp_path, "bad.csv", "0,0,0\n0,x,0\n")
    written(tmp_path, "nan.csv", "0,0,0\nnan,0,0\n")
    written(tmp_path, "empty.stl", "solid nothing")
    written(tmp_path, "broken.glb", "solid nothing")
    written(tmp_path, "open.off", CUBE_OFF.replace("8 6 0", "8 5 0").replace("4 1 2 6 5\n", ""))
    written(tmp_path, "square.geojson", SQUARE)
    assert main(arguments) == 2
    errors = capsys.readouterr().err
    assert errors.startswith("error: ")
    assert message in errors
    assert "Traceback" not in errors


@pytest.mark.parametrize("writes", [True, False])
def test_kernels_for_others_are_compiled_whatever_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], writes: bool
) -> None:
    """With an installed seed nothing was compiled, an empty one was written, and the exit code was 0."""
    around: list[dict[str, str]] = []

    def run(_: object, env: dict[str, str], check: bool) -> SimpleNamespace:
        around.append(env)
        Path(env["ENGINE_CACHE_DIR"]).mkdir(exist_ok=True)
        if writes:
            (Path(env["ENGINE_CACHE_DIR"]) / f"{len(around)}.nbc").touch()
        return SimpleNamespace(returncode=0)

    monkeypatch.setenv("ENGINE_CACHE_SEED", str(tmp_path / "seed"))
    monkeypatch.setattr("engine.warm_command.subprocess.run", run)
    assert main(["warm", "--into", str(tmp_path / "made"), "--cpu", "generic", "--processes", "1"]) == 2 * (not writes)
    assert {env["ENGINE_CACHE_SEED"] for env in around} == {""}
    assert {env["PYTHONHASHSEED"] for env in around} == {"0"}
    assert {env["NUMBA_CPU_NAME"] for env in around} == {"generic"}
    assert len({env["ENGINE_CACHE_DIR"] for env in around}) == 3  # a folder each, then all together
    assert (tmp_path / "made" / "MADE_BY").exists() == writes
    assert ("no kernel was written" in capsys.readouterr().err) != writes


@pytest.mark.parametrize("suffix", ["geojsonl", "gpkg", "fgb", "parquet", "geojson"])
def test_layers_are_written_as_files_of_many_kinds(tmp_path: Path, suffix: str) -> None:
    if suffix in ("gpkg", "fgb"):
        pytest.importorskip("pyogrio")
    if suffix == "parquet":
        pytest.importorskip("pyarrow")
    at = '{"type": "Feature", "properties": {"n": N}, "geometry": {"type": "Point", "coordinates": [N, 0]}}\n'
    source, mask, target = (tmp_path / name for name in ("a.geojsonl", "mask.geojson", f"made.{suffix}"))
    source.write_text("".join(at.replace("N", str(k)) for k in range(5)))
    mask.write_text('{"type": "Polygon", "coordinates": [[[1, -1], [3, -1], [3, 1], [1, 1], [1, -1]]]}')
    assert main(["crop", str(source), str(mask), "-o", str(target)]) == 0
    made = engine.read_layer(target)["features"]
    assert sorted(each["properties"]["n"] for each in made) == [1, 2, 3]  # FlatGeobuf sorts
    assert main(["nearest", str(mask), str(source), "-o", str(target), "-q"]) == 0
    assert len(engine.read_layer(target)["features"]) == 3
