"use strict";

// The slider of the range: first for a guess, then for the reader's flock. Above it, what every range gives.

const SCALE = [60, 100]; // m, of the means and of the dots of single flocks

/** The place of a range among increasing ranges: an index, or a number between two of them. */
function placeOf(range, ranges) {
  const above = ranges.findIndex((each) => each >= range);
  if (above <= 0) return above === 0 ? 0 : ranges.length - 1;
  return above - (ranges[above] - range) / (ranges[above] - ranges[above - 1]);
}

class Choice {
  /** `playground`: means over many flocks, of `fixed` ranges and `learned`, or null. */
  constructor(page, playground) {
    Object.assign(this, { page, playground, guess: null, friend: null, ranges: [0, 1] });
    $("range").addEventListener("input", () => {
      if (!page.look.asking) return page.choose(page.active, `fixed:${this.range}`);
      page.look.asking.range = this.range;
      $("fly").disabled = false;
      this.showSlider(this.range);
      page.draw();
    });
    $("skip").addEventListener("click", () => this.close(true));
    $("predict").addEventListener("submit", async (event) => {
      event.preventDefault();
      this.guess = this.range;
      await page.choose(page.panels[0], `fixed:${this.guess}`);
      this.close(true);
    });
    page.player.addEventListener("change", () => page.player.isPlaying && this.close(false));
  }

  get range() {
    return this.ranges[Number($("range").value)];
  }

  /** Asks before the first flight: nothing on the page answers, and no circle shows a range until the reader does. */
  ask() {
    this.page.look.asking = { range: null };
    document.body.classList.add("asking");
    this.ranges = this.page.flight.scenario.ranges;
    this.showSlider(this.ranges[Math.floor(this.ranges.length / 2)]);
    $("range").setAttribute("aria-valuetext", "no guess yet");
    $("fly").disabled = true;
  }

  close(isFlying) {
    if (!this.page.look.asking) return;
    document.body.classList.remove("asking");
    delete this.page.look.asking;
    this.page.showAll();
    if (isFlying) this.page.player.play();
  }

  /** Shows the ranges of a scenario, and the place of one of them. */
  showSlider(range) {
    const { theme } = this.page.look;
    const { unit } = this.page.flight;
    const place = (each) => placeOf(each, this.ranges);
    const slider = $("range");
    slider.max = this.ranges.length - 1;
    if (range !== null) slider.value = Math.round(place(range));
    slider.classList.toggle("idle", range === null);
    slider.setAttribute("aria-valuetext", range === null ? "each agent decides" : `${range} ${unit}`);
    slider.style.setProperty("--scale", `linear-gradient(to right, ${this.ranges.map(theme.colorOf)})`);
    const last = this.ranges.at(-1);
    const texts = [[0, "nobody"], ...[4, 10, 20, 40].filter((each) => each < 0.8 * last).map((each) => [each, each])];
    $("ticks").replaceChildren(
      ...[...texts, [last, "everybody"]].map(([each, text]) => {
        const tick = element("span", {}, String(text));
        tick.style.left = `${(100 * place(each)) / (this.ranges.length - 1)}%`;
        return tick;
      }),
    );
  }

  /** Shows the range of the reader's flock, what whole runs of this flock gave, and the means. */
  show() {
    const { page } = this;
    const { active, flight, trials } = page;
    this.ranges = flight.scenario.ranges;
    if (page.look.asking) return;
    const { policy, kind, color } = active.run;
    this.showSlider(kind === "fixed" && active.run.isLive ? policy.range : null);
    $("choice").style.setProperty("--run", `var(--${color})`);
    const dots = [...trials.values()].filter((each) => each.range !== null);
    this.showMeans(dots, this.meansOf(flight));
    showAnswer(page, this.meansOf(flight), this);
    const ended = page.runs.filter(({ isNoted }) => isNoted);
    const texts = ended.map(({ title, objective }) => `${title}: ${objective.toFixed(1)} m`);
    const flock = `${flight.scenario.name}, ${flight.start ? "given start" : `seed ${flight.seed}`}`;
    $("announcement").textContent = texts.length ? `${flock}. Lowest mean distance. ${texts.join(", ")}.` : flock;
  }

  /** The means over many flocks, where they hold: in the scenario of the playground as it is. */
  meansOf({ scenario, agents, isSteered }) {
    return scenario.name === this.page.start.scenario && agents === null && !isSteered ? this.playground : null;
  }

  /** Draws a dot for every range that flew, and the means as a line with a band. */
  showMeans(trials, means) {
    const { ranges } = this;
    const values = trials.map(({ objective }) => objective);
    $("trials").hidden = $("trials-key").hidden = !values.length;
    if (!values.length) return;
    const [low, high] = means ? SCALE : [Math.floor(Math.min(...values) - 1), Math.ceil(Math.max(...values) + 1)];
    const across = (value) => [0, ranges.length - 1].map((place) => [place, value]);
    const [lines, bands] = [[], []];
    if (means) {
      const at = (name) => means.fixed.map((mean, index) => [placeOf(means.ranges[index], ranges), mean[name]]);
      bands.push({ low: at("low"), high: at("high"), color: "var(--fixed)" });
      lines.push({ points: at("mean"), color: "var(--fixed)", width: 2.5 });
      lines.push({ points: across(means.learned.mean), color: "var(--learned)", width: 2.5 });
    }
    plot($("trials"), {
      x: [0, ranges.length - 1],
      y: [low, high],
      lines,
      bands,
      dots: trials.map(({ range, objective, title, color }) => ({
        at: [placeOf(range, ranges), objective],
        color: `var(--${color})`,
        title: `${title}: ${objective.toFixed(1)} m`,
      })),
      yTicks: (means ? [60, 70, 80, 90, 100] : [low, high]).map((value) => [value, `${value} m`]),
    });
    const texts = trials.map(({ title, objective }) => `${title} ${objective.toFixed(1)} m`);
    $("trials").setAttribute("aria-label", `Whole runs of this flock: ${texts.join(", ")}`);
    const ofMeans = means ? `Lines: means of ${means.flocks.toLocaleString("en")} flocks. ` : "";
    $("trials-key").textContent = `${ofMeans}Dots: this flock.`;
  }
}
