// Python code that plays the same flock.

/** Returns three lines of Python. `objective`: what they print, or null if that is not known yet. */
export function pythonCode({ world, seed, isLearned, range }, policy, objective) {
  const [name, run] = isLearned
    ? ["load_policy", `load_policy("${policy.file}").record(${seed}, "${world.name}")`]
    : ["simulate", `simulate("${world.name}", ${asPython(range)}, seed=${seed})`];
  const printed = objective === null ? "" : `  # ${asPython(objective)}`;
  return `from flockesc_env import ${name}\nrun = ${run}\nprint(run.mean_distance.min())${printed}`;
}

/** A number as Python prints a float: both languages print the shortest digits that give the same float. */
export function asPython(value) {
  return Number.isInteger(value) ? value.toFixed(1) : String(value);
}
