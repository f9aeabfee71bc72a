"use strict";

// The page: builds its parts and connects them.

const MAX_PANELS = 4;
const FRAME_BUDGET = 12; // ms of a frame for model steps; a flock that needs more flies slower than in reality

class Page {
  constructor({ versions, worlds, policies, start, playground }, recordings, isLive) {
    Object.assign(this, { versions, worlds, start, recordings, isLive });
    this.policies = new PolicyList(policies);
    this.policies.headline = start.headline;
    this.player = new Player();
    this.look = { theme: readTheme(), color: "component", trails: true, edges: false, discs: false };
    this.panels = [];
    this.outcomes = new Map(); // objectives of whole runs of this flock, by policy
    this.pointer = null;
    this.camera = new Camera();
    this.curves = new Curves($("charts"), this.player, this.look.theme);
    this.inspector = new Inspector($("inspector"));
    this.player.reach = (time) => this.reach(time, FRAME_BUDGET);
    this.player.addEventListener("again", () => this.again());
    this.player.addEventListener("change", () => this.showTime());
    bindPlayer(this.player);
    this.bindLooks();
    if (isLive) this.bindWorld();
    if (playground) this.bindPlayground(playground);
    $("save").addEventListener("click", () => savePicture(this));
    this.videoButton = new VideoButton($("save-video"), this);
    new ResizeObserver(() => this.draw()).observe($("panels"));
    setInterval(() => this.updateCurves(), 100);
  }

