"use strict";

// Reads what document.py wrote: columns of numbers as compressed typed arrays.

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
async function decodeRun({ name, kind, seed, scenario, rangeUnit, isMetric, columns }) {
  const run = {
    name,
    kind, // "fixed", "rule" or "learned"
    seed,
    scenario,
    rangeUnit,
    isMetric, // whether ranges alone tell neighbors, as the page draws them
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

/** Step that is under way at a time, and the share of it that has passed. */
function stepAt(run, time) {
  const steps = Math.min(Math.max(time / run.timeStep, 0), run.numSteps);
  // Times are multiples of the step up to rounding; a frame late by that must not show the step before.
  const step = Math.min(Math.floor(steps + 1e-6), run.numSteps);
  return { step, share: Math.max(steps - step, 0) };
}

/** Whether an agent has been caught at a step. */
function isCaught(run, step, agent) {
  return run.caughtAt[agent] <= step;
}

/** Range of an agent, whether there is one for all or one each. */
function rangeOf(run, step, agent) {
  return run.ranges[step * run.rangesPerTime + (run.rangesPerTime === 1 ? 0 : agent)];
}
