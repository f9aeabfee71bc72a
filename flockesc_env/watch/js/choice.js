"use strict";

// The controls of a panel that choose its policy: the slider of the range, four buttons, and a list.

/** The range at a place of the slider, from 0 to 100: a square-root scale, rounded to readable numbers. */
function rangeAt(place, maxRange) {
  const range = maxRange * (place / 100) ** 2;
  const unit = range < 2 ? 0.1 : range < 30 ? 0.5 : 1;
  return Number((Math.round(range / unit) * unit).toFixed(1));
}

/** The place of a range on the slider, from 0 to 100. */
function placeOf(range, maxRange) {
  return 100 * Math.sqrt(Math.min(range / maxRange, 1));
}

class Choice {
  /** `choose`: called with the text of the policy that the reader chooses. */
  constructor(choose, policies) {
    this.choose = choose;
    this.policies = policies;
    this.shown = element("output", { className: "chosen" });
    this.slider = element("input", { type: "range", className: "ranges", min: 0, max: 100, step: 0.5 });
    this.slider.setAttribute("aria-label", "How far each agent listens");
    this.ticks = element("div", { className: "ticks", ariaHidden: "true" });
    this.select = element("select", { ariaLabel: "Policy" });
    const button = (text, note, spec) => {
      const made = element("button", { type: "button" }, element("b", {}, text), element("small", {}, note));
      made.addEventListener("click", () => choose(spec()));
      return made;
    };
    this.buttons = {
      nobody: button("Nobody", "", () => "fixed:0"),
      best: button("Best fixed", "", () => `fixed:${this.scenario.best}`),
      everybody: button("Everybody", "", () => `fixed:${this.scenario.maxRange}`),
      learned: button("Learned", "each decides", () => this.learned),
    };
    this.learned = policies.headline;
    this.root = element(
      "div",
      { className: "choice" },
      element(
        "div",
        { className: "title" },
        element("span", {}, "How far each agent listens"),
        this.select,
        this.shown,
      ),
      this.slider,
      this.ticks,
      element("div", { className: "buttons" }, ...Object.values(this.buttons)),
    );
    this.slider.addEventListener("input", () =>
      choose(`fixed:${rangeAt(Number(this.slider.value), this.scenario.maxRange)}`),
    );
    this.select.addEventListener("change", () => {
      if (this.select.value === "fixed") choose(`fixed:${rangeAt(Number(this.slider.value), this.scenario.maxRange)}`);
      else choose(this.select.value);
    });
  }

  /** Shows a run's policy. `recordings`: recorded runs that the panel can show instead. */
  show(run, { scenario, unit }, recordings) {
    this.scenario = scenario;
    const isFixed = run.spec.startsWith("fixed:");
    const range = isFixed ? Number(run.spec.slice("fixed:".length)) : null;
    const text = isFixed ? `${range} ${unit}` : run.title;
    this.shown.value = isFixed ? text : "";
    if (isFixed) this.slider.value = placeOf(range, scenario.maxRange);
    this.slider.classList.toggle("idle", !isFixed);
    this.slider.setAttribute("aria-valuetext", text);
    const marks = [0, 1, 10, 30, 100].filter((mark) => mark < 0.8 * scenario.maxRange);
    const ticks = [...marks, scenario.maxRange].map((mark) => {
      const tick = element("span", {}, String(mark));
      tick.style.left = `${placeOf(mark, scenario.maxRange)}%`;
      return tick;
    });
    this.ticks.replaceChildren(...ticks);
    const press = (name, spec, note) => {
      this.buttons[name].setAttribute("aria-pressed", String(run.spec === spec));
      if (note) this.buttons[name].querySelector("small").textContent = note;
    };
    press("nobody", "fixed:0", `0 ${unit}`);
    press("everybody", `fixed:${scenario.maxRange}`, `${scenario.maxRange} ${unit}`);
    this.buttons.best.hidden = scenario.best === null;
    if (scenario.best !== null) press("best", `fixed:${scenario.best}`, `${scenario.best} ${unit}`);
    this.buttons.learned.hidden = !this.learned;
    press("learned", this.learned);
    this.showOptions(run, recordings);
  }

  showOptions(run, recordings) {
    if (this.numFiles !== this.policies.files.size) this.listOptions(recordings);
    this.numFiles = this.policies.files.size;
    this.select.value = run.spec.startsWith("fixed:") ? "fixed" : run.spec;
  }

  listOptions(recordings) {
    const named = (spec, title) => new Option(title, spec);
    const files = [...this.policies.files.values()];
    const groups = groupBy(files);
    const lists = [...groups].map(([label, entries]) =>
      element(
        "optgroup",
        { label },
        ...entries.map(({ spec, label, sha256 }) => {
          const option = named(spec, label);
          if (sha256) option.title = `sha256 ${sha256}`;
          return option;
        }),
      ),
    );
    const rules = Object.keys(RULES).map((name) => named(name, name.replaceAll("-", " ")));
    this.select.replaceChildren(
      named("fixed", "fixed range"),
      ...recordings.map(({ spec, title }) => named(spec, `${title} (recorded)`)),
      element("optgroup", { label: "rules" }, ...rules),
      ...lists,
    );
  }
}

function groupBy(entries) {
  const groups = new Map();
  for (const entry of entries) groups.set(entry.group, [...(groups.get(entry.group) ?? []), entry]);
  return groups;
}
