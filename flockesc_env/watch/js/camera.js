"use strict";

// The camera that all panels share: it sees a plane from above, and space in perspective.

const TURN_PER_PIXEL = 0.008; // radians
const FROM_ABOVE = { yaw: 0, pitch: 0 }; // radians
const FROM_ASIDE = { yaw: -0.6, pitch: 1.1 };
const MARGIN = 1.04; // size of the window over that of the box

class Camera {
  constructor() {
    this.box = null;
    this.width = this.height = 1;
    this.setDimension(2);
  }

  /** Looks at a plane from above, or at space from the side. */
  setDimension(dimension) {
    this.isSpatial = dimension === 3;
    this.start = this.isSpatial ? FROM_ASIDE : FROM_ABOVE;
    this.reset();
  }

  reset() {
    this.zoomFactor = 1;
    this.shift = [0, 0];
    this.turn = { ...this.start };
    this.update();
  }

  /** Shows at least what lies in a box {low, high} in m. */
  fit(box) {
    this.box = box;
    this.update();
  }

  resize(width, height) {
    if (width === this.width && height === this.height) return;
    Object.assign(this, { width, height });
    this.update();
  }

  /** Follows the pointer: turns space, shifts a plane. */
  drag(dx, dy) {
    if (this.isSpatial) {
      this.turn.yaw += dx * TURN_PER_PIXEL;
      this.turn.pitch = Math.min(Math.max(this.turn.pitch - dy * TURN_PER_PIXEL, 0), Math.PI);
    } else {
      this.shift = [this.shift[0] + dx, this.shift[1] + dy];
    }
    this.update();
  }

  /** Zooms around the point under the pointer. */
  zoom(factor, x, y) {
    const bounded = Math.min(Math.max(this.zoomFactor * factor, 0.5), 40) / this.zoomFactor;
    this.zoomFactor *= bounded;
    const [centerX, centerY] = [this.width / 2, this.height / 2];
    this.shift = [
      x - centerX - (x - centerX - this.shift[0]) * bounded,
      y - centerY - (y - centerY - this.shift[1]) * bounded,
    ];
    this.update();
  }

  update() {
    if (!this.box) return;
    const { low, high } = this.box;
    this.center = low.map((value, axis) => (value + high[axis]) / 2);
    this.eye = this.isSpatial ? 2.2 * Math.hypot(...low.map((value, axis) => high[axis] - value)) : Infinity; // m away
    this.aim(this.start);
    this.fitToWindow();
    this.pixelsPerMetre *= this.zoomFactor;
    this.aim(this.turn);
  }

  /** Computes the unit vectors right, up and toward the viewer in coordinates of the flock. */
  aim({ yaw, pitch }) {
    const [c, s, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
    this.right = [c, s, 0];
    this.up = [-s * cp, c * cp, sp];
    this.toward = [s * sp, -c * sp, cp];
  }

  /** Chooses the scale and the center so that all corners of the box are in the window. */
  fitToWindow() {
    Object.assign(this, { pixelsPerMetre: 1, middle: [0, 0] });
    const low = [Infinity, Infinity];
    const high = [-Infinity, -Infinity];
    for (let corner = 0; corner < 8; corner++) {
      const at = this.box.low.map((value, axis) => (corner & (1 << axis) ? this.box.high[axis] : value));
      const seen = this.project(...at, [0, 0, 0]);
      const offsets = [seen[0] - this.width / 2 - this.shift[0], this.height / 2 + this.shift[1] - seen[1]];
      offsets.forEach((value, axis) => {
        low[axis] = Math.min(low[axis], value);
        high[axis] = Math.max(high[axis], value);
      });
    }
    const extent = high.map((value, axis) => Math.max(value - low[axis], 1)); // the box around one agent has no extent
    this.pixelsPerMetre = Math.min(this.width / extent[0], this.height / extent[1]) / MARGIN;
    this.middle = high.map((value, axis) => (value + low[axis]) / 2);
  }

  /** Writes x and y in pixels, and pixels per metre at that depth, to `out`. */
  project(x, y, z, out) {
    const dx = x - this.center[0];
    const dy = y - this.center[1];
    const dz = z - this.center[2];
    const { right, up, toward } = this;
    const depth = toward[0] * dx + toward[1] * dy + toward[2] * dz;
    const nearness = this.isSpatial ? this.eye / Math.max(this.eye - depth, 1e-3) : 1;
    const scale = this.pixelsPerMetre * nearness;
    const across = nearness * (right[0] * dx + right[1] * dy + right[2] * dz) - this.middle[0];
    const upward = nearness * (up[0] * dx + up[1] * dy + up[2] * dz) - this.middle[1];
    out[0] = this.width / 2 + this.shift[0] + this.pixelsPerMetre * across;
    out[1] = this.height / 2 + this.shift[1] - this.pixelsPerMetre * upward;
    out[2] = scale;
    return out;
  }

  /** Position in m of a pixel, on a plane. */
  unproject(x, y) {
    return [
      this.center[0] + (x - this.width / 2 - this.shift[0]) / this.pixelsPerMetre,
      this.center[1] - (y - this.height / 2 - this.shift[1]) / this.pixelsPerMetre,
    ];
  }
}

const STRAY = 0.005; // share of the agents at either end of an axis that may leave the window
const ROOM = 6; // m around the agents
const EASE = 5; // 1/s

/** The box {low, high} in m that a camera shows: all flocks at one time. Its ends move smoothly. */
class Window {
  box = null;

