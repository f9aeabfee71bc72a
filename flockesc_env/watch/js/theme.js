"use strict";

// The palette of render/palette.py, for canvases.

function readTheme() {
  const style = getComputedStyle(document.documentElement);
  const value = (name) => style.getPropertyValue(`--${name}`).trim();
  const ramp = colorRamp(value("ranges").split(/, */));
  return {
    ...Object.fromEntries(["ink", "muted", "grid", "line", "ground", "predator"].map((name) => [name, value(name)])),
    runs: Object.fromEntries(RUN_COLORS.map((name) => [name, value(name)])),
    colorOf: (range) => ramp(range / COLOR_END),
  };
}

const COLOR_END = 20; // m: the color scale ends here, as in films of policies that set up to 20 m

// Names of colors in the style: the best single range, the reader's, learned policies, rules and others.
const RUN_COLORS = ["fixed", "accent", "learned", "other-0", "other-2", "other-3", "other-4"];

const FIRST_COLORS = { fixed: "fixed", learned: "learned", rule: "other-0" };

/** Gives every run the color of its kind of policy or, if that is taken, the next of the other colors. */
function chooseColors(runs) {
  const taken = new Set();
  for (const run of runs) {
    const first = run.kind === "fixed" && run.isLive && !run.policy.isBest ? "accent" : FIRST_COLORS[run.kind];
    const free = RUN_COLORS.filter((name, at) => at > 2 && !taken.has(name));
    run.color = taken.has(first) ? (free[0] ?? first) : first;
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
