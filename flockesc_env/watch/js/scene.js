"use strict";

// Draws one run at one time onto a canvas.

const NUMBER_FONT = "bold 16px system-ui, sans-serif";

/** Returns the shortest offset along an axis in a periodic domain, or the offset itself if `side` is null. */
function shortest(offset, side) {
  return side === null || Math.abs(offset) <= side / 2 ? offset : offset - side * Math.round(offset / side);
}

class Scene {
  constructor(canvas, camera) {
    this.canvas = canvas;
    this.camera = camera;
    this.context = canvas.getContext("2d");
    this.rival = null; // the run of the best single range on the same flock, whose ring is dotted
  }

  setRun(run) {
    this.run = run;
    this.points = new Float32Array(3 * run.numAgents); // projected: x, y, pixels per metre
    this.marks = new Float32Array(2 * run.numAgents); // projected headings, in units of a mark's length
  }

  /** `look`: what is drawn (`asking`, `chosen`, `target`, ..) and the colors of the theme. */
  draw(time, look) {
    const { canvas, camera, context, run } = this;
    const density = window.devicePixelRatio || 1;
    const [width, height] = (this.size ??= [canvas.clientWidth, canvas.clientHeight]); // reading them lays out the page
    if (canvas.width !== Math.round(width * density) || canvas.height !== Math.round(height * density)) {
      canvas.width = Math.round(width * density);
      canvas.height = Math.round(height * density);
    }
    camera.resize(width, height);
    context.setTransform(density, 0, 0, density, 0, 0);
    context.clearRect(0, 0, width, height);
    this.look = look;
    this.moment = frameAt(run, time);
    this.alive = aliveAt(run, this.moment.step);
    this.projectAgents();
    drawGround(context, camera, look.theme);
    this.drawPredators();
    if (camera.isSpatial) this.drawShadows();
    this.drawCaught();
    const byColor = this.agentsByColor();
    this.drawAgents(byColor);
    if (!look.asking) this.drawRings();
    else if (look.asking.range !== null) this.drawChosen(this.guessOf(look.asking.range));
    if (look.chosen?.run === run) this.drawChosen(look.chosen);
    if (look.target) this.drawTarget(look.target);
    if (look.invitation && run.isLive) this.drawInvitation(look.invitation);
    drawScaleBar(context, camera, look.theme);
  }

  /** Interpolates point `index` of a column between two steps and writes its projection to `out`. */
  projectBetween(column, count, index, step, share, out) {
    const { dimension, last, document } = this.run;
    const here = (step * count + index) * dimension;
    const next = step < last ? here + count * dimension : here;
    const at = (axis) =>
      column[here + axis] + share * shortest(column[next + axis] - column[here + axis], document.periodic_side);
    return this.camera.project(at(0), at(1), dimension === 3 ? at(2) : 0, out);
  }

  projectAgents() {
    const { camera, points, marks, moment } = this;
    const { positions, headings, numAgents, dimension } = this.run;
    const { right, up } = camera;
    const out = [0, 0, 0];
    for (let agent = 0; agent < numAgents; agent++) {
      points.set(this.projectBetween(positions, numAgents, agent, moment.step, moment.share, out), 3 * agent);
      const at = (moment.step * numAgents + agent) * dimension;
      const [x, y, z] = [headings[at], headings[at + 1], dimension === 3 ? headings[at + 2] : 0];
      marks[2 * agent] = (right[0] * x + right[1] * y + right[2] * z) / 127;
      marks[2 * agent + 1] = -(up[0] * x + up[1] * y + up[2] * z) / 127;
    }
  }

  /** Lists of agents by color: setting a color is slow, and one path can hold many marks. */
  agentsByColor() {
    const { run, look, moment } = this;
    const lists = new Map();
    const colorOf = look.asking ? () => look.theme.muted : look.theme.colorOf; // before a flight no color answers
    for (const agent of this.alive) {
      const color = colorOf(rangeOf(run, moment.step, agent));
      if (!lists.has(color)) lists.set(color, []);
      lists.get(color).push(agent);
    }
    return [...lists];
  }

