"use strict";

// Leads learned predators toward the reader's finger.

const NEAR = 5; // m: closer to the point the predator slows down
const GRIP = 36; // pixels from a predator within which a touch grabs it
const NUDGE = 5; // m that an arrow key moves the point

/** The reader as the predator: where the finger is, the path so far, and what it has reached. */
class Steering {
  constructor(page) {
    this.page = page;
    this.forget();
  }

  forget() {
    this.pointer = null; // m
    this.tries = new Map(); // by the policy of the flock: {straight, now, best}
  }

  /** Connects a panel's canvas: a drag of a predator grabs it, a click shows an agent. */
  bind(panel) {
    const { page } = this;
    const { canvas, scene } = panel;
    let pressed = [0, 0];
    const isDrag = ({ offsetX, offsetY }) => Math.hypot(offsetX - pressed[0], offsetY - pressed[1]) > 4;
    const isHeld = () => canvas.classList.contains("grabbed");
    canvas.addEventListener("pointerdown", ({ offsetX, offsetY, isPrimary }) => {
      pressed = [offsetX, offsetY];
      const { isSteered, scenario } = page.flight;
      if (!isPrimary || !this.first || !scenario.steered) return;
      if (!isSteered && !scene.isPredatorNear(offsetX, offsetY, GRIP)) return;
      canvas.classList.add("grabbed");
      if (isSteered) this.lead(page.camera.unproject(offsetX, offsetY));
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!isHeld() || !isDrag(event)) return;
      if (!page.flight.isSteered) page.steer(true, page.player.time);
      this.lead(page.camera.unproject(event.offsetX, event.offsetY));
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, () => {
        canvas.classList.remove("grabbed");
        this.release();
      });
    }
    // A finger that holds the predator does not scroll the page.
    canvas.addEventListener("touchstart", (event) => isHeld() && event.preventDefault(), { passive: false });
    canvas.addEventListener("click", (event) => {
      const isLeading = page.flight.isSteered && page.player.isPlaying;
      if (!isDrag(event) && !isLeading) page.inspect(panel, scene.agentAt(event.offsetX, event.offsetY));
    });
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    canvas.addEventListener(
      "keydown",
      (event) => {
        if (/^n$/i.test(event.key) && panel.run.isLive) return page.inspect(panel, event.shiftKey ? "before" : "next");
        if (!page.flight.isSteered || !(event.key in moves || event.key === "Escape")) return;
        event.preventDefault();
        event.stopImmediatePropagation();
        if (event.key === "Escape") return this.release();
        const { run } = panel;
        const at = 2 * run.numPredators * frameAt(run, page.player.time).step;
        const from = this.pointer ?? Array.from(run.predators.subarray(at, at + 2)); // the first predator
        this.lead(from.map((part, axis) => part + NUDGE * moves[event.key][axis]));
      },
      { capture: true },
    );
  }

  /** Leads the predators toward a point; the first one starts the flight. */
  lead(point) {
    const { player } = this.page;
    this.pointer = point;
    this.page.isInviting = false;
    if (!player.isPlaying && !player.hasEnded) player.play();
    this.page.draw();
  }

  release() {
    if (!this.pointer) return;
    this.pointer = null;
    this.page.draw();
  }

  get first() {
    return this.page.panels.find(({ run }) => run.isLive)?.run;
  }

  /** Makes the path so far that of the flight, so that a new run follows it. */
  keepPath() {
    if (this.page.flight.isSteered) this.page.flight.path = [...(this.first?.targets ?? [])];
  }

  /** Where the predators of a run fly: along the flight's path, else as in the first panel, else to the pointer. */
  targetOf(run) {
    const { flight } = this.page;
    if (!flight.isSteered) return null;
    const step = run.last;
    if (step < flight.path.length) return flight.path[step];
    const { first } = this;
    if (first && first !== run && step < first.targets.length) return first.targets[step];
    return this.pointer;
  }

  /** What the predator has reached against a policy: {straight, now, best} in m. */
  triesAgainst(policy) {
    if (!this.tries.has(policy.spec)) {
      const straight = new LiveRun(new Flight({ ...this.page.flight, path: [] }), policy).finish();
      this.tries.set(policy.spec, { straight, now: null, best: Infinity });
    }
    return this.tries.get(policy.spec);
  }

  /** Keeps what a whole run gave the predator. */
  note({ policy, objective }) {
    const tries = this.triesAgainst(policy);
    Object.assign(tries, { now: objective, best: Math.min(tries.best, objective) });
  }
}

/** Returns the actions, accelerations ahead and left in [-1, 1], of all learned predators of a run. */
function actionsToward({ flight, flock, numPredators, timeStep }, target) {
  const { predators } = flock; // positions, then velocities
  const actions = new Float64Array(2 * numPredators);
  if (!target) return actions; // they fly straight on
  for (let at = 0; at < 2 * numPredators; at += 2) {
    const velocity = [predators[2 * numPredators + at], predators[2 * numPredators + at + 1]];
    const { max_acceleration: maxAcceleration, max_speed: maxSpeed } = flight.limits[at / 2];
    const way = [target[0] - predators[at], target[1] - predators[at + 1]];
    const distance = Math.hypot(...way) || 1e-9;
    const speed = maxSpeed * Math.min(1, distance / NEAR);
    const change = way.map((part, axis) => (speed * part) / distance - velocity[axis]);
    const size = Math.max(maxAcceleration * timeStep, Math.hypot(...change));
    const flown = Math.hypot(...velocity);
    const isAtRest = flown < 1e-9 * maxSpeed;
    const [x, y] = isAtRest ? towardNearest(flock, predators[at], predators[at + 1]) : velocity.map((v) => v / flown);
    const bounded = (value) => Math.min(Math.max(value / size, -1), 1);
    actions[at] = bounded(x * change[0] + y * change[1]);
    actions[at + 1] = bounded(x * change[1] - y * change[0]);
  }
  return actions;
}

/** The direction that a predator at rest has in the model: toward the nearest agent. */
function towardNearest({ positions, caught }, x, y) {
  let [nearest, way] = [Infinity, [1, 0]];
  for (let at = 0; at < positions.length; at += 2) {
    const [dx, dy] = [positions[at] - x, positions[at + 1] - y];
    const distance = Math.hypot(dx, dy);
    if (distance === 0 || distance >= nearest || caught.includes(at / 2)) continue;
    [nearest, way] = [distance, [dx / distance, dy / distance]];
  }
  return way;
}
