declare const process: { argv: string[] };
import { Api } from "./generated/api";

const api = new Api({ baseUrl: process.argv[2] });
const sphere = { type: "sphere" as const, center: [0, 0, 0], radius: 1.5 };
const stored = await api.v1.putSolid(sphere);
console.log(stored.status);
const id = stored.data.id, points = [[2, 0, 0], [1.5, 0, 0], [0, 0, 0]];
console.log(JSON.stringify((await api.v1.contains({ solid: { type: "stored", id }, points })).data.contained));
const met = await api.v1.collide({ first: sphere, second: { type: "aabb", min: [1.5, -1, -1], max: [3, 1, 1] } });
console.log(met.data.collisions[0].relation);
console.log(await api.v1.bounds({ solid: { ...sphere, radius: -1 } }).then(() => 200, (refused) => refused.error.status));
