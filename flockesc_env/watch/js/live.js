"use strict";

// Controls of a served page: the seed of the flock, and the policy of every panel. The server simulates.

const SLIDER_STEP = 0.5; // m
const SLIDER_START = 13.5; // m

/** Runs one request at a time. While one is under way, only the latest of the next requests is kept. */
class LatestOnly {
  constructor(work) {
    this.work = work;
    this.isBusy = false;
  }

  async ask(question) {
    this.waiting = [question];
    if (this.isBusy) return;
    this.isBusy = true;
    try {
      while (this.waiting.length) await this.work(this.waiting.pop());
    } finally {
      this.isBusy = false;
    }
  }
}

class Live {
  constructor(options, panels, replaceRun) {
    this.options = options;
    this.seed = document.getElementById("seed");
    this.message = document.getElementById("message");
    this.replaceRun = replaceRun;
    this.seed.value = options.seed;
    this.controls = panels.map((panel) => this.addControls(panel));
    const runAll = () => this.controls.forEach((control) => control.run());
    this.seed.addEventListener("input", runAll);
    const form = document.getElementById("live");
    form.addEventListener("submit", (event) => event.preventDefault());
    document.getElementById("next-seed").addEventListener("click", () => {
      if (!/^\d+$/.test(this.seed.value)) return;
      this.seed.value = BigInt(this.seed.value) + 1n; // a seed has 64 bits, a number of JavaScript 53
      runAll();
    });
    form.hidden = false;
    this.readAddress();
  }

  /** Takes the seed and the policies of the address: #seed=3&policies=fixed:12,stubborn-leaders. */
  readAddress() {
    const asked = new URLSearchParams(location.hash.slice(1));
    const [seed, policies] = [asked.get("seed"), asked.get("policies")];
    if (seed === null && policies === null) return;
    this.seed.value = seed ?? this.seed.value;
    policies?.split(",").forEach((policy, index) => this.controls[index]?.choose(policy));
    this.controls.forEach((control) => control.run());
  }

  /** Keeps the seed and the policies in the address, for a bookmark or a reload. */
  writeAddress() {
    const policies = this.controls.map((control) => control.policy()).join(",");
    history.replaceState(null, "", `#seed=${encodeURIComponent(this.seed.value)}&policies=${policies}`);
  }

  addControls(panel) {
    const recorded = panel.run;
    const start = this.options.panels[panel.index];
    const select = element("select", { ariaLabel: "Policy" });
    if (start === null) select.append(new Option(`${recorded.title} (recorded)`, ""));
    for (const name of this.options.policies) {
      select.append(new Option(name === "fixed:RHO" ? "fixed range" : name.replaceAll("-", " "), name));
    }
    const slider = element("input", {
      type: "range",
      min: 0,
      max: Math.max(this.options.maxRange, start?.split(":")[1] ?? 0),
      step: "any", // the first value can lie between the steps of the slider
      ariaLabel: `Interaction range in ${panel.run.rangeUnit}`,
    });
    const shown = element("output");
    const isFixed = start?.startsWith("fixed:");
    select.value = isFixed ? "fixed:RHO" : (start ?? "");
    slider.value = isFixed ? start.slice("fixed:".length) : SLIDER_START;
    const show = () => {
      slider.hidden = shown.hidden = select.value !== "fixed:RHO";
      shown.value = `${slider.value} ${panel.run.rangeUnit}`;
    };
    show();
    const latest = new LatestOnly(async (query) => {
      const shownNext = query.policy === "" ? recorded : await this.fetchRun(query);
      if (shownNext) this.replaceRun(panel.index, shownNext);
    });
    const policy = () => select.value.replace("RHO", slider.value);
    const choose = (name) => {
      const option = name.startsWith("fixed:") ? "fixed:RHO" : name;
      if (![...select.options].some(({ value }) => value === option)) return;
      select.value = option;
      if (option !== name) slider.value = name.slice("fixed:".length);
    };
    const run = () => {
      show();
      this.writeAddress();
      latest.ask({ seed: this.seed.value, policy: policy() });
    };
    select.addEventListener("change", run);
    slider.addEventListener("input", () => {
      slider.value = Math.round(slider.value / SLIDER_STEP) * SLIDER_STEP;
      run();
    });
    panel.head.append(element("div", { className: "policy" }, select, slider, shown));
    return { run, select, slider, policy, choose };
  }

  /** The run that a query asks for, or null after showing the message of the server. */
  async fetchRun(query) {
    const response = await fetch(`run?${new URLSearchParams(query)}`).catch(() => null);
    const answer = await response?.json();
    this.message.value = response ? (answer.message ?? "") : "The server does not answer any more.";
    return response?.ok ? decodeRun(answer) : null;
  }
}
