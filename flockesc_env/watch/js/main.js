"use strict";

// The page: builds its parts and connects them.

class Page {
  constructor(runs, { versions, live }) {
    this.runs = runs;
    chooseColors(runs);
    this.player = new Player();
    this.camera = new Camera(runs[0].dimension === 3);
    this.look = { theme: readTheme() };
    document.body.dataset.panels = runs.length;
    this.panels = runs.map((_, index) => new Panel(index, this.camera, () => this.draw()));
    document.getElementById("panels").append(...this.panels.map((panel) => panel.root));
    this.curves = new Curves(document.getElementById("charts"), this.player, runs, this.look.theme);
    this.panels.forEach((panel, index) => panel.setRun(runs[index], runs[0].seed));
    this.versions = versions;
    describe(runs[0], versions);
    bindPlayer(this.player);
    this.bindLooks();
    this.player.addEventListener("change", () => this.draw());
    new ResizeObserver(() => this.draw()).observe(document.getElementById("panels"));
    this.showRuns();
    document.getElementById("save").addEventListener("click", () => savePicture(this));
    this.videoButton = new VideoButton(document.getElementById("save-video"), this);
    if (live) this.live = new Live(live, this.panels, (index, run) => this.replaceRun(index, run));
    this.start(new URLSearchParams(location.hash.slice(1)).get("t"));
  }

  /** Plays from the start; at a time of the address, #t=4.5, or with reduced motion, the page waits. */
  start(time) {
    this.player.seek(Number(time) || 0);
    if (time === null && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.player.play();
  }

  /** Shows another run in a panel, at the current time. */
  replaceRun(index, run) {
    const isOtherFlock = run.seed !== this.runs[index].seed;
    this.runs[index] = run;
    chooseColors(this.runs);
    if (isOtherFlock) this.box = undefined;
    this.panels.forEach((panel, at) => panel.setRun(this.runs[at], this.runs[0].seed));
    describe(this.runs[0], this.versions);
    this.showRuns();
  }

  showRuns() {
    const { runs } = this;
    this.box = boxAround(runs, this.box); // only grows, so that the view is steady while the slider moves
    this.camera.fit(this.box);
    // One scale for all panels; it only grows, so that a color keeps its meaning while the slider moves.
    this.look.largestRange = runs.reduce((most, run) => Math.max(most, run.largestRange), this.look.largestRange ?? 0);
    this.showKey();
    const areMetric = runs.every((run) => run.isMetric);
    for (const id of ["edges", "discs"]) document.getElementById(id).parentElement.hidden = !areMetric;
    this.curves.setRuns(runs);
    const durations = runs.map((run) => run.numSteps * run.timeStep);
    this.player.setDuration(Math.max(...durations), Math.min(...runs.map((run) => run.timeStep)));
  }

  draw() {
    this.panels.forEach((panel) => panel.draw(this.player.time, this.look));
  }

  bindLooks() {
    const colors = document.getElementById("color");
    colors.value = rangesDiffer(this.runs) ? "range" : "component";
    const readLooks = () => {
      this.look.color = colors.value;
      for (const id of ["trails", "edges", "discs"]) this.look[id] = document.getElementById(id).checked;
    };
    const redraw = () => {
      this.showKey();
      this.draw();
    };
    readLooks();
    document.getElementById("looks").addEventListener("change", () => {
      readLooks();
      redraw();
    });
    document.getElementById("hint").textContent = this.camera.isSpatial
      ? "drag turns, ctrl + wheel zooms, double click resets"
      : "drag moves, ctrl + wheel zooms, double click resets";
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.look.theme = readTheme();
      this.curves.redraw(this.look.theme);
      redraw();
    });
  }

  /** Shows the key of the colors. */
  showKey() {
    const { theme, color, largestRange } = this.look;
    const dot = (background) => {
      const swatch = element("i");
      swatch.style.background = background;
      return swatch;
    };
    const key = document.getElementById("key");
    if (color === "range") {
      const ramp = dot(`linear-gradient(90deg, ${theme.rampStops})`);
      ramp.className = "ramp";
      key.replaceChildren("0", ramp, `${Number(largestRange.toFixed(1))} ${this.runs[0].rangeUnit}`);
    } else {
      const named = theme.groups.slice(0, NUM_GROUP_COLORS).map(dot);
      key.replaceChildren(...named, "largest", dot(theme.groups[OTHER_GROUP]), "others", dot(theme.groups[ALONE]), "alone");
    }
  }
}

/** Whether the interaction range differs between runs, agents or times. */
function rangesDiffer(runs) {
  const first = runs[0].ranges[0];
  return runs.some((run) => run.ranges.some((range) => range !== first));
}

/** Writes the head of the page: the scenario, the seed and the versions. */
function describe({ scenario, seed }, versions) {
  const seconds = Number((scenario.num_steps * scenario.time_step).toFixed(2));
  const facts = [
    `${scenario.num_agents} agents in ${scenario.dimension === 3 ? "space" : "the plane"}`,
    `${seconds} s in ${scenario.num_steps} steps`,
    scenario.predators.length ? `predator felt within ${scenario.predator_range} m` : "no predator",
    seed === null ? "given start" : `seed ${seed}`,
    `flockesc-env ${versions["flockesc-env"]}`,
  ];
  document.getElementById("facts").textContent = facts.join(" \u00b7 ");
  const rows = [...Object.entries(scenario), ...Object.entries(versions)].map(([name, value]) => {
    const isPart = typeof value === "object";
    const text = isPart ? JSON.stringify(value) : String(value);
    return element("div", { className: isPart ? "wide" : "" }, element("dt", {}, name), element("dd", {}, text));
  });
  document.getElementById("parameters").replaceChildren(...rows);
}

const startedPage = (async () => {
  const content = JSON.parse(document.getElementById("document").textContent);
  const runs = await Promise.all(content.runs.map(decodeRun));
  return new Page(runs, content);
})();
