"use strict";

// Reads the documents of document.py: numbers in compressed typed arrays.

const ARRAYS = {
  float32: Float32Array,
  int8: Int8Array,
  uint16: Uint16Array,
  uint32: Uint32Array,
};

async function decodeColumn({ dtype, data }) {
  const bytes = Uint8Array.from(atob(data), (character) => character.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new ARRAYS[dtype](await new Response(stream).arrayBuffer());
}

/** One run: its columns as typed arrays, flat and in the order of (time, agent, axis). */
async function decodeRun({ name, title, kind, seed, scenario, rangeUnit, objective, isMetric, columns }) {
  const run = {
    name,
    title, // the readable name
    kind, // "fixed", "rule" or "learned"
    seed,
    scenario,
    rangeUnit,
    objective,
    isMetric, // whether positions and ranges alone determine the neighbors
    dimension: scenario.dimension,
    numAgents: scenario.num_agents,
    numPredators: scenario.predators.length,
    numSteps: scenario.num_steps,
    timeStep: scenario.time_step,
    rangesPerTime: columns.ranges.shape[1],
  };
  const decode = async ([key, column]) => [key, await decodeColumn(column)];
  Object.assign(run, Object.fromEntries(await Promise.all(Object.entries(columns).map(decode))));
  run.groups = trackGroups(run);
  run.largestRange = run.ranges.reduce((largest, range) => Math.max(largest, range), 0);
  return run;
}

/** The step that contains a time, and the fraction of the step that has passed. */
function stepAt(run, time) {
  const steps = Math.min(Math.max(time / run.timeStep, 0), run.numSteps);
  // Times are rounded multiples of the step; the tolerance keeps a time from falling into the step before.
  const step = Math.min(Math.floor(steps + 1e-6), run.numSteps);
  return { step, share: Math.max(steps - step, 0) };
}

/** Whether an agent has been caught at a step. */
function isCaught(run, step, agent) {
  return run.caughtAt[agent] <= step;
}

/** The interaction range of an agent, from one range for all or one per agent. */
function rangeOf(run, step, agent) {
  return run.ranges[step * run.rangesPerTime + (run.rangesPerTime === 1 ? 0 : agent)];
}
