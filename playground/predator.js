// Steers learned predators toward a point of the plane.

const NEAR = 5; // m: closer to the point the predator slows down

/** Returns the actions, accelerations ahead and left in [-1, 1], of all learned predators of a run. */
export function actionsToward(run, target, limits) {
  const { predators, numPredators } = run;
  const actions = new Float64Array(2 * numPredators);
  if (!target) return actions; // they fly straight on
  for (let at = 0; at < 2 * numPredators; at += 2) {
    const position = [predators[at], predators[at + 1]];
    const velocity = [predators[2 * numPredators + at], predators[2 * numPredators + at + 1]];
    const { max_acceleration: maxAcceleration, max_speed: maxSpeed } = limits[at / 2];
    const way = [target[0] - position[0], target[1] - position[1]];
    const distance = Math.hypot(...way) || 1e-9;
    const speed = maxSpeed * Math.min(1, distance / NEAR);
    const change = way.map((part, axis) => (speed * part) / distance - velocity[axis]);
    const most = maxAcceleration * run.world.document.time_step;
    const size = Math.max(most, Math.hypot(...change));
    const [x, y] = headingOf(velocity, maxSpeed) ?? towardNearest(run, position);
    const bounded = (value) => Math.min(Math.max(value / size, -1), 1);
    actions[at] = bounded(x * change[0] + y * change[1]);
    actions[at + 1] = bounded(x * change[1] - y * change[0]);
  }
  return actions;
}

/** Maximum acceleration and speed of every learned predator in a scenario. */
export function limitsOf(scenario) {
  return JSON.parse(scenario).predators.map(({ learned }) => learned);
}

function headingOf(velocity, maxSpeed) {
  const speed = Math.hypot(...velocity);
  return speed < 1e-9 * maxSpeed ? null : velocity.map((part) => part / speed);
}

/** The direction that a predator at rest has in the model: toward the nearest agent. */
function towardNearest({ trail, caught }, [x, y]) {
  const positions = trail.at(-1);
  let [nearest, way] = [Infinity, [1, 0]];
  for (let at = 0; at < positions.length; at += 2) {
    const [dx, dy] = [positions[at] - x, positions[at + 1] - y];
    const distance = Math.hypot(dx, dy);
    if (distance === 0 || distance >= nearest || caught.has(at / 2)) continue;
    [nearest, way] = [distance, [dx / distance, dy / distance]];
  }
  return way;
}
