"""Real meshes posted over HTTP: every answer equals the rational reference, which shares no code with the engine."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

import engine
from service.app import create_app
from service.settings import Settings
from tests.reference import containment, overlay, segments
from tests.reference.exact import q
from tests.unit.service.asking import client_of

MESHES = ["igl_bunny", "c3d_spot", "c3d_fandisk", "tm_quadknot", "tm_rabbit", "syn_menger2"]
IDENTITY = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
Json = dict[str, Any]

pytestmark = [pytest.mark.anyio]


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"


@pytest.fixture
async def client(monkeypatch: pytest.MonkeyPatch, anyio_backend: str) -> AsyncIterator[httpx.AsyncClient]:
    monkeypatch.setattr(engine, "warm", lambda **_: None)
    async with client_of(create_app(Settings(max_body_bytes=2**26, deadline_seconds=300))) as client:
        yield client


def load(data: Path, name: str) -> Json:
    with np.load(data / "meshes" / f"{name}.npz") as mesh:
        return {"type": "polyhedron", "vertices": mesh["vertices"].tolist(), "faces": mesh["faces"].tolist()}


async def post(client: httpx.AsyncClient, path: str, body: Json) -> Json:
    answer = await client.post(path, json=body, timeout=300)
    assert answer.status_code in (200, 201), answer.text[:1000]
    found: Json = answer.json()
    return found


@pytest.mark.some(1)
@pytest.mark.data
@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("n_checked", [16, pytest.param(1000, marks=pytest.mark.full)])
async def test_a_thousand_points(client: httpx.AsyncClient, data: Path, name: str, n_checked: int) -> None:
    solid = load(data, name)
    vertices = np.array(solid["vertices"])
    rng = np.random.default_rng(22)
    points = rng.uniform(vertices.min(axis=0), vertices.max(axis=0), (1000, 3))
    points[::8] = vertices[rng.integers(0, len(vertices), 125)]
    answer = await post(client, "/v1/contains", {"solid": solid, "points": points.tolist()})
    checked = np.linspace(0, 999, n_checked).astype(int)
    expected = containment.locate_many(points[checked].tolist(), solid)
    boundary = set(answer["boundary"])
    found = [0 if i in boundary else 1 if answer["contained"][i] else -1 for i in checked.tolist()]
    assert found == expected


@pytest.mark.data
async def test_two_posed_bunnies(client: httpx.AsyncClient, data: Path) -> None:
    """Apart by their boxes; a corner of one exactly on the leftmost corner of the other; a corner inside the other."""
    solid = load(data, "igl_bunny")
    vertices = np.round(np.array(solid["vertices"]) * 2**20) / 2**20  # so that the translations below are exact
    solid["vertices"] = vertices.tolist()
    left, right = vertices[vertices[:, 0].argmin()], vertices[vertices[:, 0].argmax()]
    middle = vertices.mean(axis=0)
    inside = vertices[np.abs(vertices - middle).sum(axis=1).argsort()[:200]]
    shifts = [(right - left) * 2, right - left]
    poses = [{"rotation": IDENTITY, "translation": shift.tolist()} for shift in shifts]
    # A pose that puts the leftmost corner of the second at a point which the reference finds inside the first.
    candidates = (inside + np.round(middle * 2**20) / 2**20) / 2
    held = next(p for p in candidates if containment.locate(p.tolist(), solid) == containment.INSIDE)
    poses.append({"rotation": IDENTITY, "translation": (held - left).tolist()})
    answer = await post(client, "/v1/collide", {"first": solid, "second": solid, "poses": poses})
    assert [found["relation"] for found in answer["collisions"]] == ["disjoint", "touching", "overlapping"]
    witness = answer["collisions"][1]["witness"]
    assert witness["kind"] == "vertex_vertex"


@pytest.mark.full
@pytest.mark.data
@pytest.mark.parametrize("n_checked", [6, pytest.param(200, marks=pytest.mark.full)])
async def test_segments_on_the_menger_sponge(client: httpx.AsyncClient, data: Path, n_checked: int) -> None:
    solid = load(data, "syn_menger2")
    vertices = np.array(solid["vertices"])
    rng = np.random.default_rng(7)
    ends = rng.uniform(vertices.min(axis=0) - 0.1, vertices.max(axis=0) + 0.1, (n_checked, 2, 3))
    ends[::3] = vertices[rng.integers(0, len(vertices), (len(ends[::3]), 2))]  # from corner to corner
    answer = await post(client, "/v1/clip/segments", {"region": solid, "segments": ends.tolist()})
    expected = [(source, *piece.rounded()) for source, piece in segments.clip_segments(ends.tolist(), solid)]
    found = [(piece["segment"], piece["start"], piece["end"], piece["t"]) for piece in answer["pieces"]]
    assert found == expected


@pytest.mark.parametrize("operation", ["intersection", "union", "difference", "symmetric_difference"])
async def test_a_concave_polygon_with_holes_on_another(client: httpx.AsyncClient, operation: str) -> None:
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    star = np.column_stack([np.cos(turn), np.sin(turn)]) * np.where(np.arange(24) % 2, 4.0, 10.0)[:, None]
    hole = np.column_stack([np.cos(turn[::-4]), np.sin(turn[::-4])])
    subject = {"type": "polygon", "rings": [star.tolist(), (hole * 2).tolist(), (hole * 0.5 + [6.0, 0.0]).tolist()]}
    clip = {"type": "polygon", "rings": [(star[:, ::-1] * [0.7, 1.1] + [1.0, 0.5]).tolist(), (hole * 1.5).tolist()]}
    answer = await post(client, "/v1/overlay", {"subject": subject, "clip": clip, "operation": operation})
    expected = overlay.overlay(subject, clip, operation)
    assert len(answer["pieces"]) == len(expected.pieces)
    area = sum(overlay.signed_area(ring) for p in answer["pieces"] for ring in (p["shell"], *p["holes"]))
    assert abs(area - expected.area) <= q(4.0) * q(2.0**-49) * 400  # 4 ulp of perimeter times largest coordinate
    subject_solid, clip_solid = engine.Polygon(subject["rings"]), engine.Polygon(clip["rings"])
    assert engine.overlay(subject_solid, clip_solid, operation).area_exact == expected.area
