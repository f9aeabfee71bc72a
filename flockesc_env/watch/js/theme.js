"use strict";

// The colors of page.css for what is drawn on canvases.

function readTheme() {
  const style = getComputedStyle(document.documentElement);
  const value = (name) => style.getPropertyValue(`--${name}`).trim();
  const list = (name) => value(name).split(",").map((color) => color.trim());
  return {
    ink: value("ink"),
    muted: value("muted"),
    grid: value("grid"),
    line: value("line"),
    page: value("page"),
    predator: value("predator"),
    groups: [...list("groups"), value("other"), value("alone")],
    runs: list("runs"),
    rampStops: list("ramp"),
    ramp: colorRamp(list("ramp")),
  };
}

/** A function from [0, 1] to one of 64 colors. */
function colorRamp(stops) {
  const parts = stops.map((stop) => [1, 3, 5].map((at) => parseInt(stop.slice(at, at + 2), 16)));
  const colors = Array.from({ length: 64 }, (_, index) => {
    const place = (index / 63) * (parts.length - 1);
    const below = Math.min(Math.floor(place), parts.length - 2);
    const mix = parts[below].map((a, at) => Math.round(a + (place - below) * (parts[below + 1][at] - a)));
    return `rgb(${mix})`;
  });
  return (share) => colors[Math.round(Math.min(Math.max(share, 0), 1) * 63)];
}
