"use strict";

// Curves of all runs against time, with a cursor at the current time.

const CHART_HEIGHT = 190; // px
const AXIS_FONT = "11px system-ui, sans-serif";

// The charts, and what each draws per run. With `steps`, a value holds until the next time.
const CHARTS = [
  {
    title: "Distance to the predator (m)",
    key: () => "solid: mean, thin: its lowest so far, dashed: nearest agent, dotted: best fixed range",
    series: [
      { column: "lowestMean", width: 1, alpha: 0.55 },
      { column: "minDistance", width: 1.25, dash: [5, 4] },
      { column: "meanDistance", width: 2 },
    ],
    objective: "lowestMean",
  },
  {
    title: "Interaction range",
    unit: (run) => run.rangeUnit,
    key: () => "line: mean over agents, shade: standard deviation",
    series: [
      { column: "lowRange", width: 0, steps: true },
      { column: "highRange", width: 0, steps: true },
      { column: "meanRange", width: 2, steps: true },
    ],
    band: [1, 0],
  },
  {
    title: "Connected components",
    key: () => "of the neighbor graph, on a logarithmic scale",
    series: [{ column: "numComponents", width: 2, steps: true }],
    isLogarithmic: true,
  },
];

const POLARIZATION = {
  title: "Polarization",
  key: () => "1: all agents head the same way",
  series: [{ valueAt: polarizationAt, width: 2 }],
};

/** Returns the norm of the mean heading at a step. */
function polarizationAt({ headings, numAgents, dimension }, step) {
  const sums = new Array(dimension).fill(0);
  const first = step * numAgents * dimension;
  for (let at = 0; at < numAgents * dimension; at++) sums[at % dimension] += headings[first + at];
  return Math.hypot(...sums) / (127 * numAgents);
}

/** Returns the charts of a run. A scenario without predators has no distances. */
function chartsOf(run) {
  return run.numPredators > 0 ? CHARTS : [POLARIZATION, ...CHARTS.slice(1)];
}

class Curves {
  constructor(container, player, theme) {
    Object.assign(this, { container, player, theme, runs: [], charts: [], yardstick: null });
    player.addEventListener("change", () => this.moveCursor());
    new ResizeObserver(() => this.resize()).observe(container);
  }

  /** Shows runs. `yardstick`: a run whose lowest mean distance is drawn behind them, or null. */
  setRuns(runs, yardstick = null) {
    const specs = chartsOf(runs[0]);
    const isOther =
      runs.length !== this.runs.length || runs[0].rangeUnit !== this.runs[0].rangeUnit || specs[0] !== this.specs[0];
    Object.assign(this, { runs, yardstick, specs });
    if (isOther) {
      this.charts.forEach((chart) => chart.destroy());
      this.container.replaceChildren();
      this.charts = specs.map((spec) => this.build(spec, this.container));
    } else this.update();
    this.moveCursor();
  }

  /** Shows the frames that the runs have got. */
  update() {
    this.charts.forEach((chart, at) => {
      chart.setData(this.dataOf(this.specs[at]));
      this.describe(chart, this.specs[at]);
    });
  }

  /** Names the chart for screen readers: the first, last, least and largest value of every run's last series. */
  describe(chart, { title, series }) {
    const perRun = series.length;
    const texts = this.runs.map((run, at) => {
      const values = chart.data[perRun * (at + 1)].filter((value) => typeof value === "number");
      const text = (value) => String(Number(value.toFixed(1)));
      const [low, high] = [Math.min(...values), Math.max(...values)].map(text);
      if (!values.length) return "";
      return `${run.title}: from ${text(values[0])} to ${text(values.at(-1))}, between ${low} and ${high}`;
    });
    chart.root.setAttribute("aria-label", `${title} against time. ${texts.join("; ")}.`);
  }

  /** Draws again, for example in the colors of another theme. */
  redraw(theme) {
    this.theme = theme;
    this.charts.forEach((chart) => chart.redraw(false));
  }

  build(spec, container) {
    const title = spec.unit ? `${spec.title} (${spec.unit(this.runs[0])})` : spec.title;
    const place = element(
      "div",
      { className: "chart" },
      element("h3", {}, title),
      element("p", {}, spec.key(this.runs[0])),
    );
    container.append(place);
    const chart = new uPlot(this.optionsOf(spec, place.clientWidth), this.dataOf(spec), place);
    chart.now = element("div", { className: "now" });
    chart.over.append(chart.now);
    chart.root.setAttribute("role", "img");
    this.describe(chart, spec);
    this.bindScrubbing(chart);
    return chart;
  }

