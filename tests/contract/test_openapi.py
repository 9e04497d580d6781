"""The OpenAPI document is a stored file, so that a change shows up in review, and keeps the rules of generators.

Written again by ``python -m tests.contract.test_openapi``, and so are the examples of answers: what the service answers
to the examples of its questions. Every property of every model has a description and an example. A new question needs
its ``with_example``, a new property its ``Field(description=...)``; one that no example of a question or an answer
shows, ``examples=[...]`` too.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import anyio
import pytest

import engine
from service import body
from service.app import create_app
from service.openapi import ANSWERS as EXAMPLES
from service.settings import Settings
from tests.unit.service.asking import SHEET, client_of, examples, of_scene

STORED = Path(__file__).with_name("openapi.json")
OPERATIONS = {
    ("post", "/v1/contains"): "contains",
    ("post", "/v1/contains/scene"): "contains_scene",
    ("post", "/v1/clip/polygons"): "clip_polygons",
    ("post", "/v1/overlay"): "overlay",
    ("post", "/v1/overlay/batch"): "overlay_batch",
    ("post", "/v1/bounds"): "bounds",
    ("post", "/v1/volume"): "volume",
    ("post", "/v1/section"): "section",
    ("post", "/v1/cut"): "cut",
    ("post", "/v1/overlap"): "overlap",
    ("post", "/v1/clearance"): "clearance",
    ("post", "/v1/distances"): "distances",
    ("post", "/v1/compare"): "compare",
    ("post", "/v1/collide"): "collide",
    ("post", "/v1/collide/scene"): "collide_scene",
    ("post", "/v1/clip/segments"): "clip_segments",
    ("post", "/v1/clip/lines"): "clip_lines",
    ("post", "/v1/hits"): "hits",
    ("post", "/v1/scenes/{scene_id}/hits"): "hits_stored_scene",
    ("post", "/v1/scenes/{scene_id}/binary/hits"): "hits_stored_scene_binary",
    ("post", "/v1/solids/{solid_id}/hits"): "hits_stored",
    ("post", "/v1/layers/overlay"): "overlay_layers",
    ("post", "/v1/layers/union"): "unite_layer",
    ("post", "/v1/layers/contains"): "locate_in_layer",
    ("post", "/v1/layers/clip"): "clip_layer",
    ("post", "/v1/layers/join"): "join_layers",
    ("post", "/v1/layers/nearest"): "join_nearest",
    ("post", "/v1/layers/split"): "split_layer",
    ("post", "/v1/layers/stream"): "stream_features",
    ("post", "/v1/clip/segments/scene"): "clip_segments_scene",
    ("post", "/v1/scenes"): "put_scene",
    ("get", "/v1/scenes/{scene_id}"): "get_scene",
    ("head", "/v1/scenes/{scene_id}"): "has_scene",
    ("post", "/v1/scenes/{scene_id}/contains"): "contains_stored_scene",
    ("post", "/v1/scenes/{scene_id}/distances"): "distances_stored_scene",
    ("post", "/v1/scenes/{scene_id}/binary/distances"): "distances_stored_scene_binary",
    ("post", "/v1/solids/{solid_id}/distances"): "distances_stored",
    ("post", "/v1/scenes/{scene_id}/collide"): "collide_stored_scene",
    ("post", "/v1/scenes/{scene_id}/clip/segments"): "clip_segments_stored_scene",
    ("post", "/v1/scenes/{scene_id}/binary/contains"): "contains_stored_scene_binary",
    ("post", "/v1/scenes/{scene_id}/binary/clip/segments"): "clip_segments_stored_scene_binary",
    ("post", "/v1/solids"): "put_solid",
    ("post", "/v1/solids/import"): "import_solid",
    ("post", "/v1/solids/inspect"): "inspect_solid",
    ("post", "/v1/solids/{solid_id}/contains"): "contains_stored",
    ("post", "/v1/solids/{solid_id}/clip/segments"): "clip_segments_stored",
    ("get", "/v1/solids/{solid_id}"): "get_solid",
    ("head", "/v1/solids/{solid_id}"): "has_solid",
    ("get", "/healthz"): "healthz",
    ("get", "/readyz"): "readyz",
    ("get", "/metrics"): "metrics",
}

ANSWERS = {
    "/metrics": "text/plain",
    **dict.fromkeys(
        [f"/v1/layers/{name}" for name in ("overlay", "union", "contains", "clip", "join", "nearest", "split")],
        "application/geo+json",
    ),
    "/v1/layers/stream": "application/x-ndjson",
    "/v1/scenes/{scene_id}/binary/contains": "application/octet-stream",
    "/v1/scenes/{scene_id}/binary/clip/segments": "application/octet-stream",
    "/v1/scenes/{scene_id}/binary/distances": "application/octet-stream",
    "/v1/solids/{solid_id}/distances": "application/octet-stream",
    "/v1/scenes/{scene_id}/binary/hits": "application/octet-stream",
    "/v1/solids/{solid_id}/hits": "application/octet-stream",
    "/v1/solids/{solid_id}/contains": "application/octet-stream",
    "/v1/solids/{solid_id}/clip/segments": "application/octet-stream",
}

FILES = dict.fromkeys(("/v1/solids", "/v1/solids/inspect"), (*body.FILES, body.MULTIPART))
"""Files that are taken beside JSON, by path."""


def document() -> dict[str, Any]:
    """Return the document with the default settings, without the version (a release must not touch the file)."""
    made = create_app(Settings(concurrency=1)).openapi()
    return {**made, "info": {**made["info"], "version": "stored without"}}


def text(made: dict[str, Any]) -> str:
    return json.dumps(made, indent=1) + "\n"


@pytest.fixture(scope="module")
def made() -> dict[str, Any]:
    return document()


def schemas(node: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], dict[str, Any]]]:
    """Yield every JSON schema of the document with its path."""
    if isinstance(node, list):
        for i_item, item in enumerate(node):
            yield from schemas(item, (*path, str(i_item)))
    elif isinstance(node, dict):
        if {"type", "$ref", "oneOf"} & set(node) and path[-1:] != ("properties",):
            yield path, node
        for key, value in node.items():
            if key not in ("examples", "example", "securitySchemes"):
                yield from schemas(value, (*path, key))


def test_document_is_the_stored_one(made: dict[str, Any]) -> None:
    assert text(made) == STORED.read_text("utf-8"), "the API changed: python -m tests.contract.test_openapi"


def test_operations_have_names_of_their_own(made: dict[str, Any]) -> None:
    found = {
        (method, path): operation["operationId"]
        for path, item in made["paths"].items()
        for method, operation in item.items()
    }
    assert found == OPERATIONS


def test_one_media_type_for_each_operation_and_direction(made: dict[str, Any]) -> None:
    for path, item in made["paths"].items():
        for operation in item.values():
            if "requestBody" in operation:
                is_binary = "binary" in operation["tags"]
                kind = "application/octet-stream" if is_binary else "application/json"
                kind = ANSWERS[path] if path.endswith("/stream") else kind
                assert list(operation["requestBody"]["content"]) == [kind]
                assert list(operation["requestBody"].get("x-also-accepts", ())) == [*FILES.get(path, ())]
                assert operation["requestBody"]["required"] is True
            for status, response in operation["responses"].items():
                answer = ANSWERS.get(path, "application/json")
                expected = answer if status < "300" else "application/problem+json"
                assert list(response.get("content", {expected: 0})) == [expected]


def test_every_error_is_described(made: dict[str, Any]) -> None:
    for path, item in made["paths"].items():
        if path.startswith("/v1/") and "post" in item:
            body = set() if "binary" in item["post"]["tags"] else {"400"}
            assert body | {"404", "408", "413", "415", "422", "503", "504"} <= set(item["post"]["responses"])


def test_every_number_has_a_format(made: dict[str, Any]) -> None:
    formats = {"number": "double", "integer": "int64"}
    for path, schema in schemas(made):
        if schema.get("type") in formats:
            assert schema.get("format") == formats[schema["type"]], path


def test_nothing_that_generators_choke_on(made: dict[str, Any]) -> None:
    for path, schema in schemas(made):
        assert "prefixItems" not in schema, path
        assert "anyOf" not in schema, path
        assert schema.get("type") != "null", path
        assert not isinstance(schema.get("type"), list), path
        assert "default" not in schema, path
    assert not {"Box", "Ref"} & set(made["components"]["schemas"])


def test_positions_are_arrays_of_two_to_three_numbers(made: dict[str, Any]) -> None:
    center = made["components"]["schemas"]["SphereSolid"]["properties"]["center"]
    number = {"type": "number", "format": "double"}
    expected = {"type": "array", "minItems": 2, "maxItems": 3, "items": number}
    assert {name: center[name] for name in expected} == expected


def test_the_union_of_solids_is_named_and_told_apart(made: dict[str, Any]) -> None:
    solid = made["components"]["schemas"]["Solid"]
    assert (solid["type"], solid["discriminator"]["propertyName"]) == ("object", "type")
    refs = {member["$ref"] for member in solid["oneOf"]}
    assert refs == set(solid["discriminator"]["mapping"].values())
    assert len(refs) == 12
    operands = made["components"]["schemas"]["CsgSolid"]["properties"]["operands"]
    assert operands["items"] == {"$ref": "#/components/schemas/Solid"}


def test_every_schema_has_its_name_as_title(made: dict[str, Any]) -> None:
    """Viewers show the members of a union by their titles."""
    for name, schema in made["components"]["schemas"].items():
        assert schema["title"] == name


def test_every_property_has_a_description_and_an_example(made: dict[str, Any]) -> None:
    found = made["components"]["schemas"]
    for name, schema in found.items():
        for field, part in schema.get("properties", {}).items():
            assert part.get("description"), f"{name}.{field}: Field(description=...) is missing"
            referred = found.get(part.get("$ref", "").rpartition("/")[2], {})
            shown = part.get("examples") or referred.get("examples")
            assert shown, f"{name}.{field}: no example shows it; see the head of this file"


def test_every_question_and_answer_has_an_example(made: dict[str, Any]) -> None:
    for path, item in made["paths"].items():
        for operation in item.values():
            bodies = [operation.get("requestBody", {})]
            bodies += [answer for status, answer in operation["responses"].items() if status < "300"]
            for each in bodies:
                for media_type, content in each.get("content", {}).items():
                    assert media_type != "application/json" or content["examples"], path
            for status, answer in operation["responses"].items():
                if status >= "400":
                    assert answer["content"]["application/problem+json"]["example"]["status"] == int(status)


def answers() -> dict[str, list[Any]]:
    """Return what the service answers to the examples of its questions, by the model of the answer."""
    app = create_app(Settings(concurrency=1, deadline_seconds=300))
    paths = app.openapi()["paths"]

    async def ask() -> dict[str, list[Any]]:
        found: dict[str, list[Any]] = {}
        async with client_of(app) as client:
            sheet = (await client.post("/v1/scenes", json=SHEET)).json()["id"]
            for path, example in examples(app.openapi()):
                answer = await client.post(of_scene(path, sheet), json=example)
                content = paths[path]["post"]["responses"][str(answer.status_code)]["content"]
                media_type = answer.headers["content-type"].partition(";")[0]
                assert media_type in content, answer.text
                name = content[media_type]["schema"]["$ref"].rpartition("/")[2]
                found.setdefault(name, []).append(answer.json())
        return found

    return anyio.run(ask)


def lasting(answer: Any) -> Any:
    """Return an answer without what changes from time to time: seconds, and what its accuracy took."""
    return {name: value for name, value in answer.items() if not name.startswith(("seconds", "accuracy"))}


def test_the_examples_of_answers_are_what_is_answered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "warm", lambda **_: None)
    found, stored = answers(), json.loads(EXAMPLES.read_text("utf-8"))
    assert sorted(found) == sorted(stored), "a question is new: python -m tests.contract.test_openapi"
    for name, items in found.items():
        assert [*map(lasting, items)] == [*map(lasting, stored[name])], name


def test_keys_are_described(made: dict[str, Any]) -> None:
    schemes = made["components"]["securitySchemes"]
    assert {(scheme["type"], scheme.get("scheme")) for scheme in schemes.values()} == {
        ("http", "bearer"),
        ("apiKey", None),
    }
    assert made["security"][0] == {}
    asking = create_app(Settings(api_keys="a", root_path="/geometry")).openapi()
    assert asking["security"] == [{"bearer": []}, {"key": []}]
    assert asking["servers"][0]["url"] == "/geometry"
    assert asking["paths"]["/healthz"]["get"]["security"] == []


@pytest.mark.full
@pytest.mark.skipif(shutil.which("npm") is None, reason="no npm is installed")
def test_linters_find_nothing(tmp_path: Path) -> None:
    """Redocly's recommended rules and spectral's own: no error and no warning."""
    packages = ("@redocly/cli@2", "@stoplight/spectral-cli@6")
    words = ("npm", "install", "--silent", "--no-audit", "--no-fund", "--ignore-scripts", *packages)
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    if done.returncode:
        pytest.skip("npm cannot install the linters here")
    (tmp_path / ".spectral.yaml").write_text('extends: ["spectral:oas"]\n')
    (tmp_path / "redocly.yaml").write_text("extends: [recommended]\n")
    for command in (
        ("redocly", "lint", "--max-problems=1000", str(STORED)),
        ("spectral", "lint", "--fail-severity=warn", str(STORED)),
    ):
        done = subprocess.run(("npx", *command), cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        assert "Warning was generated" not in done.stdout + done.stderr, done.stdout + done.stderr


def test_limits_stand_in_the_document_and_follow_the_settings(made: dict[str, Any]) -> None:
    assert "x-limit" not in json.dumps(made)
    small = create_app(Settings(max_faces=7)).openapi()["components"]["schemas"]
    assert small["PolyhedronSolid"]["properties"]["faces"]["maxItems"] == 7


def test_unknown_fields_are_refused_everywhere(made: dict[str, Any]) -> None:
    for name, schema in made["components"]["schemas"].items():
        if "properties" in schema:  # GeoJSON has members of its own and of others (RFC 7946, 6.1)
            assert schema["additionalProperties"] is name.startswith("GeoJson"), name


@pytest.mark.parametrize(("model", "name", "kind"), [
    ("ContainsRequest", "points", "MultiPoint"), ("CompareRequest", "points", "MultiPoint"),
    ("ClipSegmentsRequest", "segments", "LineString"), ("ClipLinesRequest", "lines", "MultiLineString"),
    ("ClipPolygonsRequest", "polygons", "FeatureCollection"), ("OverlayBatchRequest", "clips", "GeometryCollection"),
])  # fmt: skip
def test_geojson_in_place_of_an_array_has_a_schema(made: dict[str, Any], model: str, name: str, kind: str) -> None:
    """Beside that of the array: generators would make an object of a union (`test_clients.py`)."""
    field = made["components"]["schemas"][model]["properties"][name]
    assert field["type"] == "array"
    assert kind in field["x-also-accepts"]["properties"]["type"]["enum"]


if __name__ == "__main__":
    engine.warm = lambda **_: None  # what is asked compiles what it needs
    made_anew, stored = answers(), json.loads(EXAMPLES.read_text("utf-8"))
    for name, items in made_anew.items():
        if [*map(lasting, items)] == [*map(lasting, stored.get(name, []))]:
            made_anew[name] = stored[name]  # no change for the sake of seconds
    EXAMPLES.write_text(json.dumps(made_anew, indent=1) + "\n", "utf-8")
    STORED.write_text(text(document()), "utf-8")
