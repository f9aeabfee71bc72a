"use strict";

// Draws one run at one time onto a canvas.

const TRAIL = 1.0; // s of an agent's past
const DEPTHS = 5; // shades by which agents in space fade with their depth
const MAX_TRAIL_PARTS = 16000; // of all trails of the page; more are slow
const MAX_EDGES = 60000; // more are unreadable and slow

/** Returns the shortest offset along an axis in a periodic world, or the offset itself if `side` is null. */
function shortest(offset, side) {
  return side === null || Math.abs(offset) <= side / 2 ? offset : offset - side * Math.round(offset / side);
}

class Scene {
  constructor(canvas, camera) {
    this.canvas = canvas;
    this.camera = camera;
    this.context = canvas.getContext("2d");
    this.forget();
  }

  setRun(run) {
    this.run = run;
    this.forget();
    this.points = new Float32Array(3 * run.numAgents); // projected: x, y, pixels per metre
    this.marks = new Float32Array(2 * run.numAgents); // projected headings, in units of a mark's length
  }

  /** Forgets the neighbors of the last frame, for example after a change of the range. */
  forget() {
    this.edges = { step: -1, pairs: [] }; // found once per step, drawn in many frames
  }

  /** `look`: what is drawn (color, trails, edges, discs, largestRange) and the colors of the theme. */
  draw(time, look) {
    const { canvas, camera, context, run } = this;
    const density = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(width * density) || canvas.height !== Math.round(height * density)) {
      canvas.width = Math.round(width * density);
      canvas.height = Math.round(height * density);
    }
    camera.resize(width, height);
    context.setTransform(density, 0, 0, density, 0, 0);
    context.clearRect(0, 0, width, height);
    this.look = look;
    this.moment = frameAt(run, time);
    this.projectAgents();
    drawGround(context, camera, look.theme);
    this.drawPredators();
    if (camera.isSpatial) this.drawShadows();
    this.drawCaught();
    const byColor = this.agentsByColor();
    if (look.trails) this.drawTrails(byColor);
    if (look.edges && run.pairsAt) this.drawEdges();
    if (look.discs) this.drawDiscs(byColor);
    this.drawAgents(byColor);
    if (look.chosen?.run === run) this.drawChosen(look.chosen);
    if (look.target) this.drawTarget(look.target);
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
    const groups = look.color === "range" ? null : run.groups.at(moment.step);
    for (let agent = 0; agent < run.numAgents; agent++) {
      if (isCaught(run, moment.step, agent)) continue;
      // The scale has square roots, as the slider: small ranges differ more than large ones.
      const color = groups
        ? look.theme.groups[groups[agent]]
        : look.theme.ramp(Math.sqrt(rangeOf(run, moment.step, agent) / (look.largestRange || 1)));
      if (!lists.has(color)) lists.set(color, []);
      lists.get(color).push(agent);
    }
    // Agents that are alone are drawn first, so that they do not cover the components.
    const isBehind = ([color]) => color === look.theme.groups[ALONE];
    return [...lists].sort((a, b) => isBehind(b) - isBehind(a));
  }

  /** Draws a small cross where each agent was caught. */
  drawCaught() {
    const { context, run, points, moment, look } = this;
    context.beginPath();
    for (let agent = 0; agent < run.numAgents; agent++) {
      if (!isCaught(run, moment.step, agent)) continue;
      const [x, y] = [points[3 * agent], points[3 * agent + 1]];
      context.moveTo(x - 2.5, y - 2.5);
      context.lineTo(x + 2.5, y + 2.5);
      context.moveTo(x - 2.5, y + 2.5);
      context.lineTo(x + 2.5, y - 2.5);
    }
    context.lineWidth = 1;
    context.strokeStyle = look.theme.ink;
    context.globalAlpha = 0.3;
    context.stroke();
    context.globalAlpha = 1;
  }

  drawAgents(byColor) {
    const { context, points, marks, camera } = this;
    const size = Math.min(Math.max(3 * camera.pixelsPerMetre, 6.5), 11);
    const drawMarks = (color, agents) => {
      context.beginPath();
      for (const agent of agents) {
        const length = (size * points[3 * agent + 2]) / camera.pixelsPerMetre;
        dart(context, points[3 * agent], points[3 * agent + 1], marks[2 * agent], marks[2 * agent + 1], length);
      }
      context.fillStyle = color;
      context.fill();
    };
    if (!camera.isSpatial) {
      for (const [color, agents] of byColor) drawMarks(color, agents);
      return;
    }
    const depths = this.depthsOfAgents();
    for (let depth = 0; depth < DEPTHS; depth++) {
      context.globalAlpha = 0.5 + (0.5 * depth) / (DEPTHS - 1);
      for (const [color, agents] of byColor)
        drawMarks(
          color,
          agents.filter((agent) => depths[agent] === depth),
        );
    }
  }

  /** From 0 for the farthest agents to DEPTHS - 1 for the nearest, by their pixels per metre. */
  depthsOfAgents() {
    const scales = this.points.filter((_, at) => at % 3 === 2);
    const far = scales.reduce((a, b) => Math.min(a, b));
    const near = scales.reduce((a, b) => Math.max(a, b));
    return scales.map((scale) => Math.min(Math.floor((DEPTHS * (scale - far)) / (near - far || 1)), DEPTHS - 1));
  }

  /** Draws a dot on the floor below every agent. */
  drawShadows() {
    const { context, camera, look, moment } = this;
    const { positions, numAgents } = this.run;
    const out = [0, 0, 0];
    context.fillStyle = look.theme.ink;
    context.globalAlpha = 0.18;
    for (let agent = 0; agent < numAgents; agent++) {
      if (isCaught(this.run, moment.step, agent)) continue;
      const at = 3 * (moment.step * numAgents + agent);
      camera.project(positions[at], positions[at + 1], camera.box.low[2], out);
      context.fillRect(out[0] - 1, out[1] - 1, 2, 2);
    }
    context.globalAlpha = 1;
  }

  drawTrails(byColor) {
    const { context, moment } = this;
    const { positions, numAgents, timeStep } = this.run;
    const length = Math.min(
      Math.round(TRAIL / timeStep),
      Math.ceil(MAX_TRAIL_PARTS / (numAgents * this.look.numPanels)),
    );
    const first = Math.max(0, moment.step - length);
    const out = [0, 0, 0];
    context.globalAlpha = 0.35;
    context.lineWidth = 1;
    for (const [color, agents] of byColor) {
      context.beginPath();
      for (const agent of agents) {
        context.moveTo(this.points[3 * agent], this.points[3 * agent + 1]);
        for (let step = moment.step; step >= first; step--) {
          this.projectBetween(positions, numAgents, agent, step, 0, out);
          if (this.crossesBorder(agent, step)) context.moveTo(out[0], out[1]);
          else context.lineTo(out[0], out[1]);
        }
      }
      context.strokeStyle = color;
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  /** Returns whether an agent leaves a periodic world on one side and enters it on the other after a step. */
  crossesBorder(agent, step) {
    const { positions, numAgents, dimension, last, document } = this.run;
    if (document.periodic_side === null || step === last) return false;
    const here = (step * numAgents + agent) * dimension;
    const next = here + numAgents * dimension;
    for (let axis = 0; axis < dimension; axis++) {
      const moved = positions[next + axis] - positions[here + axis];
      if (shortest(moved, document.periodic_side) !== moved) return true;
    }
    return false;
  }

  drawDiscs(byColor) {
    const { context, points, run, moment } = this;
    context.lineWidth = 1;
    for (const [color, agents] of byColor) {
      context.beginPath();
      for (const agent of agents) {
        const radius = rangeOf(run, moment.step, agent) * points[3 * agent + 2];
        context.moveTo(points[3 * agent] + radius, points[3 * agent + 1]);
        context.arc(points[3 * agent], points[3 * agent + 1], radius, 0, 2 * Math.PI);
      }
      context.strokeStyle = color;
      context.globalAlpha = 0.3;
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  drawEdges() {
    const { context, points, look, moment, run } = this;
    if (this.edges.step !== moment.step) this.edges = { step: moment.step, pairs: run.pairsAt(moment.step) };
    const { pairs } = this.edges;
    if (pairs.length > 2 * MAX_EDGES) {
      context.font = LABEL_FONT;
      context.fillStyle = look.theme.ink;
      context.textAlign = "right";
      context.textBaseline = "top";
      context.fillText(`more than ${MAX_EDGES} pairs of neighbors: not drawn`, this.camera.width - 12, 10);
      return;
    }
    context.beginPath();
    for (let at = 0; at < pairs.length; at += 2) {
      context.moveTo(points[3 * pairs[at]], points[3 * pairs[at] + 1]);
      context.lineTo(points[3 * pairs[at + 1]], points[3 * pairs[at + 1] + 1]);
    }
    context.globalAlpha = Math.min(0.5, Math.max(0.08, 400 / pairs.length));
    context.lineWidth = 1;
    context.strokeStyle = look.theme.ink;
    context.stroke();
    context.globalAlpha = 1;
  }

  /** Draws an agent's range and lines to the agents that it hears. */
  drawChosen({ agent, heard }) {
    const { context, points, run, moment, look } = this;
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
      const radius = rangeOf(run, moment.step, agent) * scale;
      context.moveTo(x + radius, y);
      context.arc(x, y, radius, 0, 2 * Math.PI);
    }
    context.stroke();
  }

  /** Draws where the reader points. */
  drawTarget(target) {
    const { context, camera, look } = this;
    const [x, y] = camera.project(...target, 0, [0, 0, 0]);
    context.lineWidth = 1.5;
    context.strokeStyle = look.theme.predator;
    context.beginPath();
    context.arc(x, y, 7, 0, 2 * Math.PI);
    context.stroke();
    for (const [dx, dy] of [
      [1, 0],
      [-1, 0],
      [0, 1],
      [0, -1],
    ]) {
      line(context, x + 3 * dx, y + 3 * dy, x + 11 * dx, y + 11 * dy);
    }
  }

  /** The agent nearest to a pixel, or null if none is near. */
  agentAt(x, y) {
    const { points, run, moment } = this;
    let [nearest, found] = [16, null]; // pixels
    for (let agent = 0; agent < run.numAgents; agent++) {
      if (isCaught(run, moment.step, agent)) continue;
      const distance = Math.hypot(points[3 * agent] - x, points[3 * agent + 1] - y);
      if (distance < nearest) [nearest, found] = [distance, agent];
    }
    return found;
  }

  drawPredators() {
    const { context, run, moment, look, camera } = this;
    const { predators, numPredators, document } = run;
    for (let predator = 0; predator < numPredators; predator++) {
      const project = (step, share) => this.projectBetween(predators, numPredators, predator, step, share, [0, 0, 0]);
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
      const length = Math.hypot(to[0] - from[0], to[1] - from[1]) || 1;
      context.beginPath();
      const size = (13 * scale) / camera.pixelsPerMetre;
      dart(context, x, y, (to[0] - from[0]) / length, (to[1] - from[1]) / length, size);
      context.fill();
    }
  }
}

/** Adds a mark along (ux, uy) to the path; it is shorter the more it points at the viewer. */
function dart(context, x, y, ux, uy, length) {
  const across = Math.hypot(ux, uy) || 1;
  const [wx, wy] = [(-uy / across) * 0.42 * length, (ux / across) * 0.42 * length];
  const [dx, dy] = [ux * length, uy * length];
  context.moveTo(x + 0.75 * dx, y + 0.75 * dy);
  context.lineTo(x - 0.5 * dx + wx, y - 0.5 * dy + wy);
  context.lineTo(x - 0.25 * dx, y - 0.25 * dy);
  context.lineTo(x - 0.5 * dx - wx, y - 0.5 * dy - wy);
  context.closePath();
}
