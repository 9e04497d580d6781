declare const process: { argv: string[] };
import { BoundsApi, CollisionApi, Configuration, ContainmentApi, ResponseError, SolidsApi } from "./generated/index.js";

const configuration = new Configuration({ basePath: process.argv[2] });
const sphere = { type: "sphere" as const, center: [0, 0, 0], radius: 1.375 };

const stored = await new SolidsApi(configuration).putSolidRaw({ solid: sphere });
console.log(stored.raw.status);
const solid = { type: "stored" as const, id: (await stored.value()).id };
const points = [[2, 0, 0], [1.375, 0, 0], [0, 0, 0]];
const inside = await new ContainmentApi(configuration).contains({ containsRequest: { solid, points } });
console.log(JSON.stringify(inside.contained));
const box = { type: "aabb" as const, min: [1.375, -1, -1], max: [3, 1, 1] };
const met = await new CollisionApi(configuration).collide({ collideRequest: { first: sphere, second: box } });
console.log(met.collisions[0].relation);
try {
  await new BoundsApi(configuration).bounds({ boundsRequest: { solid: { ...sphere, radius: -1 } } });
} catch (refused) {
  console.log((refused as ResponseError).response.status);
}
