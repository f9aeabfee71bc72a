"use strict";

// Python code that plays the same flock.

/** A number as Python prints a float: both languages print the shortest digits that give the same float. */
function asPython(value) {
  return Number.isInteger(value) ? value.toFixed(1) : String(value);
}

/** The scenario of a flight in Python: the name of a preset, or a preset with other numbers. */
function scenarioInPython({ scenario, numbers, document }) {
  const fields = { agents: ["num_agents"], noise: ["angular_noise"], speed: ["predators"] };
  if (numbers.speed !== undefined) return null;
  const changes = Object.keys(numbers).map((name) => `${fields[name][0]}=${document[fields[name][0]]}`);
  return changes.length ? `preset("${scenario.name}").replace(${changes.join(", ")})` : `"${scenario.name}"`;
}

/** Returns lines of Python, or null if none play this flock. `objective`: what they print, if it is known. */
function pythonCode(flight, policy, objective) {
  const scenario = scenarioInPython(flight);
  if (scenario === null || flight.start || !flight.scenario.isPreset) return null;
  const named = JSON.stringify(policy.kind === "learned" ? policy.file : policy.spec);
  const ranges = policy.kind === "fixed" ? asPython(policy.range) : `policy=${named}`;
  return [
    "from flockesc_env import simulate",
    ...(scenario.startsWith("preset") ? ["from flockesc_env.scenario import preset"] : []),
    `run = simulate(${scenario}, ${ranges}, seed=${flight.seed})`,
    `print(run.mean_distance.min())${objective === null ? "" : `  # ${asPython(objective)}`}`,
  ].join("\n");
}
