"use strict";

// The slider of the range and four buttons, which choose the policy of one flock.

/** The ranges that a slider offers: close to each other where they are small. */
function rangesUpTo(largest, unit) {
  const steps = { m: { 2: 0.1, 30: 0.5, Infinity: 1 }, neighbors: { 30: 1, 100: 5, Infinity: 10 } }[unit];
  const ranges = [0];
  while (ranges.at(-1) < largest) {
    const [, step] = Object.entries(steps).find(([end]) => ranges.at(-1) < Number(end));
    ranges.push(Math.min(Number((ranges.at(-1) + step).toFixed(1)), largest));
  }
  return ranges;
}

/** The place of a range among increasing ranges: an index, or a number between two of them. */
function placeOf(range, ranges) {
  const above = ranges.findIndex((each) => each >= range);
  if (above <= 0) return above === 0 ? 0 : ranges.length - 1;
  return above - (ranges[above] - range) / (ranges[above] - ranges[above - 1]);
}

class Choice {
  /** `choose`: called with the text of the policy that the reader chooses. */
  constructor(root, choose, headline) {
    Object.assign(this, { choose, headline });
    this.title = element("h2");
    this.slider = element("input", { type: "range", className: "ranges", min: 0, step: 1 });
    this.slider.setAttribute("aria-label", "How far each agent listens");
    this.trials = new Trials();
    this.ticks = element("div", { className: "ticks", ariaHidden: "true" });
    this.buttons = ["Nobody", "Best fixed", "Everybody", "Learned"].map((text) => {
      const button = element("button", { type: "button" }, element("b", {}, text), element("small"));
      button.addEventListener("click", () => choose(button.value));
      return button;
    });
    const buttons = element("div", { className: "buttons" }, ...this.buttons);
    root.replaceChildren(this.title, this.trials.root, this.slider, this.ticks, buttons);
    this.slider.addEventListener("input", () => choose(this.sliderSpec));
  }

  get sliderSpec() {
    return `fixed:${this.ranges[Number(this.slider.value)]}`;
  }

  /** Shows the policy of a panel's run, the `name` of its flock, and what whole runs of this flock have given. */
  show({ run }, { scenario, unit }, name, trials, theme) {
    const { best, maxRange } = scenario;
    this.ranges = rangesUpTo(maxRange, unit);
    const isFixed = run.policy?.kind === "fixed";
    const text = isFixed ? `${run.policy.range} ${unit}` : run.title;
    const verb = isFixed ? (unit === "m" ? "listen within" : "listen to") : "follow";
    this.title.replaceChildren(`${name} ${verb} `, element("output", {}, text));
    this.slider.max = this.ranges.length - 1;
    if (isFixed) this.slider.value = Math.round(placeOf(run.policy.range, this.ranges));
    this.slider.classList.toggle("idle", !isFixed);
    this.slider.setAttribute("aria-valuetext", text);
    this.slider.style.setProperty("--scale", `linear-gradient(to right, ${this.ranges.map(theme.colorOf)})`);
    const marks = [0, 1, 10, 30, 100].filter((mark) => mark < 0.8 * maxRange);
    const ticks = [...marks, maxRange].map((mark) => {
      const tick = element("span", {}, String(mark));
      tick.style.left = `${(100 * placeOf(mark, this.ranges)) / (this.ranges.length - 1)}%`;
      return tick;
    });
    this.ticks.replaceChildren(...ticks);
    const offers = [
      ["fixed:0", `0 ${unit}`],
      [best === null ? "" : `fixed:${best}`, `${best} ${unit}`],
      [`fixed:${maxRange}`, `${maxRange} ${unit}`],
      [this.headline ?? "", "each decides"],
    ];
    this.buttons.forEach((button, at) => {
      const [value, note] = offers[at];
      Object.assign(button, { value, hidden: !value, ariaPressed: String(run.spec === value) });
      button.lastChild.textContent = note;
    });
    this.trials.show(trials, this.ranges, run.spec);
  }
}

const TRIALS_HEIGHT = 64; // px

/** A drawing above the slider: a dot for every range that was tried, at its objective, a line for other policies. */
class Trials {
  constructor() {
    this.root = element("div", { className: "trials" });
    this.root.setAttribute("role", "img");
  }

  /** `trials`: {title, range, objective} by the text of the policy; the range is null for other policies. */
  show(trials, ranges, spec) {
    const values = [...trials.values()].map(({ objective }) => objective);
    const [low, high] = [10 * Math.floor(Math.min(...values) / 10), 10 * Math.floor(Math.max(...values) / 10 + 1)];
    const y = (objective) => TRIALS_HEIGHT - 8 - ((TRIALS_HEIGHT - 16) * (objective - low)) / (high - low);
    const drawn = [...trials].map(([key, { title, range, objective }]) => {
      const text = `${title}: ${objective.toFixed(1)} m`;
      const name = svg("title", {}, text);
      const className = key === spec ? "now" : "";
      if (range === null) {
        const at = y(objective);
        const label = svg("text", { x: "100%", y: at < 14 ? at + 13 : at - 4, "text-anchor": "end" }, text);
        return svg("g", {}, svg("line", { x1: 0, x2: "100%", y1: at, y2: at, class: className }, name), label);
      }
      const x = `${(100 * placeOf(range, ranges)) / (ranges.length - 1)}%`;
      return svg("circle", { cx: x, cy: y(objective), r: key === spec ? 6 : 4, class: className }, name);
    });
    const label = (y, text) => svg("text", { x: 0, y }, text);
    const ends = values.length ? [label(10, `${high} m`), label(TRIALS_HEIGHT - 2, `${low} m`)] : [];
    this.root.hidden = !trials.size;
    this.root.replaceChildren(svg("svg", { width: "100%", height: TRIALS_HEIGHT }, ...ends, ...drawn));
    const text = [...trials.values()].map(({ title, objective }) => `${title} ${objective.toFixed(1)} m`);
    this.root.setAttribute("aria-label", `Whole runs of this flock: ${text.join(", ")}`);
  }
}
