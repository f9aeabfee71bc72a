"use strict";

// Python code that plays the same flock.

/** A number as Python prints a float: both languages print the shortest digits that give the same float. */
function asPython(value) {
  return Number.isInteger(value) ? value.toFixed(1) : String(value);
}

/** Returns lines of Python, or null if none play this flock. `objective`: what they print, if it is known. */
function pythonCode({ scenario, agents, seed, start }, policy, objective) {
  if (start || !scenario.isPreset) return null;
  const named = JSON.stringify(policy.kind === "learned" ? policy.file : policy.spec);
  const ranges = policy.kind === "fixed" ? asPython(policy.range) : `policy=${named}`;
  const isPreset = agents === null;
  const flock = isPreset ? `"${scenario.name}"` : `preset("${scenario.name}").replace(num_agents=${agents})`;
  return [
    "from flockesc_env import simulate",
    ...(isPreset ? [] : ["from flockesc_env.scenario import preset"]),
    `run = simulate(${flock}, ${ranges}, seed=${seed})`,
    `print(run.mean_distance.min())${objective === null ? "" : `  # ${asPython(objective)}`}`,
  ].join("\n");
}

function codeNote({ isSteered, start }, code) {
  if (isSteered) return "The code plays this flock with the predator of the scenario: nobody steers it.";
  if (code) return "Python prints the same number, to the last digit.";
  return start ? "The flock has a given start, which no seed gives." : "The scenario has no name.";
}
