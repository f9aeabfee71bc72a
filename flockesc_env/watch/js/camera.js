"use strict";

// The camera that all panels share: it sees a plane from above, and space in perspective.

const TURN_PER_PIXEL = 0.008; // radians
const FROM_ABOVE = { yaw: 0, pitch: 0 }; // radians
const FROM_ASIDE = { yaw: -0.6, pitch: 1.1 };
const MARGIN = 1.1; // size of the window over that of the box

class Camera {
  constructor(isSpatial) {
    this.isSpatial = isSpatial;
    this.start = isSpatial ? FROM_ASIDE : FROM_ABOVE;
    this.box = null;
    this.width = this.height = 1;
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
    const [low, high] = [[Infinity, Infinity], [-Infinity, -Infinity]];
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

/** The box around all positions of the runs and, if it is given, around `box`. */
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
