"use strict";

// Predict first, then see: the mean objective against the fixed range, from flocks that this page plays.

const GUESS_RANGES = [0, 2, 5, 8, 10, 12, 15, 20, 30, 45, 65, 100]; // m
const GUESS_SEEDS = 16;
const SLICE = 6; // ms of every frame

class Prediction {
  /** `published`: `{ranges, mean, low, high, flocks}` of the published curve. */
  constructor(scenarios, published, theme) {
    Object.assign(this, { published, theme, sums: GUESS_RANGES.map(() => 0) });
    this.scenario = scenarios.find(({ name }) => name === published.scenario);
    const [slider, shown] = [$("guess"), $("guessed")];
    const show = () => {
      this.guess = rangeAt(Number(slider.value), this.scenario.maxRange);
      shown.value = `${this.guess} m`;
      slider.setAttribute("aria-valuetext", shown.value);
    };
    slider.addEventListener("input", show);
    show();
    $("predict-show").addEventListener("click", () => this.reveal());
  }

  reveal() {
    $("predict-ask").hidden = true;
    $("predict-answer").hidden = false;
    this.jobs = [];
    for (let seed = 0; seed < GUESS_SEEDS; seed++) GUESS_RANGES.forEach((_, at) => this.jobs.push([at, String(seed)]));
    this.total = this.jobs.length;
    this.chart = new uPlot(this.options(), this.data(), $("predict-chart"));
    new ResizeObserver(() => this.chart.setSize({ width: $("predict-chart").clientWidth, height: 200 })).observe(
      $("predict-chart"),
    );
    this.work();
  }

  /** Plays flocks for some milliseconds of every frame. */
  work() {
    const end = performance.now() + SLICE;
    while (performance.now() < end && (this.run || this.jobs.length)) {
      if (!this.run) {
        [this.at, this.seed] = this.jobs.shift();
        const flight = new Flight({ scenario: this.scenario, seed: this.seed });
        this.run = new LiveRun(flight, new FixedRange(GUESS_RANGES[this.at], "m"));
      }
      this.run.reach(Infinity, () => null, Math.max(end - performance.now(), 0.5));
      if (!this.run.hasEnded) break;
      this.sums[this.at] += this.run.objective;
      this.run.free();
      this.run = null;
      this.isChanged = true;
    }
    if (this.isChanged) this.show();
    if (this.run || this.jobs.length) requestAnimationFrame(() => this.work());
  }

  /** The mean objective of the page's flocks at every range; null until all have ended, because a few say little. */
  means() {
    const haveEnded = !this.run && !this.jobs.length;
    return this.sums.map((sum) => (haveEnded ? sum / GUESS_SEEDS : null));
  }

  show() {
    this.isChanged = false;
    this.chart.setData(this.data());
    const done = this.total - this.jobs.length - (this.run ? 1 : 0);
    const { ranges, mean, flocks } = this.published;
    const at = (range) => `${range} m: ${interpolate(ranges, mean, range).toFixed(1)} m`;
    $("predict-text").textContent =
      `Your guess, ${at(this.guess)} on average over ${flocks} flocks. The best fixed range, which was chosen ` +
      `on other flocks, ${at(this.scenario.best)}. This page has played ${done} of ${this.total} flocks.`;
  }

  data() {
    const { ranges, mean } = this.published;
    const place = (range) => placeOf(range, this.scenario.maxRange);
    const guessed = interpolate(ranges, mean, this.guess);
    const isShown = (range) => range <= this.scenario.maxRange;
    return uPlot.join([
      [ranges.filter(isShown).map(place), mean.filter((_, at) => isShown(ranges[at]))],
      [GUESS_RANGES.map(place), this.means()],
      [[place(this.guess)], [guessed]],
    ]);
  }

  options() {
    const axis = { stroke: () => this.theme().muted, font: AXIS_FONT, ticks: { show: false } };
    const points = (size, color) => ({ show: true, size, fill: color, stroke: color });
    return {
      width: $("predict-chart").clientWidth,
      height: 200,
      legend: { show: false },
      cursor: { show: false },
      scales: { x: { time: false, range: [0, 100] } },
      axes: [
        {
          ...axis,
          grid: { show: false },
          size: 34,
          splits: () => [0, 1, 10, 30, 60, 100].map((range) => placeOf(range, this.scenario.maxRange)),
          values: (_, places) => places.map((place) => `${rangeAt(place, this.scenario.maxRange)} m`),
        },
        { ...axis, grid: { stroke: () => this.theme().grid, width: 1 }, size: 44 },
      ],
      series: [
        {},
        { stroke: () => this.theme().muted, width: 2, points: { show: false }, spanGaps: true },
        { stroke: () => this.theme().accent, width: 0, points: points(7, () => this.theme().accent) },
        { stroke: () => this.theme().predator, width: 0, points: points(12, () => this.theme().predator) },
      ],
    };
  }
}

/** The value at `x` on the line through points with increasing `xs`. */
function interpolate(xs, ys, x) {
  const above = Math.max(
    1,
    xs.findIndex((value) => value >= x) === -1 ? xs.length - 1 : xs.findIndex((value) => value >= x),
  );
  const share = Math.min(Math.max((x - xs[above - 1]) / (xs[above] - xs[above - 1]), 0), 1);
  return ys[above - 1] + share * (ys[above] - ys[above - 1]);
}
