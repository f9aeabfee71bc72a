"use strict";

// The palette of render/palette.py, for canvases.

function readTheme() {
  const style = getComputedStyle(document.documentElement);
  const value = (name) => style.getPropertyValue(`--${name}`).trim();
  const list = (name) =>
    value(name)
      .split(",")
      .map((color) => color.trim());
  const ramp = colorRamp(list("ranges"));
  return {
    ink: value("ink"),
    muted: value("muted"),
    grid: value("grid"),
    line: value("line"),
    page: value("page"),
    ground: value("ground"),
    accent: value("accent"),
    predator: value("predator"),
    // Of the other colors these differ most, also with red-green blindness.
    runs: [value("fixed"), value("learned"), ...[1, 4, 0].map((at) => list("others")[at])],
    colorOf: (range) => ramp(range / COLOR_END),
  };
}

const COLOR_END = 20; // m: the color scale ends here, as in films of policies that set up to 20 m

const FIRST_COLORS = { fixed: 0, learned: 1, rule: 2 }; // places in a theme's `runs`

/** Gives every run the color of its kind of policy or, if that is taken, the next of the other colors. */
function chooseColors(runs) {
  const taken = new Set();
  for (const run of runs) {
    run.color = FIRST_COLORS[run.kind];
    while (taken.has(run.color)) run.color = Math.max(run.color + 1, FIRST_COLORS.rule);
    taken.add(run.color);
  }
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
