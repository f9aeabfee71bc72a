"use strict";

// Runs that the page simulates, with the same bits as in Python.

const PER_AGENT = JSON.stringify({ view: "agent" });
const NO_PUSHES = new Float64Array();
const NEVER = 2 ** 32 - 1; // the step at which an agent is caught that never is

/** Loads the engine that the page holds. */
async function loadEngine() {
  await wasm_bindgen({ module_or_path: await inflate(bytesOf($("engine").textContent), "deflate") });
}

/** Columns of a live run: type, and numbers per frame. */
const columnsOf = (agents, predators, dimension) => ({
  times: [Float64Array, 1],
  positions: [Float32Array, agents * dimension],
  headings: [Int8Array, agents * dimension],
  ranges: [Float64Array, agents],
  predators: [Float32Array, predators * dimension],
  meanDistance: [Float64Array, 1],
  lowestMean: [Float64Array, 1],
  survivors: [Uint32Array, 1],
});

/** A run of one policy from the start of a flock, which grows. Only the pointer may change while it does. */
class LiveRun {
  /** `flight`: which flock it is (see `Flight`). */
  constructor(flight, policy) {
    const { document, unit } = flight;
    const { spec, title, kind } = policy;
    Object.assign(this, {
      spec,
      title,
      kind,
      isLive: true,
      flight,
      seed: flight.start ? null : flight.seed,
      ...factsOf(document),
      rangeUnit: unit,
      rangesPerTime: document.num_agents,
      capacity: 0,
      policy,
      pushes: [], // actions of the predators, by step
      targets: [], // where the reader pointed, by step
      caughtAt: new Uint32Array(document.num_agents).fill(NEVER),
    });
    this.columns = columnsOf(this.numAgents, this.numPredators, this.dimension);
    this.flock = flight.newFlock();
    this.chooseRanges = policy.start(this);
    this.note();
    this.decide();
  }

  get last() {
    return this.flock.steps;
  }

  get hasEnded() {
    return this.flock.hasEnded;
  }

  /** The objective: the lowest mean distance so far in m. */
  get objective() {
    return this.lowestMean[this.last];
  }

  /** Sets the ranges of the step that begins at the frame `last`. A decision may hold for several steps. */
  decide() {
    const step = this.last;
    const [start, end] = [step * this.numAgents, (step + 1) * this.numAgents];
    if (this.hasEnded || step % this.policy.stepsPerAction !== 0) {
      this.ranges.copyWithin(start, start - this.numAgents, start);
    } else {
      const chosen = this.chooseRanges();
      if (chosen.length === 1) this.ranges.fill(chosen[0], start, end);
      else this.ranges.set(chosen, start);
    }
  }

  /** Makes a model step. `target`: the point in m toward which the reader steers the predators, or null. */
  step(target = null) {
    const { flock, last, flight } = this;
    const pushes = flight.limits ? actionsToward(this, target) : NO_PUSHES;
    flock.step(this.rangesAt(last), pushes);
    this.pushes[last] = pushes;
    this.targets[last] = target;
    this.note();
    this.decide();
  }

  /** Steps to the end; the predators fly straight on if the reader steers them. Returns the objective. */
  finish() {
    while (!this.hasEnded) this.step();
    return this.objective;
  }

  rangesAt(step) {
    return this.ranges.subarray(step * this.numAgents, (step + 1) * this.numAgents);
  }

  /** Records the state of the flock as the frame `last`. */
  note() {
    const { flock, last, numAgents, dimension } = this;
    this.reserve(last + 1);
    const [mean] = flock.distances;
    const { positions, predators, velocities, caught } = flock;
    this.positions.set(positions, last * numAgents * dimension);
    this.headings.set(headingsOf(velocities, dimension), last * numAgents * dimension);
    this.predators.set(predators.subarray(0, this.numPredators * dimension), last * this.numPredators * dimension);
    for (const agent of caught) if (this.caughtAt[agent] > last) this.caughtAt[agent] = last;
    this.times[last] = last * this.timeStep;
    this.meanDistance[last] = mean;
    this.lowestMean[last] = last > 0 ? Math.min(this.lowestMean[last - 1], mean) : mean;
    this.survivors[last] = numAgents - caught.length;
  }

  reserve(frames) {
    if (frames <= this.capacity) return;
    this.capacity = Math.min(Math.max(2 * this.capacity, 256, frames), this.numSteps + 1);
    for (const [name, [Type, size]] of Object.entries(this.columns)) {
      const grown = new Type(this.capacity * size);
      if (this[name]) grown.set(this[name]);
      this[name] = grown;
    }
  }

  /** The ids that an agent hears at a frame. `range`: as if this were the range of all, or null. */
  heardBy(listener, step, range = null) {
    const agents = aliveAt(this, step);
    const graph = this.graphAt(step, agents);
    if (range !== null) graph[2].fill(range);
    const self = agents.indexOf(listener);
    if (!this.document.mutual) graph[2].forEach((_, at, ranges) => at !== self && (ranges[at] = 0));
    const pairs = wasm_bindgen.neighborPairs(this.flight.json, ...graph);
    const heard = [];
    for (let at = 0; at < pairs.length; at += 2) if (pairs[at] === self) heard.push(agents[pairs[at + 1]]);
    return heard;
  }

  /** Positions, headings and ranges of some agents that define the neighbor graph of a step. */
  graphAt(step, agents) {
    const { dimension, numAgents, document } = this;
    const at = document.frozen_graph ? 0 : step;
    const take = (column, scale) =>
      Float64Array.from({ length: agents.length * dimension }, (_, index) => {
        const agent = agents[Math.floor(index / dimension)];
        return column[(at * numAgents + agent) * dimension + (index % dimension)] / scale;
      });
    const ranges = Float64Array.from(agents, (agent) => this.ranges[at * numAgents + agent]);
    return [take(this.positions, 1), take(this.headings, 127), ranges];
  }
}

/** Headings as signed bytes, where 127 is 1; 0 for an agent at rest. */
function headingsOf(velocities, dimension) {
  const headings = new Int8Array(velocities.length);
  for (let at = 0; at < velocities.length; at += dimension) {
    let square = 0;
    for (let axis = 0; axis < dimension; axis++) square += velocities[at + axis] ** 2;
    const scale = square > 0 ? 127 / Math.sqrt(square) : 0;
    for (let axis = 0; axis < dimension; axis++) headings[at + axis] = Math.round(velocities[at + axis] * scale);
  }
  return headings;
}
