declare const process: { argv: string[] };
import createClient from "openapi-fetch";
import type { paths } from "./api.d.ts";

const client = createClient<paths>({ baseUrl: process.argv[2] });
const sphere = { type: "sphere" as const, center: [0, 0, 0], radius: 1.5 };

const stored = await client.POST("/v1/solids", { body: sphere });
console.log(stored.response.status);
const inside = await client.POST("/v1/contains", {
  body: { solid: { type: "stored", id: stored.data!.id }, points: [[2, 0, 0], [1.5, 0, 0], [0, 0, 0]] },
});
console.log(JSON.stringify(inside.data!.contained));
const met = await client.POST("/v1/collide", {
  body: { first: sphere, second: { type: "aabb", min: [1.5, -1, -1], max: [3, 1, 1] } },
});
console.log(met.data!.collisions[0].relation);
const refused = await client.POST("/v1/bounds", { body: { solid: { ...sphere, radius: -1 } } });
console.log(refused.error!.status);
