"use strict";

// One run: its name, its scene and its numbers at the current time.

const SILENT = 1; // range below which an agent listens to nobody: it hardly ever has a neighbor

class Panel {
  constructor(page) {
    this.title = element("h2");
    this.note = element("span", { className: "note" });
    this.now = element("span", { className: "now-value" });
    this.lowest = element("b", { className: "lowest" });
    this.canvas = element("canvas", { tabIndex: 0 });
    this.canvas.setAttribute("role", "img");
    this.listening = element("p", { className: "listening" });
    this.root = element(
      "article",
      { className: "panel" },
      element("header", {}, this.title, this.note, this.now, this.lowest),
      this.canvas,
      this.listening,
    );
    this.scene = new Scene(this.canvas, page.camera);
    bindCamera(this.canvas, page.camera, () => page.draw());
    new ResizeObserver(() => {
      this.scene.size = null;
      page.draw();
    }).observe(this.canvas);
  }

  setRun(run) {
    this.run = run;
    this.scene.setRun(run);
  }

  /** Shows the name of the run's policy. `rival`: the run of the best single range, or null. */
  show(rival) {
    const { run } = this;
    this.scene.rival = rival && rival !== run && isOneFlock(run, rival) ? rival : null;
    this.title.textContent = this.title.title = run.title;
    this.note.textContent = this.note.title = noteOf(run);
    this.root.style.setProperty("--run", `var(--${run.color})`);
    const keys = run.flight?.isSteered ? "Arrows lead the predator, Escape lets it go." : "Arrows move the view.";
    const agents = run.isLive ? " N shows the next agent, Shift and N the one before." : "";
    this.canvas.setAttribute("aria-label", `Flock under ${run.title}. Plus and minus zoom. ${keys}${agents}`);
    this.canvas.classList.toggle("steered", Boolean(run.flight?.isSteered));
  }

  draw(time, look) {
    const { run } = this;
    this.scene.draw(time, look);
    const { step } = frameAt(run, time);
    const meters = (value) => (Number.isFinite(value) ? `${value.toFixed(1)} m` : "");
    const [now, caught] = [meters(run.meanDistance[step]), run.numAgents - run.survivors[step]];
    this.now.textContent = [now && `now ${now}`, caught && `${caught} caught`].filter(Boolean).join(", ");
    this.lowest.textContent = meters(run.lowestMean[step]);
    const pieces = listening(run, step).map(([text, range]) => [text, `background: ${look.theme.colorOf(range)}`]);
    const told = String(pieces);
    if (told === this.told) return; // most pictures are of the same step
    this.told = told;
    const spans = pieces.map(([text, style]) => element("span", {}, element("i", { style }), text));
    this.listening.replaceChildren(...spans);
  }
}

/** How far agents listen at a step, as pieces of a sentence, each with the range that gives its color. */
function listening(run, step) {
  const ranges = aliveAt(run, step).map((agent) => rangeOf(run, step, agent));
  if (!ranges.length) return [];
  const top = Math.max(...ranges);
  const far = Number(top.toPrecision(3));
  if (top < SILENT || ranges.every((range) => range === top))
    return [[`all listen to ${top ? `${far} ${run.rangeUnit}` : "nobody"}`, top]];
  const of100 = (test) => Math.round((100 * ranges.filter(test).length) / ranges.length);
  const between = ranges.filter((range) => range >= SILENT && range < 0.95 * top).sort((a, b) => a - b);
  const pieces = [
    [`${of100((range) => range >= 0.95 * top)} of 100 listen to ${far} ${run.rangeUnit}`, top],
    [`${of100((range) => range < SILENT)} to nobody`, 0],
  ];
  if (between.length >= 0.05 * ranges.length) pieces.push(["others between", between[between.length >> 1]]);
  return pieces;
}

/** What a reader must know of a run besides its policy: where it was trained, how its agents see, and its seed. */
function noteOf(run) {
  if (!run.isLive) return `recorded, ${run.seed === null ? "given start" : `seed ${run.seed}`}`;
  if (run.kind === "fixed") return "";
  const { trainedIn, options } = run.policy;
  const flown = JSON.parse(run.flight.unsteered);
  const isSame = (field) => JSON.stringify(trainedIn[field] ?? false) === JSON.stringify(flown[field] ?? false);
  if (trainedIn && !Object.keys(flown).every(isSame)) return "not trained for this scenario";
  const sensing = JSON.parse(options).predator_sensing_range;
  return run.numPredators ? `predator ${sensing === null ? "always seen" : `seen within ${sensing} m`}` : "";
}
