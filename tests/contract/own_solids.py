"""Two solids of the test's own, registered with the fewest cells, and every question about them: `python own_solids.py`
prints a line of JSON for each, the question and what came of it."""

from __future__ import annotations

import json
import pickle
import traceback
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np

import engine
from engine.solids import registry
from engine.solids.checks import as_number, as_vector


class Diamond(engine.Solid):
    """All points at most `reach` from `center`, as the sum of the distances along the axes."""

    __slots__ = ("center", "reach")
    type: ClassVar[str] = "diamond"
    _pickled: ClassVar[tuple[str, ...]] = ("center", "reach")
    center: Any
    reach: float

    def __init__(self, center: object, reach: object) -> None:
        vector = as_vector(center, None, ("center",))
        self._set(dimension=len(vector), center=vector, reach=as_number(reach, ("reach",)))


class Fog(engine.Solid):
    """A solid that can do nothing."""

    __slots__ = ("center",)
    type: ClassVar[str] = "fog"
    _pickled: ClassVar[tuple[str, ...]] = ("center",)

    def __init__(self, center: object) -> None:
        vector = as_vector(center, None, ("center",))
        self._set(dimension=len(vector), center=vector)


def in_diamond(point: Any, solid: Diamond, _: object) -> int:
    """Return the location of a point, exactly."""
    rest = Fraction(solid.reach) - sum(abs(Fraction(x) - Fraction(c)) for x, c in zip(point, solid.center.tolist()))
    return (rest > 0) - (rest < 0)


CENTER = {"center": registry.Field("position", "Its middle.")}
registry.register(
    registry.Row(
        solid=Diamond,
        about="An octahedron, or a square on its corner.",
        fields={**CENTER, "reach": registry.Field("number", "How far it reaches.")},
        stored=("center", "reach"),
        exact=in_diamond,
    )
)
registry.register(registry.Row(solid=Fog, about="Nothing.", fields=CENTER))

