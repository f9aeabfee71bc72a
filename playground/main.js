// Connects the controls to the flock.

import load from "./flockesc_wasm.js";
import { Camera } from "./camera.js";
import { drawCurve } from "./curve.js";
import { drawRun } from "./draw.js";
import { objectiveOf, Pace, Run } from "./flock.js";
import { actionsToward, limitsOf } from "./predator.js";
import { pythonCode } from "./python.js";
import { Results } from "./results.js";
import { DEFAULT_SEED, DEFAULT_WORLD, parseSeed, placeOf, rangeAt, readState, writeState } from "./state.js";
import { readTheme } from "./theme.js";

const END_PAUSE = 2.5; // s before a flock flies again
const $ = (id) => document.getElementById(id);

class Playground {
  constructor({ worlds, policy }) {
    this.worlds = worlds.map((world) => ({ ...world, document: JSON.parse(world.scenario) }));
    this.policy = policy;
    this.isPlaying = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.pointer = null; // pixels on the canvas
    this.results = new Results($("results"), $("announcement"));
    $("worlds").append(...this.worlds.map(({ name }) => new Option(name.replaceAll("-", " "), name)));
    this.readColors();
    this.restore();
  }

  readColors() {
    this.theme = readTheme();
    $("slider").style.setProperty("--scale", `linear-gradient(to right, ${this.theme.stops})`);
  }

  /** Takes the state from the address. */
  restore() {
    this.state = readState(location.hash, this.worlds);
    this.begin();
  }

  /** Changes which flock flies, and starts it. */
  change(changes) {
    Object.assign(this.state, changes);
    if (!this.state.world.playsPolicy) this.state.isLearned = false;
    if (!this.state.world.steered) this.state.isSteered = false;
    this.begin();
  }

  /** Changes the policy of the running flock. */
  choose(changes) {
    Object.assign(this.state, changes);
    if (!this.run.hasEnded) this.run.choose(this.state);
    this.show();
  }

  /** Starts the flock of the state from the beginning. */
  begin() {
    this.run?.free();
    this.run = new Run(this.state, this.policy);
    this.run.choose(this.state);
    this.pace = new Pace(this.state.world.document.time_step);
    this.camera = new Camera(this.state.world.dimension);
    this.camera.include(this.run);
    this.camera.resize($("flock").clientWidth, $("flock").clientHeight);
    this.limits = this.state.isSteered ? limitsOf(this.state.world.steered) : null;
    this.ended = 0; // s since the end
    this.results.begin(this.state);
    this.show();
  }

  get target() {
    return this.state.isSteered && this.pointer ? this.camera.unproject(...this.pointer) : null;
  }

  step() {
    if (this.run.hasEnded) return;
    if (this.limits) this.run.step(this.state, actionsToward(this.run, this.target, this.limits));
    else this.run.step(this.state);
    this.camera.include(this.run);
    if (this.run.hasEnded) this.results.note(this.run, this.state);
  }

  /** Plays to the end at once, and returns the objective. */
  finish() {
    while (!this.run.hasEnded) this.step();
    this.pace.share = 1;
    this.camera.box = this.camera.goal;
    this.draw();
    return this.run.objective;
  }

  play(isPlaying) {
    this.isPlaying = isPlaying;
    if (isPlaying && this.run.hasEnded) this.begin();
    this.show();
  }

  /** Called once per frame, `seconds` after the last one. */
  frame(seconds) {
    if (!this.isPlaying) return;
    if (this.run.hasEnded) {
      this.ended += seconds;
      this.pace.share = 1;
      if (this.ended > END_PAUSE) this.begin();
    } else for (let due = this.pace.add(seconds); due > 0; due--) this.step();
    this.camera.follow(Math.min(seconds, 0.2));
    this.draw();
  }

  draw() {
    const { run, theme } = this;
    drawRun($("flock"), this.camera, run, this.pace.share, theme, this.target);
    drawCurve($("curve"), run, theme);
    const meters = (value) => [value.toFixed(1), Object.assign(document.createElement("small"), { textContent: " m" })];
    $("now").replaceChildren(...meters(run.means.at(-1)));
    $("lowest").replaceChildren(...meters(run.objective));
    const { num_steps: numSteps, time_step: timeStep } = run.world.document;
    $("time").textContent = `${run.time.toFixed(1)} of ${numSteps * timeStep} s`;
  }

