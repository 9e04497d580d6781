"""The OpenAPI document is a stored file, so that a change shows up in review, and keeps the rules of generators.

Written anew by ``python -m tests.contract.test_openapi``.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from service.app import create_app
from service.settings import Settings

STORED = Path(__file__).with_name("openapi.json")
OPERATIONS = {
    ("post", "/v1/contains"): "contains",
    ("post", "/v1/contains/scene"): "contains_scene",
    ("post", "/v1/clip/polygons"): "clip_polygons",
    ("post", "/v1/overlay"): "overlay",
    ("post", "/v1/bounds"): "bounds",
    ("post", "/v1/clearance"): "clearance",
    ("post", "/v1/compare"): "compare",
    ("post", "/v1/collide"): "collide",
    ("post", "/v1/collide/scene"): "collide_scene",
    ("post", "/v1/clip/segments"): "clip_segments",
    ("post", "/v1/solids"): "put_solid",
    ("post", "/v1/solids/import"): "import_solid",
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
    "/v1/solids/{solid_id}/contains": "application/octet-stream",
    "/v1/solids/{solid_id}/clip/segments": "application/octet-stream",
}


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
            if key not in ("examples", "example"):
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
                assert list(operation["requestBody"]["content"]) == [kind]
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
    assert center == {"type": "array", "minItems": 2, "maxItems": 3, "items": number}


def test_the_union_of_solids_is_named_and_told_apart(made: dict[str, Any]) -> None:
    solid = made["components"]["schemas"]["Solid"]
    assert solid["discriminator"]["propertyName"] == "type"
    refs = {member["$ref"] for member in solid["oneOf"]}
    assert refs == set(solid["discriminator"]["mapping"].values())
    assert len(refs) == 11
    operands = made["components"]["schemas"]["CsgSolid"]["properties"]["operands"]
    assert operands["items"] == {"$ref": "#/components/schemas/Solid"}


def test_limits_stand_in_the_document_and_follow_the_settings(made: dict[str, Any]) -> None:
    assert "x-limit" not in json.dumps(made)
    small = create_app(Settings(max_faces=7)).openapi()["components"]["schemas"]
    assert small["PolyhedronSolid"]["properties"]["faces"]["maxItems"] == 7


def test_unknown_fields_are_refused_everywhere(made: dict[str, Any]) -> None:
    for name, schema in made["components"]["schemas"].items():
        if schema.get("type") == "object":
            assert schema["additionalProperties"] is False, name


if __name__ == "__main__":
    STORED.write_text(text(document()), "utf-8")
