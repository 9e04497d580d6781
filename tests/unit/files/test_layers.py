"""Layers from files: GeoJSON as text, open files and bytes, other formats through geopandas; errors in words."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import pytest

import engine
from engine.__main__ import main
from engine.files.layers import write_layer

RING = [[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]]
POLYGON = {"type": "Polygon", "coordinates": [RING]}
LAYER = {"type": "FeatureCollection", "name": "parcels", "features": [
    {"type": "Feature", "properties": {"owner": "Ada"}, "geometry": POLYGON}]}  # fmt: skip


def test_geojson_is_read_from_wherever_it_is(tmp_path: Path) -> None:
    octets = b"\xef\xbb\xbf\n " + json.dumps(LAYER).encode()
    path = tmp_path / "a.geojson"
    path.write_bytes(octets)
    for given in (path, str(path), octets, io.BytesIO(octets)):
        assert engine.read_layer(given) == LAYER
    with path.open("rb") as file:
        assert engine.read_layer(file) == LAYER
    assert engine.read_layer(json.dumps(POLYGON).encode())["features"][0]["geometry"] == POLYGON
    assert engine.locate([(1, 1)], engine.read_layer(path)).tolist() == [1]
    rows = engine.layers.overlay_features(engine.read_layer(path), LAYER, "intersection")
    assert [row["properties"] for row in rows] == [{"owner_1": "Ada", "owner_2": "Ada"}]


@pytest.mark.parametrize("suffix", ["gpkg", "shp", "fgb", "parquet"])
def test_other_formats_come_through_geopandas(tmp_path: Path, suffix: str) -> None:
    geopandas = pytest.importorskip("geopandas")
    frame = geopandas.GeoDataFrame.from_features(LAYER["features"], crs="EPSG:25832")
    path = tmp_path / f"a.{suffix}"
    if suffix == "parquet":
        pytest.importorskip("pyarrow")
        frame.to_parquet(path)
        for given in (path.read_bytes(), io.BytesIO(path.read_bytes())):  # known by its contents
            assert engine.read_layer(given) == engine.read_layer(path)
        wide = [{**LAYER["features"][0], "properties": {"owner": None, "n": n}} for n in range(3)]
        write_layer(str(tmp_path / "b.parquet"), wide, None)
        assert [each["properties"]["n"] for each in engine.read_layer(tmp_path / "b.parquet")["features"]] == [0, 1, 2]
        path.with_name("c.parquet").write_bytes(path.read_bytes()[:-9])
        with pytest.raises(engine.InvalidInputError, match="cannot be read as a layer"):
            engine.read_layer(path.with_name("c.parquet"))
    else:
        frame.to_file(path)
    layer = engine.read_layer(path)
    assert layer["features"][0]["properties"] == {"owner": "Ada"}
    assert "25832" in json.dumps(layer["crs"])
    assert engine.union_all(layer).area == 4.0


@pytest.mark.parametrize(("given", "words"), [
    (b"{", "is not JSON"), (b"[" * 9, "geopandas|cannot be read as a layer"), (b"", "no GeoJSON"),
    (b'{"type": "sphere"}', "no GeoJSON: its type is 'sphere'"), (b"{" + b"\xff", "no text in UTF-8"),
    ("nowhere.geojson", "nowhere.geojson: there is no such file"), (7, "file must be a path"),
    (io.StringIO("{}"), "open for reading bytes"), ("/", "it is a folder, not a file"),
    *((b'{"type": "Point", "coordinates": [1, 2]}\n{"type": "FeatureCollection"%b}' % features, "line 2 .* no feature")
      for features in (b"", b', "features": 5', b', "features": [1]')),
])  # fmt: skip
def test_what_is_no_layer_is_refused_in_words(given: Any, words: str) -> None:
    with pytest.raises(engine.InvalidInputError, match=words) as error:
        engine.read_layer(given)
    assert "Errno" not in str(error.value)
    assert "codec" not in str(error.value)


@pytest.mark.parametrize("command", [
    "contains nowhere.stl p.npy", "contains box.json nowhere.csv", "overlay nowhere.geojson a.geojson",
    "contains box.json latin.csv", "contains latin.json p.npy", "contains box.json latin.geojson",
    "contains box.json nowhere.npy", "bounds .",
])  # fmt: skip
def test_the_command_line_speaks_in_words(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("box.json").write_text('{"type": "aabb", "min": [0, 0], "max": [1, 1]}')
    for name in ("latin.csv", "latin.json", "latin.geojson"):
        Path(name).write_bytes(b"\xfc, 1\n")
    assert main(command.split()) == 2
    said = capsys.readouterr().err
    assert "Errno" not in said
    assert "codec" not in said
    assert command.split()[1] in said or command.split()[2] in said


def test_files_without_geometries_are_refused(tmp_path: Path) -> None:
    pytest.importorskip("geopandas")
    (tmp_path / "a.csv").write_text("a,b\n1,2\n")
    with pytest.raises(engine.InvalidInputError, match=r"a.csv has no geometries; its columns are \['a', 'b'\]"):
        engine.read_layer(tmp_path / "a.csv")
    feature = {"type": "Feature", "properties": {"geometry": 3}, "geometry": POLYGON}
    with pytest.raises(engine.InvalidInputError, match="no place for a property named geometry"):
        write_layer(str(tmp_path / "a.gpkg"), [feature], None)
    write_layer(str(tmp_path / "b.gpkg"), LAYER["features"], {"type": "name", "properties": None})
    assert engine.union_all(engine.read_layer(tmp_path / "b.gpkg")).area == 4.0
