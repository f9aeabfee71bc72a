// The camera: sees a plane from above, and space from the side without perspective. It follows the flock.

const MARGIN = 12; // m around what is shown
const SHARE_OUTSIDE = 0.005; // of the agents at either end of an axis, which may leave the window
const EASE = 5; // 1/s

export class Camera {
  constructor(dimension) {
    this.isSpatial = dimension === 3;
    const [yaw, pitch] = this.isSpatial ? [-0.6, 1.1] : [0, 0];
    const [c, s, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
    this.right = [c, s, 0];
    this.up = [-s * cp, c * cp, sp];
    this.toward = [s * sp, -c * sp, cp];
    this.goal = null;
    this.box = null;
  }

  /** Coordinates on the screen in m: rightward and upward. */
  flatten(points, at) {
    if (!this.isSpatial) return [points[at], points[at + 1]];
    const along = ([x, y, z]) => x * points[at] + y * points[at + 1] + z * points[at + 2];
    return [along(this.right), along(this.up)];
  }

  /** Widens the window so that it shows the flock and the predators of a run. It never narrows. */
  include(run) {
    const { dimension } = run.world;
    const positions = run.trail.at(-1);
    const agents = Array.from({ length: run.numAgents }, (_, agent) => this.flatten(positions, agent * dimension));
    const predators = Array.from({ length: run.numPredators }, (_, at) => this.flatten(run.predators, at * dimension));
    const box = [0, 1].map((axis) => {
      const sorted = agents.map((point) => point[axis]).sort((a, b) => a - b);
      const skipped = Math.floor(SHARE_OUTSIDE * sorted.length);
      const ends = [sorted[skipped], sorted.at(-1 - skipped), ...predators.map((point) => point[axis])];
      const old = this.goal?.[axis] ?? [Infinity, -Infinity];
      return [Math.min(old[0], Math.min(...ends) - MARGIN), Math.max(old[1], Math.max(...ends) + MARGIN)];
    });
    this.goal = box;
    this.box ??= box;
  }

  /** Moves toward the window that is wanted, for some seconds. */
  follow(seconds) {
    const share = 1 - Math.exp(-EASE * seconds);
    this.box = this.box.map((ends, axis) => ends.map((end, at) => end + share * (this.goal[axis][at] - end)));
  }

  resize(width, height) {
    Object.assign(this, { width, height });
    const [[left, right], [low, high]] = this.box;
    this.scale = Math.min(width / (right - left), height / (high - low)); // pixels per m
    this.middle = [(left + right) / 2, (low + high) / 2];
  }

  /** Pixels of a point on the screen in m. */
  project([x, y]) {
    return [
      this.width / 2 + this.scale * (x - this.middle[0]),
      this.height / 2 - this.scale * (y - this.middle[1]),
    ];
  }

  /** The point of the plane in m at a pixel. */
  unproject(x, y) {
    return [
      this.middle[0] + (x - this.width / 2) / this.scale,
      this.middle[1] - (y - this.height / 2) / this.scale,
    ];
  }
}
