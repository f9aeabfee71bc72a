"use strict";

// Which flock flies: a scenario with the numbers that the reader changed, a seed, and who steers the predators.

/** The numbers of a scenario that a reader can change: how to read and write them in its document. */
const NUMBERS = {
  agents: {
    label: "agents",
    least: 2,
    most: 3000,
    step: 1,
    read: (document) => document.num_agents,
    write: (document, value) => (document.num_agents = value),
  },
  noise: {
    label: "noise of headings",
    least: 0,
    most: 6,
    step: 0.05,
    read: (document) => document.angular_noise,
    write: (document, value) => (document.angular_noise = value),
  },
  speed: {
    label: "predator's speed, m/s",
    least: 1,
    most: 60,
    step: 0.5,
    read: ({ predators }) => rounded1(Math.max(...predators.map(speedOf))) || NaN,
    write({ predators }, value) {
      for (const predator of predators.filter(speedOf)) {
        // others rest, or follow a given path
        const [part] = Object.values(predator);
        const scale = value / speedOf(predator);
        part.velocity = part.velocity.map((speed) => speed * scale);
        if (part.max_speed != null) part.max_speed = Math.max(part.max_speed * scale, Math.hypot(...part.velocity));
      }
    },
  },
};

function speedOf(predator) {
  const [part] = Object.values(predator);
  return part.velocity ? Math.hypot(...part.velocity) : 0;
}

const rounded1 = (value) => Number(value.toFixed(1));

/** One flock. `numbers`: values of `NUMBERS` that differ from the scenario's. */
class Flight {
  constructor({ scenario, seed, numbers = {}, isSteered = false, path = [] }) {
    Object.assign(this, { scenario, seed, numbers, isSteered, path, unit: scenario.unit, maxRange: scenario.maxRange });
    this.start = seed === null ? scenario.start : null; // positions and velocities, flat float64 arrays in base64
    this.document = JSON.parse(isSteered ? scenario.steered : scenario.json);
    for (const [name, value] of Object.entries(numbers)) NUMBERS[name].write(this.document, value);
    const isAsGiven = Object.keys(numbers).length === 0;
    this.json = isAsGiven ? (isSteered ? scenario.steered : scenario.json) : JSON.stringify(this.document);
    this.limits = isSteered ? this.document.predators.map(({ learned }) => learned) : null;
    this.observers = new Map();
  }

  newFlock() {
    const { json, seed, start } = this;
    const arrays = start ? [start.positions, start.velocities].map((text) => new Float64Array(bytesOf(text).buffer)) : [];
    return new wasm_bindgen.Flock(json, PER_AGENT, BigInt(start ? 0 : seed), ...arrays);
  }

  /** The observer of a policy's options. */
  observer(options) {
    if (!this.observers.has(options)) this.observers.set(options, new wasm_bindgen.Observer(this.json, options));
    return this.observers.get(options);
  }

  /** Names of the numbers that this scenario has. */
  get editable() {
    const document = JSON.parse(this.scenario.json);
    const names = Object.keys(NUMBERS).filter((name) => Number.isFinite(NUMBERS[name].read(document)));
    return this.start ? [] : names;
  }
}

/** The objective of a whole run. */
function objectiveOf(flight, policy) {
  return new LiveRun(flight, policy).finish();
}
