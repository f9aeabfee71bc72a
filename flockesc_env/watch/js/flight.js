"use strict";

// Which flock flies: a scenario, its number of agents if the reader changed it, a seed, and who steers the predators.

const AGENTS = { least: 2, most: 3000 };

/** One flock. `agents`: the reader's number of agents, or null for the scenario's. */
class Flight {
  constructor({ scenario, seed, agents = null, isSteered = false, path = [] }) {
    Object.assign(this, { scenario, seed, agents, isSteered, path, unit: scenario.unit });
    this.start = seed === null ? scenario.start : null; // positions and velocities, flat float64 arrays in base64
    const changes = agents === null ? {} : { num_agents: agents };
    const withAgents = (json) => JSON.stringify({ ...JSON.parse(json), ...changes });
    this.unsteered = withAgents(scenario.json);
    this.json = isSteered ? withAgents(scenario.steered) : this.unsteered;
    this.document = JSON.parse(this.json);
    this.limits = isSteered ? this.document.predators.map(({ learned }) => learned) : null;
    this.observers = new Map();
  }

  newFlock() {
    const { json, seed, start } = this;
    const arrays = start
      ? [start.positions, start.velocities].map((text) => new Float64Array(bytesOf(text).buffer))
      : [];
    return new wasm_bindgen.Flock(json, PER_AGENT, BigInt(start ? 0 : seed), ...arrays);
  }

  /** The observer of a policy's options. */
  observer(options) {
    if (!this.observers.has(options)) this.observers.set(options, new wasm_bindgen.Observer(this.json, options));
    return this.observers.get(options);
  }
}