  /** Draws a dot where each agent was caught. */
  drawCaught() {
    const { context, run, points, moment, look } = this;
    context.fillStyle = look.theme.ink;
    context.globalAlpha = 0.4;
    for (let agent = 0; agent < run.numAgents; agent++) {
      const [x, y] = points.subarray(3 * agent, 3 * agent + 2);
      if (isCaught(run, moment.step, agent)) context.fillRect(x - 1.5, y - 1.5, 3, 3);
    }
    context.globalAlpha = 1;
  }

  drawAgents(byColor) {
    const { context, points, marks, camera } = this;
    const size = Math.min(Math.max(3 * camera.pixelsPerMetre, 6.5), 11);
    for (const [color, agents] of byColor) {
      context.beginPath();
      for (const agent of agents) {
        const [x, y, scale] = points.subarray(3 * agent, 3 * agent + 3);
        const [ux, uy] = marks.subarray(2 * agent, 2 * agent + 2);
        dart(context, x, y, ux, uy, (size * scale) / camera.pixelsPerMetre);
      }
      context.fillStyle = color;
      context.fill();
    }
  }

  /** Draws a dot on the floor below every agent. */
  drawShadows() {
    const { context, camera, look, moment } = this;
    const { positions, numAgents } = this.run;
    const out = [0, 0, 0];
    context.fillStyle = look.theme.ink;
    context.globalAlpha = 0.18;
    for (const agent of this.alive) {
      const at = 3 * (moment.step * numAgents + agent);
      camera.project(positions[at], positions[at + 1], camera.box.low[2], out);
      context.fillRect(out[0] - 1, out[1] - 1, 2, 2);
    }
    context.globalAlpha = 1;
  }

  /** Draws an agent's range and lines to the agents that it hears. */
  drawChosen({ agent, heard, range }) {
    const { context, points, run, look } = this;
    const [x, y, scale] = points.subarray(3 * agent, 3 * agent + 3);
    context.strokeStyle = look.theme.ink;
    context.lineWidth = 1;
    context.beginPath();
    for (const other of heard) {
      context.moveTo(x, y);
      context.lineTo(points[3 * other], points[3 * other + 1]);
    }
    context.globalAlpha = 0.5;
    context.stroke();
    context.globalAlpha = 1;
    context.lineWidth = 1.5;
    context.beginPath();
    context.arc(x, y, 9, 0, 2 * Math.PI);
    if (run.rangeUnit === "m") {
      context.moveTo(x + range * scale, y);
      context.arc(x, y, range * scale, 0, 2 * Math.PI);
    }
    context.stroke();
    if (look.asking) this.drawNumber(`${range} m`, x, Math.max(y - range * scale, 20), look.theme.ink);
  }

  drawNumber(text, x, y, color) {
    label(this.context, text, x, y, color, NUMBER_FONT, this.look.theme);
  }

  /** Says that the reader can take the predator. */
  drawInvitation(text) {
    const [x, y] = this.predatorPixels(0);
    this.drawTarget(this.camera.unproject(x, y), 18);
    const middle = Math.min(Math.max(x, 80), this.camera.width - 80);
    this.drawNumber(text, middle, y + (y < this.camera.height - 50 ? 34 : -34), this.look.theme.predator);
  }

  /** Draws a circle of some pixels, for example where the reader points. */
  drawTarget(target, radius = 7) {
    const { context, camera, look } = this;
    const [x, y] = camera.project(...target, 0, [0, 0, 0]);
    context.lineWidth = 1.5;
    context.strokeStyle = look.theme.predator;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.stroke();
  }

  /**
   * Draws the lowest mean distance so far as a ring around the predator, with its number, and the present one as a
   * hairline. The dotted ring is the lowest mean distance of the best single range.
   */
  drawRings() {
    const { context, run, rival, moment, look, camera } = this;
    if (run.numPredators !== 1 || run.document.periodic_side !== null) return;
    const [x, y, scale] = this.predatorPixels(0);
    const ring = (distance, color, width, dash = []) => {
      context.strokeStyle = color;
      context.lineWidth = width;
      context.setLineDash(dash);
      context.beginPath();
      context.arc(x, y, distance * scale, 0, 2 * Math.PI);
      context.stroke();
      context.setLineDash([]);
    };
    const [lowest, color] = [run.lowestMean[moment.step], look.theme.runs[run.color]];
    if (!Number.isFinite(lowest)) return;
    ring(run.meanDistance[moment.step], color, 0.75);
    if (rival) ring(rival.lowestMean[Math.min(moment.step, rival.last)], look.theme.ink, 1.5, [2, 5]);
    ring(lowest, color, 2.5);
    const radius = lowest * scale;
    const sides = [[x, y + radius], [x + radius, y], [x, y - radius], [x - radius, y]];
    const isInside = ([at, height]) => at > 30 && at < camera.width - 30 && height > 16 && height < camera.height - 16;
    const side = sides.find(isInside);
    if (side) this.drawNumber(`${lowest.toFixed(0)} m`, ...side, color);
  }