  /** Starts the flock and the policies of the address or, without one, of the document. */
  async restore() {
    const { flight, policies, time } = readAddress(location.hash, this.worlds, this.start);
    // Files are read first, so that nothing draws the flocks between their end and the new ones.
    await Promise.all(policies.map((spec) => this.policies.find(spec).catch(() => null)));
    this.flight = this.isLive ? (this.flightOf(flight) ?? new Flight({ ...flight, numbers: {} })) : null;
    this.camera.setDimension((this.flight?.document ?? this.recordings[0].document).dimension);
    this.window = new Window();
    for (const panel of this.panels.splice(0)) this.drop(panel);
    this.forgetOutcomes();
    for (const spec of policies.slice(0, MAX_PANELS)) await this.addPanel(spec);
    if (!this.panels.length) await this.addPanel(this.isLive ? `fixed:${this.flight.world.best ?? 0}` : "recording:0");
    const isRecorded = this.panels.every(({ run }) => !run.isLive);
    this.look.color = isRecorded && !rangesDiffer(this.panels) ? "component" : "range";
    $("color").value = this.look.color;
    this.showAll();
    this.seek(Number(time) || 0);
    if (time === null && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.player.play();
  }

  /** The run of a policy's text: a recording, or a new live run. */
  async runOf(spec) {
    if (spec.startsWith("recording:")) {
      const recording = this.recordings[Number(spec.slice("recording:".length))];
      if (recording) return recording;
    }
    return new LiveRun(this.flight, await this.policies.find(spec, this.flight.unit));
  }

  async addPanel(spec) {
    const run = await this.runOf(spec).catch((error) => this.say(messageOf(error)));
    if (!run || this.panels.length >= MAX_PANELS) return;
    const panel = new Panel(this, this.isLive);
    panel.setRun(run);
    this.panels.push(panel);
    $("panels").append(panel.root);
    this.reach(this.player.time);
  }

  removePanel(panel) {
    this.panels.splice(this.panels.indexOf(panel), 1);
    this.drop(panel);
    this.showAll();
  }

  drop(panel) {
    panel.root.remove();
    if (panel.run.isLive) panel.run.free();
    this.inspector.choose(panel, null);
  }

  /** Sets the policy of a panel from the shown time on. After the end of a run, all flocks start again. */
  async choose(panel, spec) {
    panel.wanted = spec; // of several choices in a row, only the last counts
    try {
      if (spec.startsWith("recording:")) panel.setRun(await this.runOf(spec));
      else {
        const policy = await this.policies.find(spec, this.flight.unit);
        if (panel.wanted !== spec) return;
        this.apply(panel, policy);
      }
      this.say("");
    } catch (error) {
      this.say(messageOf(error));
    }
    this.showAll();
  }

  apply(panel, policy) {
    const { run } = panel;
    const isAtEnd = this.player.duration > 0 && this.player.hasEnded;
    if (!run.isLive) panel.setRun(new LiveRun(this.flight, policy));
    else if (isAtEnd) run.setPolicy(policy);
    else {
      run.rewind(Math.min(Math.ceil(this.player.time / run.timeStep - 1e-6), run.last));
      run.setPolicy(policy);
    }
    if (!isAtEnd) this.reach(this.player.time);
    else {
      this.again();
      this.player.play();
    }
  }

  /** Starts the same flock again under the present policies. */
  again() {
    if (this.flight?.path.length) this.flight = new Flight({ ...this.flight, path: [] });
    for (const panel of this.panels) if (panel.run.isLive) panel.setRun(new LiveRun(this.flight, panel.run.policy));
    this.player.time = 0;
    this.showAll();
  }

  /** The flock that is wanted; null, with a message, if its world cannot have the numbers. */
  flightOf(wanted) {
    try {
      const flight = new Flight(wanted);
      flight.newFlock().free();
      return flight;
    } catch (error) {
      this.say(messageOf(error));
      return null;
    }
  }

  /** Flies another flock: a world, a seed, numbers or a pilot. */
  fly(changes) {
    const { world, seed, numbers, isSteered } = this.flight;
    const wanted = { world, seed, numbers, isSteered, ...changes };
    if (changes.world) wanted.numbers = {};
    if (!wanted.world.steered) wanted.isSteered = false;
    if (!wanted.world.start && wanted.seed === null) wanted.seed = "0";
    const flight = this.flightOf(wanted);
    if (!flight) return this.showAll();
    this.flight = flight;
    this.say("");
    this.camera.setDimension(this.flight.document.dimension);
    this.window = new Window();
    this.forgetOutcomes();
    for (const panel of this.panels) this.moveToFlight(panel, Boolean(changes.world));
    this.player.time = 0;
    this.showAll();
    this.seek(0);
  }

  /** Plays the policy of a panel on the present flock. In another world a fixed range becomes the best one there. */
  moveToFlight(panel, isOtherWorld) {
    const { best, maxRange } = this.flight.world;
    const { run } = panel;
    if (!run.isLive) return;
    const fallback = new FixedRange(best ?? maxRange / 10, this.flight.unit);
    try {
      panel.setRun(new LiveRun(this.flight, isOtherWorld && run.kind === "fixed" ? fallback : run.policy));
    } catch (error) {
      this.say(`${run.title} cannot play here: ${messageOf(error)}`);
      panel.setRun(new LiveRun(this.flight, fallback));
    }
  }

  /** Steps the live runs up to a time, and returns the time that all have reached. */
  reach(time, budget = Infinity) {
    const end = performance.now() + budget;
    let reached = time;
    for (const { run } of this.panels) {
      if (!run.isLive) continue;
      run.reach(time, (asking) => this.targetOf(asking), Math.max(end - performance.now(), 0));
      if (!run.hasEnded) reached = Math.min(reached, run.last * run.timeStep);
      this.window.include(run);
    }
    return reached;
  }

  seek(time) {
    this.player.seek(time);
    this.window.follow(10);
    this.draw();
  }

  /** Where the predators of a run fly: along the path of the link, else as in the first panel, else to the pointer. */
  targetOf(run) {
    if (!this.flight.isSteered) return null;
    const step = run.last;
    if (step < this.flight.path.length) return this.flight.path[step];
    const first = this.panels.find((panel) => panel.run.isLive)?.run;
    if (first && first !== run && step < first.targets.length) return first.targets[step];
    return this.pointer && roundedPoint(this.pointer);
  }

  /** Takes the pointer's place in m, or null if it left the field. */
  point(panel, event) {
    if (!this.flight?.isSteered) return;
    this.pointer = event && this.camera.unproject(event.offsetX, event.offsetY);
    if (!this.player.isPlaying) this.draw();
  }

  inspect(panel, agent) {
    if (this.flight?.isSteered) return;
    this.inspector.choose(panel, agent);
    this.draw();
  }

  /** Shows the runs and the state in every part of the page. */
  showAll() {
    const runs = this.panels.map(({ run }) => run);
    if (!runs.length) return;
    chooseColors(runs);
    document.body.dataset.panels = runs.length;
    const durations = runs.map((run) => run.numSteps * run.timeStep);
    this.player.setDuration(Math.max(...durations), Math.min(...runs.map((run) => run.timeStep)));
    // A fixed scale, so that a color keeps its meaning.
    this.look.largestRange = Math.max(this.flight?.maxRange ?? LARGEST_RANGE, ...runs.map((run) => run.largestRange));
    this.panels.forEach((panel) => panel.show(this));
    runs.forEach((run) => this.window.include(run));
    this.curves.setRuns(runs, this.yardstick());
    this.describe(runs[0]);
    this.showKey();
    if (this.isLive) this.showWorld();
    this.showTime();
  }

  showTime() {
    if (!this.panels.length) return;
    const { time } = this.player;
    this.reach(time);
    for (const { run } of this.panels) this.noteOutcome(run);
    this.showScore();
    this.draw();
  }

  draw() {
    if (!this.window || this.window.isEmpty) return;
    const now = performance.now();
    this.camera.fit(this.window.follow(this.player.isPlaying ? Math.min((now - (this.drawn ?? now)) / 1000, 0.2) : 10));
    this.drawn = now;
    this.look.numPanels = this.panels.length;
    this.look.chosen = this.inspector.at(this.player.time);
    this.look.target = this.flight?.isSteered ? this.pointer : null;
    this.panels.forEach((panel) => panel.draw(this.player.time, this.look));
  }

  /** Adds new frames to the curves; drawing them in every frame of the page is too slow. */
  updateCurves() {
    const isMeasured = this.measureYardstick();
    const frames = this.panels.map(({ run }) => run.last).join();
    if ((frames === this.curveFrames && isMeasured) || !this.curves.charts.length) return;
    this.curveFrames = frames;
    this.panels.forEach(({ run }) => run.isLive && run.countComponents());
    this.curves.update();
  }

  /** The run of the best fixed range on this flock, which the chart shows behind the others; null without one. */
  yardstick() {
    const { flight } = this;
    const { best } = flight?.world ?? {};
    if (!flight || flight.isSteered || best === null) return null;
    if (this.measured?.flight !== flight) {
      this.measured?.free();
      this.measured = new LiveRun(flight, new FixedRange(best, flight.unit));
    }
    return this.measured;
  }

  /** Plays the yardstick for some milliseconds; returns whether it has ended. */
  measureYardstick() {
    const run = this.curves.yardstick;
    if (!run || run.hasEnded) return true;
    run.reach(Infinity, () => null, FRAME_BUDGET);
    return false;
  }

  /** Keeps the objective of a whole run under one policy. */
  noteOutcome(run) {
    if (!run.isLive || !run.hasEnded || run.isNoted) return;
    run.isNoted = true;
    const { objective, onlyPolicy, title } = run;
    $("announcement").textContent = `${title}: the mean distance was never below ${objective.toFixed(1)} m.`;
    if (!onlyPolicy || this.flight.isSteered) return;
    this.outcomes.set(title, objective);
    const sorted = [...this.outcomes].sort(([, a], [, b]) => b - a);
    $("outcomes").replaceChildren(
      ...sorted.map(([name, value]) => element("li", {}, `${name} `, element("b", {}, `${value.toFixed(1)} m`))),
    );
  }

  forgetOutcomes() {
    this.outcomes.clear();
    $("outcomes").replaceChildren();
  }

  /** With two flocks, shows which is ahead and by how much. */
  showScore() {
    const score = $("score");
    score.hidden = this.panels.length !== 2;
    if (score.hidden) return;
    const [a, b] = this.panels.map(({ run }) => run.lowestMean[frameAt(run, this.player.time).step]);
    const [ahead] = a >= b ? this.panels : this.panels.slice(1);
    const lead = Math.abs(a - b).toFixed(1);
    score.replaceChildren(
      ...(lead === "0.0" ? ["No flock is ahead"] : [element("b", {}, ahead.run.title), ` is ahead by `, element("b", {}, `${lead} m`)]),
      element("small", {}, "difference of the lowest mean distances so far"),
    );
  }

  say(text) {
    $("message").textContent = text;
  }

  bindLooks() {
    const read = () => {
      this.look.color = $("color").value;
      for (const id of ["trails", "edges", "discs"]) this.look[id] = $(id).checked;
      this.showKey();
      this.draw();
    };
    $("looks").addEventListener("change", read);
    $("edges").parentElement.hidden = !this.isLive;
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.look.theme = readTheme();
      this.curves.redraw(this.look.theme);
      this.showKey();
      this.draw();
    });
  }

  /** Shows the key of the colors. */
  showKey() {
    const { theme, color, largestRange } = this.look;
    document.documentElement.style.setProperty("--scale", `linear-gradient(to right, ${theme.rampStops})`);
    const dot = (background, className = "") => {
      const swatch = element("i", { className });
      swatch.style.background = background;
      return swatch;
    };
    const unit = this.panels[0]?.run.rangeUnit ?? "m";
    if (color === "range") {
      const end = `${Number((largestRange ?? 0).toFixed(1))} ${unit}`;
      $("key").replaceChildren("0", dot("var(--scale)", "ramp"), end);
    } else {
      const named = theme.groups.slice(0, NUM_GROUP_COLORS).map((name) => dot(name));
      $("key").replaceChildren(...named, "largest", dot(theme.groups[OTHER_GROUP]), "others", dot(theme.groups[ALONE]), "alone");
    }
  }

  /** Writes the head of the page: the scenario, the seed and the versions. */
  describe({ document: scenario, seed }) {
    const seconds = Number((scenario.num_steps * scenario.time_step).toFixed(2));
    const facts = [
      `${scenario.num_agents} agents in ${scenario.dimension === 3 ? "space" : "the plane"}`,
      `${seconds} s in ${scenario.num_steps} steps`,
      scenario.predators.length ? `agents flee within ${scenario.predator_range} m of a predator` : "no predator",
      seed === null ? "given start" : `seed ${seed}`,
      `flockesc-env ${this.versions["flockesc-env"]}`,
    ];
    $("facts").textContent = facts.join(" \u00b7 ");
    const rows = [...Object.entries(scenario), ...Object.entries(this.versions)].map(([name, value]) => {
      const isPart = typeof value === "object";
      const text = isPart ? JSON.stringify(value) : String(value);
      return element("div", { className: isPart ? "wide" : "" }, element("dt", {}, name), element("dd", {}, text));
    });
    $("parameters").replaceChildren(...rows);
  }
}

/** Whether the interaction range differs between runs, agents or times. */
function rangesDiffer(panels) {
  const first = panels[0].run.ranges[0];
  return panels.some(({ run }) => run.ranges.some((range) => range !== first));
}

function messageOf(error) {
  return error instanceof Error ? error.message : String(error);
}
