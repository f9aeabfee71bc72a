"use strict";

// Colors of the largest components. They persist while components split, merge and lose agents.

const NUM_GROUP_COLORS = 5;
const OTHER_GROUP = NUM_GROUP_COLORS; // a component smaller than those with colors
const ALONE = NUM_GROUP_COLORS + 1; // a component of one agent

/** Color index of every agent of a run, by frame. */
class Groups {
  constructor(run) {
    this.run = run;
    this.frames = [];
  }

  at(step) {
    while (this.frames.length <= step) {
      const labels = this.run.labelsAt(this.frames.length);
      const now = new Uint8Array(labels.length).fill(ALONE);
      colorComponents(largestFirst(labels), this.frames.at(-1), now);
      this.frames.push(now);
    }
    return this.frames[step];
  }

  /** Forgets the frames from a step on. */
  forget(step) {
    this.frames.length = Math.min(this.frames.length, step);
  }
}

/** Lists of the agents of every component of two agents or more. */
function largestFirst(labels) {
  const members = new Map();
  labels.forEach((label, agent) => {
    if (!members.has(label)) members.set(label, []);
    members.get(label).push(agent);
  });
  return [...members.values()].filter((agents) => agents.length > 1).sort((a, b) => b.length - a.length);
}

/** A component keeps the color of most of its agents, unless a larger one keeps it; the others get free colors. */
function colorComponents(components, before, now) {
  const free = new Set(Array(NUM_GROUP_COLORS).keys());
  const waiting = [];
  const paint = (agents, color) => agents.forEach((agent) => (now[agent] = color));
  for (const agents of components.slice(0, NUM_GROUP_COLORS)) {
    const votes = Array(NUM_GROUP_COLORS).fill(0);
    if (before) agents.forEach((agent) => before[agent] < NUM_GROUP_COLORS && votes[before[agent]]++);
    const color = [...free].reduce((best, next) => (votes[next] > votes[best] ? next : best));
    if (votes[color] > 0) {
      free.delete(color);
      paint(agents, color);
    } else {
      waiting.push(agents);
    }
  }
  for (const agents of waiting) {
    const [color] = free;
    free.delete(color);
    paint(agents, color);
  }
  for (const agents of components.slice(NUM_GROUP_COLORS)) paint(agents, OTHER_GROUP);
}