  /** The agent in the middle of the flock and those that it would hear: what a range means. */
  guessOf(range) {
    const { points, run, alive: agents } = this;
    const mean = [0, 1].map((axis) => agents.reduce((sum, agent) => sum + points[3 * agent + axis], 0) / agents.length);
    const toMiddle = (agent) => Math.hypot(points[3 * agent] - mean[0], points[3 * agent + 1] - mean[1]);
    const agent = agents.reduce((a, b) => (toMiddle(b) < toMiddle(a) ? b : a));
    return { agent, range, heard: run.heardBy(agent, 0, range) };
  }

  /** The agent nearest to a pixel, or null if none is near. */
  agentAt(x, y) {
    const { points, alive } = this;
    let [nearest, found] = [16, null]; // pixels
    for (const agent of alive) {
      const distance = Math.hypot(points[3 * agent] - x, points[3 * agent + 1] - y);
      if (distance < nearest) [nearest, found] = [distance, agent];
    }
    return found;
  }

  /** Pixels of a predator, and pixels per metre there. */
  predatorPixels(predator, step = this.moment.step, share = this.moment.share) {
    const { predators, numPredators } = this.run;
    return this.projectBetween(predators, numPredators, predator, step, share, [0, 0, 0]);
  }

  /** Whether a predator is within some pixels of a pixel. */
  isPredatorNear(x, y, pixels) {
    const places = Array.from({ length: this.run.numPredators }, (_, predator) => this.predatorPixels(predator));
    return places.some((place) => Math.hypot(place[0] - x, place[1] - y) <= pixels);
  }

  drawPredators() {
    const { context, run, moment, look, camera } = this;
    const { numPredators, document } = run;
    for (let predator = 0; predator < numPredators; predator++) {
      const project = (step, share) => this.predatorPixels(predator, step, share);
      const [x, y, scale] = project(moment.step, moment.share);
      context.fillStyle = context.strokeStyle = look.theme.predator;
      context.beginPath();
      // Some scenarios draw the range at random for every seed.
      if (document.randomization.length === 0) context.arc(x, y, document.predator_range * scale, 0, 2 * Math.PI);
      context.globalAlpha = 0.1;
      context.fill();
      context.globalAlpha = 0.45;
      context.lineWidth = 1;
      context.stroke();
      context.beginPath();
      for (let step = 0; step <= moment.step; step++) context.lineTo(...project(step, 0).slice(0, 2));
      context.lineTo(x, y);
      context.globalAlpha = 0.7;
      context.lineWidth = 1.5;
      context.stroke();
      context.globalAlpha = 1;
      const from = project(Math.max(moment.step - 1, 0), 0);
      const to = project(Math.min(Math.max(moment.step, 1), run.last), 0);
      const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
      const length = Math.hypot(dx, dy);
      context.beginPath();
      const size = (13 * scale) / camera.pixelsPerMetre;
      dart(context, x, y, length ? dx / length : 1, length ? dy / length : 0, size);
      context.fill();
    }
  }
}

/** Adds a mark along (ux, uy) to a path to fill, which closes it; it is shorter the more it points at the viewer. */
function dart(context, x, y, ux, uy, length) {
  const across = Math.hypot(ux, uy) || 1;
  const [wx, wy] = [(-uy / across) * 0.42 * length, (ux / across) * 0.42 * length];
  const [dx, dy] = [ux * length, uy * length];
  context.moveTo(x + 0.75 * dx, y + 0.75 * dy);
  context.lineTo(x - 0.5 * dx + wx, y - 0.5 * dy + wy);
  context.lineTo(x - 0.25 * dx, y - 0.25 * dy);
  context.lineTo(x - 0.5 * dx - wx, y - 0.5 * dy - wy);
}
