"use strict";

// Drawings of lines, bands and dots over a rectangle of values, which stretch with the page.

const SIDE = 1000; // of the drawing's own coordinates

/**
 * Draws into an element. `x`, `y`: the least and largest value; `lines`: {points, color, width, dash}; `bands`: {low,
 * high, color}; `dots`: {at, color, title}; `xTicks`, `yTicks`: [value, text]. Points are [x, y].
 */
function plot(root, { x, y, lines = [], bands = [], dots = [], xTicks = [], yTicks = [] }) {
  const share = (value, [low, high]) => Math.min(Math.max((value - low) / (high - low), 0), 1);
  const place = ([a, b]) => `${(SIDE * share(a, x)).toFixed(1)} ${(SIDE * (1 - share(b, y))).toFixed(1)}`;
  const path = (points) => points.map(place).join("L");
  const shapes = [
    ...yTicks.map(([value]) => svg("path", { class: "grid", d: `M${place([x[0], value])}H${SIDE}` })),
    ...bands.map(({ low, high, color }) =>
      svg("path", { d: `M${path(low)}L${path([...high].reverse())}Z`, style: `fill: ${color}`, opacity: 0.2 }),
    ),
    ...lines.map(({ points, color, width = 2, dash = "none" }) =>
      svg("path", {
        d: points.length ? `M${path(points)}` : "",
        style: `stroke: ${color}; stroke-width: ${width}; stroke-dasharray: ${dash}`,
      }),
    ),
    ...dots.map(({ at, color, title }) =>
      svg("path", { class: "dot", d: `M${place(at)}h0`, style: `stroke: ${color}` }, svg("title", {}, title)),
    ),
  ];
  const tick = (text, className, style) => {
    const made = element("span", { className }, text);
    Object.assign(made.style, style);
    return made;
  };
  root.classList.add("plot");
  root.setAttribute("role", "img");
  root.replaceChildren(
    svg("svg", { viewBox: `0 0 ${SIDE} ${SIDE}`, preserveAspectRatio: "none" }, ...shapes),
    ...xTicks.map(([value, text]) => tick(text, "x", { left: `${100 * share(value, x)}%` })),
    ...yTicks.map(([value, text]) => tick(text, "y", { bottom: `${100 * share(value, y)}%` })),
  );
}
