"use strict";

// The page: builds its parts, and shows runs side by side.

const LARGEST_RANGE = 100; // m: everybody hears everybody

/** A page that replays recorded runs. `LivePage` adds what simulates. */
class Page {
  constructor({ versions, start }, recordings) {
    Object.assign(this, { versions, start, recordings });
    this.player = new Player();
    this.look = { theme: readTheme(), color: "component", trails: true, edges: false, discs: false };
    this.panels = [];
    this.camera = new Camera();
    this.window = new Window();
    this.curves = new Curves($("charts"), this.player, this.look.theme);
    this.player.addEventListener("again", () => this.again());
    this.player.addEventListener("change", () => this.showTime());
    bindPlayer(this.player);
    this.bindLooks();
    $("save").addEventListener("click", () => savePicture(this));
    this.videoButton = new VideoButton($("save-video"), this);
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
    const isRecorded = this.panels.every(({ run }) => !run.isLive);
    this.look.color = isRecorded && !rangesDiffer(this.panels) ? "component" : "range";
    $("color").value = this.look.color;
    this.showAll();
    this.seek(Number(time) || 0);
    if (time === null && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.player.play();
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
    this.window.follow(10);
    this.draw();
  }

  /** The largest range of the color scale, which is fixed, so that a color keeps its meaning. */
  get maxRange() {
    return LARGEST_RANGE;
  }

  /** Shows the runs and the state in every part of the page. */
  showAll() {
    const runs = this.panels.map(({ run }) => run);
    if (!runs.length) return;
    chooseColors(runs);
    document.body.dataset.panels = runs.length;
    const durations = runs.map((run) => run.numSteps * run.timeStep);
    this.player.setDuration(Math.max(...durations), Math.min(...runs.map((run) => run.timeStep)));
    this.look.largestRange = Math.max(this.maxRange, ...runs.map((run) => run.largestRange));
    this.panels.forEach((panel) => panel.show(this));
    runs.forEach((run) => this.window.include(run));
    this.curves.setRuns(runs, this.yardstick());
    this.describe(runs[0]);
    this.showKey();
    this.showTime();
  }

  /** A run that the chart shows behind the others, or null. */
  yardstick() {
    return null;
  }

  showTime() {
    if (!this.panels.length) return;
    this.showScore();
    this.draw();
  }

  draw() {
    if (this.window.isEmpty) return;
    const now = performance.now();
    this.camera.fit(this.window.follow(this.player.isPlaying ? Math.min((now - (this.drawn ?? now)) / 1000, 0.2) : 10));
    this.drawn = now;
    this.look.numPanels = this.panels.length;
    this.panels.forEach((panel) => panel.draw(this.player.time, this.look));
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
      ...(lead === "0.0"
        ? ["No flock is ahead"]
        : [element("b", {}, ahead.run.title), ` is ahead by `, element("b", {}, `${lead} m`)]),
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
    const unit = this.panels[0].run.rangeUnit;
    if (color === "range") {
      const end = `${Number(largestRange.toFixed(1))} ${unit}`;
      $("key").replaceChildren("0", dot("var(--scale)", "ramp"), end);
    } else {
      const named = theme.groups.slice(0, NUM_GROUP_COLORS).map((name) => dot(name));
      $("key").replaceChildren(
        ...named,
        "largest",
        dot(theme.groups[OTHER_GROUP]),
        "others",
        dot(theme.groups[ALONE]),
        "alone",
      );
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
