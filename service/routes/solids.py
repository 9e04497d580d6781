"""Solids kept between requests, named by their content."""

from __future__ import annotations

from typing import Annotated, Any, Final

from fastapi import APIRouter, Path
from starlette.responses import Response

from service.convert import answers, questions
from service.route import GeometryRoute
from service.routes.base import responses, router_of
from service.schemas.solids import Solid, StoredSolidSummary
from service.store import Kept
from service.work import Call, CallOf

router = router_of("solids")
lookup = APIRouter(route_class=GeometryRoute, tags=["solids"], responses=responses(401, 403, 404, 503))
KNOWN: Final[dict[int | str, dict[str, Any]]] = {
    304: {"description": "The client has it: one of the tags in If-None-Match is the id."}
}

Id = Annotated[str, Path(description="Name of a stored solid, from `POST /v1/solids`.")]


@router.post(
    "/v1/solids",
    operation_id="put_solid",
    status_code=201,
    responses={200: {"description": "It was there already.", "model": StoredSolidSummary}, **responses(507)},
)
def put_solid(question: Solid, call: CallOf) -> StoredSolidSummary:
    """Keep a solid, so that later requests can name it: `{"type": "stored", "id": ...}`. The same solid has the same
    id everywhere; it may leave the store when others need the room."""
    solid = questions.to_solid(question, call, ())
    return answers.from_stored(put(solid, call), solid)


def put(value: Kept, call: Call) -> str:
    """Put a solid or a scene into the store, say so, and return its name."""
    name, is_new = call.store.put(value)
    call.status = 201 if is_new else 200
    call.headers.update({"Location": f"{call.path.removesuffix('/import')}/{name}", "ETag": f'"{name}"'})
    return name


@lookup.get("/v1/solids/{solid_id}", operation_id="get_solid", responses=KNOWN)
def get_solid(solid_id: Id, call: CallOf) -> StoredSolidSummary:
    """Return what the store holds under an id."""
    call.headers["ETag"] = f'"{solid_id}"'
    return answers.from_stored(solid_id, call.store.get(solid_id))


@lookup.head("/v1/solids/{solid_id}", operation_id="has_solid", response_class=Response, responses=KNOWN)
def has_solid(solid_id: Id, call: CallOf) -> None:
    """Tell by the status whether the store holds an id."""
    call.headers["ETag"] = f'"{solid_id}"'
    call.store.get(solid_id)
