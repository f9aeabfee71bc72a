"use strict";

// The page: builds its parts, and shows runs side by side.

/** A page that replays recorded runs. `LivePage` adds what simulates. */
class Page {
  constructor({ versions, start }, recordings) {
    Object.assign(this, { versions, start, recordings });
    this.player = new Player();
    this.look = { theme: readTheme(), trails: true, edges: false };
    this.panels = [];
    this.camera = new Camera();
    this.window = new Window();
    this.curves = new Curves($("charts"), this.player, this.look.theme);
    this.player.addEventListener("again", () => this.again());
    this.player.addEventListener("change", () => this.showTime());
    bindPlayer(this.player);
    this.bindLooks();
    new ResizeObserver(() => this.draw()).observe($("panels"));
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
    if (time === null && !isStill()) this.player.play();
  }

  addPanel(run) {
    const panel = new Panel(this);
    panel.setRun(run);
    this.panels.push(panel);
    $("panels").append(panel.root);
    return panel;
  }

  removePanel(panel) {
    this.panels.splice(this.panels.indexOf(panel), 1);
    this.drop(panel);
    this.showAll();
  }

  drop(panel) {
    panel.root.remove();
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

  /** Shows the runs and the state in every part of the page. */
  showAll() {
    if (!this.panels.length) return;
    const runs = this.panels.map(({ run }) => run);
    chooseColors(runs);
    document.body.dataset.panels = runs.length;
    $("score").hidden = runs.length !== 2 || !runs[0].numPredators || !areOneFlock(runs);
    const durations = runs.map((run) => run.numSteps * run.timeStep);
    this.player.setDuration(Math.max(...durations), Math.min(...runs.map((run) => run.timeStep)));
    this.panels.forEach((panel) => panel.show(this));
    this.curves.setRuns(runs, this.yardstick);
    this.describe(runs[0]);
    this.showKey();
    this.showTime();
  }

  /** The run of the best fixed range on the same flock, or null. */
  get yardstick() {
    return null;
  }

  showTime() {
    if (!this.panels.length) return;
    this.showScore();
    this.draw();
  }

  /** Draws the flocks. `seconds`: for which the camera moves, by default those since the last picture. */
  draw(seconds = null) {
    if (!this.panels.length) return;
    const now = performance.now();
    const passed = this.player.isPlaying ? Math.min((now - (this.drawn ?? now)) / 1000, 0.2) : 10;
    const runs = this.panels.map(({ run }) => run);
    this.camera.fit(this.window.follow(runs, this.player.time, seconds ?? passed));
    this.drawn = now;
    Object.assign(this.look, { numPanels: runs.length, yardstick: this.yardstick });
    this.panels.forEach((panel) => panel.draw(this.player.time, this.look));
  }

  /** With two runs of one flock, shows which is ahead and by how much. */
  showScore() {
    const runs = this.panels.map(({ run }) => run);
    if ($("score").hidden) return;
    const [a, b] = runs.map((run) => run.lowestMean[frameAt(run, this.player.time).step]);
    const lead = Math.abs(a - b).toFixed(1);
    const [ahead, behind] = a >= b ? runs : [runs[1], runs[0]];
    $("score").replaceChildren(
      element("b", {}, lead === "0.0" ? "\u00b10 m" : `+${lead} m`),
      element("small", {}, lead === "0.0" ? "no flock is ahead" : `${ahead.title} is ahead of ${behind.title}`),
    );
  }

  say(text) {
    $("message").textContent = text;
  }

  bindLooks() {
    const read = () => {
      for (const id of ["trails", "edges"]) this.look[id] = $(id).checked;
      this.draw();
    };
    $("looks").addEventListener("change", read);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.look.theme = readTheme();
      this.curves.redraw(this.look.theme);
      this.showAll();
    });
  }

  /** Shows the key of the colors and of the ring. */
  showKey() {
    const { rangeUnit, numPredators } = this.panels[0].run;
    const colors = Array.from({ length: 9 }, (_, at) => this.look.theme.colorOf((at * COLOR_END) / 8));
    const ramp = element("i");
    ramp.style.background = `linear-gradient(to right, ${colors})`;
    const ring = numPredators === 1 ? "\u00b7 ring: mean distance to the predator" : "";
    $("key").replaceChildren("Range 0 ", ramp, ` ${COLOR_END} ${rangeUnit} or more ${ring}`);
  }

  /** Writes the scenario, the seed and the versions. */
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
    const values = [...Object.entries(scenario), ...Object.entries(this.versions)];
    const text = (value) => (typeof value === "object" ? JSON.stringify(value) : String(value));
    $("parameters").replaceChildren(...rows(values.map(([name, value]) => [name, text(value)])));
  }
}

/** Whether the reader asks for less motion. */
function isStill() {
  return matchMedia("(prefers-reduced-motion: reduce)").matches;
}

function messageOf(error) {
  return error instanceof Error ? error.message : String(error);
}
