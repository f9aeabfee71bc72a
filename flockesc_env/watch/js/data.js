"use strict";

// Recorded runs: reads the documents of document.py, whose numbers are compressed typed arrays.

const ARRAYS = { float32: Float32Array, int8: Int8Array, uint32: Uint32Array };

/** Bytes of a text in base64. */
function bytesOf(base64) {
  return Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
}

/** Decompresses bytes; `format`: "deflate" or "deflate-raw". */
async function inflate(bytes, format) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream(format));
  return new Response(stream).arrayBuffer();
}

async function decodeColumn({ dtype, data }) {
  return new ARRAYS[dtype](await inflate(bytesOf(data), "deflate"));
}

/** What a run takes from its scenario. */
function factsOf(document) {
  const { dimension, num_agents: numAgents, num_steps: numSteps, time_step: timeStep, predators } = document;
  return { document, dimension, numAgents, numSteps, timeStep, numPredators: predators.length };
}

/**
 * A recorded run. Its columns are typed arrays, flat and in the order of (time, agent, axis). `LiveRun` has the same
 * columns, up to its frame `last`.
 */
class Recording {
  static async decode(document, index) {
    const decode = async ([key, column]) => [key, await decodeColumn(column)];
    const columns = Object.fromEntries(await Promise.all(Object.entries(document.columns).map(decode)));
    return new Recording(document, columns, index);
  }

  constructor({ title, kind, seed, scenario, rangeUnit, columns: documents }, columns, index) {
    Object.assign(this, columns, {
      spec: `recording:${index}`,
      title, // the readable name
      kind, // "fixed", "rule" or "learned"
      seed, // null: no seed gives this start
      ...factsOf(scenario),
      rangeUnit,
      rangesPerTime: documents.ranges.shape[1],
      last: scenario.num_steps,
      hasEnded: true,
    });
  }
}

/** Whether two runs begin with the same flock. */
function isOneFlock(a, b) {
  const start = a.positions.subarray(0, a.numAgents * a.dimension);
  return a.numAgents === b.numAgents && start.every((value, at) => value === b.positions[at]);
}

/** The frame before a time, and the fraction of the step that has passed. */
function frameAt(run, time) {
  const steps = Math.min(Math.max(time / run.timeStep, 0), run.last);
  // Times are rounded multiples of the step; the tolerance keeps a time from falling into the step before.
  const step = Math.min(Math.floor(steps + 1e-6), run.last);
  return { step, share: Math.max(steps - step, 0) };
}

/** Whether an agent has been caught at a step. */
function isCaught(run, step, agent) {
  return run.caughtAt[agent] <= step;
}

/** Ids of the agents that are not caught at a step. */
function aliveAt(run, step) {
  return [...Array(run.numAgents).keys()].filter((agent) => !isCaught(run, step, agent));
}

/** The interaction range of an agent, from one range for all or one per agent. */
function rangeOf(run, step, agent) {
  return run.ranges[step * run.rangesPerTime + (run.rangesPerTime === 1 ? 0 : agent)];
}
