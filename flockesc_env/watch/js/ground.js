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

/** Draws a grid up to the edges of the picture or, in space, a floor below the box of the camera. */
function drawGround(context, camera, theme) {
  const { isSpatial, box, width, height } = camera;
  context.lineWidth = 1;
  context.strokeStyle = isSpatial ? theme.line : theme.grid;
  const spacing = roundBelow(110 / camera.pixelsPerMetre);
  const whole = (corner, round) => corner.map((value) => round(value / spacing) * spacing);
  const low = isSpatial ? whole(box.low, Math.floor) : camera.unproject(0, height);
  const high = isSpatial ? whole(box.high, Math.ceil) : camera.unproject(width, 0);
  const between = (from, to) => {
    const [ax, ay] = camera.project(...from, box.low[2], [0, 0, 0]);
    const [bx, by] = camera.project(...to, box.low[2], [0, 0, 0]);
    line(context, ax, ay, bx, by);
  };
  for (const x of multiples(low[0], high[0], spacing)) between([x, low[1]], [x, high[1]]);
  for (const y of multiples(low[1], high[1], spacing)) between([low[0], y], [high[0], y]);
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