  colorOf(run) {
    return this.theme.runs[run.color % this.theme.runs.length];
  }

  dataOf({ series, objective }) {
    const tables = this.runs.map((run) => [
      Array.from(run.times.subarray(0, run.last + 1)),
      ...series.map(({ column, valueAt = (_, step) => run[column][step] }) =>
        Array.from({ length: run.last + 1 }, (_, step) => {
          const value = column === "numComponents" && step >= run.counted ? null : valueAt(run, step);
          return Number.isFinite(value) ? value : null;
        }),
      ),
    ]);
    const { yardstick } = this;
    const isShown = yardstick && !this.runs.includes(yardstick);
    const dotted = isShown ? yardstick : { times: [0], meanDistance: [null], last: 0 };
    const part = (column) => Array.from(column).slice(0, dotted.last + 1);
    if (objective) tables.push([part(dotted.times), part(dotted.meanDistance)]);
    return uPlot.join(tables);
  }

  optionsOf(spec, width) {
    const axis = { stroke: () => this.theme.muted, font: AXIS_FONT, ticks: { show: false } };
    const grid = { stroke: () => this.theme.grid, width: 1 };
    const color = (at) => this.colorOf(this.runs[at]);
    const perRun = spec.series.length;
    const series = this.runs.flatMap((_, at) =>
      spec.series.map(({ width: lineWidth, dash, steps, alpha = 1 }) => ({
        stroke: () => color(at),
        width: lineWidth,
        alpha,
        dash,
        points: { show: false },
        paths: steps ? uPlot.paths.stepped({ align: 1 }) : undefined,
      })),
    );
    const dotted = { stroke: () => this.theme.ink, width: 1.5, dash: [2, 4], points: { show: false } };
    const bands = this.runs.flatMap((_, at) =>
      spec.band ? [{ series: spec.band.map((index) => 1 + at * perRun + index), fill: () => `${color(at)}26` }] : [],
    );
    return {
      width,
      height: CHART_HEIGHT,
      legend: { show: false },
      cursor: { x: false, y: false, points: { show: false }, drag: { x: false, y: false } },
      scales: {
        x: { time: false, range: () => [0, this.player.duration || 1] },
        y: spec.isLogarithmic
          ? { distr: 3, range: (_, low, high) => [1, Math.max(10, high)] }
          : { range: (_, low, high) => [0, (high || 1) * 1.08] },
      },
      axes: [
        { ...axis, grid: { show: false }, size: 34, values: (_, ticks) => ticks.map((tick) => `${tick} s`) },
        { ...axis, grid, size: 44 },
      ],
      series: [{}, ...series, ...(spec.objective ? [dotted] : [])],
      bands,
      hooks: { draw: spec.objective ? [(chart) => this.drawObjectives(chart, spec.objective)] : [] },
    };
  }

  /** Marks every run's objective where it is reached. */
  drawObjectives(chart, column) {
    const { ctx: context } = chart;
    const density = window.devicePixelRatio || 1;
    context.save();
    this.runs.forEach((run) => {
      const objective = run[column][run.last];
      if (!Number.isFinite(objective)) return;
      const x = chart.valToPos(run.times[run[column].indexOf(objective)], "x", true);
      const y = chart.valToPos(objective, "y", true);
      context.fillStyle = this.colorOf(run);
      context.strokeStyle = this.theme.page;
      context.lineWidth = 3 * density;
      context.beginPath();
      context.arc(x, y, 4.5 * density, 0, 2 * Math.PI);
      context.stroke();
      context.fill();
    });
    context.restore();
  }

  bindScrubbing(chart) {
    const seek = (event) =>
      this.player.seek(chart.posToVal(event.clientX - chart.over.getBoundingClientRect().left, "x"));
    chart.over.addEventListener("pointerdown", (event) => {
      chart.over.setPointerCapture(event.pointerId);
      this.player.pause();
      seek(event);
    });
    chart.over.addEventListener("pointermove", (event) => chart.over.hasPointerCapture(event.pointerId) && seek(event));
  }

  moveCursor() {
    for (const chart of this.charts) {
      chart.now.style.transform = `translateX(${chart.valToPos(this.player.time, "x")}px)`;
    }
  }

  resize() {
    this.charts.forEach((chart) => {
      chart.setSize({ width: chart.root.parentElement.clientWidth, height: CHART_HEIGHT });
    });
    this.moveCursor();
  }
}
