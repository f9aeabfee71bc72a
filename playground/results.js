// The objective after whole runs of one flock, by policy.

export class Results {
  constructor(list, announcement) {
    Object.assign(this, { list, announcement });
  }

  /** Forgets the results of another flock. */
  begin({ world, seed, isSteered }) {
    const flock = `${world.name} ${seed} ${isSteered}`;
    if (flock === this.flock) return;
    this.flock = flock;
    this.objectives = new Map();
    this.list.replaceChildren();
    this.announcement.textContent = "";
  }

  /** Adds a run that has ended, if its policy did not change. */
  note(run, { world }) {
    const unit = world.unit === "m" ? "m" : "nearest";
    const objective = `${run.objective.toFixed(1)} m`;
    this.announcement.textContent = `The run ended. The mean distance was never below ${objective}.`;
    if (run.used.size !== 1 || run.isSteered) return;
    const [policy] = run.used;
    this.objectives.set(policy, objective);
    const rank = (key) => (key === "learned" ? Infinity : key);
    const sorted = [...this.objectives].sort(([a], [b]) => rank(a) - rank(b));
    this.list.replaceChildren(
      ...sorted.map(([key, value]) => {
        const item = document.createElement("li");
        const number = Object.assign(document.createElement("b"), { textContent: value });
        item.append(key === "learned" ? "learned: " : `${key} ${unit}: `, number);
        return item;
      }),
    );
  }
}
