"""Calls the client that openapi-generator made for Python, a package named `openapi_client`."""

import sys

import openapi_client as api
from openapi_client.models import (
    AabbSolid,
    BoundsRequest,
    CollideRequest,
    ContainsRequest,
    Solid,
    SphereSolid,
    StoredSolid,
)

client = api.ApiClient(api.Configuration(host=sys.argv[1]))
sphere = Solid(SphereSolid(type="sphere", center=[0, 0, 0], radius=1.625))
stored = api.SolidsApi(client).put_solid_with_http_info(sphere)
print(stored.status_code)
solid = Solid(StoredSolid(type="stored", id=stored.data.id))
question = ContainsRequest(solid=solid, points=[[2, 0, 0], [1.625, 0, 0], [0, 0, 0]])
print(str(api.ContainmentApi(client).contains(question).contained).replace(" ", ""))
box = Solid(AabbSolid(type="aabb", min=[1.625, -1, -1], max=[3, 1, 1]))
print(api.CollisionApi(client).collide(CollideRequest(first=sphere, second=box)).collisions[0].relation)
try:
    api.BoundsApi(client).bounds(BoundsRequest(solid=Solid(SphereSolid(type="sphere", center=[0, 0, 0], radius=-1))))
except api.ApiException as refused:
    print(refused.status)
