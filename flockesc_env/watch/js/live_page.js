"use strict";

// A page that simulates: which flock flies, under which policies, and what the reader changes.

const MAX_PANELS = 2;
const AT_ONCE = 200; // ms after a change in which whole runs are played at once; longer ones go on in the background
const FRAME_BUDGET = 12; // ms of a frame for model steps; a flock that needs more flies slower than in reality

class LivePage extends Page {
  constructor(content, recordings) {
    super(content, recordings);
    this.scenarios = content.scenarios;
    this.policies = new PolicyList(content.policies);
    this.policies.headline = content.start.headline;
    this.learned = content.policies.find(({ spec }) => spec === content.start.headline)?.title;
    this.isInviting = true; // until the reader has led the predator
    this.trials = new Map(); // objectives of whole runs of this flock, by the text of the policy
    this.steering = new Steering(this);
    this.inspector = new Inspector($("inspector"), () => this.draw());
    this.choice = new Choice(this, content.playground);
    this.player.reach = (time) => this.reach(time, FRAME_BUDGET);
    this.player.addEventListener("end", () => this.showAll());
    this.controls = new Controls(this);
    setInterval(() => this.work(), 50);
    addEventListener("hashchange", () => this.restore());
    for (const name of ["pointerdown", "keydown"]) addEventListener(name, () => this.say(""), { capture: true });
  }

  /** Shows the address, after an earlier one: reading files takes time. */
  restore() {
    return (this.restored = Promise.resolve(this.restored).then(() => this.readHash()));
  }

  /** Starts the flock and the policies of the address or, without one, of the document. */
  async readHash() {
    const { flight, policies, time, guess, problems } = readAddress(location.hash, this.scenarios, this.start);
    // Files are read first, so that nothing draws the flocks between their end and the new ones.
    await Promise.all(policies.map((spec) => this.policies.find(spec, flight.scenario).catch(() => null)));
    const isFirst = !this.flight && (!location.hash || guess !== null) && this.choice.playground;
    this.choice.close(false);
    this.choice.friend = guess;
    this.say(problems.join(" "));
    this.flight = this.flightOf(flight) ?? new Flight({ ...flight, agents: null });
    this.changeFlock();
    if (isFirst) this.choice.ask();
    this.inspector.choose(null, null);
    for (const panel of this.panels.splice(0)) panel.root.remove();
    for (const spec of policies) await this.addPolicy(spec);
    if (!this.panels.length) await this.addPolicy(`fixed:${this.flight.scenario.first}`);
    this.begin(isFirst ? 0 : time);
  }

  /** The run of a policy's text: a recording, or a new live run. */
  async runOf(spec) {
    const recording = this.recordings.find((run) => run.spec === spec);
    return recording ?? new LiveRun(this.flight, await this.policies.find(spec, this.flight.scenario));
  }

  /** Adds a panel for a policy's text. */
  async addPolicy(spec) {
    const run = await this.runOf(spec).catch((error) => this.say(messageOf(error)));
    if (run) this.addPanel(run);
    this.catchUp();
  }

  addPanel(run) {
    const panel = super.addPanel(run);
    panel.select = element("select", { ariaLabel: "Policy of this flock" });
    panel.select.addEventListener("change", () => {
      this.choose(panel, panel.select.value === "fixed" ? `fixed:${this.choice.range}` : panel.select.value);
    });
    panel.title.after(element("label", { className: "pick" }, "\u25be", panel.select));
    this.steering.bind(panel);
    return panel;
  }

  /** The panel whose range the slider sets. */
  get active() {
    const isFixed = ({ run }) => run.isLive && run.kind === "fixed";
    return this.panels.find(isFixed) ?? this.panels[0];
  }

  /** Shows another policy in a panel: its run of the same flock, at the present time. */
  async choose(panel, spec) {
    panel.wanted = spec; // of several choices in a row, only the last counts
    this.steering.keepPath();
    try {
      const run = await this.runOf(spec);
      if (panel.wanted !== spec) return;
      panel.setRun(run);
      this.catchUp();
    } catch (error) {
      this.say(messageOf(error));
    }
    this.showAll();
  }

  /** Starts the same flock again under the present policies. */
  again() {
    if (this.flight.isSteered) {
      this.flight = new Flight({ ...this.flight, path: [] });
      for (const panel of this.panels) this.moveToFlight(panel, false);
    }
    super.again();
  }

  /** The flock that is wanted; null, with a message, if its scenario cannot have the number of agents. */
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

  /** Flies another flock from its start: a scenario, a seed, a number of agents or a pilot. */
  fly(changes) {
    const { scenario, seed, agents, isSteered } = this.flight;
    const wanted = { scenario, seed, agents, isSteered, ...changes };
    if (changes.scenario) wanted.agents = null;
    if (!wanted.scenario.steered) wanted.isSteered = false;
    if (!wanted.scenario.start && wanted.seed === null) wanted.seed = "0";
    this.say("");
    const flight = this.flightOf(wanted);
    if (!flight) return this.showAll();
    this.flight = flight;
    this.changeFlock();
    for (const panel of this.panels) this.moveToFlight(panel, Boolean(changes.scenario));
    this.player.time = 0;
    this.catchUp();
    this.showAll();
    this.seek(0);
  }

