"use strict";

// A page that simulates: which flock flies, under which policies, and what the reader changes.

const MAX_PANELS = 4;
const AT_ONCE = 200; // ms after a change in which whole runs are played at once; longer ones go on in the background
const FRAME_BUDGET = 12; // ms of a frame for model steps; a flock that needs more flies slower than in reality
const REST = 2000; // ms between two flocks of the tour

class LivePage extends Page {
  constructor(content, recordings) {
    super(content, recordings);
    this.scenarios = content.scenarios;
    this.policies = new PolicyList(content.policies);
    this.policies.headline = content.start.headline;
    this.tour = content.playground?.tour ?? []; // seeds of the flocks that fly one after another at first
    this.isTouring = false;
    this.trials = new Map(); // objectives of whole runs of this flock, by the text of the policy
    this.steering = new Steering(this);
    this.inspector = new Inspector($("inspector"), () => this.draw());
    this.choice = new Choice($("choice"), (spec) => this.choose(this.active, spec), content.start.headline);
    this.prediction = content.playground ? new Prediction(this, content.playground) : null;
    this.player.reach = (time) => this.reach(time, FRAME_BUDGET);
    this.player.addEventListener("end", () => this.end());
    this.controls = new Controls(this);
    setInterval(() => this.work(), 50);
    addEventListener("hashchange", () => this.restore());
  }

  /** Shows the address, after an earlier one: reading files takes time. */
  restore() {
    return (this.restored = Promise.resolve(this.restored).then(() => this.readHash()));
  }

  /** Starts the flock and the policies of the address or, without one, of the document. */
  async readHash() {
    const { flight, policies, time, problems } = readAddress(location.hash, this.scenarios, this.start);
    // Files are read first, so that nothing draws the flocks between their end and the new ones.
    await Promise.all(policies.map((spec) => this.policies.find(spec).catch(() => null)));
    this.prediction?.close(false);
    this.say(problems.join(" "));
    this.flight = this.flightOf(flight) ?? new Flight({ ...flight, numbers: {} });
    this.changeFlock();
    for (const panel of this.panels.splice(0)) this.drop(panel);
    for (const spec of policies) await this.addPolicy(spec);
    if (!this.panels.length) await this.addPolicy(`fixed:${this.flight.scenario.best ?? 0}`);
    const isFirst = !location.hash && this.prediction;
    this.isTouring = Boolean(isFirst) && !isStill();
    if (isFirst) this.prediction.ask();
    this.begin(isFirst ? 0 : time);
  }

  /** The run of a policy's text: a recording, or a new live run. */
  async runOf(spec) {
    const recording = this.recordings.find((run) => run.spec === spec);
    return recording ?? new LiveRun(this.flight, await this.policies.find(spec, this.flight.unit));
  }

  /** Adds a panel for a policy's text. */
  async addPolicy(spec) {
    const run = await this.runOf(spec).catch((error) => this.say(messageOf(error)));
    if (!run) return;
    this.addPanel(run);
    this.catchUp();
  }

  addPanel(run) {
    const panel = super.addPanel(run);
    panel.select = element("select", { ariaLabel: "Policy of this flock" });
    panel.select.addEventListener("change", () => {
      this.choose(panel, panel.select.value === "fixed" ? this.choice.sliderSpec : panel.select.value);
    });
    panel.title.after(element("label", { className: "pick" }, "\u25be", panel.select));
    panel.root.addEventListener("pointerdown", () => {
      if (panel === this.active || panel.run.kind !== "fixed" || !panel.run.isLive) return;
      this.chosen = panel;
      this.controls.showChoice();
    });
    this.steering.bind(panel);
    return panel;
  }

  /** The panel whose range the slider sets: the last one with a fixed range that the reader touched. */
  get active() {
    const isFixed = ({ run }) => run.isLive && run.kind === "fixed";
    const first = this.panels.find(isFixed) ?? this.panels[0];
    return this.panels.includes(this.chosen) ? this.chosen : first;
  }

  removePanel(panel) {
    this.isTouring = false;
    super.removePanel(panel);
  }

  drop(panel) {
    super.drop(panel);
    this.inspector.choose(panel, null);
  }

  /** Shows another policy in a panel: its run of the same flock, at the present time. */
  async choose(panel, spec) {
    this.isTouring = false;
    panel.wanted = spec; // of several choices in a row, only the last counts
    this.steering.keepPath();
    try {
      const run = await this.runOf(spec);
      if (panel.wanted !== spec) return;
      panel.setRun(run);
      this.chosen = panel;
      this.say("");
      this.catchUp();
    } catch (error) {
      this.say(messageOf(error));
    }
    this.showAll();
    this.announce(panel.run);
  }

  announce(run) {
    if (!run.isLive || !run.hasEnded || this.flight.isSteered) return;
    $("announcement").textContent = `${run.title}: the mean distance is never below ${run.objective.toFixed(1)} m.`;
  }

  /** Starts the same flock again under the present policies. */
  again() {
    if (this.flight.isSteered) {
      this.flight = new Flight({ ...this.flight, path: [] });
      for (const panel of this.panels) this.moveToFlight(panel, false);
    }
    super.again();
  }

  /** The flock that is wanted; null, with a message, if its scenario cannot have the numbers. */
  flightOf(wanted) {
    try {
      const flight = new Flight(wanted);
      flight.newFlock(); // raises an error if the core refuses it
      return flight;
    } catch (error) {
      this.say(messageOf(error));
      return null;
    }
  }

