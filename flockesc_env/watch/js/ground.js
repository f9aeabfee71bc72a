"use strict";

// The background of a scene: a grid in a plane, a floor in space, and a scale bar.

const LABEL_FONT = "11px system-ui, sans-serif";

/** The largest of 1, 2 or 5 times a power of ten that is at most a length. */
function roundBelow(length) {
  const power = 10 ** Math.floor(Math.log10(length));
  return [5, 2, 1].find((digit) => digit * power <= length) * power;
}

/** A multiple of a spacing, rounded to remove floating-point error. */
function rounded(value) {
  return String(Number(value.toPrecision(9)));
}

function drawGround(context, camera, theme) {
  context.lineWidth = 1;
  context.strokeStyle = camera.isSpatial ? theme.line : theme.grid;
  if (camera.isSpatial) drawFloor(context, camera);
  else drawGrid(context, camera);
}

/** Writes a text around a point, on a strip of the ground. */
function label(context, text, x, y, color, font, theme) {
  Object.assign(context, { font, fillStyle: theme.ground, globalAlpha: 0.85, textAlign: "center" });
  const width = context.measureText(text).width + 6;
  context.fillRect(x - width / 2, y - 10, width, 20);
  Object.assign(context, { fillStyle: color, globalAlpha: 1, textBaseline: "middle" });
  context.fillText(text, x, y);
}

function multiples(low, high, spacing) {
  const first = Math.ceil(low / spacing);
  return Array.from({ length: Math.floor(high / spacing) - first + 1 }, (_, at) => (first + at) * spacing);
}

function drawGrid(context, camera) {
  const { width, height } = camera;
  const spacing = roundBelow(110 / camera.pixelsPerMetre);
  const [left, top] = camera.unproject(0, 0);
  const [right, bottom] = camera.unproject(width, height);
  const out = [0, 0, 0];
  for (const column of multiples(left, right, spacing)) {
    const [x] = camera.project(column, 0, 0, out);
    line(context, x, 0, x, height);
  }
  for (const row of multiples(bottom, top, spacing)) {
    const [, y] = camera.project(0, row, 0, out);
    line(context, 0, y, width, y);
  }
}

function drawFloor(context, camera) {
  const { low, high } = camera.box;
  const spacing = roundBelow(110 / camera.pixelsPerMetre);
  const [x0, x1, y0, y1] = [low[0], high[0], low[1], high[1]].map(
    (value, at) => (at % 2 ? Math.ceil(value / spacing) : Math.floor(value / spacing)) * spacing,
  );
  const between = (from, to) => {
    const [ax, ay] = camera.project(...from, low[2], [0, 0, 0]);
    const [bx, by] = camera.project(...to, low[2], [0, 0, 0]);
    line(context, ax, ay, bx, by);
  };
  for (const x of multiples(x0, x1, spacing)) between([x, y0], [x, y1]);
  for (const y of multiples(y0, y1, spacing)) between([x0, y], [x1, y]);
}

/** In space, the scale bar is right at the depth of the center. */
function drawScaleBar(context, camera, theme) {
  const length = roundBelow(120 / camera.pixelsPerMetre);
  const right = camera.width - 14;
  const left = right - length * camera.pixelsPerMetre;
  const y = camera.height - 14;
  context.strokeStyle = theme.ink;
  context.lineWidth = 1.5;
  for (const x of [left, right]) line(context, x, y - 4, x, y + 4);
  line(context, left, y, right, y);
  label(context, `${rounded(length)} m`, (left + right) / 2, y - 11, theme.ink, LABEL_FONT, theme);
}

function line(context, x0, y0, x1, y1) {
  context.beginPath();
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
  context.stroke();
}
