"use strict";

// Policies that the page can run: fixed ranges, simple rules, and networks of policy files.

/** One range for all agents: the best one of the scenario, or the reader's. */
class FixedRange {
  constructor(range, { unit, best }) {
    const isBest = range === best;
    const title = `${isBest ? "Best single range" : "Your range"}: ${range} ${unit}`;
    Object.assign(this, { range, isBest, title, spec: `fixed:${range}`, kind: "fixed", stepsPerAction: 1 });
    this.options = JSON.stringify({ view: "agent", predator_sensing_range: null });
  }

  start() {
    return () => [this.range];
  }
}

// Rules of flockesc_env/policies/rules.py with their default numbers. NumPy compares in float32.
const leaders = (sensingRange) => ({
  options: { view: "agent", predator_sensing_range: sensingRange },
  entry: "predator_direction_ahead",
  rangeOf: (ahead) => (-ahead > Math.fround(0.8) ? 0 : 10),
});
const RULES = {
  "stubborn-leaders": leaders(null),
  "stubborn-leaders-local": leaders(30),
  "listen-while-fleeing": {
    options: { view: "flock", predator_sensing_range: null },
    entry: "heading_away",
    rangeOf: (away) => (away > Math.fround(0.05) ? 20 : 0),
  },
};

/** A hand-written rule that compares one entry of the observation. */
class Rule {
  constructor(name) {
    const { options, entry, rangeOf: rule } = RULES[name];
    const title = `Rule: ${name.replaceAll("-", " ")}`;
    Object.assign(this, { entry, rule, title, spec: name, kind: "rule", stepsPerAction: 1 });
    this.options = JSON.stringify(options);
  }

  start(run) {
    const observer = run.flight.observer(this.options);
    const { entries, rows } = observer;
    const at = entries.indexOf(this.entry);
    return () => {
      const observed = observer.observe(run.flock);
      return Array.from({ length: rows }, (_, row) => this.rule(observed[row * entries.length + at]));
    };
  }
}

/** The network of a policy file. */
class NetworkPolicy {
  /** `content`: the bytes of the file; `entry`: names for readers, see `watch/live.py`. */
  static async read(content, { spec, title, file, sha256, isDropped = false }) {
    const { header, parameters } = await readPolicyFile(content);
    const network = new wasm_bindgen.PolicyFile(header, parameters);
    const { options, stepsPerAction } = network;
    const trainedIn = JSON.parse(header).scenario;
    const names = { spec, title, file, sha256, isDropped, trainedIn, kind: "learned" };
    return Object.assign(new NetworkPolicy(), names, { network, options, stepsPerAction, parameters });
  }

  start(run) {
    const observer = run.flight.observer(this.options);
    const network = this.network.network(observer.entries);
    return () => network.ranges(observer.observe(run.flock), observer.rows);
  }
}

/** The policies that a reader can choose, by the text that names them in addresses. */
class PolicyList {
  /** `files`: entries of policy files with their content, `data`. */
  constructor(files) {
    this.files = new Map(files.map((entry) => [entry.spec, entry]));
  }

  /** Returns the policy of a text in a scenario. Raises an error with a message for readers. */
  async find(spec, scenario) {
    const entry = this.files.get(spec);
    if (!entry && spec.startsWith("fixed:")) {
      const text = spec.slice("fixed:".length);
      const range = /^[+-]?[\d.]+(e[+-]?\d+)?$/i.test(text) ? Number(text) : NaN;
      if (!(range >= 0 && Number.isFinite(range))) throw new Error(`${spec}: expected a range >= 0`);
      return new FixedRange(range, scenario);
    }
    if (!entry && Object.hasOwn(RULES, spec)) return new Rule(spec);
    if (!entry) throw new Error(`${spec}: this page has no such policy. If it is a file, drop it on the page.`);
    return entry.policy ?? this.add(entry, bytesOf(entry.data));
  }

  /** Adds the policy of a file's bytes. */
  async add(entry, bytes) {
    const policy = await NetworkPolicy.read(bytes, entry);
    this.files.set(entry.spec, { ...entry, policy });
    return policy;
  }

  /** Fills the list of a panel. `recordings`: recorded runs that it can show. */
  list(select, { title, spec, policy }, recordings) {
    const isFixed = policy?.kind === "fixed";
    select.replaceChildren(
      new Option(isFixed ? title : "One range for all", "fixed"),
      ...recordings.map((run) => new Option(`${run.title} (recorded)`, run.spec)),
      ...[...this.files.values()].map((entry) => new Option(entry.title, entry.spec)),
      ...Object.keys(RULES).map((name) => new Option(new Rule(name).title, name)),
    );
    select.value = isFixed ? "fixed" : spec;
  }
}
