"use strict";

// The curve of all runs against time, with a cursor at the current time.

const MOST_POINTS = 500; // of a line

/** Returns the norm of the mean heading at a step. */
function polarizationAt({ headings, numAgents, dimension }, step) {
  const sums = new Array(dimension).fill(0);
  const first = step * numAgents * dimension;
  for (let at = 0; at < numAgents * dimension; at++) sums[at % dimension] += headings[first + at];
  return Math.hypot(...sums) / (127 * numAgents);
}

class Curves {
  constructor(container, player) {
    this.player = player;
    this.title = element("h2");
    this.key = element("p");
    this.chart = element("div", { className: "chart" });
    this.now = element("div", { className: "now" });
    container.replaceChildren(this.title, this.key, this.chart);
    player.addEventListener("change", () => this.moveCursor());
    const seek = ({ clientX }) => {
      const { left, width } = this.chart.getBoundingClientRect();
      player.seek((player.duration * (clientX - left)) / width);
    };
    this.chart.addEventListener("pointerdown", (event) => {
      this.chart.setPointerCapture(event.pointerId);
      player.pause();
      seek(event);
    });
    this.chart.addEventListener("pointermove", (event) => this.chart.hasPointerCapture(event.pointerId) && seek(event));
  }

  /**
   * Shows the frames that runs have got. `rival`: a run whose lowest mean distance is dotted, or null. A scenario without
   * predators has no distances.
   */
  show(runs, rival) {
    const { player } = this;
    const hasPredators = runs[0].numPredators > 0;
    const points = (run, valueAt) => {
      const stride = Math.ceil((run.last + 1) / MOST_POINTS);
      const steps = Array.from({ length: Math.floor(run.last / stride) + 1 }, (_, at) => at * stride);
      return steps.map((step) => [run.times[step], valueAt(run, step)]).filter(([, value]) => Number.isFinite(value));
    };
    const lowestAt = (run, step) => run.lowestMean[step];
    const nowAt = (run, step) => run.meanDistance[step];
    const lines = runs.flatMap((run) => {
      const color = `var(--${run.color})`;
      if (!hasPredators) return [{ points: points(run, polarizationAt), color }];
      return [
        { points: points(run, nowAt), color, width: 1 },
        { points: points(run, lowestAt), color, width: 2.5 },
      ];
    });
    if (rival && !runs.includes(rival))
      lines.push({ points: points(rival, lowestAt), color: "var(--ink)", width: 1.5, dash: "2 5" });
    const highest = hasPredators ? Math.max(...lines.flatMap((line) => line.points.map(([, value]) => value)), 1) : 1;
    const spacing = roundBelow(highest / 2);
    const seconds = roundBelow((player.duration || 1) / 4);
    this.title.textContent = hasPredators ? "Mean distance to the predator (m)" : "Polarization";
    this.key.textContent = hasPredators
      ? "Thick: lowest so far. Thin: now. Dotted: best single range."
      : "1: all agents head the same way.";
    plot(this.chart, {
      x: [0, player.duration || 1],
      y: [0, 1.05 * highest],
      lines,
      xTicks: multiples(0, player.duration, seconds).map((time) => [time, `${rounded(time)} s`]),
      yTicks: multiples(0, highest, spacing).map((value) => [value, rounded(value)]),
    });
    this.chart.append(this.now);
    const ends = runs.map((run) => {
      const values = points(run, hasPredators ? lowestAt : polarizationAt).map(([, value]) => value.toFixed(1));
      return `${run.title}: from ${values[0]} to ${values.at(-1)}`;
    });
    this.chart.setAttribute("aria-label", `${this.title.textContent} against time. ${ends.join("; ")}.`);
    this.moveCursor();
  }

  moveCursor() {
    this.now.style.left = `${(100 * this.player.time) / (this.player.duration || 1)}%`;
  }
}
