"use strict";

// The neighbor graph of a run at one step.

/** Flat list of pairs of neighbors: at least one hears the other. The search stops above `limit` pairs. */
function neighborPairs(run, step, limit) {
  const { positions, numAgents, dimension } = run;
  const start = step * numAgents * dimension;
  const at = (agent, axis) => positions[start + agent * dimension + axis];
  // Agents are sorted by x, so the search for partners of an agent ends at the largest range.
  const order = [...Array(numAgents).keys()]
    .filter((agent) => !isCaught(run, step, agent))
    .sort((a, b) => at(a, 0) - at(b, 0));
  const ranges = order.map((agent) => rangeOf(run, step, agent));
  const largest = ranges.reduce((a, b) => Math.max(a, b), 0);
  const pairs = [];
  for (let i = 0; i < order.length && pairs.length <= 2 * limit; i++) {
    for (let j = i + 1; j < order.length && at(order[j], 0) - at(order[i], 0) <= largest; j++) {
      let square = 0;
      for (let axis = 0; axis < dimension; axis++) square += (at(order[j], axis) - at(order[i], axis)) ** 2;
      if (square <= Math.max(ranges[i], ranges[j]) ** 2) pairs.push(order[i], order[j]);
    }
  }
  return pairs;
}
