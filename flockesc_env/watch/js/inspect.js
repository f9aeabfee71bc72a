"use strict";

// One agent: its range, the agents that it hears, what it heard, what it does and what its policy observes.

class Inspector {
  /** `close`: called after the reader closed the card. */
  constructor(card, close) {
    Object.assign(this, { card, chosen: null });
    $("agent-close").addEventListener("click", () => {
      this.choose(null, null);
      close();
    });
  }

  /** Chooses the next agent of a panel that is not caught, or the one before. */
  move(panel, isBack, time) {
    const ids = aliveAt(panel.run, frameAt(panel.run, time).step);
    const at = this.chosen?.panel === panel ? ids.indexOf(this.chosen.agent) : isBack ? 0 : -1;
    if (ids.length) this.choose(panel, ids[(at + (isBack ? -1 : 1) + ids.length) % ids.length]);
  }

  /** Chooses an agent of a panel, or none. */
  choose(panel, agent) {
    this.chosen = agent === null || !panel.run.isLive ? null : { panel, agent };
    this.card.hidden = !this.chosen;
  }

  /** What the scene draws of the chosen agent: its id and the agents that it hears. */
  at(time) {
    if (!this.chosen) return null;
    const { panel, agent } = this.chosen;
    const { run } = panel;
    const { step } = frameAt(run, time);
    if (!run.isLive || agent >= run.numAgents || isCaught(run, step, agent)) return null;
    if (this.found?.run !== run || this.found.step !== step || this.found.agent !== agent) {
      const heard = run.heardBy(agent, step);
      this.found = { run, agent, step, heard, range: rangeOf(run, step, agent) };
      this.describe(this.found);
    }
    return this.found;
  }

  describe({ run, agent, step, heard, range }) {
    const heading = headingAt(run, step, agent);
    const mean = [0, 0, 0];
    for (const id of [agent, ...heard]) headingAt(run, step, id).forEach((part, axis) => (mean[axis] += part));
    const turned = step > 0 ? turnBetween(headingAt(run, step - 1, agent), heading, run.dimension) : "-";
    const within = `${Number(range.toFixed(2))} ${run.rangeUnit}`;
    $("agent").textContent = `Agent ${agent} listens ${range ? `within ${within}` : "to nobody"}`;
    $("agent-why").textContent = {
      fixed: "All agents have this range at all times.",
      rule: "The rule sets this range from the observation below.",
      learned:
        `A network of ${run.policy.parameters?.length} numbers, the same for all agents, sets this range from the ` +
        `observation below, every ${Number((run.policy.stepsPerAction * run.timeStep).toFixed(2))} s.`,
    }[run.kind];
    $("agent-facts").replaceChildren(
      ...rows([
        ["hears", `${heard.length || "no"} ${heard.length === 1 ? "agent" : "agents"}`],
        ...(heard.length ? [["mean heading with them", turnBetween(heading, mean, run.dimension)]] : []),
        ["turned in the last step", turned],
      ]),
    );
    const { names, values } = this.observation(run, agent, step);
    $("agent-view").textContent = run.kind === "fixed" ? "What a policy could observe" : "What it observes";
    $("agent-entries").replaceChildren(...rows(inWords(names, values, run, agent)));
  }

  /** The entries of the agent's observation at a frame. */
  observation(run, agent, step) {
    const observer = run.flight.observer(run.policy.options);
    const names = observer.entries;
    const observed = observer.observe(step < run.last ? this.flockAt(run, step) : run.flock);
    const row = observer.rows === 1 ? 0 : agent;
    return { names, values: observed.subarray(row * names.length, (row + 1) * names.length) };
  }

  /** The flock of a run at an earlier frame: played again, from the last frame that was asked for if it lies before. */
  flockAt(run, step) {
    const isUsable = this.past?.of === run.flock && this.past.flock.steps <= step;
    if (!isUsable) this.past = { of: run.flock, flock: run.flight.newFlock() };
    const { flock } = this.past;
    while (flock.steps < step) flock.step(run.rangesAt(flock.steps), run.pushes[flock.steps]);
    return flock;
  }
}

// Entries of observations in words and units, as docs/model.md scales them. Directions are from the agent's heading.
const WORDS = {
  time: ["time", (x, { numSteps, timeStep }) => `${(x * numSteps * timeStep).toFixed(2)} s`],
  running_minimum: ["lowest mean distance so far", (x, { document }) => `${unscaled(x, document.initial_side)} m`],
  last_range: ["its last range", (x, { policy, rangeUnit }) => `${(x * maxRangeOf(policy)).toFixed(1)} ${rangeUnit}`],
  speed: ["its speed", (x, { document }, agent) => `${unscaled(x, speedAt(document, agent))} m/s`],
  neighbor_count: ["heard in the last step", (x) => `${unscaled(x, 8, 0)} agents`],
  heard_velocity: ["their mean velocity", velocityText],
  predator_sensed: ["sees the predator", (x) => (x ? "yes" : "no")],
  predator_distance: ["distance to the predator", (x, { document }) => `${unscaled(x, document.initial_side)} m`],
  predator_direction: ["direction of the predator", directionText],
  predator_velocity: ["predator's relative velocity", velocityText],
};

/** Names and values of observation entries for readers; the components of a vector are one value. */
function inWords(names, values, run, agent) {
  const stems = names.map((name) => name.replace(/_(ahead|left|up)$/, ""));
  return [...new Set(stems)].map((stem) => {
    const entries = Array.from(values).filter((_, at) => stems[at] === stem);
    const plain = () => entries.map((x) => x.toFixed(2)).join(", ");
    const [words, textOf] = WORDS[stem] ?? [stem.replaceAll("_", " "), plain];
    return [words, textOf(entries.length > 1 ? entries : entries[0], run, agent)];
  });
}

/** The number whose scaled value is x: u from x = u / (u + half). */
function unscaled(x, half, digits = 1) {
  return ((half * x) / (1 - x)).toFixed(digits);
}

const maxRangeOf = ({ options }) => JSON.parse(options).max_range ?? 100; // m, the option's default
const speedAt = ({ speed }, agent) => speed[agent] ?? speed; // one for all, or one per agent

function velocityText(vector, { document, dimension }, agent) {
  const size = Math.hypot(...vector);
  return `${unscaled(size, speedAt(document, agent))} m/s, ${directionText(vector, { dimension })}`;
}

function directionText(vector, { dimension }) {
  return vector.every((part) => part === 0) ? "-" : turnBetween([1, 0, 0].slice(0, dimension), vector, dimension);
}

function headingAt(run, step, agent) {
  const at = (step * run.numAgents + agent) * run.dimension;
  return Array.from(run.headings.subarray(at, at + run.dimension), (part) => part / 127);
}

/** The angle from one direction to another, as text. */
function turnBetween(from, to, dimension) {
  if (dimension === 3) {
    const dot = from.reduce((sum, part, axis) => sum + part * to[axis], 0);
    const cosine = dot / (Math.hypot(...from) * Math.hypot(...to) || 1);
    return `${degrees(Math.acos(Math.min(Math.max(cosine, -1), 1)))} apart`;
  }
  const turn = Math.atan2(from[0] * to[1] - from[1] * to[0], from[0] * to[0] + from[1] * to[1]);
  const angle = degrees(Math.abs(turn));
  return angle === degrees(0) ? "straight ahead" : `${angle} ${turn > 0 ? "left" : "right"}`;
}

function degrees(angle) {
  return `${((180 * angle) / Math.PI).toFixed(0)}\u00b0`;
}
