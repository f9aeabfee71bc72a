"use strict";

// One run: its name, its scene and its numbers at the current time.

const STATS = [
  ["meanDistance", "mean distance"],
  ["minDistance", "nearest agent"],
  ["lowestMean", "lowest mean so far"],
  ["numComponents", "components"],
  ["survivors", "agents left"],
  ["range", "interaction range"],
];

function element(tag, attributes = {}, ...children) {
  const made = Object.assign(document.createElement(tag), attributes);
  made.append(...children);
  return made;
}

class Panel {
  constructor(index, camera, redraw) {
    this.title = element("h2");
    this.note = element("span", { className: "note" });
    this.head = element("header", {}, this.title, this.note);
    this.canvas = element("canvas");
    this.values = Object.fromEntries(STATS.map(([key]) => [key, element("dd")]));
    const stats = STATS.map(([key, text]) => element("div", {}, element("dt", {}, text), this.values[key]));
    this.root = element(
      "article",
      { className: "panel" },
      this.head,
      this.canvas,
      element("dl", { className: "stats" }, ...stats),
    );
    this.index = index;
    this.scene = new Scene(this.canvas, camera);
    bindCamera(this.canvas, camera, redraw);
  }

  setRun(run, seedOfPage) {
    this.run = run;
    this.scene.setRun(run);
    this.values.survivors.parentElement.hidden = run.scenario.capture_radius === null;
    this.title.textContent = run.title;
    this.note.textContent = run.seed === seedOfPage ? "" : run.seed === null ? "given start" : `seed ${run.seed}`;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `Flock under ${run.title}`);
  }

  draw(time, look) {
    this.root.style.setProperty("--run", look.theme.runs[this.run.color % look.theme.runs.length]);
    this.scene.draw(time, look);
    const { run, values } = this;
    const { step } = stepAt(run, time);
    for (const key of ["meanDistance", "minDistance", "lowestMean"]) {
      const value = run[key][step];
      values[key].replaceChildren(...(Number.isFinite(value) ? quantity(value.toFixed(1)) : ["-"]));
    }
    values.numComponents.textContent = run.numComponents[step];
    values.survivors.textContent = run.survivors[step];
    const [mean, low, high] = [run.meanRange[step], run.lowRange[step], run.highRange[step]];
    const spread = high > low ? element("small", {}, ` (${low.toFixed(0)}–${high.toFixed(0)})`) : "";
    values.range.replaceChildren(...quantity(mean.toFixed(1), run.rangeUnit), spread);
  }
}

function quantity(value, unit = "m") {
  return [value, element("small", {}, ` ${unit}`)];
}

/** Connects the camera to dragging, pinching or ctrl + wheel, and double click. */
function bindCamera(canvas, camera, redraw) {
  let last;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    last = event;
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!canvas.hasPointerCapture(event.pointerId)) return;
    camera.drag(event.clientX - last.clientX, event.clientY - last.clientY);
    last = event;
    redraw();
  });
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (!event.ctrlKey && !event.metaKey) return; // scrolls the page
      event.preventDefault();
      camera.zoom(Math.exp(-event.deltaY / 300), event.offsetX, event.offsetY);
      redraw();
    },
    { passive: false },
  );
  canvas.addEventListener("dblclick", () => {
    camera.reset();
    redraw();
  });
}
