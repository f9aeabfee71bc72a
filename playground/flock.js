// An episode in the core: its steps, and what the page draws of its past.

import { Flock, Network } from "./flockesc_wasm.js";

const TRAIL = 20; // states
const NO_ACTIONS = new Float64Array();

/** One episode. `state` says which flock it is; its policy and range may change while the flock flies. */
export class Run {
  constructor({ world, seed, isSteered }, policy) {
    this.world = world;
    this.policy = policy;
    this.flock = new Flock(isSteered ? world.steered : world.scenario, world.options, BigInt(seed));
    this.numAgents = this.flock.positions.length / world.dimension;
    this.predators = this.flock.predators;
    this.numPredators = this.predators.length / (2 * world.dimension);
    this.isSteered = isSteered;
    this.ranges = new Float64Array(this.numAgents);
    this.askedAt = -1; // step of the policy's last decision, or -1 if a fixed range was set after it
    this.used = new Set(); // policies of the steps so far
    this.trail = [];
    this.means = [];
    this.lowest = [];
    this.note();
  }

  get hasEnded() {
    return this.flock.hasEnded;
  }

  get time() {
    return this.flock.steps * this.world.document.time_step;
  }

  /** The objective: the lowest mean distance so far in m. */
  get objective() {
    return this.lowest.at(-1);
  }

  /** Records the state after a step. */
  note() {
    const { flock } = this;
    const [mean, , lowest] = flock.distances;
    this.before = this.predators;
    this.predators = flock.predators;
    this.velocities = flock.velocities;
    this.caught = new Set(flock.caught);
    this.trail.push(flock.positions);
    if (this.trail.length > TRAIL) this.trail.shift();
    this.means.push(mean);
    this.lowest.push(lowest);
  }

  /** Sets the ranges of the next step. */
  choose({ isLearned, range }) {
    if (isLearned) return this.askPolicy();
    this.ranges.fill(range);
    this.askedAt = -1;
  }

  /** Makes a model step under a fixed range or the learned policy. */
  step(state, actions = NO_ACTIONS) {
    this.choose(state);
    this.used.add(state.isLearned ? "learned" : state.range);
    this.flock.step(this.ranges, actions);
    this.note();
  }

  /** Lets every agent decide. A decision holds for some model steps. */
  askPolicy() {
    const { flock, policy, askedAt } = this;
    this.network ??= new Network(
      policy.architecture,
      flock.entries,
      Float64Array.from(policy.ranges),
      Float32Array.from(policy.parameters),
    );
    const holds = flock.steps === askedAt || flock.steps % policy.stepsPerAction !== 0;
    if (askedAt >= 0 && holds) return;
    this.ranges = this.network.ranges(flock.observe(), this.numAgents);
    this.askedAt = flock.steps;
  }

  /** Plays to the end of the episode and returns the objective. */
  finish(state) {
    while (!this.hasEnded) this.step(state);
    return this.objective;
  }

  /** Frees the memory in the core. */
  free() {
    this.flock.free();
    this.network?.free();
  }
}

/** The objective of a whole episode under one policy that nobody changes. */
export function objectiveOf(state, policy) {
  const run = new Run({ ...state, isSteered: false }, policy);
  const objective = run.finish(state);
  run.free();
  return objective;
}

/** Turns real time into model steps of `timeStep` seconds. */
export class Pace {
  constructor(timeStep) {
    this.timeStep = timeStep;
    this.share = 1; // of the current step that is drawn
  }

  /** Adds some seconds and returns the number of steps that are due. */
  add(seconds) {
    this.share += Math.min(seconds, 0.2) / this.timeStep; // a hidden tab does not catch up
    const due = Math.max(0, Math.ceil(this.share) - 1);
    this.share -= due;
    return due;
  }
}