  /** Gives the predator to the reader, at a time in s, or back. From the start, the first touch begins the flight. */
  steer(isSteered, time = 0) {
    const { predators, time_step: timeStep } = JSON.parse(this.flight.scenario.json);
    // A predator in the reader's hand flies straight on until it is led. Others would have flown elsewhere.
    const isStraight = predators.every((predator) => "constant_velocity" in predator);
    const steps = isSteered && isStraight ? Math.round(time / timeStep) : 0;
    this.fly({ isSteered, path: Array(steps).fill(null) });
    this.reach(steps * timeStep);
    this.seek(steps * timeStep);
    if (isSteered && !time) {
      this.player.pause();
      $("panels").scrollIntoView({ block: "nearest" });
    } else this.player.play();
  }

  /** Shows an agent of a panel: an id, "next", "before", or null for none. The card must not cover its flock. */
  inspect(panel, agent) {
    if (typeof agent === "string") this.inspector.move(panel, agent === "before", this.player.time);
    else this.inspector.choose(panel, agent);
    this.draw();
    const [card, field] = [this.inspector.card, panel.canvas].map((part) => part.getBoundingClientRect());
    if (card.height && card.top < field.bottom && card.left < field.right) panel.root.scrollIntoView();
  }

  /** Forgets what belongs to another flock. */
  changeFlock() {
    this.camera.setDimension(this.flight.document.dimension);
    this.window = new Window();
    this.trials.clear();
    this.steering.forget();
    const { scenario, isSteered, document: model } = this.flight;
    const hasBest = scenario.best !== null && !isSteered && model.predators.length > 0;
    this.best = hasBest ? new LiveRun(this.flight, new FixedRange(scenario.best, scenario)) : null;
  }

  /** Flies the flock with the next seed. */
  next() {
    this.fly({ seed: String((BigInt(this.flight.seed ?? 0) + 1n) % 2n ** 64n) });
    this.player.play();
  }

  /** Plays the policy of a panel on the present flock. In another scenario a fixed range becomes the best one there. */
  moveToFlight(panel, isOtherScenario) {
    const { scenario } = this.flight;
    const { run } = panel;
    if (!run.isLive) return;
    const fallback = new FixedRange(scenario.first, scenario);
    try {
      panel.setRun(new LiveRun(this.flight, isOtherScenario && run.kind === "fixed" ? fallback : run.policy));
    } catch (error) {
      this.say(`${run.title} cannot play here: ${messageOf(error)}`);
      panel.setRun(new LiveRun(this.flight, fallback));
    }
  }

  /** Steps all live runs up to a time, the one that is behind first, and returns the time that all have reached. */
  reach(time, budget = Infinity, runs = this.runs) {
    const end = performance.now() + budget;
    const timeOf = (run) => run.last * run.timeStep;
    const isBehind = (run) => run.isLive && !run.hasEnded && timeOf(run) < time - 1e-9;
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
    const runs = this.allRuns;
    if (!this.flight.isSteered) this.reach(Infinity, FRAME_BUDGET, runs);
    const progress = runs.map((run) => run.last).join();
    if (progress === this.progress) return;
    this.progress = progress;
    this.showDuration();
    this.noteTrials();
    this.curves.show(this.runs, this.rival);
  }

  /** Keeps the objectives of whole runs. */
  noteTrials() {
    const found = this.allRuns.filter((run) => run.isLive && run.hasEnded && !run.isNoted && run.numPredators > 0);
    if (!found.length) return;
    chooseColors(this.runs);
    for (const run of found) {
      run.isNoted = true;
      const { spec, title, objective, color = "fixed" } = run;
      if (this.flight.isSteered) this.steering.note(run);
      else this.trials.set(spec, { title, range: run.policy.range ?? null, objective, color });
    }
    this.choice.show();
    this.controls.showCode();
  }

  /** The runs of the panels, and the one of the best single range. */
  get allRuns() {
    return this.best ? [...this.runs, this.best] : this.runs;
  }

  get rival() {
    return this.runs.find(({ isLive, spec }) => isLive && spec === this.best?.spec) ?? this.best;
  }

  /** The address of the present state, with the reader's guess. */
  link(guess = this.choice.guess) {
    const specs = this.runs.map(({ spec }) => spec);
    return writeAddress(this.flight, specs, guess);
  }

  showAll() {
    if (!this.panels.length) return;
    super.showAll();
    this.controls.show();
  }

  showTime() {
    if (!this.panels.length) return;
    this.reach(this.player.time, this.player.isPlaying ? 0 : Infinity);
    this.noteTrials();
    super.showTime();
  }

  /** What the field says to a reader who has not led the predator yet, or null. */
  get invitation() {
    const { isSteered, scenario } = this.flight;
    const { time, isPlaying, hasEnded } = this.player;
    if (isSteered) return isPlaying || hasEnded || this.steering.pointer ? null : "touch: it follows";
    return this.isInviting && scenario.steered !== null && time >= 3 && time < 6 ? "drag the predator" : null;
  }

  draw(seconds = null) {
    if (!this.flight || !this.panels.length) return; // the page is still reading
    this.look.chosen = this.inspector.at(this.player.time);
    this.look.target = this.flight.isSteered ? this.steering.pointer : null;
    this.look.invitation = this.invitation;
    super.draw(seconds);
  }
}
