// Draws the mean distance to the predator over time, and its lowest value so far.

import { prepare, segment } from "./draw.js";

const FONT = "11px system-ui, sans-serif";
const [LEFT, RIGHT, TOP, BOTTOM] = [30, 8, 8, 20]; // pixels around the plot

export function drawCurve(canvas, run, theme) {
  const { context, width, height } = prepare(canvas);
  const { num_steps: numSteps, time_step: timeStep } = run.world.document;
  const highest = run.means.reduce((a, b) => Math.max(a, b), 120);
  const most = 50 * Math.ceil(highest / 50);
  const x = (step) => LEFT + (step / numSteps) * (width - LEFT - RIGHT);
  const y = (distance) => height - BOTTOM - (distance / most) * (height - TOP - BOTTOM);

  context.font = FONT;
  context.fillStyle = theme.muted;
  context.textAlign = "right";
  context.textBaseline = "middle";
  context.beginPath();
  for (let distance = 0; distance <= most; distance += 50) {
    segment(context, [LEFT, y(distance)], [width - RIGHT, y(distance)]);
    context.fillText(String(distance), LEFT - 6, y(distance));
  }
  context.lineWidth = 1;
  context.strokeStyle = theme.line;
  context.stroke();
  context.textBaseline = "alphabetic";
  for (let time = 0; time <= numSteps * timeStep + 1e-9; time += 3) {
    context.textAlign = time === 0 ? "left" : "center";
    const label = time + 3 > numSteps * timeStep ? `${time} s` : String(time);
    if (time + 3 > numSteps * timeStep) context.textAlign = "right";
    context.fillText(label, x(time / timeStep), height - 5);
  }

  const trace = (values, color, dash) => {
    context.beginPath();
    values.forEach((value, step) => context.lineTo(x(step), y(value)));
    context.setLineDash(dash);
    context.lineWidth = 2;
    context.strokeStyle = color;
    context.stroke();
    context.setLineDash([]);
  };
  trace(run.lowest, theme.predator, [4, 3]);
  trace(run.means, theme.ink, []);
  context.beginPath();
  context.arc(x(run.means.length - 1), y(run.means.at(-1)), 3.5, 0, 2 * Math.PI);
  context.fillStyle = theme.ink;
  context.fill();
}
