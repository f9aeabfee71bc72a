// Draws a run: agents colored by the range to which they listen, their trails, and the predators.

const FONT = "11px system-ui, sans-serif";

/** Fits the pixels of a canvas to its size in the page; returns its context and that size. */
export function prepare(canvas) {
  const density = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const [wide, high] = [Math.round(width * density), Math.round(height * density)];
  if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
  const context = canvas.getContext("2d");
  context.setTransform(density, 0, 0, density, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

/** Draws a run between its last two states; at `share` 1 the last one. `target`: where the reader points. */
export function drawRun(canvas, camera, run, share, theme, target) {
  const { context, width, height } = prepare(canvas);
  camera.resize(width, height);
  if (camera.isSpatial) drawCube(context, camera, run, theme);
  else drawGrid(context, camera, theme);
  const points = agentPoints(camera, run, share);
  drawCaught(context, run, points, theme);
  const groups = agentsByColor(run, theme);
  drawTrails(context, camera, run, groups, points);
  drawAgents(context, camera, run, groups, points);
  drawPredators(context, camera, run, share, theme);
  if (target) drawTarget(context, camera.project(target), theme);
  drawScale(context, camera, theme);
}

function between(before, after, share) {
  return after.map((value, at) => before[at] + share * (value - before[at]));
}

function agentPoints(camera, { trail, numAgents, world }, share) {
  const positions = between(trail.at(-2) ?? trail.at(-1), trail.at(-1), share);
  return Array.from({ length: numAgents }, (_, agent) =>
    camera.project(camera.flatten(positions, agent * world.dimension)),
  );
}

/** Lists of agents by color. The scale is fixed: 0 to the largest range, with square roots as on the slider. */
function agentsByColor(run, theme) {
  const groups = new Map();
  for (let agent = 0; agent < run.numAgents; agent++) {
    if (run.caught.has(agent)) continue;
    const share = Math.min(Math.sqrt(run.ranges[agent] / run.world.maxRange), 1);
    const color = theme.ramp[Math.round(63 * share)];
    if (!groups.has(color)) groups.set(color, []);
    groups.get(color).push(agent);
  }
  return groups;
}

function drawTrails(context, camera, run, groups, points) {
  context.lineWidth = 1;
  context.globalAlpha = 0.3;
  for (const [color, agents] of groups) {
    context.beginPath();
    for (const agent of agents) {
      context.moveTo(...points[agent]);
      for (let at = run.trail.length - 2; at >= 0; at--) {
        context.lineTo(...camera.project(camera.flatten(run.trail[at], agent * run.world.dimension)));
      }
    }
    context.strokeStyle = color;
    context.stroke();
  }
  context.globalAlpha = 1;
}

function drawAgents(context, camera, run, groups, points) {
  const { dimension } = run.world;
  const length = Math.min(Math.max(3 * camera.scale, 7), 12);
  for (const [color, agents] of groups) {
    context.beginPath();
    for (const agent of agents) {
      dart(context, points[agent], camera.flatten(run.velocities, agent * dimension), length);
    }
    context.fillStyle = color;
    context.fill();
  }
}

function drawPredators(context, camera, run, share, theme) {
  const { dimension, document } = run.world;
  const now = between(run.before, run.predators, share);
  const isFeltKnown = document.randomization.length === 0;
  for (let at = 0; at < run.numPredators; at++) {
    const point = camera.project(camera.flatten(now, at * dimension));
    context.beginPath();
    dart(context, point, camera.flatten(now, (run.numPredators + at) * dimension), 24);
    context.fillStyle = theme.predator;
    context.strokeStyle = theme.ground;
    context.lineWidth = 1.5;
    context.fill();
    context.stroke();
    if (!isFeltKnown) continue;
    context.beginPath();
    context.arc(...point, document.predator_range * camera.scale, 0, 2 * Math.PI);
    context.setLineDash([3, 5]);
    context.lineWidth = 1.25;
    context.strokeStyle = theme.predator;
    context.stroke();
    context.setLineDash([]);
  }
}

/** Adds an arrowhead around a point, which flies along a vector in m, rightward and upward. */
function dart(context, [x, y], [right, up], length) {
  const size = Math.hypot(right, up);
  const [a, b] = size > 0 ? [(right / size) * length, (-up / size) * length] : [length / 2, 0];
  context.moveTo(x + 0.6 * a, y + 0.6 * b);
  context.lineTo(x - 0.4 * a - 0.32 * b, y - 0.4 * b + 0.32 * a);
  context.lineTo(x - 0.2 * a, y - 0.2 * b);
  context.lineTo(x - 0.4 * a + 0.32 * b, y - 0.4 * b - 0.32 * a);
  context.closePath();
}

function drawCaught(context, run, points, theme) {
  context.beginPath();
  for (const agent of run.caught) {
    const [x, y] = points[agent];
    segment(context, [x - 2.5, y - 2.5], [x + 2.5, y + 2.5]);
    segment(context, [x - 2.5, y + 2.5], [x + 2.5, y - 2.5]);
  }
  context.lineWidth = 1;
  context.strokeStyle = theme.frame;
  context.stroke();
}

function drawTarget(context, [x, y], theme) {
  context.beginPath();
  context.arc(x, y, 7, 0, 2 * Math.PI);
  segment(context, [x - 11, y], [x - 3, y]);
  segment(context, [x + 3, y], [x + 11, y]);
  segment(context, [x, y - 11], [x, y - 3]);
  segment(context, [x, y + 3], [x, y + 11]);
  context.lineWidth = 1.5;
  context.strokeStyle = theme.predator;
  context.stroke();
}

/** Draws lines every 50 m. */
function drawGrid(context, camera, theme) {
  const { width, height } = camera;
  const [left, top] = camera.unproject(0, 0);
  const [right, bottom] = camera.unproject(width, height);
  context.beginPath();
  for (let x = 50 * Math.ceil(left / 50); x <= right; x += 50) {
    const [at] = camera.project([x, 0]);
    segment(context, [at, 0], [at, height]);
  }
  for (let y = 50 * Math.ceil(bottom / 50); y <= top; y += 50) {
    const [, at] = camera.project([0, y]);
    segment(context, [0, at], [width, at]);
  }
  context.lineWidth = 1;
  context.strokeStyle = theme.grid;
  context.stroke();
}

/** Draws the edges of the cube in which agents start. */
function drawCube(context, camera, { world }, theme) {
  const side = world.document.initial_side;
  const corner = (index) => [index & 1, (index >> 1) & 1, index >> 2].map((bit) => bit * side);
  const pixel = (index) => camera.project(camera.flatten(corner(index), 0));
  context.beginPath();
  for (let index = 0; index < 8; index++) {
    for (const bit of [1, 2, 4]) if (!(index & bit)) segment(context, pixel(index), pixel(index | bit));
  }
  context.lineWidth = 1;
  context.strokeStyle = theme.line;
  context.stroke();
}

function drawScale(context, camera, theme) {
  const length = camera.width < 500 ? 20 : 50; // m
  const right = camera.width - 14;
  const left = right - length * camera.scale;
  const y = camera.height - 14;
  context.beginPath();
  for (const x of [left, right]) segment(context, [x, y - 4], [x, y + 4]);
  segment(context, [left, y], [right, y]);
  context.lineWidth = 1.5;
  context.strokeStyle = context.fillStyle = theme.ink;
  context.stroke();
  context.font = FONT;
  context.textAlign = "center";
  context.fillText(`${length} m`, (left + right) / 2, y - 7);
}

export function segment(context, from, to) {
  context.moveTo(...from);
  context.lineTo(...to);
}
