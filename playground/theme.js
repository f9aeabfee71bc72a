// Colors of the palette in theme.css, for canvases.

export function readTheme() {
  const style = getComputedStyle(document.documentElement);
  const value = (name) => style.getPropertyValue(`--${name}`).trim();
  const names = ["ink", "muted", "grid", "line", "frame", "page", "ground", "predator", "accent", "learned"];
  const colors = Object.fromEntries(names.map((name) => [name, value(name)]));
  const stops = value("ranges").split(",").map((color) => color.trim());
  return { ...colors, stops, ramp: ramp(stops) };
}

/** Returns 64 colors from the first to the last stop, which are `#rrggbb`. */
function ramp(stops) {
  const parts = stops.map((stop) => [1, 3, 5].map((at) => parseInt(stop.slice(at, at + 2), 16)));
  return Array.from({ length: 64 }, (_, index) => {
    const place = (index / 63) * (parts.length - 1);
    const below = Math.min(Math.floor(place), parts.length - 2);
    return `rgb(${parts[below].map((a, at) => Math.round(a + (place - below) * (parts[below + 1][at] - a)))})`;
  });
}
