// Plays cases in the core for web pages: reads a JSON list from the standard input, and prints a JSON list of results.
//
// Usage: node engine.mjs FOLDER, where FOLDER has the module that `make engine` builds.
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";

const folder = process.argv[2];
const script = readFileSync(`${folder}/flockesc_wasm.js`, "utf8");
const engine = new Function(`${script}; return wasm_bindgen;`)();
engine.initSync({ module: readFileSync(`${folder}/flockesc_wasm_bg.wasm`) });

const floats = (numbers) => Float64Array.from(numbers);
const bytes = (array) => new Uint8Array(array.buffer, array.byteOffset, array.byteLength);

function started({ scenario, options, seed, start }) {
  return new engine.Flock(scenario, options, BigInt(seed), ...(start ?? []).map(floats));
}

function policyOf({ header, parameters }) {
  return new engine.PolicyFile(header, Float32Array.from(parameters));
}

const kinds = {
  // The hash of every state, observation and reward of an episode.
  episode(play) {
    const flock = started(play);
    const observer = new engine.Observer(play.scenario, play.options);
    const digest = createHash("sha256");
    const note = () => {
      const observed = observer.observe(flock);
      for (const array of [flock.positions, flock.velocities, flock.predators, observed, flock.rewards]) {
        digest.update(bytes(array));
      }
    };
    note();
    for (const action of play.actions) {
      flock.step(...action.map(floats));
      note();
    }
    return digest.digest("hex");
  },

  // The lowest value of the objective and the number of components after an episode under a network.
  network(play) {
    const flock = started(play);
    const observer = new engine.Observer(play.scenario, play.options);
    const network = policyOf(play).network(observer.entries);
    while (!flock.hasEnded) flock.step(network.ranges(observer.observe(flock), observer.rows), floats([]));
    return [flock.distances[2], flock.numComponents];
  },

  // The same, for a flock with one range per agent and step, and a network with its own options.
  observed(play) {
    const flock = started(play);
    const policy = policyOf(play);
    const observer = new engine.Observer(play.scenario, policy.options);
    const network = policy.network(observer.entries);
    let ranges;
    while (!flock.hasEnded) {
      if (flock.steps % policy.stepsPerAction === 0) {
        const set = network.ranges(observer.observe(flock), observer.rows);
        ranges = floats({ length: flock.rewards.length }).map((_, row) => set[row % set.length]);
      }
      flock.step(ranges, floats([]));
    }
    return [flock.distances[2], flock.numComponents];
  },

  // The message for a policy file that is refused.
  refusal(play) {
    try {
      policyOf(play);
    } catch ({ message }) {
      return message;
    }
    return null;
  },

  // The pairs of neighbors.
  graph({ scenario, arrays }) {
    return Array.from(engine.neighborPairs(scenario, ...arrays.map(floats)));
  },
};

const cases = JSON.parse(readFileSync(0));
console.log(JSON.stringify(cases.map((play) => kinds[play.kind](play))));