SQUARE = {2: [[[0, 0], [2, 0], [2, 2], [0, 2]]], 3: [[[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]]}


def others(d: int) -> dict[str, engine.Solid]:
    """Return a solid of each type, of one dimension."""
    box = engine.Aabb([0] * d, [1] * d)
    found: list[engine.Solid] = [
        engine.HalfSpace([1] * d, 0), engine.Sphere([0] * d, 1), box, engine.Convex(box.rows),
        engine.Csg("union", [box]),
        engine.Implicit([{"powers": [1] * d, "coefficient": 1}]), engine.Triangle(np.eye(3)[:, :d]),
    ]  # fmt: skip
    mesh = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
    found += [engine.Polygon(SQUARE[2])] if d == 2 else [engine.Polyhedron(*mesh), engine.Surface(*mesh)]
    return {solid.type: solid for solid in found}


def engine_questions(solid: Any) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Yield every public question that takes a solid."""
    d = solid.dimension
    points, segments, poses = [[0.25] * d, [9] * d], [[[-2] * d, [2] * d]], (np.eye(d)[None], np.zeros((1, d)))
    pose = engine.Pose(np.eye(d)[::-1] * ([1] * (d - 1) + [-1] if d == 2 else [-1] * 3), [0.5] * d)
    for name in ("locate", "contains"):
        yield name, lambda name=name: getattr(engine, name)(points, solid)
        yield f"{name} report", lambda name=name: getattr(engine, name)(np.zeros((2000, d)), solid, report=True)
    yield "bounds", lambda: engine.bounds(solid)
    for its_pose in (None, pose):
        yield f"distances {its_pose}", lambda p=its_pose: engine.distances(points, solid, pose=p)
    yield "distances nearest", lambda: engine.distances(points, solid, nearest=True)
    yield "distances within", lambda: engine.distances(points, solid, within=1.0)
    yield "volume", lambda: engine.volume(solid)
    yield "area", lambda: engine.area(solid)
    yield "centroid", lambda: engine.centroid(solid)
    yield "section", lambda: engine.section(solid, [0.5])
    yield "cut", lambda: engine.cut(solid, engine.HalfSpace([1] * d, 0))
    yield "overlap_volume", lambda: engine.overlap_volume(solid, engine.Aabb([0] * d, [1] * d))
    yield "clip_segments", lambda: engine.clip_segments(segments, solid)
    yield "hits", lambda: engine.hits(segments, solid)
    yield "clip_lines", lambda: engine.clip_lines(segments, solid)
    yield "clip_polygons", lambda: engine.clip_polygons([SQUARE[d]], solid)
    yield "repr", lambda: repr(solid)
    yield "pickle", lambda: pickle.loads(pickle.dumps(solid)).type
    yield "csg", lambda: engine.locate(points, engine.Csg("union", [solid, engine.Sphere([0] * d, 1)]))
    yield "pickled csg", lambda: pickle.loads(pickle.dumps(engine.Csg("union", [solid]))).type
    for kind, other in others(d).items():
        for first, second in ((solid, other), (other, solid)):
            at = f"{first.type} {second.type}"
            yield f"collide {at}", lambda a=first, b=second: engine.collide(a, b)
            yield f"collide detail {at}", lambda a=first, b=second: engine.collide(a, b, detail=True, first_pose=pose)
            yield f"collide_poses {at}", lambda a=first, b=second: engine.collide_poses(a, b, *poses)
            yield f"clearance {at}", lambda a=first, b=second: engine.clearance(a, b)
            yield f"clearance_poses {at}", lambda a=first, b=second: engine.clearance_poses(a, b, *poses)
        for its_pose in (None, pose):
            bodies, at = ([other, solid], [None, its_pose]), f"{kind} {'posed' if its_pose else ''}"
            yield f"locate_scene {at}", lambda b=bodies: engine.locate_scene(points, *b)
            yield f"locate_scene many {at}", lambda b=bodies: engine.locate_scene(np.zeros((300, d)), *b, report=True)
            yield f"collide_scene {at}", lambda b=bodies: engine.collide_scene(*b, gap=1.0)
            for what in ("locate", "collide", "clip_segments", "distances"):
                given = () if what == "collide" else (segments,) if what == "clip_segments" else (points,)
                yield f"Scene.{what} {at}", lambda b=bodies, w=what, g=given: getattr(engine.Scene(*b), w)(*g)
                moved = {"moved": {1: pose}}
                yield (
                    f"Scene.{what} moved {at}",
                    lambda b=bodies, w=what, g=given, m=moved: getattr(engine.Scene(*b).moved(m["moved"]), w)(*g),
                )
    if d == 2:
        for both in ((solid, others(2)["polygon"]), (others(2)["polygon"], solid)):
            yield f"overlay {both[0].type}", lambda b=both: engine.overlay(*b)
            yield f"overlay_batch {both[0].type}", lambda b=both: engine.overlay_batch([b[0]], [b[1]])
        yield "union_all", lambda: engine.union_all([solid])
    yield "compare contains", lambda: engine.compare("contains", points, solid)
    yield "compare clip_segments", lambda: engine.compare("clip_segments", segments, solid)
    yield "compare clip_polygons", lambda: engine.compare("clip_polygons", [SQUARE[d]], solid)
    yield "compare collide", lambda: engine.compare("collide", engine.Sphere([0] * d, 1), solid)


def service_questions(model: dict[str, Any], d: int) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield every request that takes a solid."""
    points, segments = [[0.25] * d, [9] * d], [[[-2] * d, [2] * d]]
    sphere = {"type": "sphere", "center": [0] * d, "radius": 1}
    yield "solids", model
    yield "contains", {"solid": model, "points": points}
    yield "contains", {"solid": {"type": "csg", "operation": "union", "operands": [model, sphere]}, "points": points}
    yield "bounds", {"solid": model}
    yield "distances", {"solid": model, "points": points}
    yield "volume", {"solid": model}
    yield "section", {"solid": model, "heights": [0.5]}
    yield "cut", {"solid": model, "region": {"type": "half_space", "normal": [1] * d, "offset": 0}}
    yield "overlap", {"first": model, "second": sphere}
    yield "clip/segments", {"region": model, "segments": segments}
    yield "hits", {"surface": model, "segments": segments}
    yield "clip/lines", {"region": model, "lines": segments}
    yield "clip/polygons", {"region": model, "polygons": [SQUARE[d]]}
    bodies = {"bodies": [{"solid": sphere}, {"solid": model}]}
    yield "scenes", bodies
    yield "contains/scene", {**bodies, "points": points}
    yield "collide/scene", bodies
    yield "clip/segments/scene", {**bodies, "segments": segments}
    for first, second in ((model, sphere), (sphere, model)):
        yield "collide", {"first": first, "second": second}
        yield "clearance", {"first": first, "second": second}
        if d == 2:
            polygon = {"type": "polygon", "rings": SQUARE[2]}
            pair = (model, polygon) if first is model else (polygon, model)
            yield "overlay", {"subject": pair[0], "clip": pair[1], "operation": "union"}
            yield "overlay/batch", {"subjects": [pair[0]], "clips": [pair[1]], "operation": "union"}
    yield "compare", {"operation": "contains", "solid": model, "points": points}
    yield "compare", {"operation": "clip_segments", "region": model, "segments": segments}
    yield "compare", {"operation": "collide", "first": model, "second": sphere}


def say(question: str, **what: Any) -> None:
    """Print what came of a question."""
    print(json.dumps({"question": question, **what}))


def ask_engine() -> None:
    """Ask the engine all there is to ask."""
    for d in (2, 3):
        for solid in (Diamond([0] * d, 1), Fog([0] * d)):
            for name, ask in engine_questions(solid):
                try:
                    answer, kind = ask(), "answer"
                except engine.EngineError as error:
                    answer, kind = error.message, type(error).__name__
                except Exception:
                    answer, kind = traceback.format_exc(), "fault"
                say(f"{solid.type} {d}D {name}", kind=kind, told=str(answer)[-600:])


def ask_service() -> None:
    """Ask every endpoint."""
    from fastapi.testclient import TestClient

    from service.app import create_app
    from service.settings import Settings

    with TestClient(create_app(Settings()), raise_server_exceptions=False) as client:
        say("openapi", kind="200", told=" ".join(client.get("/openapi.json").json()["components"]["schemas"]))
        for d in (2, 3):
            for name, more in (("diamond", {"reach": 1}), ("fog", {})):
                model = {"type": name, "center": [0] * d, **more}
                stored = client.post("/v1/solids", json=model).json().get("id", "0" * 64)
                octets = np.zeros(2 * d).tobytes()
                for path in ("contains", "clip/segments"):
                    headers = {"content-type": "application/octet-stream"}
                    answer = client.post(f"/v1/solids/{stored}/{path}", content=octets, headers=headers)
                    say(f"{name} {d}D binary {path}", kind=str(answer.status_code), told=answer.text[:600])
                for path, body in service_questions(model, d):
                    answer = client.post(f"/v1/{path}", json=body)
                    say(f"{name} {d}D {path}", kind=str(answer.status_code), told=answer.text[:600])


if __name__ == "__main__":
    ask_engine()
    ask_service()