  /** Flies another flock from its start: a scenario, a seed, numbers or a pilot. */
  fly(changes, isTouring = false) {
    this.isTouring = isTouring;
    const { scenario, seed, numbers, isSteered } = this.flight;
    const wanted = { scenario, seed, numbers, isSteered, ...changes };
    if (changes.scenario) wanted.numbers = {};
    if (!wanted.scenario.steered) wanted.isSteered = false;
    if (!wanted.scenario.start && wanted.seed === null) wanted.seed = "0";
    const flight = this.flightOf(wanted);
    if (!flight) return this.showAll();
    this.flight = flight;
    this.say("");
    this.changeFlock();
    for (const panel of this.panels) this.moveToFlight(panel, Boolean(changes.scenario));
    this.player.time = 0;
    this.catchUp();
    this.showAll();
    this.seek(0);
  }

  /** Gives the predator to the reader, at a time in s, or back. */
  steer(isSteered, time = 0) {
    const { predators, time_step: timeStep } = JSON.parse(this.flight.scenario.json);
    // A predator in the reader's hand flies straight on until it is led. Others would have flown elsewhere.
    const isStraight = predators.every((predator) => "constant_velocity" in predator);
    const steps = isSteered && isStraight ? Math.round(time / timeStep) : 0;
    this.fly({ isSteered, path: Array(steps).fill(null) });
    this.reach(steps * timeStep);
    this.seek(steps * timeStep);
    this.player.play();
  }

  /** Shows an agent of a panel, or none. */
  inspect(panel, agent) {
    this.inspector.choose(panel, agent);
    this.draw();
  }

  /** Forgets what belongs to another flock. */
  changeFlock() {
    this.camera.setDimension(this.flight.document.dimension);
    this.window = new Window();
    this.trials.clear();
    this.steering.forget();
    const { best } = this.flight.scenario;
    const hasBest = best !== null && !this.flight.isSteered && this.flight.document.predators.length > 0;
    this.best = hasBest ? new LiveRun(this.flight, new FixedRange(best, this.flight.unit)) : null;
  }

  /** Flies the next flock of the tour or, outside the tour, the one with the next seed. */
  next() {
    const { isTouring, tour, flight } = this;
    const seed = String((BigInt(flight.seed ?? 0) + 1n) % 2n ** 64n);
    this.fly({ seed: isTouring ? tour[(tour.indexOf(flight.seed) + 1) % tour.length] : seed }, isTouring);
    this.player.play();
  }

  /** What happens at the end of a run. */
  end() {
    this.showAll();
    const isOver = () => this.isTouring && this.player.hasEnded && !this.player.isPlaying;
    if (isOver()) setTimeout(() => isOver() && this.next(), REST);
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

  /** Steps all live runs up to a time, the one that is behind first, and returns the time that all have reached. */
  reach(time, budget = Infinity, runs = this.panels.map(({ run }) => run)) {
    const end = performance.now() + budget;
    const isBehind = (run) => run.isLive && !run.hasEnded && run.last * run.timeStep < time - 1e-9;
    const timeOf = (run) => run.last * run.timeStep;
    const next = () => runs.filter(isBehind).reduce((a, b) => (a && timeOf(a) <= timeOf(b) ? a : b), null);
    for (let run = next(); run && performance.now() < end; run = next()) run.step(this.steering.targetOf(run));
    return Math.min(time, ...runs.filter(isBehind).map(timeOf));
  }

  /** Plays the runs on after a change: up to the present time and, unless the reader steers, to their end. */
  catchUp() {
    this.reach(this.flight.isSteered ? this.player.time : Infinity, AT_ONCE);
    this.noteTrials();
  }

  /** Plays whole runs in the background and shows what they give. */
  work() {
    if (!this.flight || !this.panels.length) return;
    const runs = this.panels.map(({ run }) => run);
    if (this.best) runs.push(this.best);
    if (!this.flight.isSteered) this.reach(Infinity, FRAME_BUDGET, runs);
    for (const { run } of this.panels) if (run.isLive) run.countComponents(FRAME_BUDGET);
    const progress = runs.map((run) => `${run.last} ${run.counted}`).join();
    if (progress === this.progress) return;
    this.progress = progress;
    this.noteTrials();
    this.curves.update();
  }

  /** Keeps the objectives of whole runs. */
  noteTrials() {
    const isNew = ({ run }) => run.isLive && run.hasEnded && !run.isNoted && run.numPredators > 0;
    const found = this.panels.filter(isNew);
    for (const { run } of found) {
      run.isNoted = true;
      if (this.flight.isSteered) this.steering.note(run);
      else this.trials.set(run.spec, { title: run.title, range: run.policy.range ?? null, objective: run.objective });
    }
    if (found.length) this.controls.showResults();
  }

  get yardstick() {
    return this.panels.find(({ run }) => run.isLive && run.spec === this.best?.spec)?.run ?? this.best;
  }

  /** The address of the present state, with the pointer's path. */
  link() {
    const specs = this.panels.map(({ run }) => run.spec);
    return writeAddress(this.flight, specs, this.steering.path);
  }

  showAll() {
    if (!this.panels.length) return;
    super.showAll();
    this.controls.show();
  }

  showTime() {
    this.reach(this.player.time, this.player.isPlaying ? 0 : Infinity);
    this.noteTrials();
    document.body.classList.toggle("ended", this.player.hasEnded && !this.isTouring);
    super.showTime();
  }

  draw(seconds = null) {
    if (!this.flight || !this.panels.length) return; // the page is still reading
    this.look.chosen = this.inspector.at(this.player.time);
    this.look.target = this.flight.isSteered ? this.steering.pointer : null;
    super.draw(seconds);
  }
}
