"use strict";

// Files of what the page shows: a picture of one moment, a video of the replay.

const VIDEO_TYPES = ["video/webm;codecs=vp9", "video/webm", "video/mp4"];
const VIDEO_BITS = 8e6; // per second

/** The panels of a page side by side with their titles, on a canvas of a fixed size. */
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
    page.panels.forEach((panel, at) => {
      const [x, y] = [(at % columns) * width, Math.floor(at / columns) * (height + bar)];
      const run = page.runs[at];
      context.fillStyle = theme.runs[run.color % theme.runs.length];
      context.fillText(`${run.title}, ${page.player.time.toFixed(2)} s`, x + bar / 3, y + 0.65 * bar);
      context.drawImage(panel.canvas, x, y + bar, width, height);
    });
    return canvas;
  }
}

/** Saves the panels as a PNG file. */
function savePicture(page) {
  const canvas = new Sheet(page).draw();
  element("a", { href: canvas.toDataURL(), download: `flock-${page.player.time.toFixed(2)}s.png` }).click();
}

/** Records the replay from its start while it plays, and saves it when playback stops. */
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
      const href = URL.createObjectURL(new Blob(parts, { type }));
      element("a", { href, download: `flock.${type.split("/")[1]}` }).click();
      setTimeout(() => URL.revokeObjectURL(href), 60_000);
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
