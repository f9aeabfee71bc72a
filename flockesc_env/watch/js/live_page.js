"use strict";

// A page that simulates: which flock flies, under which policies, and what the reader changes.

const MAX_PANELS = 4;
const FRAME_BUDGET = 12; // ms of a frame for model steps; a flock that needs more flies slower than in reality

class LivePage extends Page {
  constructor(content, recordings) {
    super(content, recordings);
    this.scenarios = content.scenarios;
    this.policies = new PolicyList(content.policies);
    this.policies.headline = content.start.headline;
    this.outcomes = new Map(); // objectives of whole runs of this flock, by policy
    this.pointer = null;
    this.inspector = new Inspector($("inspector"));
    this.player.reach = (time) => this.reach(time, FRAME_BUDGET);
    this.controls = new Controls(this, content.playground);
    setInterval(() => this.updateCurves(), 100);
    addEventListener("hashchange", () => this.restore());
  }

  get maxRange() {
    return this.flight.maxRange;
  }

  /** Starts the flock and the policies of the address or, without one, of the document. */
  async restore() {
    const { flight, policies, time } = readAddress(location.hash, this.scenarios, this.start);
    // Files are read first, so that nothing draws the flocks between their end and the new ones.
    await Promise.all(policies.map((spec) => this.policies.find(spec).catch(() => null)));
    this.flight = this.flightOf(flight) ?? new Flight({ ...flight, numbers: {} });
    this.camera.setDimension(this.flight.document.dimension);
    this.window = new Window();
    for (const panel of this.panels.splice(0)) this.drop(panel);
    this.forgetOutcomes();
    for (const spec of policies.slice(0, MAX_PANELS)) await this.addPolicy(spec);
    if (!this.panels.length) await this.addPolicy(`fixed:${this.flight.scenario.best ?? 0}`);
    this.begin(time);
  }

  /** The run of a policy's text: a recording, or a new live run. */
  async runOf(spec) {
    const recording = this.recordings.find((run) => run.spec === spec);
    return recording ?? new LiveRun(this.flight, await this.policies.find(spec, this.flight.unit));
  }

  /** Adds a panel for a policy's text. */
  async addPolicy(spec) {
    if (this.panels.length >= MAX_PANELS) return;
    const run = await this.runOf(spec).catch((error) => this.say(messageOf(error)));
    if (!run) return;
    this.addPanel(run);
    this.reach(this.player.time);
  }

  addPanel(run) {
    const panel = super.addPanel(run);
    panel.choice = new Choice((spec) => this.choose(panel, spec), this.policies);
    panel.stats.before(panel.choice.root);
    const { canvas, scene } = panel;
    let pressed = [0, 0];
    canvas.addEventListener("pointerdown", ({ offsetX, offsetY }) => (pressed = [offsetX, offsetY]));
    canvas.addEventListener("click", ({ offsetX, offsetY }) => {
      const isDrag = Math.hypot(offsetX - pressed[0], offsetY - pressed[1]) > 4;
      if (!isDrag) this.inspect(panel, scene.agentAt(offsetX, offsetY));
    });
    for (const name of ["pointerdown", "pointermove"]) canvas.addEventListener(name, (event) => this.point(event));
    for (const name of ["pointerleave", "pointercancel"]) canvas.addEventListener(name, () => this.point(null));
    return panel;
  }

  drop(panel) {
    super.drop(panel);
    if (panel.run.isLive) panel.run.free();
    this.inspector.choose(panel, null);
  }

  /** Sets the policy of a panel from the shown time on. After the end of a run, all flocks start again. */
  async choose(panel, spec) {
    panel.wanted = spec; // of several choices in a row, only the last counts
    try {
      const recording = this.recordings.find((run) => run.spec === spec);
      if (recording) panel.setRun(recording);
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
    if (this.flight.path.length) this.flight = new Flight({ ...this.flight, path: [] });
    for (const panel of this.panels) if (panel.run.isLive) panel.setRun(new LiveRun(this.flight, panel.run.policy));
    super.again();
  }

  /** The flock that is wanted; null, with a message, if its scenario cannot have the numbers. */
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

  /** Flies another flock: a scenario, a seed, numbers or a pilot. */
  fly(changes) {
    const { scenario, seed, numbers, isSteered } = this.flight;
    const wanted = { scenario, seed, numbers, isSteered, ...changes };
    if (changes.scenario) wanted.numbers = {};
    if (!wanted.scenario.steered) wanted.isSteered = false;
    if (!wanted.scenario.start && wanted.seed === null) wanted.seed = "0";
    const flight = this.flightOf(wanted);
    if (!flight) return this.showAll();
    this.flight = flight;
    this.say("");
    this.camera.setDimension(this.flight.document.dimension);
    this.window = new Window();
    this.forgetOutcomes();
    for (const panel of this.panels) this.moveToFlight(panel, Boolean(changes.scenario));
    this.player.time = 0;
    this.showAll();
    this.seek(0);
  }

  /** Plays the policy of a panel on the present flock. In another scenario a fixed range becomes the best one there. */
  moveToFlight(panel, isOtherScenario) {
    const { best, maxRange } = this.flight.scenario;
    const { run } = panel;
    if (!run.isLive) return;
    const fallback = new FixedRange(best ?? maxRange / 10, this.flight.unit);
    try {
      panel.setRun(new LiveRun(this.flight, isOtherScenario && run.kind === "fixed" ? fallback : run.policy));
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
  point(event) {
    if (!this.flight.isSteered) return;
    this.pointer = event && this.camera.unproject(event.offsetX, event.offsetY);
    if (!this.player.isPlaying) this.draw();
  }

  inspect(panel, agent) {
    if (this.flight.isSteered) return;
    this.inspector.choose(panel, agent);
    this.draw();
  }

  /** The address of the present state, with the pointer's path. */
  link() {
    const first = this.panels.find(({ run }) => run.isLive)?.run;
    const path = this.flight.isSteered ? (first?.targets ?? []) : [];
    return writeAddress(
      this.flight,
      this.panels.map(({ run }) => run.spec),
      path,
    );
  }

  showAll() {
    super.showAll();
    this.controls.show();
  }

  showTime() {
    this.reach(this.player.time);
    for (const { run } of this.panels) this.noteOutcome(run);
    super.showTime();
  }

  draw() {
    if (!this.flight) return; // the page is still reading
    this.look.chosen = this.inspector.at(this.player.time);
    this.look.target = this.flight.isSteered ? this.pointer : null;
    super.draw();
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
    const { best } = flight.scenario;
    if (flight.isSteered || best === null) return null;
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
}