  /** Moves for some seconds toward the flocks at a time, and returns the box. */
  follow(runs, time, seconds) {
    const ends = runs.map((run) => endsAt(run, frameAt(run, time).step));
    const pick = (name, choose) => [0, 1, 2].map((axis) => choose(...ends.map((end) => end[name][axis])));
    const goal = { low: pick("low", Math.min), high: pick("high", Math.max) };
    const share = this.box ? 1 - Math.exp(-EASE * seconds) : 1;
    const mix = (from, to) => from.map((end, axis) => end + share * (to[axis] - end));
    const { low, high } = this.box ?? goal;
    this.box = { low: mix(low, goal.low), high: mix(high, goal.high) };
    return this.box;
  }
}

/** The ends of a flock and its predators at a frame, along three axes. */
function endsAt({ positions, predators, numAgents, numPredators, dimension, document }, step) {
  const low = [0, 0, 0];
  const high = [0, 0, 0];
  const reach = document.randomization.length ? ROOM : Math.min(Math.max(document.predator_range, ROOM), 60);
  const skipped = Math.floor(STRAY * numAgents);
  for (let axis = 0; axis < dimension; axis++) {
    const along = (column, count) =>
      Float32Array.from({ length: count }, (_, at) => column[(step * count + at) * dimension + axis]).sort();
    const values = along(positions, numAgents);
    const places = [...along(predators, numPredators)];
    low[axis] = Math.min(values[skipped] - ROOM, ...places.map((place) => place - reach));
    high[axis] = Math.max(values[numAgents - 1 - skipped] + ROOM, ...places.map((place) => place + reach));
  }
  return { low, high };
}

/** Connects the camera to dragging, two fingers, ctrl + wheel and the keys of a canvas. */
function bindCamera(canvas, camera, redraw) {
  const fingers = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, ({ pointerId }) => fingers.delete(pointerId));
  }
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before || canvas.classList.contains("grabbed")) return; // the finger holds the predator
    const now = [event.offsetX, event.offsetY];
    const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
    if (other) {
      const apart = ([x, y]) => Math.hypot(x - other[0], y - other[1]) || 1;
      camera.zoom(apart(now) / apart(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
    } else camera.drag(now[0] - before[0], now[1] - before[1]);
    fingers.set(event.pointerId, now);
    redraw();
  });
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (!event.ctrlKey && !event.metaKey) return; // scrolls the page
      event.preventDefault();
      camera.zoom(Math.exp(-event.deltaY / 300), event.offsetX, event.offsetY);
      redraw();
    },
    { passive: false },
  );
  const middle = () => [canvas.clientWidth / 2, canvas.clientHeight / 2];
  const keys = {
    "+": () => camera.zoom(1.25, ...middle()),
    "-": () => camera.zoom(0.8, ...middle()),
    0: () => camera.reset(),
    ArrowLeft: () => camera.drag(30, 0),
    ArrowRight: () => camera.drag(-30, 0),
    ArrowUp: () => camera.drag(0, 30),
    ArrowDown: () => camera.drag(0, -30),
  };
  canvas.addEventListener("keydown", (event) => {
    if (!(event.key in keys) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation(); // the arrows step through time elsewhere
    keys[event.key]();
    redraw();
  });
}
