"use strict";

// Curves of all runs against time, with a cursor at the current time.

const CHART_HEIGHT = 190; // px
const AXIS_FONT = "11px system-ui, sans-serif";

// The charts, and what each draws per run. With `steps`, a value holds until the next time.
const CHARTS = [
  {
    title: "Distance to the predator (m)",
    key: () => "solid: mean, thin: its lowest so far, dashed: nearest agent",
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
    this.charts.forEach((chart, at) => chart.setData(this.dataOf(this.specs[at])));
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
    this.bindScrubbing(chart);
    return chart;
  }

  colorOf(run) {
    return this.theme.runs[run.color % this.theme.runs.length];
  }

  dataOf({ series }) {
    const tables = this.runs.map((run) => [
      Array.from(run.times.subarray(0, run.last + 1)),
      ...series.map(({ column, valueAt = (_, step) => run[column][step] }) =>
        Array.from({ length: run.last + 1 }, (_, step) => valueAt(run, step)).map((value) =>
          Number.isFinite(value) ? value : null,
        ),
      ),
    ]);
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
      series: [{}, ...series],
      bands,
      hooks: {
        drawSeries: spec.objective ? [(chart, index) => index === 1 && this.drawYardstick(chart)] : [],
        draw: spec.objective ? [(chart) => this.drawObjectives(chart, spec.objective)] : [],
      },
    };
  }

  /** Draws the lowest mean distance of the yardstick, and its name. */
  drawYardstick(chart) {
    if (!this.yardstick) return;
    const { ctx: context } = chart;
    const { lowestMean, times, last, policy } = this.yardstick;
    const density = window.devicePixelRatio || 1;
    const place = (step) => [chart.valToPos(times[step], "x", true), chart.valToPos(lowestMean[step], "y", true)];
    context.save();
    context.beginPath();
    for (let step = 0; step <= last; step++) context.lineTo(...place(step));
    context.strokeStyle = context.fillStyle = this.theme.muted;
    context.lineWidth = 2 * density;
    context.setLineDash([2 * density, 4 * density]);
    context.stroke();
    context.font = `${10.5 * density}px system-ui, sans-serif`;
    context.textAlign = "right";
    const [x, y] = place(last);
    if (this.yardstick.hasEnded)
      context.fillText(`best ${policy.title}: ${lowestMean[last].toFixed(1)} m`, x, y - 6 * density);
    context.restore();
  }

  /** Marks every run's objective where it is reached. */
  drawObjectives(chart, column) {
    const { ctx: context } = chart;
    const density = window.devicePixelRatio || 1;
    context.save();
    context.font = `600 ${11.5 * density}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.lineJoin = "round";
    this.runs.forEach((run, at) => {
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
      if (this.runs.length > 2) return; // more labels collide
      const label = [objective.toFixed(1), x, y + (at % 2 ? -9 : 17) * density]; // labels of neighboring runs do not overlap
      context.strokeText(...label);
      context.fillText(...label);
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