  /** Shows the state in the controls, in the address and in the code. */
  show() {
    const { world, seed, isLearned, range, isSteered } = this.state;
    const unit = world.unit === "m" ? "m" : "nearest";
    $("play").textContent = this.isPlaying ? "❚❚" : "▶";
    $("play").setAttribute("aria-label", this.isPlaying ? "Pause" : "Play");
    $("slider").value = placeOf(range, world.maxRange);
    $("slider").classList.toggle("idle", isLearned);
    const chosen = isLearned ? "learned" : `${range} ${unit}`;
    $("chosen").textContent = chosen;
    $("slider").setAttribute("aria-valuetext", chosen);
    const pressed = { nobody: 0, best: world.best, everybody: world.maxRange };
    for (const [id, value] of Object.entries(pressed)) {
      $(id).setAttribute("aria-pressed", String(!isLearned && range === value));
      $(id).querySelector("small").textContent = `${value} ${unit}`;
    }
    $("learned").setAttribute("aria-pressed", String(isLearned));
    $("learned").disabled = !world.playsPolicy;
    $("ticks").replaceChildren(...[0, 0.01, 0.1, 0.3, 1].map((share) => {
      const tick = Object.assign(document.createElement("span"), { textContent: share * world.maxRange });
      tick.style.left = `${placeOf(share, 1)}%`;
      return tick;
    }));
    $("worlds").value = world.name;
    $("seed").value = seed;
    const training = isLearned ? " Each agent sets its range with a policy that was trained on the paper's flock." : "";
    $("about").textContent = `${world.name}: ${world.title}.${training}`;
    $("chosen-seed").hidden = world.name !== DEFAULT_WORLD || seed !== DEFAULT_SEED;
    $("steer").checked = isSteered;
    $("steering").hidden = !world.steered;
    $("hint").hidden = !isSteered;
    $("flock").classList.toggle("steered", isSteered);
    history.replaceState(null, "", `#${writeState(this.state)}`);
    this.showCode();
    this.draw();
  }

  /** Shows the code at once, and what it prints when the controls rest. */
  showCode() {
    clearTimeout(this.timer);
    if (!$("python").open) return;
    $("code").textContent = pythonCode(this.state, this.policy, null);
    $("note").textContent = this.state.isSteered
      ? "The code plays this flock with the predator of the world: nobody steers it."
      : "Python prints the same number, to the last digit, for a run whose range you do not change.";
    this.timer = setTimeout(() => {
      const objective = objectiveOf(this.state, this.policy);
      $("code").textContent = pythonCode(this.state, this.policy, objective);
    }, 300);
  }
}

function connect(page) {
  const onClick = (id, act) => $(id).addEventListener("click", act);
  onClick("play", () => page.play(!page.isPlaying));
  onClick("restart", () => page.begin());
  const step = () => {
    page.play(false);
    page.step();
    page.pace.share = 1;
    page.camera.follow(0.2);
    page.draw();
  };
  onClick("step", step);
  const setRange = (range) => page.choose({ range, isLearned: false });
  $("slider").addEventListener("input", ({ target }) => {
    setRange(rangeAt(Number(target.value), page.state.world.maxRange));
  });
  onClick("nobody", () => setRange(0));
  onClick("best", () => setRange(page.state.world.best));
  onClick("everybody", () => setRange(page.state.world.maxRange));
  onClick("learned", () => page.choose({ isLearned: true }));
  $("steer").addEventListener("change", ({ target }) => page.change({ isSteered: target.checked }));
  $("worlds").addEventListener("change", ({ target }) => {
    const world = page.worlds.find(({ name }) => name === target.value);
    page.change({ world, range: world.best });
  });
  $("seed").addEventListener("change", ({ target }) => {
    page.change({ seed: parseSeed(target.value.trim()) ?? page.state.seed });
  });
  onClick("next", () => page.change({ seed: String((BigInt(page.state.seed) + 1n) % 2n ** 64n) }));
  onClick("copy", async () => {
    const copied = await navigator.clipboard?.writeText(location.href).then(() => true, () => false);
    $("announcement").textContent = copied ? "The link is copied." : "Copy the link from the address bar.";
  });
  $("python").addEventListener("toggle", () => page.showCode());

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const isField = event.target.matches("input:not([type=checkbox]), select");
    const takesSpace = event.target.matches("button, summary, select, input:not([type=range])");
    if (event.key === " " && !takesSpace) page.play(!page.isPlaying);
    else if (event.key === "ArrowRight" && !isField) step();
    else if (event.key === "ArrowLeft" && !isField) page.begin();
    else return;
    event.preventDefault();
  });
  const point = ({ offsetX, offsetY }) => {
    page.pointer = [offsetX, offsetY];
    if (page.state.isSteered && !page.isPlaying) page.draw();
  };
  for (const name of ["pointerdown", "pointermove"]) $("flock").addEventListener(name, point);
  for (const name of ["pointerleave", "pointercancel"]) $("flock").addEventListener(name, () => (page.pointer = null));
  addEventListener("hashchange", () => page.restore());
  new ResizeObserver(() => page.draw()).observe($("flock"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    page.readColors();
    page.draw();
  });
  let last = performance.now();
  requestAnimationFrame(function tick(now) {
    page.frame(Math.max(0, now - last) / 1000);
    last = now;
    requestAnimationFrame(tick);
  });
}

try {
  const [data] = await Promise.all([fetch("worlds.json").then((answer) => answer.json()), load()]);
  window.playground = new Playground(data);
  connect(window.playground);
} catch (error) {
  $("stage").classList.add("error");
  $("stage").textContent = `The flock cannot fly here: ${error.message}`;
  throw error;
}
