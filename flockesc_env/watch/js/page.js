"use strict";

// The page: builds its parts, and shows runs side by side.

const LINGER = 3; // s from the last change of a ring to the end of playing, as in films

/** A page that replays recorded runs. `LivePage` adds what simulates. */
class Page {
  constructor({ versions, start }, recordings) {
    Object.assign(this, { versions, start, recordings, panels: [] });
    this.player = new Player();
    this.look = { theme: readTheme() };
    this.camera = new Camera();
    this.window = new Window();
    this.curves = new Curves($("charts"), this.player);
    this.player.addEventListener("again", () => this.again());
    this.player.addEventListener("change", () => this.showTime());
    bindPlayer(this.player);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.look.theme = readTheme();
      this.showAll();
    });
  }

  /** Starts with the runs of the document, at the time of the address. */
  async restore() {
    this.camera.setDimension(this.recordings[0].dimension);
    this.recordings.forEach((run) => this.addPanel(run));
    this.begin(new URLSearchParams(location.hash.slice(1)).get("t"));
  }

  /** Plays from the start; at a given time, or with reduced motion, the page waits. */
  begin(time) {
    this.showAll();
    this.seek(Number(time) || 0);
    const isStill = matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (time === null && !isStill) this.player.play();
  }

  addPanel(run) {
    const panel = new Panel(this);
    panel.setRun(run);
    this.panels.push(panel);
    $("panels").append(panel.root);
    return panel;
  }

  /** Starts again from the beginning. */
  again() {
    this.player.time = 0;
    this.showAll();
  }

  seek(time) {
    this.player.seek(time);
    this.draw(10);
  }

  get runs() {
    return this.panels.map(({ run }) => run);
  }

  /** Shows the runs and the state in every part of the page. */
  showAll() {
    if (!this.panels.length) return;
    const { runs } = this;
    chooseColors(runs);
    document.body.dataset.panels = runs.length;
    this.showDuration();
    this.panels.forEach((panel) => panel.show(this.rival));
    this.curves.show(runs, this.rival);
    this.describe(runs[0]);
    this.showTime();
  }

  /** Playing stops when no ring changes any more, if that is known. */
  showDuration() {
    const { runs } = this;
    const duration = Math.max(...runs.map((run) => run.numSteps * run.timeStep));
    const isKnown = runs.every((run) => run.hasEnded && run.numPredators > 0);
    const lowestAt = ({ times, lowestMean, last }) => times[lowestMean.indexOf(lowestMean[last])];
    const stop = isKnown ? Math.min(Math.max(...runs.map(lowestAt)) + LINGER, duration) : duration;
    this.player.setDuration(duration, Math.min(...runs.map((run) => run.timeStep)), stop);
  }

  /** The run of the best single range on the same flock, or null. */
  get rival() {
    return null;
  }

  showTime() {
    this.draw();
  }

  /** Draws the flocks. `seconds`: for which the camera moves, by default those since the last picture. */
  draw(seconds = null) {
    if (!this.panels.length) return;
    const now = performance.now();
    const passed = this.player.isPlaying ? Math.min((now - (this.drawn ?? now)) / 1000, 0.2) : 10;
    this.camera.fit(this.window.follow(this.runs, this.player.time, seconds ?? passed));
    this.drawn = now;
    this.panels.forEach((panel) => panel.draw(this.player.time, this.look));
  }

  say(text) {
    $("message").textContent = text;
  }

  /** Writes the number of agents, the seed and the version. */
  describe({ document: scenario, seed }) {
    const start = seed === null ? "given start" : `seed ${seed}`;
    const facts = [`${scenario.num_agents} agents`, start, `flockesc-env ${this.versions["flockesc-env"]}`];
    $("facts").textContent = facts.join(" \u00b7 ");
    $("lead").hidden = $("key").hidden = !scenario.predators.length;
  }
}

function messageOf(error) {
  return error instanceof Error ? error.message : String(error);
}
