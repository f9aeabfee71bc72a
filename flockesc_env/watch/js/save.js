"use strict";

// Files of what the page shows: a picture of one moment, a video of a run.

const VIDEO_TYPES = ["video/webm;codecs=vp9", "video/webm", "video/mp4"];
const VIDEO_BITS = 8e6; // per second

/** The panels of a page side by side with their titles and numbers, on a canvas of a fixed size. */
class Sheet {
  constructor(page) {
    this.page = page;
    const { width, height } = page.panels[0].canvas;
    const count = page.panels.length;
    const bar = Math.round(30 * (window.devicePixelRatio || 1));
    const columns = Math.min(count, count === 4 ? 2 : 3);
    Object.assign(this, { width, height, bar, columns });
    this.canvas = element("canvas", { width: columns * width, height: Math.ceil(count / columns) * (height + bar) });
  }

  draw() {
    const { page, canvas, width, height, bar, columns } = this;
    const { theme } = page.look;
    const context = canvas.getContext("2d");
    context.fillStyle = theme.page;
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.font = `600 ${Math.round(bar / 2)}px system-ui, sans-serif`;
    page.panels.forEach(({ run, canvas: field }, at) => {
      const [x, y] = [(at % columns) * width, Math.floor(at / columns) * (height + bar)];
      const lowest = run.lowestMean[frameAt(run, page.player.time).step];
      context.fillStyle = theme.runs[run.color % theme.runs.length];
      context.fillText(
        `${run.title}, ${page.player.time.toFixed(1)} s, lowest mean distance ${lowest.toFixed(1)} m`,
        x + bar / 3,
        y + 0.65 * bar,
        width - bar,
      );
      context.fillStyle = theme.ground;
      context.fillRect(x, y + bar, width, height);
      context.drawImage(field, x, y + bar, width, height);
    });
    return canvas;
  }
}

/** Saves the panels as a PNG file. */
function savePicture(page) {
  saveFile(new Sheet(page).draw().toDataURL(), `flock-${page.player.time.toFixed(2)}s.png`);
}

/** Records a run from its start while it plays, and saves it when playback stops. */
class VideoButton {
  constructor(button, page) {
    Object.assign(this, { button, page });
    this.type = window.MediaRecorder && VIDEO_TYPES.find((type) => MediaRecorder.isTypeSupported(type));
    button.hidden = !this.type;
    button.addEventListener("click", () => (this.recorder ? page.player.pause() : this.record()));
    page.player.addEventListener("change", () => this.follow());
  }

  record() {
    const { player } = this.page;
    player.pause();
    player.seek(0);
    this.sheet = new Sheet(this.page);
    const stream = this.sheet.draw().captureStream();
    this.recorder = new MediaRecorder(stream, { mimeType: this.type, videoBitsPerSecond: VIDEO_BITS });
    const parts = [];
    this.recorder.addEventListener("dataavailable", (event) => parts.push(event.data));
    this.recorder.addEventListener("stop", () => {
      const [type] = this.type.split(";");
      saveFile(new Blob(parts, { type }), `flock.${type.split("/")[1]}`);
    });
    this.recorder.start();
    this.button.textContent = "Stop and save";
    player.play();
  }

  /** Adds a frame after every change of time; the last one stops the recorder. */
  follow() {
    if (!this.recorder) return;
    this.sheet.draw();
    if (this.page.player.isPlaying) return;
    const { recorder } = this;
    this.recorder = null;
    this.button.textContent = "Save video";
    requestAnimationFrame(() => recorder.stop());
  }
}
