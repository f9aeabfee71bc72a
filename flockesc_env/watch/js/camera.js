"use strict";

// The view that all panels share: from above onto a plane, in perspective into space.

const TURN_PER_PIXEL = 0.008; // radians
const START_TURN = { yaw: -0.6, pitch: 1.1 }; // radians; a pitch of 0 looks straight down

class Camera {
  constructor(isSpatial) {
    this.isSpatial = isSpatial;
    this.box = null;
    this.width = this.height = 1;
    this.reset();
  }

  reset() {
    this.zoomFactor = 1;
    this.shift = [0, 0];
    this.turn = { yaw: 0, pitch: 0, ...(this.isSpatial ? START_TURN : {}) };
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

  /** Zooms so that what is under the pointer stays there. */
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
    const extent = low.map((value, axis) => Math.max(high[axis] - value, 1)); // a lone agent has none
    const diagonal = Math.hypot(...extent);
    this.eye = this.isSpatial ? 2.2 * diagonal : Infinity; // m from the center
    const fitted = this.isSpatial
      ? Math.min(this.width / (0.85 * diagonal), this.height / (0.68 * diagonal))
      : Math.min(this.width / (1.06 * extent[0]), this.height / (1.12 * extent[1]));
    this.pixelsPerMetre = fitted * this.zoomFactor;
    const { yaw, pitch } = this.turn;
    const [c, s, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
    this.right = [c, s, 0];
    this.up = [-s * cp, c * cp, sp];
    this.toward = [s * sp, -c * sp, cp];
  }

  /** Writes x and y in pixels, and pixels per metre at that depth, to `out`. */
  project(x, y, z, out) {
    const dx = x - this.center[0];
    const dy = y - this.center[1];
    const dz = z - this.center[2];
    const { right, up, toward } = this;
    const depth = toward[0] * dx + toward[1] * dy + toward[2] * dz;
    const scale = this.pixelsPerMetre * (this.isSpatial ? this.eye / Math.max(this.eye - depth, 1e-3) : 1);
    out[0] = this.width / 2 + this.shift[0] + scale * (right[0] * dx + right[1] * dy + right[2] * dz);
    out[1] = this.height / 2 + this.shift[1] - scale * (up[0] * dx + up[1] * dy + up[2] * dz);
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

/** The box around everything that happens in some runs; `box` is made larger where it is given. */
function boxAround(runs, box = { low: [0, 0, 0].fill(Infinity), high: [0, 0, 0].fill(-Infinity) }) {
  const [low, high] = [[...box.low], [...box.high]];
  for (const { positions, predators, dimension } of runs) {
    for (const points of [positions, predators]) {
      for (let at = 0; at < points.length; at++) {
        const axis = at % dimension;
        if (points[at] < low[axis]) low[axis] = points[at];
        if (points[at] > high[axis]) high[axis] = points[at];
      }
    }
    if (dimension === 2) low[2] = high[2] = 0;
  }
  return { low, high };
}
