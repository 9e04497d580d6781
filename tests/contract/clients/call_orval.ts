declare const process: { argv: string[] };
import { bounds, collide, contains, putSolid } from "./generated";

const own = fetch;
globalThis.fetch = (path, options) => own(new URL(String(path), process.argv[2]), options);
const sphere = { type: "sphere" as const, center: [0, 0, 0], radius: 1.5 };
const stored = await putSolid(sphere);
console.log(stored.status);
const solid = { type: "stored" as const, id: (stored.data as { id: string }).id };
const inside = await contains({ solid, points: [[2, 0, 0], [1.5, 0, 0], [0, 0, 0]] });
console.log(JSON.stringify((inside.data as { contained: boolean[] }).contained));
const met = await collide({ first: sphere, second: { type: "aabb", min: [1.5, -1, -1], max: [3, 1, 1] } });
console.log((met.data as { collisions: { relation: string }[] }).collisions[0].relation);
console.log((await bounds({ solid: { ...sphere, radius: -1 } })).status);
