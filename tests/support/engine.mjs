// Plays cases in the core for web pages: reads a JSON list from the standard input, and prints a JSON list of hashes.
//
// Usage: node engine.mjs FOLDER, where FOLDER has the module that `make playground` builds.
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const folder = process.argv[2];
const { default: load, Flock, Network } = await import(pathToFileURL(`${folder}/flockesc_wasm.js`));
await load({ module_or_path: readFileSync(`${folder}/flockesc_wasm_bg.wasm`) });

const bytes = (array) => new Uint8Array(array.buffer, array.byteOffset, array.byteLength);

// Ranges that differ by agent and step, as in `golden_episodes.ranges`.
const varied = (t, count) => Float64Array.from({ length: count }, (_, agent) => (37 * t + 11 * agent) % 61);

// The hash of every state and observation of an episode.
function run(play) {
  const flock = new Flock(play.scenario, play.options, BigInt(play.seed));
  const digest = createHash("sha256");
  for (let t = 0; t < play.actions && !flock.hasEnded; t++) {
    if (t > 0) flock.step(varied(t, play.rows), varied(t, play.controls).map((value) => value / 64));
    const predators = flock.predators;
    for (const array of [flock.positions, flock.velocities, predators, flock.observe(), flock.rewards]) {
      digest.update(bytes(array));
    }
  }
  return digest.digest("hex");
}

// The lowest value of the objective and the number of components after an episode under a network.
function network(play) {
  const flock = new Flock(play.scenario, play.options, BigInt(play.seed));
  const parameters = Float32Array.from(play.parameters);
  const network = new Network(play.architecture, flock.entries, Float64Array.from(play.ranges), parameters);
  while (!flock.hasEnded) flock.step(network.ranges(flock.observe(), play.rows), new Float64Array());
  return [flock.distances[2], flock.numComponents];
}

const cases = JSON.parse(readFileSync(0));
const results = cases.map((play) => (play.architecture ? network(play) : run(play)));
console.log(JSON.stringify(results));
