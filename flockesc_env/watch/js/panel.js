"use strict";

// One run: its name, its scene and its numbers at the current time.

const STATS = [
  ["minDistance", "nearest agent"],
  ["numComponents", "components"],
  ["survivors", "agents left"],
  ["range", "mean range"],
];

class Panel {
  constructor(page) {
    this.title = element("h2");
    this.note = element("span", { className: "note" });
    this.close = element(
      "button",
      { type: "button", className: "close", ariaLabel: "Remove this flock", title: "Remove this flock" },
      "\u00d7",
    );
    this.close.addEventListener("click", () => page.removePanel(this));
    this.canvas = element("canvas", { tabIndex: 0 });
    this.canvas.setAttribute("role", "img");
    this.now = element("dd");
    this.lowest = element("dd");
    const readout = element(
      "dl",
      { className: "readout" },
      element("div", {}, element("dt", {}, "mean distance now"), this.now),
      element("div", { className: "objective" }, element("dt", {}, "lowest so far"), this.lowest),
    );
    this.values = Object.fromEntries(STATS.map(([key]) => [key, element("dd")]));
    const stats = STATS.map(([key, text]) => element("div", {}, element("dt", {}, text), this.values[key]));
    this.stats = element("dl", { className: "stats" }, ...stats);
    this.choice = null; // `LivePage` adds one
    this.root = element(
      "article",
      { className: "panel" },
      element("header", {}, this.title, this.note, this.close),
      element("div", { className: "field" }, this.canvas, readout),
      this.stats,
    );
    this.scene = new Scene(this.canvas, page.camera);
    bindCamera(this.canvas, page.camera, () => page.draw());
  }

  setRun(run) {
    if (this.run?.isLive && this.run !== run) this.run.free();
    this.run = run;
    this.scene.setRun(run);
  }

  /** Shows the name of the run's policy and the choice. */
  show(page) {
    const { run } = this;
    this.scene.forget();
    this.title.textContent = this.title.title = run.title;
    this.note.textContent = this.note.title = noteOf(run);
    this.close.hidden = page.panels.length < 2;
    this.values.survivors.parentElement.hidden = run.document.capture_radius === null;
    this.canvas.setAttribute("aria-label", `Flock under ${run.title}. Plus and minus zoom, arrows move the view.`);
    this.canvas.classList.toggle("steered", Boolean(run.flight?.isSteered));
    this.choice?.show(run, page.flight, page.recordings);
  }

  draw(time, look) {
    const { run, values } = this;
    this.root.style.setProperty("--run", look.theme.runs[run.color % look.theme.runs.length]);
    this.scene.draw(time, look);
    const { step } = frameAt(run, time);
    const meters = (value) => (Number.isFinite(value) ? quantity(value.toFixed(1)) : ["-"]);
    this.now.replaceChildren(...meters(run.meanDistance[step]));
    this.lowest.replaceChildren(...meters(run.lowestMean[step]));
    values.minDistance.replaceChildren(...meters(run.minDistance[step]));
    if (run.isLive && run.counted <= step) run.countComponents();
    values.numComponents.textContent = run.numComponents[step];
    values.survivors.textContent = run.survivors[step];
    const [mean, low, high] = [run.meanRange[step], run.lowRange[step], run.highRange[step]];
    const spread = high > low ? element("small", {}, ` (${low.toFixed(0)}\u2013${high.toFixed(0)})`) : "";
    values.range.replaceChildren(...quantity(mean.toFixed(1), run.rangeUnit), spread);
  }
}

/** What a reader must know of a run besides its policy: how its agents see, and whether it follows the seed. */
function noteOf(run) {
  if (!run.isLive) return `recorded, ${run.seed === null ? "given start" : `seed ${run.seed}`}`;
  if (run.kind === "fixed" || !run.numPredators) return "";
  const sensing = JSON.parse(run.policy.options).predator_sensing_range;
  return `agents see the predator ${sensing === null ? "at any distance" : `within ${sensing} m`}`;
}
