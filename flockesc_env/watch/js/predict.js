"use strict";

// Predict first, then see: a guess of the best range, and the means over many flocks.

class Prediction {
  /** `playground`: `fixed`, the mean objectives of `ranges`, and `learned`, with intervals, over `flocks` flocks. */
  constructor(page, playground) {
    const { ranges } = playground;
    Object.assign(this, { page, guess: null }, playground);
    this.slider = element("input", { type: "range", id: "guess", min: 0, max: ranges.length - 1 });
    this.slider.value = Math.floor(0.75 * ranges.length);
    const skip = element("button", { type: "button", id: "skip" }, "Just watch");
    const ask = element("label", { htmlFor: "guess" }, "How far should they listen?");
    const fly = element("button", { id: "fly" }, "Fly");
    this.form = element("form", { id: "predict" }, ask, this.slider, fly, skip);
    this.slider.addEventListener("input", () => this.draw());
    skip.addEventListener("click", () => this.close(true));
    this.form.addEventListener("submit", async (event) => {
      event.preventDefault();
      this.guess = this.range;
      const { isTouring, panels } = page;
      await page.choose(panels[0], `fixed:${this.guess}`);
      page.isTouring = isTouring;
      this.close(true);
    });
    page.player.addEventListener("change", () => page.player.isPlaying && this.close(false));
  }

  get range() {
    return this.ranges[Number(this.slider.value)];
  }

  /** Asks before the first flight: nothing on the page answers. */
  ask() {
    $("panels").append(this.form);
    document.body.classList.add("asking");
    this.draw();
  }

  draw() {
    this.page.look.guess = this.range;
    this.slider.setAttribute("aria-valuetext", `${this.range} m`);
    this.page.draw();
  }

  close(isFlying) {
    if (!document.body.classList.contains("asking")) return;
    this.form.remove();
    document.body.classList.remove("asking");
    delete this.page.look.guess;
    this.page.showAll();
    if (isFlying) this.page.player.play();
  }

  /** Shows the means as bars, where they hold: for the scenario of the playground as it is. */
  show({ scenario, numbers, isSteered }) {
    const isShown = scenario.name === this.page.start.scenario && !Object.keys(numbers).length && !isSteered;
    $("means").hidden = !isShown;
    if (!isShown) return;
    const { best } = scenario;
    const of = (range) => this.fixed[this.ranges.indexOf(range)];
    const bars = [
      [`best fixed range, ${best} m`, of(best), "fixed"],
      [`learned, mean of ${this.policies} trainings`, this.learned, "learned"],
    ];
    if (this.guess !== null) bars.unshift([`your range, ${this.guess} m`, of(this.guess), "accent"]);
    const largest = Math.max(...bars.map(([, { high }]) => high));
    const drawn = bars.map(([name, { mean, low, high }, color]) => {
      const bar = element("span", { className: "bar-line" });
      bar.style.cssText = `width: ${(60 * mean) / largest}%; background: var(--${color})`;
      const text = `${mean.toFixed(1)} m `;
      const interval = element("small", {}, `[${low.toFixed(1)}, ${high.toFixed(1)}]`);
      return element("div", {}, element("dt", {}, name), element("dd", {}, bar, element("b", {}, text), interval));
    });
    $("means").replaceChildren(
      element("h2", {}, `Mean over ${this.flocks.toLocaleString("en")} other flocks`),
      element("p", {}, "Lowest mean distance to the predator, with its 95 % interval over flocks."),
      element("dl", {}, ...drawn),
    );
  }
}
