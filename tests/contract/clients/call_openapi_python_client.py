"""Calls the client that openapi-python-client made, a package named `generated`."""

import sys

from generated import Client
from generated.api.bounds import bounds
from generated.api.collision import collide
from generated.api.containment import contains
from generated.api.solids import put_solid
from generated.models import AabbSolid, BoundsRequest, CollideRequest, ContainsRequest, SphereSolid, StoredSolid

client = Client(base_url=sys.argv[1])
sphere = SphereSolid(type_="sphere", center=[0, 0, 0], radius=1.75)
stored = put_solid.sync_detailed(client=client, body=sphere)
print(stored.status_code.value)
solid = StoredSolid(type_="stored", id=stored.parsed.id)
question = ContainsRequest(solid=solid, points=[[2, 0, 0], [1.75, 0, 0], [0, 0, 0]])
print(str(contains.sync(client=client, body=question).contained).replace(" ", ""))
box = AabbSolid(type_="aabb", min_=[1.75, -1, -1], max_=[3, 1, 1])
print(collide.sync(client=client, body=CollideRequest(first=sphere, second=box)).collisions[0].relation)
refused = BoundsRequest(solid=SphereSolid(type_="sphere", center=[0, 0, 0], radius=-1))
print(bounds.sync(client=client, body=refused).status)
