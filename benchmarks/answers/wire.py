"""Questions to the service, in this process: every POST endpoint, JSON and octets, good requests and broken ones."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from functools import partial
from typing import Any
from unittest import mock

import httpx

import engine
from benchmarks.answers import overlays, shapes, solids
from benchmarks.answers.asking import Question, drawn_by
from benchmarks.answers.draws import NEAR_PLACES, Array, Draw
from benchmarks.answers.solids import points_about
from benchmarks.workloads import document
from service.app import create_app
from service.settings import Settings

Request = tuple[str, Any]
"""Path and body: a value for JSON, bytes for octets."""
_KEPT_HEADERS = ("location", "etag", "allow", "accept-post", "content-type")
_LEFT_OUT = ("memory", "largest_displacement")
"""Members of answers that depend on structures, and a bound that depends on the order of edges."""


def answers_to(requests: list[Request], workers: int | None) -> tuple[int, Any]:
    """Return status, some headers and body of the answers of a new service, one request after another."""
    with mock.patch.object(engine, "warm", return_value=None):  # kernels load when they are first used
        return len(requests), asyncio.run(_ask(requests))


async def _ask(requests: list[Request]) -> list[Any]:
    app = create_app(Settings(deadline_seconds=300.0, access_log=False))
    answers = []
    async with app.router.lifespan_context(app):
        app.state.warm.wait(60)
        transport = httpx.ASGITransport(app=app)
        async with httpx.AsyncClient(transport=transport, base_url="http://test", timeout=None) as client:
            for path, body in requests:
                kind = "application/octet-stream" if isinstance(body, bytes) else "application/json"
                content = body if isinstance(body, bytes | str) else json.dumps(body)
                answers.append(_said(await client.post(path, content=content, headers={"content-type": kind})))
    return answers


def _said(answer: httpx.Response) -> Any:
    headers = {name: answer.headers[name] for name in _KEPT_HEADERS if name in answer.headers}
    is_json = "json" in headers.get("content-type", "")
    return [answer.status_code, headers, _without_costs(answer.json()) if is_json else answer.content]


def _without_costs(body: Any) -> Any:
    if not isinstance(body, dict):
        return body
    remaining = {name: _without_costs(value) for name, value in body.items() if name not in _LEFT_OUT}
    if "accuracy" in remaining:
        remaining["accuracy"] = remaining["accuracy"]["decisions"]
    return remaining


def _pose(draw: Draw, dimension: int) -> dict[str, Any]:
    pose = solids.pose(draw, dimension)
    return {"rotation": pose.rotation.tolist(), "translation": pose.translation.tolist()}


def _shape(draw: Draw, makers: Any, dimension: int) -> tuple[dict[str, Any], Array]:
    """Return a solid with a JSON form, and its targets."""
    while True:  # bound: a callable is rare
        shape = draw.pick(makers)(draw, dimension, draw.pick(NEAR_PLACES))
        if not _holds_callable(shape.solid):
            return document(shape.solid), shape.targets


def _holds_callable(solid: Any) -> bool:
    if isinstance(solid, engine.Csg):
        return any(map(_holds_callable, solid.operands))
    return isinstance(solid, engine.Implicit) and solid.function is not None


def _bodies(draw: Draw, makers: Any, dimension: int, n: int, share_posed: float) -> list[dict[str, Any]]:
    result = [{"solid": _shape(draw, makers, dimension)[0]} for _ in range(n)]
    return [body | ({"pose": _pose(draw, dimension)} if draw.chance(share_posed) else {}) for body in result]


def _good(draw: Draw, dimension: int) -> Iterator[Request]:
    n, located, collided = draw.pick([3, 40, 400]), solids.LOCATED[dimension], solids.COLLIDED[dimension]
    solid, targets = _shape(draw, located, dimension)
    yield "/v1/contains", {"solid": solid, "points": points_about(draw, targets, n).tolist()}
    bodies = _bodies(draw, located, dimension, 4, 0.5)
    yield "/v1/contains/scene", {"bodies": bodies, "points": points_about(draw, targets, n).tolist()}
    first, second = (_shape(draw, collided, dimension)[0] for _ in range(2))
    yield "/v1/collide", {"first": first, "second": second}
    poses = [_pose(draw, dimension) for _ in range(5)]
    yield "/v1/collide", {"first": first, "second": second, "poses": poses, "detail": True}
    bodies = _bodies(draw, collided, dimension, 6, 0.3)
    yield "/v1/collide/scene", {"bodies": bodies, "skip": [[0, 1]], "detail": draw.chance(0.5)}
    region, targets = _shape(draw, solids.REGIONS[dimension], dimension)
    segments = points_about(draw, targets, 2 * n).reshape(n, 2, dimension)
    yield "/v1/clip/segments", {"region": region, "segments": segments.tolist()}
    region, targets = _shape(draw, (solids.half_space, solids.aabb, solids.convex), dimension)
    polygons = [[points_about(draw, targets, draw.one(3, 6)).tolist()] for _ in range(5)]
    yield "/v1/clip/polygons", {"region": region, "polygons": polygons}
    subject, clip = (
        {"type": "polygon", "rings": [ring.tolist() for ring in side]} for side in overlays.any_rings(draw)
    )
    for name in overlays.OPERATIONS:
        yield "/v1/overlay", {"subject": subject, "clip": clip, "operation": name}
    yield "/v1/bounds", {"solid": region if draw.chance(0.3) else first}
    yield "/v1/solids", solid


def _broken(draw: Draw, request: Request) -> Request:
    """Return a request with one fault."""
    path, body = request
    match draw.one(0, 4):
        case 0:
            return path, json.dumps(body)[: draw.one(1, 60)]
        case 1:
            return path, {**body, "unknown": 1}
        case 2:
            return path, dict(list(body.items())[1:])
        case 3:
            return path, json.dumps(body).replace("0,", draw.pick(["null,", '"0",', "1e999,", "true,", "[],"]), 1)
    return path, json.dumps(body).encode()


@drawn_by("http", 20)
def json_requests(draw: Draw) -> Iterator[Question]:
    requests = [request for dimension in (2, 3) for request in _good(draw, dimension)]
    yield partial(answers_to, requests + [_broken(draw, request) for request in requests])


@drawn_by("http", 10)
def stored_solids(draw: Draw) -> Iterator[Question]:
    """Solids stored twice, referenced by id in JSON and in octets; octets of a wrong length."""
    requests: list[Request] = []
    for dimension in (2, 3):
        for makers in (solids.LOCATED[dimension], solids.REGIONS[dimension][:-1]):
            solid, targets = _shape(draw, makers, dimension)
            name = _id_of(solid)
            points, stored = points_about(draw, targets, 200).astype("<f8"), {"type": "stored", "id": name}
            queried, clipped = f"/v1/solids/{name}/contains", f"/v1/solids/{name}/clip/segments"
            requests += [
                (queried, points.tobytes()), ("/v1/solids", solid), ("/v1/solids", solid), (queried, points.tobytes()),
                (queried, b"1234567"), (clipped, points.tobytes()),
                ("/v1/contains", {"solid": stored, "points": points.tolist()}), ("/v1/bounds", {"solid": stored}),
            ]  # fmt: skip
    yield partial(answers_to, requests)


def _id_of(solid: dict[str, Any]) -> str:
    """Return the id that the service gives a solid."""
    _, [[_, _, body]] = answers_to([("/v1/solids", solid)], None)
    return str(body["id"])


@drawn_by("http", 2)
def long_lists(draw: Draw) -> Iterator[Question]:
    """Enough items that they are encoded in parts."""
    shape = solids.aabb(draw, 2)
    points = draw.uniform(-4.0, 4.0, 42_000, 2)
    box = document(shape.solid)
    requests: list[Request] = [("/v1/contains", {"solid": box, "points": points.tolist()})]
    requests.append(("/v1/contains/scene", {"bodies": [{"solid": box}], "points": points.tolist()}))
    requests.append(("/v1/clip/segments", {"region": box, "segments": points.reshape(-1, 2, 2).tolist()}))
    yield partial(answers_to, requests)


@drawn_by("http", 1)
def mesh_files(draw: Draw) -> Iterator[Question]:
    """A file of the format that needs nothing but numbers (extra `formats`)."""
    requests: list[Request] = []
    for make in shapes.MESHES:
        vertices, faces = make(draw)
        rows = [" ".join(map(repr, row)) for row in vertices.tolist()]
        rows += [" ".join(map(str, [3, *row])) for row in faces.tolist()]
        text = "\n".join(["OFF", f"{len(vertices)} {len(faces)} 0", *rows, ""])
        requests.append(("/v1/solids/import?format=off", text.encode()))
    yield partial(answers_to, requests)
