"use strict";

// The clock of the page: time in s, playing or not.

class Player extends EventTarget {
  constructor() {
    super();
    Object.assign(this, { time: 0, duration: 0, stop: 0, timeStep: 1, speed: 1, isPlaying: false });
    this.reach = (time) => time; // the latest time up to this one that can be shown
  }

  /** `stop`: the time in s at which playing ends; a reader can move on to the end of the run, and play there. */
  setDuration(duration, timeStep, stop = duration) {
    Object.assign(this, { duration, timeStep, stop });
  }

  get hasEnded() {
    return this.time === this.stop || this.time >= this.duration;
  }

  seek(time) {
    this.time = Math.min(Math.max(time, 0), this.duration);
    this.dispatchEvent(new Event("change"));
  }

  /** Moves by some steps, to a whole step. */
  stepBy(steps) {
    this.pause();
    this.seek((Math.round(this.time / this.timeStep) + steps) * this.timeStep);
  }

  toggle() {
    return this.isPlaying ? this.pause() : this.play();
  }

  play() {
    cancelAnimationFrame(this.frame); // pausing and playing within one frame must not leave two clocks
    if (this.hasEnded) this.dispatchEvent(new Event("again"));
    this.isPlaying = true;
    let before = performance.now();
    const advance = (now) => {
      const passed = Math.min(Math.max(now - before, 0) / 1000, 0.25); // a hidden tab does not catch up
      before = now;
      const end = this.time < this.stop ? this.stop : this.duration;
      const wanted = Math.min(this.time + passed * this.speed, end);
      const time = this.reach(wanted);
      if (time >= end) this.isPlaying = false;
      this.seek(time);
      if (this.isPlaying) this.frame = requestAnimationFrame(advance);
      else this.dispatchEvent(new Event("end"));
    };
    this.frame = requestAnimationFrame(advance);
    this.dispatchEvent(new Event("change"));
  }

  pause() {
    cancelAnimationFrame(this.frame);
    this.isPlaying = false;
    this.dispatchEvent(new Event("change"));
  }
}

/** Connects a player to the buttons and keys of the page. */
function bindPlayer(player) {
  const [play, scrub, time, speed] = ["play", "scrub", "time", "speed"].map($);
  play.addEventListener("click", () => player.toggle());
  scrub.addEventListener("input", () => {
    const time = Number(scrub.value); // before the pause, which shows the present time
    player.pause();
    player.seek(time);
  });
  speed.addEventListener("change", () => (player.speed = Number(speed.value)));
  player.addEventListener("change", () => {
    play.textContent = player.isPlaying ? "\u275a\u275a" : "\u25b6\ufe0e";
    play.setAttribute("aria-label", player.isPlaying ? "Pause" : "Play");
    Object.assign(scrub, { max: player.duration, step: player.timeStep / 10, value: player.time });
    scrub.setAttribute("aria-valuetext", `${player.time.toFixed(1)} seconds`);
    time.textContent = `${player.time.toFixed(1)} of ${Number(player.duration.toFixed(1))} s`;
  });
  const second = () => Math.max(1, Math.round(1 / player.timeStep));
  const keys = {
    " ": () => player.toggle(),
    ArrowLeft: (event) => player.stepBy(event.shiftKey ? -second() : -1),
    ArrowRight: (event) => player.stepBy(event.shiftKey ? second() : 1),
    Home: () => player.seek(0),
    End: () => player.seek(player.duration),
  };
  document.addEventListener("keydown", (event) => {
    // Other sliders need the arrows, but not the space bar.
    const isOurs = event.target === scrub || (event.key === " " && event.target.type === "range");
    const isOthers = !isOurs && event.target.closest("input:not([type=checkbox]), select, summary");
    const isPress = event.key === " " && event.target.closest("button, input[type=checkbox]");
    if (!(event.key in keys) || isOthers || isPress || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key](event);
  });
}
