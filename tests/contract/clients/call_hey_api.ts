declare const process: { argv: string[] };
import { client } from "./generated/client.gen";
import { bounds, collide, contains, containsStored, putSolid } from "./generated/sdk.gen";

client.setConfig({ baseUrl: process.argv[2] });
const sphere = { type: "sphere" as const, center: [0, 0, 0], radius: 1.5 };
const stored = await putSolid({ body: sphere });
console.log(stored.response!.status);
const id = stored.data!.id, points = [[2, 0, 0], [1.5, 0, 0], [0, 0, 0]];
console.log(JSON.stringify((await contains({ body: { solid: { type: "stored", id }, points } })).data!.contained));
const met = await collide({ body: { first: sphere, second: { type: "aabb", min: [1.5, -1, -1], max: [3, 1, 1] } } });
console.log(met.data!.collisions[0].relation);
console.log((await bounds({ body: { solid: { ...sphere, radius: -1 } } })).error!.status);
const octets = new Blob([new Float64Array(points.flat()).buffer]);
const located = await containsStored({ path: { solid_id: id }, body: octets, parseAs: "arrayBuffer" });
console.log(JSON.stringify([...new Int8Array(located.data as unknown as ArrayBuffer)]));
