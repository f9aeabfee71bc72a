"use strict";

// One run: its name, its scene and its numbers at the current time.

class Panel {
  constructor(page) {
    this.title = element("h2");
    this.note = element("span", { className: "note" });
    this.whole = element("b", { className: "whole" });
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
    this.left = element("dd");
    const entries = { "mean distance": this.now, "lowest so far": this.lowest, "agents left": this.left };
    const readout = element(
      "dl",
      { className: "readout" },
      ...Object.entries(entries).map(([name, value]) => element("div", {}, element("dt", {}, name), value)),
    );
    this.root = element(
      "article",
      { className: "panel" },
      element("header", {}, this.title, this.note, this.whole, this.close),
      element("div", { className: "field" }, this.canvas, readout),
    );
    this.scene = new Scene(this.canvas, page.camera);
    bindCamera(this.canvas, page.camera, () => page.draw());
  }

  setRun(run) {
    this.run = run;
    this.scene.setRun(run);
  }

  /** Shows the name of the run's policy. */
  show(page) {
    const { run } = this;
    this.scene.forget();
    const best = page.flight?.scenario.best;
    const isBest = run.isLive && typeof best === "number" && run.spec === `fixed:${best}`;
    this.title.textContent = this.title.title = isBest ? `best ${run.title}` : run.title;
    this.note.textContent = this.note.title = noteOf(run);
    this.close.hidden = page.panels.length < 2;
    this.left.parentElement.hidden = run.document.capture_radius === null;
    const keys = run.flight?.isSteered ? "Arrows lead the predator, Escape lets it go." : "Arrows move the view.";
    this.canvas.setAttribute("aria-label", `Flock under ${run.title}. Plus and minus zoom. ${keys}`);
    this.canvas.classList.toggle("steered", Boolean(run.flight?.isSteered));
  }

  draw(time, look) {
    const { run } = this;
    this.root.style.setProperty("--run", look.theme.runs[run.color % look.theme.runs.length]);
    this.scene.draw(time, look);
    const { step } = frameAt(run, time);
    const meters = (value) => (Number.isFinite(value) ? quantity(value.toFixed(1)) : ["-"]);
    this.now.replaceChildren(...meters(run.meanDistance[step]));
    this.lowest.replaceChildren(...meters(run.lowestMean[step]));
    const isKnown = run.hasEnded && run.numPredators > 0;
    this.whole.textContent = isKnown ? `${run.lowestMean[run.last].toFixed(1)} m` : "";
    this.whole.title = "Lowest mean distance of the whole run";
    this.left.textContent = run.survivors[step];
  }
}

/** What a reader must know of a run besides its policy: how its agents see, and whether it follows the seed. */
function noteOf(run) {
  if (!run.isLive) return `recorded, ${run.seed === null ? "given start" : `seed ${run.seed}`}`;
  if (run.kind === "fixed" || !run.numPredators) return "";
  const sensing = JSON.parse(run.policy.options).predator_sensing_range;
  return `predator ${sensing === null ? "always seen" : `seen within ${sensing} m`}`;
}
