"use strict";

// One agent: its range, the agents that it hears, what it heard, what it does and what its policy observes.

class Inspector {
  constructor(card) {
    this.card = card;
    this.chosen = null;
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
    const key = `${step} ${run.last === step ? run.meanRange[step] : ""} ${agent}`;
    if (this.found?.run !== run || this.found.key !== key) {
      const pairs = run.pairsAt(step, agent);
      this.found = { run, key, agent, step, heard: pairs.filter((_, at) => at % 2 === 1) };
      this.describe(this.found);
    }
    return this.found;
  }

  describe({ run, agent, step, heard }) {
    const heading = headingAt(run, step, agent);
    const mean = [0, 0, 0];
    for (const id of [agent, ...heard]) headingAt(run, step, id).forEach((part, axis) => (mean[axis] += part));
    const turned = step > 0 ? turnBetween(headingAt(run, step - 1, agent), heading, run.dimension) : "-";
    const facts = [
      ["listens within", `${Number(rangeOf(run, step, agent).toFixed(2))} ${run.rangeUnit}`],
      ["hears", `${heard.length} ${heard.length === 1 ? "agent" : "agents"}`],
      ["mean heading that it hears, seen from its own", turnBetween(heading, mean, run.dimension)],
      ["turned in the last step", turned],
    ];
    const rows = (pairs) =>
      pairs.map(([name, value]) => element("div", {}, element("dt", {}, name), element("dd", {}, value)));
    $("agent").textContent = `Agent ${agent}`;
    $("agent-facts").replaceChildren(...rows(facts));
    const { names, values } = this.observation(run, agent, step);
    $("agent-view").textContent = run.kind === "fixed" ? "What a policy could observe" : "What its policy observes";
    $("agent-entries").replaceChildren(
      ...rows(names.map((name, at) => [name.replaceAll("_", " "), values[at].toFixed(3)])),
    );
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
    // A run has another flock after its past has changed.
    if (this.past?.of !== run.flock || this.past.flock.steps > step) {
      this.past?.flock.free();
      this.past = { of: run.flock, flock: run.flight.newFlock() };
    }
    const { flock } = this.past;
    while (flock.steps < step) flock.step(run.rangesAt(flock.steps), run.pushes[flock.steps]);
    return flock;
  }
}

function headingAt(run, step, agent) {
  const at = (step * run.numAgents + agent) * run.dimension;
  return Array.from(run.headings.subarray(at, at + run.dimension), (part) => part / 127);
}

/** The angle from one direction to another, as text. */
function turnBetween(from, to, dimension) {
  if (dimension === 3) {
    const dot = from.reduce((sum, part, axis) => sum + part * to[axis], 0);
    return `${degrees(Math.acos(Math.min(Math.max(dot / (Math.hypot(...from) * Math.hypot(...to) || 1), -1), 1)))} apart`;
  }
  const turn = Math.atan2(from[0] * to[1] - from[1] * to[0], from[0] * to[0] + from[1] * to[1]);
  const angle = degrees(Math.abs(turn));
  return angle === degrees(0) ? "the same" : `${angle} ${turn > 0 ? "left" : "right"}`;
}

function degrees(angle) {
  return `${((180 * angle) / Math.PI).toFixed(0)}\u00b0`;
}
