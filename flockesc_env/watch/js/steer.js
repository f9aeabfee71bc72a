"use strict";

// Steers learned predators toward a point of the plane.

const NEAR = 5; // m: closer to the point the predator slows down

/** Returns the actions, accelerations ahead and left in [-1, 1], of all learned predators of a run. */
function actionsToward({ flight, flock, numPredators, timeStep }, target) {
  const { predators } = flock; // positions, then velocities
  const actions = new Float64Array(2 * numPredators);
  if (!target) return actions; // they fly straight on
  for (let at = 0; at < 2 * numPredators; at += 2) {
    const velocity = [predators[2 * numPredators + at], predators[2 * numPredators + at + 1]];
    const { max_acceleration: maxAcceleration, max_speed: maxSpeed } = flight.limits[at / 2];
    const way = [target[0] - predators[at], target[1] - predators[at + 1]];
    const distance = norm(way) || 1e-9;
    const speed = maxSpeed * Math.min(1, distance / NEAR);
    const change = way.map((part, axis) => (speed * part) / distance - velocity[axis]);
    const size = Math.max(maxAcceleration * timeStep, norm(change));
    const [x, y] = headingOf(velocity, maxSpeed) ?? towardNearest(flock, [predators[at], predators[at + 1]]);
    const bounded = (value) => Math.min(Math.max(value / size, -1), 1);
    actions[at] = bounded(x * change[0] + y * change[1]);
    actions[at + 1] = bounded(x * change[1] - y * change[0]);
  }
  return actions;
}

/** Unlike `Math.hypot`, the same bits in every browser, so that a link replays the same flock. */
function norm([x, y]) {
  return Math.sqrt(x * x + y * y);
}

function headingOf(velocity, maxSpeed) {
  const speed = norm(velocity);
  return speed < 1e-9 * maxSpeed ? null : velocity.map((part) => part / speed);
}

/** The direction that a predator at rest has in the model: toward the nearest agent. */
function towardNearest({ positions, caught }, [x, y]) {
  let [nearest, way] = [Infinity, [1, 0]];
  for (let at = 0; at < positions.length; at += 2) {
    const [dx, dy] = [positions[at] - x, positions[at + 1] - y];
    const distance = norm([dx, dy]);
    if (distance === 0 || distance >= nearest || caught.includes(at / 2)) continue;
    [nearest, way] = [distance, [dx / distance, dy / distance]];
  }
  return way;
}
